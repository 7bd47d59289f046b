"""What tests of commands still take of bad cases; goes with test_cli.py and test_cli_surfaces.py."""

from __future__ import annotations

from typing import NamedTuple

from bad_input import GOOD_CASE, bad

GOOD = GOOD_CASE


class Bad(NamedTuple):
    """One bad file."""

    content: bytes
    words: tuple[str, ...]


BAD_CASES = {
    name: Bad(bad("case")[name].content, (words,))
    for name, words in {
        "not toml": "is not valid TOML",
        "unknown robot": "'puma561'",
        "radius NaN": "got nan",
        "misspelt kind": "surface.kind",
        "missing mesh": "no.stl: there is no such file",
        "nested too deeply": "is nested too deeply",
    }.items()
}


def write(folder, content, name="case.toml"):
    """The path of a new file with this content."""
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return str(path)
