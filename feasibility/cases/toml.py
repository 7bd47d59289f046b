"""TOML as text: writing values, and reading one `key=value` of the command line."""

from __future__ import annotations

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from typing import Any

from coverable_errors import CoverableError

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+", re.ASCII)
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r"}


class TomlError(CoverableError):
    """Text that is not the TOML it should be."""


def toml_value(value: Any) -> str:
    """One value on one line; `tomllib` reads it back as the same value.

    Example:
        >>> toml_value({"joint 1": [-1.5, 2.0], "open": True})
        '{ "joint 1" = [-1.5, 2.0], open = true }'
    """
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isinf(value):
            return "inf" if value > 0 else "-inf"
        return repr(value)
    if isinstance(value, str):
        return toml_string(value)
    if isinstance(value, Mapping):
        rows = ", ".join(f"{toml_key(key)} = {toml_value(item)}" for key, item in value.items())
        return f"{{ {rows} }}" if rows else "{}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    raise TypeError(f"TOML has no {type(value).__name__}")


def toml_string(text: str) -> str:
    """A basic string with everything escaped that must be."""
    return '"' + "".join(_escaped(character) for character in text) + '"'


def _escaped(character: str) -> str:
    """One character inside a basic string."""
    if character in _ESCAPES:
        return _ESCAPES[character]
    code = ord(character)
    return f"\\u{code:04X}" if code < 32 or code == 127 else character


def toml_key(key: str) -> str:
    """A key, quoted where it must be."""
    return key if _BARE_KEY.fullmatch(key) else toml_string(key)


def toml_document(tables: Mapping[str, Mapping[str, Any]]) -> str:
    """Tables of values as a document; empty tables are left out."""
    parts = []
    for name, table in tables.items():
        if table:
            rows = [f"{toml_key(key)} = {toml_value(value)}" for key, value in table.items()]
            parts.append("\n".join([f"[{toml_key(name)}]", *rows]) + "\n")
    return "\n".join(parts)


def parse_toml(text: str) -> dict[str, Any]:
    """Read a document.

    Raises:
        TomlError: it is not TOML; the message has the line where the parser knows it.
    """
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise TomlError("is nested too deeply") from error
    except ValueError as error:  # TOMLDecodeError, and Python's own limit on digits
        raise TomlError(f"is not valid TOML: {error}") from error


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
    try:
        path = _path(tomllib.loads(f"{key.strip()} = 0"))
    except (ValueError, RecursionError) as error:
        raise TomlError(f"does not begin with a key; {form}") from error
    value = value.strip()
    if not value:
        return path, None
    try:
        table = tomllib.loads(f"value = {value}")
    except (ValueError, RecursionError) as error:
        if value[0] in "[{\"'" or not value.isprintable():
            raise TomlError(f"the value is not valid TOML; {form}") from error
        return path, value
    if set(table) != {"value"}:
        raise TomlError(f"holds more than one setting; {form}")
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
