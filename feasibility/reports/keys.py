"""The reference of the case file as rows, and as the page docs/keys.md."""

from __future__ import annotations

from collections.abc import Sequence

from coverable.errors import ArgumentError, alternatives, close
from feasibility.cases.keys import Key, all_keys

HEADINGS = ("key", "type", "unit", "default", "meaning", "example")
NEEDED = "needed"
HEAD = """\
# The keys of a case file

`coverable keys` prints this reference, `coverable keys surface` one table of it, and
`coverable keys mesh` the keys of one kind of surface. The program reads by the same table. A key
with the default "needed" has to be given. Lengths are in metres; angles are in degrees where the
key ends in `_deg`.
"""


Groups = dict[str, list[Key]]
"""Keys by their heading."""


def title_of(key: Key) -> str:
    """The heading of a key.

    Example:
        >>> [title_of(key) for key in all_keys() if key.name in ("standoff", "tube")]
        ['[surface] with kind = "torus"', '[task]']
    """
    return f"[{key.table}]" + (f' with kind = "{key.kind}"' if key.kind else "")


def keys_under(heading: str | None = None) -> Groups:
    """Keys by their heading, in the order of the reference.

    Args:
        heading: a table ("surface", and all that belongs to it) or a kind of surface ("mesh"); all
            keys by default.

    Raises:
        ArgumentError: there is no such table or kind.
    """
    found: Groups = {}
    for key in all_keys():
        names = {key.table, key.table.partition(".")[0]}
        names |= {key.kind, f"surface.{key.kind}"} if key.kind else set()
        if heading is None or heading in names:
            found.setdefault(title_of(key), []).append(key)
    if found:
        return found
    titles = dict.fromkeys(name for key in all_keys() for name in (key.table, key.kind))
    known = tuple(filter(None, titles))
    guess = close(heading, known)
    hint = f"did you mean {guess}?" if guess else f"there are {alternatives(known)}"
    raise ArgumentError(f"there is no table {heading!r} of a case file; {hint}")


def as_text(found: Groups) -> str:
    """The reference for people: each key with an example, what it takes, and what it means.

    Example:
        >>> print(as_text(keys_under("surface.facing")).split("direction")[0], end="")
        [surface.facing]
    """
    parts = []
    for title, keys in found.items():
        lines = [title]
        for key in keys:
            unit = f" [{key.unit}]" if key.unit else ""
            lines += [key.written, f"    {key.type}{unit}; {default_of(key)}", f"    {key.meaning}"]
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


def default_of(key: Key) -> str:
    """'needed', perhaps by some kinds only, or what holds where the key is left out."""
    if key.default is None or key.default.startswith(NEEDED):
        return key.default or NEEDED
    return f"default: {key.default}"


def as_json(found: Groups) -> dict[str, list[dict[str, str | None]]]:
    """One object for each key; its `default` is null where it is needed."""
    rows = [
        {
            "table": key.table,
            "kind": key.kind or None,
            "key": key.name,
            "type": key.type,
            "unit": key.unit or None,
            "default": key.default,
            "meaning": key.meaning,
            "example": key.example,
        }
        for keys in found.values()
        for key in keys
    ]
    return {"keys": rows}


def as_page() -> str:
    """The reference as Markdown: what docs/keys.md holds."""
    parts = [HEAD]
    for title, keys in keys_under().items():
        rows = [HEADINGS, ("---",) * len(HEADINGS), *map(_row, keys)]
        parts.append(f"## {title}\n\n" + "".join(f"| {' | '.join(row)} |\n" for row in rows))
    return "\n".join(parts)


def _row(key: Key) -> Sequence[str]:
    """A row of the page: what is TOML as code."""
    default = NEEDED if key.default is None else key.default
    row = (f"`{key.name}`", key.type, key.unit, default, key.meaning, f"`{key.example}`")
    return [text.replace("|", "\\|") for text in row]
