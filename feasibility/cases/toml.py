"""TOML that is read: a document as tables.

rtoml reads it: a parser in Rust, which takes time in proportion to the text and nests 80 deep.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

import rtoml

from coverable.errors import CoverableError

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+", re.ASCII)


class TomlError(CoverableError):
    """Text that is not the TOML it should be."""


def toml_key(key: str) -> str:
    """A key for a message, quoted where it must be."""
    return key if _BARE_KEY.fullmatch(key) else json.dumps(key, ensure_ascii=False)


def parse_toml(text: str) -> dict[str, Any]:
    """Read a document.

    Raises:
        TomlError: it is not TOML; the message has line and column.
    """
    try:
        return rtoml.loads(text)
    except rtoml.TomlParsingError as error:
        said = str(error)
    # Raised by itself: rtoml's own error cannot be sent to another process.
    what = "is nested too deeply" if "recur" in said else "is not valid TOML"
    raise TomlError(f"{what}: {said}")


def as_read(value: Any) -> Any:
    """A value as the TOML parser would give it: lists and plain tables."""
    if isinstance(value, Mapping):
        return {key: as_read(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return [as_read(item) for item in value]
    return value
