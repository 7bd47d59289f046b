"""TOML as text, one `key=value` of the command line, and changes to tables before they are read."""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Callable, Mapping
from itertools import accumulate
from typing import Any

from coverable_errors import CoverableError, Fault, shown

# `tomllib` takes time and memory with the square of a dotted key's length, and calls itself for
# each open bracket: both are limited before it sees a text.
MOST_BRACKETS = 16  # open at once; control nets in pieces of a study need 7
MOST_PARTS = 8  # of one key, and tables inside each other; a study needs 5
MOST_KEYS = 50_000  # parts of all keys together

# What may hold brackets, dots and equals signs that mean nothing. A string that never ends goes to
# the end of its line or of the text; the parser refuses it there.
STRINGS_AND_COMMENTS = re.compile(
    r'"""(?:[^\\"]|\\.|"{1,2}(?!"))*+"{0,5}'
    r"|'''(?:[^']|'{1,2}(?!'))*+'{0,5}"
    r'|"(?:[^\\"\n]|\\.)*+"?'
    r"|'[^'\n]*+'?"
    r"|#[^\n]*+",
    re.DOTALL,
)
_PATH = re.compile(r"(?<![\w-])[\w-]++(?:[ \t]*+\.[ \t]*+[\w-]++)*+")
_KEY = re.compile(
    rf"{_PATH.pattern}(?=[ \t]*+=)|^[ \t]*+\[\[?+[ \t]*+{_PATH.pattern}[ \t]*+\]", re.MULTILINE
)
# An array as it is written over several lines, without one inside that is written so.
_OPENED = re.compile(r"^(.*)\[\n((?: +.*[^\[\n]\n)+?) *\]", re.MULTILINE)
WIDTH = 100  # of a line
_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+", re.ASCII)


class TomlError(CoverableError):
    """Text that is not the TOML it should be."""


def toml_key(key: str) -> str:
    """A key for a message, quoted where it must be."""
    return key if _BARE_KEY.fullmatch(key) else json.dumps(key, ensure_ascii=False)


def toml_document(tables: Mapping[str, Any]) -> str:
    """Tables of values as a document that `parse_toml` reads back; empty ones are left out.

    Example:
        >>> print(toml_document({"task": {"cone_deg": 45.0}, "search": {}}), end="")
        [task]
        cone_deg = 45.0
    """
    import tomli_w

    text = tomli_w.dumps({name: table for name, table in tables.items() if table != {}})
    before = ""
    while text != before:  # from the inside outwards
        before, text = text, _OPENED.sub(_on_one_line, text)
    return text


def _on_one_line(found: re.Match[str]) -> str:
    """An array that is written over several lines, on one if it fits."""
    short = f"{found[1]}[{', '.join(line.strip(' ,') for line in found[2].splitlines())}]"
    return short if len(short) <= WIDTH else found[0]


def parse_toml(text: str) -> dict[str, Any]:
    """Read a document.

    Raises:
        TomlError: it is not TOML; the message has the line where the parser knows it.
    """
    excess = too_much(text)
    if excess:
        raise TomlError(excess)
    try:
        tables = tomllib.loads(text)
    except ValueError as error:  # TOMLDecodeError, and Python's own limit on digits
        raise TomlError(f"is not valid TOML: {error}") from error
    excess = too_deep(tables)
    if excess:
        raise TomlError(excess)
    return tables


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
    for part in (key, value):
        excess = too_much(part)
        if excess:
            raise TomlError(f"{excess}; {form}")
    try:
        path = _path(tomllib.loads(f"{key.strip()} = 0"))
    except ValueError as error:
        raise TomlError(f"does not begin with a key; {form}") from error
    value = value.strip()
    if not value:
        return path, None
    try:
        table = tomllib.loads(f"value = {value}")
    except ValueError as error:
        if value[0] in "[{\"'" or not value.isprintable():
            raise TomlError(f"the value is not valid TOML; {form}") from error
        return path, value
    if set(table) != {"value"}:
        raise TomlError(f"holds more than one setting; {form}")
    excess = too_deep(table["value"], len(path))
    if excess:
        raise TomlError(f"{excess}; {form}")
    return path, table["value"]


def _path(table: dict[str, Any]) -> tuple[str, ...]:
    """The one path of keys that leads into nested tables."""
    path: list[str] = []
    inner: Any = table
    while isinstance(inner, dict):
        if len(inner) != 1:
            raise ValueError("more than one key")
        (key, inner) = next(iter(inner.items()))
        path.append(key)
    return tuple(path)


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


def _change_paths(tables: dict[str, Any], change: Callable[[str], str]) -> None:
    """Change the paths of a case file, where they are paths."""

    def changed(value: Any) -> Any:
        return change(value) if isinstance(value, str) and value.strip() else value

    robot, surface = tables.get("robot"), tables.get("surface")
    if isinstance(robot, dict):
        if "urdf" in robot:
            robot["urdf"] = changed(robot["urdf"])
        if isinstance(robot.get("package_dirs"), list):
            robot["package_dirs"] = [changed(folder) for folder in robot["package_dirs"]]
    if isinstance(surface, dict):
        pieces = surface.get("pieces")
        for piece in (surface, *(pieces if isinstance(pieces, list) else ())):
            if isinstance(piece, dict) and "file" in piece:
                piece["file"] = changed(piece["file"])
    collision = tables.get("collision")
    if isinstance(collision, dict):
        if "srdf" in collision:
            collision["srdf"] = changed(collision["srdf"])
        for objects in (collision.get("scene"), collision.get("tool")):
            for entry in objects if isinstance(objects, list) else ():
                if isinstance(entry, dict) and "file" in entry:
                    entry["file"] = changed(entry["file"])


def as_read(value: Any) -> Any:
    """A value as the TOML parser would give it: lists and plain tables."""
    if isinstance(value, Mapping):
        return {key: as_read(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return [as_read(item) for item in value]
    return value


def too_much(text: str) -> str:
    """What is too deep or too many in a TOML text; empty where nothing is.

    Example:
        >>> too_much("a = [[1, 2], [3, 4]]")
        ''
        >>> too_much("a = " + 20 * "[")
        'is nested too deeply: 20 brackets are open at once, more than 16'
    """
    bare = STRINGS_AND_COMMENTS.sub(lambda found: "" if found[0][0] == "#" else "s", text)
    steps = (1 if bracket in "[{" else -1 for bracket in re.findall(r"[\[\]{}]", bare))
    deepest = max(accumulate(steps), default=0)
    deep = "is nested too deeply:"
    if deepest > MOST_BRACKETS:
        return f"{deep} {deepest:,} brackets are open at once, more than {MOST_BRACKETS}"
    longest = max((found[0].count(".") for found in _PATH.finditer(bare)), default=0) + 1
    if longest > MOST_PARTS:
        return f"{deep} a key has {longest:,} parts, more than {MOST_PARTS}"
    keys = sum(1 + found[0].count(".") for found in _KEY.finditer(bare))
    return f"has {keys:,} keys, more than {MOST_KEYS:,}" if keys > MOST_KEYS else ""


def too_deep(tables: Any, above: int = 0) -> str:
    """What is too deep in tables that were read; empty where nothing is.

    Tables may lie inside each other as deep as a key may say, so that they can be written again.

    Args:
        tables: what the parser made of a text that is not `too_much`.
        above: tables that it will lie in.
    """
    if above > MOST_PARTS:
        return f"is nested too deeply: at most {MOST_PARTS} tables inside each other are read"
    inner = tables.values() if isinstance(tables, dict) else tables
    if not isinstance(tables, (dict, list)):
        return ""
    below = above + isinstance(tables, dict)
    return next(filter(None, (too_deep(value, below) for value in inner)), "")
