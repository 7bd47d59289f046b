"""The reference of the case file: every key with its type, unit, default, meaning and an example.

`keys.toml` holds it, a line each. Reading takes from here which keys there are, messages say from
here what was expected, and `coverable keys` and docs/keys.md show it.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

KEYS = Path(__file__).with_name("keys.toml")


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a case file."""

    table: str
    """The table that it is in: "robot", "surface", "surface.cut", ..."""
    name: str
    type: str
    """What the value is: "must be ..." in messages."""
    meaning: str
    example: str
    """A value, as TOML."""
    unit: str = ""
    default: str | None = None
    """What holds without it, as TOML or in words; None where the key is needed."""
    kind: str = ""
    """The one kind of surface that has it; empty where every kind has it."""
    argument: str = ""
    """What a patch's constructor calls it."""

    @property
    def written(self) -> str:
        """The key with its example, as TOML."""
        return f"{self.name} = {self.example}"


@cache
def all_keys() -> tuple[Key, ...]:
    """Every key of a case file, in the order of the tables.

    Example:
        >>> [key.name for key in all_keys() if key.table == "task"][:3]
        ['standoff', 'cone_deg', 'tolerance']
    """
    tables = tomllib.loads(KEYS.read_text(encoding="utf-8"))
    kinds = tables.pop("kind")
    found = []
    for table, entries in tables.items():
        found += [Key(table=table, name=name, **entry) for name, entry in entries.items()]
        for kind in kinds if table == "surface" else ():
            found += [
                Key(table=table, name=name, kind=kind, **{"argument": name, **entry})
                for name, entry in kinds[kind].items()
            ]
    return tuple(found)


@cache
def keys_of(table: str, kind: str = "") -> Mapping[str, Key]:
    """The keys of one table by name, those of all kinds of surface first; empty if unknown.

    Args:
        table: as written in a case, also with a number: "surface.pieces[3]".
        kind: of surface, whose own keys are wanted too.
    """
    table = re.sub(r"\[\d+\]", "", table)
    found = {key.name: key for key in all_keys() if key.table == table and not key.kind}
    return MappingProxyType(found | (own_keys(kind) if kind else {}))


@cache
def kinds() -> tuple[str, ...]:
    """The kinds of surface that a case can name."""
    return tuple(dict.fromkeys(key.kind for key in all_keys() if key.kind))


@cache
def own_keys(kind: str) -> dict[str, Key]:
    """The keys that only one kind of surface, or some of them, have."""
    return {key.name: key for key in all_keys() if key.kind == kind}
