"""Changes to the tables of a case: one `key=value` of the command line, and where paths begin."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

from coverable.errors import Fault, shown
from feasibility.cases.toml import TomlError, parse_toml

PATHS, FOLDERS = ("urdf", "file", "srdf"), "package_dirs"  # keys whose values are files, or folders
NAMED_BY_USERS = ("xacro_args", "lock")  # tables of keys that mean nothing here


def parse_setting(text: str) -> tuple[tuple[str, ...], Any]:
    """Read `table.key=value`: the path of the key, and the value, None where it is left out.

    The value is TOML; a bare word is a string.

    Example:
        >>> parse_setting("surface.u_deg=[10, 45.5]")
        (('surface', 'u_deg'), [10, 45.5])
        >>> parse_setting("robot.limits=set-2")
        (('robot', 'limits'), 'set-2')

    Raises:
        TomlError: it is no such text.
    """
    key, equals, value = text.partition("=")
    form = "expected table.key=value, such as task.cone_deg=10"
    if not equals:
        raise TomlError(f"has no '='; {form}")
    path, inner = list[str](), None
    try:
        inner = parse_toml(f"{key.strip()} = 0")
        while isinstance(inner, dict):
            ((part, inner),) = inner.items()
            path.append(part)
    except (TomlError, ValueError) as error:
        raise TomlError(f"does not begin with a key; {form}") from error
    value = value.strip()
    if not value:
        return tuple(path), None
    try:
        table = parse_toml(f"value = {value}")
    except TomlError as error:
        if value[0] in "[{\"'" or not value.isprintable():
            raise TomlError(f"the value {error}; {form}") from error
        return tuple(path), value
    if set(table) != {"value"}:
        raise TomlError(f"holds more than one setting; {form}")
    return tuple(path), table["value"]


def override(tables: dict[str, Any], setting: str, faults: list[Fault]) -> None:
    """Replace, add or remove one key; without a value a whole table too."""
    label = f"--set {setting if setting.isprintable() and len(setting) <= 80 else shown(setting)}"
    try:
        path, value = parse_setting(setting)
    except TomlError as error:
        faults.append(Fault(label, str(error)))
        return
    *folders, key = path
    if not folders and value is not None:
        faults.append(Fault(label, "needs a table and a key, such as task.cone_deg=10"))
        return
    table: Any = tables
    for folder in folders:
        if value is None and folder not in table:
            return  # a table that is not there has nothing to remove, and is not made
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
    if base_dir is not None:
        _change_paths(tables, lambda path: os.path.join(base_dir, os.path.expanduser(path)))


def make_relative(tables: dict[str, Any], base_dir: str | os.PathLike[str]) -> None:
    """Make the paths of a case relative to the folder of its file."""
    _change_paths(tables, lambda path: os.path.relpath(path, base_dir))


def _change_paths(tables: Any, change: Callable[[str], str]) -> None:
    """Change the paths of a case file, where they are paths."""

    def changed(value: Any) -> Any:
        return change(value) if isinstance(value, str) and value.strip() else value

    for key, value in tables.items() if isinstance(tables, dict) else enumerate(tables):
        if key in PATHS:
            tables[key] = changed(value)
        elif key == FOLDERS and isinstance(value, list):
            tables[key] = [*map(changed, value)]
        elif isinstance(value, (dict, list)) and key not in NAMED_BY_USERS:
            _change_paths(value, change)
