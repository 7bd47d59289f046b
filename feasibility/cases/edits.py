"""Changes to the tables of a case before they are read: settings, absolute paths."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import Any

from coverable_errors import Fault, shown
from feasibility.cases.toml import TomlError, parse_setting


def override(tables: dict[str, Any], setting: str, faults: list[Fault]) -> None:
    """Replace, add or remove one key."""
    label = f"--set {setting if setting.isprintable() and len(setting) <= 80 else shown(setting)}"
    try:
        path, value = parse_setting(setting)
    except TomlError as error:
        faults.append(Fault(label, str(error)))
        return
    *folders, key = path
    if not folders:
        faults.append(Fault(label, "needs a table and a key, such as task.cone_deg=10"))
        return
    table: Any = tables
    for folder in folders:
        table = table.setdefault(folder, {})
        if not isinstance(table, dict):
            faults.append(Fault(label, f"{folder} is not a table"))
            return
    if value is None:
        table.pop(key, None)
    else:
        table[key] = value


def make_absolute(tables: dict[str, Any], base_dir: str | os.PathLike[str] | None) -> None:
    """Make the paths of a case file independent of the working directory, where they are paths."""
    if base_dir is None:
        return

    def absolute(value: Any) -> Any:
        if not isinstance(value, str) or not value.strip():
            return value
        return os.path.join(base_dir, os.path.expanduser(value))

    robot, surface = tables.get("robot"), tables.get("surface")
    if isinstance(robot, dict):
        if "urdf" in robot:
            robot["urdf"] = absolute(robot["urdf"])
        if isinstance(robot.get("package_dirs"), list):
            robot["package_dirs"] = [absolute(folder) for folder in robot["package_dirs"]]
    if isinstance(surface, dict):
        pieces = surface.get("pieces")
        for piece in (surface, *(pieces if isinstance(pieces, list) else ())):
            if isinstance(piece, dict) and "file" in piece:
                piece["file"] = absolute(piece["file"])


def as_read(value: Any) -> Any:
    """A value as the TOML parser would give it: lists and plain tables."""
    if isinstance(value, Mapping):
        return {key: as_read(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return [as_read(item) for item in value]
    return value
