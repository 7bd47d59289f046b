"""Changes to a case: of its tables by `key=value`, and of its text, which stays as it was written.

Only plain ways of writing a key are known in texts. Whoever changes one reads the result again, and
writes it anew where it does not say what it should.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, NamedTuple

from coverable.errors import Fault, shown
from feasibility.cases.toml import TomlError, parse_toml, toml_key

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
Path = tuple[str, ...]
_NAME = r"([\w-]+(?:[ \t]*\.[ \t]*[\w-]+)*)"
_HEADER = re.compile(rf"[ \t]*\[(\[?)[ \t]*{_NAME}[ \t]*\]")
_KEY = re.compile(rf"([ \t]*){_NAME}[ \t]*=[ \t]*")


class _Entry(NamedTuple):
    """A key with its value, or the header of a table."""

    path: Path
    table: Path
    """Of the header that it stands under, or is."""
    indent: str
    begin: int
    """Of its line."""
    value: int
    """Where the value begins; -1 of a header."""
    end: int
    """Where the value ends, or the header's line."""


def differences(before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[Path, Any]:
    """What has to be set for tables to become others, by path; None for what has to go.

    Example:
        >>> differences({"a": {"b": 1, "c": 2}}, {"a": {"b": 3}})
        {('a', 'c'): None, ('a', 'b'): 3}
    """
    found: dict[Path, Any] = {(key,): None for key in before if key not in after}
    inner = dict[Path, Any]()
    for key, value in after.items():
        old = before.get(key)
        if isinstance(value, Mapping) and value != old:
            if old is not None and not isinstance(old, Mapping):
                found[(key,)] = None
            known = old if isinstance(old, Mapping) else {}
            inner |= {(key, *path): one for path, one in differences(known, value).items()}
        elif value != old:
            inner[(key,)] = value
    goes = {path: one for path, one in inner.items() if one is None}
    return {**found, **goes, **{path: one for path, one in inner.items() if one is not None}}


def edited(text: str, changes: Mapping[Path, Any], tables: Mapping[str, Any]) -> str:
    r"""A text with some keys set, added or removed.

    Args:
        text: TOML.
        changes: see `differences`.
        tables: what the text shall say, for tables that are written in one line.

    Example:
        >>> edited("[a]\nb = 1  # one\n", {("a", "b"): 2, ("a", "c"): [3]}, {})
        '[a]\nb = 2  # one\nc = [3]\n'
    """
    for path, value in changes.items():
        text = _changed(text if text.endswith("\n") else f"{text}\n", path, value, tables)
    return text


def _changed(text: str, path: Path, value: Any, tables: Mapping[str, Any]) -> str:
    """The text with one change."""
    entries = list(_entries(text))
    for entry in entries:
        inside = entry.value >= 0 and entry.path == path[: len(entry.path)]
        if inside and entry.path == path:
            if value is None:
                return text[: entry.begin] + text[text.index("\n", entry.end) + 1 :]
            return text[: entry.value] + inline(value) + text[entry.end :]
        if inside and text[entry.value] == "{":
            whole: Any = tables
            for key in entry.path:
                whole = whole[key]
            return text[: entry.value] + inline(whole) + text[entry.end :]
    if value is None:
        return text
    beside = [
        entry
        for entry in entries
        if entry.table == path[: len(entry.table)] and entry.path[0] == path[0]
    ]
    if not beside:
        return f"{text}\n[{toml_key(path[0])}]\n{_line(path[1:], value)}"
    last = max(beside, key=lambda entry: (len(entry.table), entry.begin))
    at = text.index("\n", last.end) + 1
    return text[:at] + last.indent + _line(path[len(last.table) :], value) + text[at:]


def _line(path: Path, value: Any) -> str:
    return f"{'.'.join(map(toml_key, path))} = {inline(value)}\n"


def _entries(text: str) -> Iterator[_Entry]:
    """All keys and headers that stand at the beginning of a line."""
    bare = STRINGS_AND_COMMENTS.sub(
        lambda found: (" " if found[0][0] == "#" else "s") * len(found[0]), text
    )
    table, at = Path(), 0
    while at < len(bare):
        stop = bare.index("\n", at)
        header, key = _HEADER.match(bare, at, stop), _KEY.match(bare, at, stop)
        if header is not None:
            table = (*_parts(header[2]), *(["[]"] if header[1] else []))
            yield _Entry(table, table, "", at, -1, stop)
        elif key is not None:
            value, stop = key.end(), _end_of_value(bare, key.end())
            end = value + len(bare[value:stop].rstrip())
            yield _Entry((*table, *_parts(key[2])), table, key[1], at, value, end)
        at = stop + 1


def _parts(name: str) -> Path:
    return tuple(part.strip() for part in name.split("."))


def _end_of_value(bare: str, at: int) -> int:
    """The end of the line on which all brackets are closed."""
    depth = 0
    while bare[at] != "\n" or depth > 0:
        depth += (bare[at] in "[{") - (bare[at] in "]}")
        at += 1
        if at == len(bare):
            return at - 1
    return at


def inline(value: Any) -> str:
    """A value as TOML in one line.

    Example:
        >>> inline({"position": [0.5, 0], "file": "part.stl"})
        '{ position = [0.5, 0], file = "part.stl" }'
    """
    if isinstance(value, Mapping):
        pairs = (f"{toml_key(key)} = {inline(one)}" for key, one in value.items())
        return f"{{ {', '.join(pairs)} }}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(inline, value))}]"
    return json.dumps(value, ensure_ascii=False)


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
        change_paths(tables, lambda path: os.path.join(base_dir, os.path.expanduser(path)))


def make_relative(tables: dict[str, Any], base_dir: str | os.PathLike[str]) -> None:
    """Make the paths of a case relative to the folder of its file."""
    change_paths(tables, lambda path: os.path.relpath(path, base_dir))


def change_paths(tables: Any, change: Callable[[str], str]) -> None:
    """Change the paths of a case file, where they are paths."""

    def changed(value: Any) -> Any:
        return change(value) if isinstance(value, str) and value.strip() else value

    for key, value in tables.items() if isinstance(tables, dict) else enumerate(tables):
        if key in PATHS:
            tables[key] = changed(value)
        elif key == FOLDERS and isinstance(value, list):
            tables[key] = [*map(changed, value)]
        elif isinstance(value, (dict, list)) and key not in NAMED_BY_USERS:
            change_paths(value, change)
