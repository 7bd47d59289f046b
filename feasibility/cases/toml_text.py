"""Tables as TOML for people."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

# An array as it is written over several lines, without one inside that is written so.
_OPENED = re.compile(r"^(.*)\[\n((?: +.*[^\[\n]\n)+?) *\]", re.MULTILINE)
WIDTH = 100  # of a line


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
