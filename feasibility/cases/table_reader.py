"""Reading one table of a case by the reference of keys; constructors check the values."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from coverable.errors import (
    MISSING,
    Checks,
    CoverableError,
    Fault,
    alternatives,
    close,
    is_number,
    printable,
    shown,
)
from feasibility.cases.keys import Key, all_keys, keys_of

MOST_GUESSES = 20  # unknown keys for which a known one is looked up
DEG = "degrees"
METRES = "metres"

Pair = tuple[float, float]
Triple = tuple[float, float, float]
Made = TypeVar("Made")

ORIGIN: Triple = (0.0, 0.0, 0.0)


class CaseError(CoverableError):
    """A case that cannot be used: all that is wrong with it, together, each with its key."""

    after_key = ": "


class Section(Checks):
    """One table of a case while it is read; every fault gets the table's name before its key.

    Which keys it may have, and what their values must be, `feasibility.cases.keys` says. A table
    that is not there, such as one of a study, may have the keys that are read.
    """

    def __init__(self, name: str, table: Any, faults: list[Fault]) -> None:
        """Read `table`; what is wrong is added to `faults`.

        Args:
            name: of the table, the front part of its keys.
            table: what the file holds there; anything but a table is a fault.
            faults: of all tables.
        """
        super().__init__(name, CaseError)
        self.name = name
        self.faults = faults
        self.keys = keys_of(name)
        self._read: list[str] = []
        self.is_table = isinstance(table, Mapping)
        self.table: Mapping[str, Any] = table if self.is_table else {}
        if not self.is_table:
            self.fault("", f"must be {table_words(name)}, got {shown(table)}")

    def of_kind(self, kind: str) -> None:
        """Say of which kind the surface is: it has the keys of that kind too."""
        self.keys = keys_of(self.name, kind)

    def keep(self, fault: Fault) -> None:
        """Keep a fault of a key of this table, or of the table itself."""
        super().keep(with_example(fault, self.keys).renamed({}, self.name))

    def fault(self, key: str, message: str) -> None:
        """Keep a fault that one sentence says."""
        self.keep(Fault(key, message))

    def wrong_type(self, key: str, value: Any) -> None:
        """Keep the fault that a value is not what the reference says."""
        self.wrong(key, value, f"must be {self.keys[key].type}")

    def has(self, key: str) -> bool:
        """Whether the key is written."""
        self._read.append(key)
        return key in self.table

    def take(self, *keys: str) -> dict[str, Any]:
        """The values of some keys as they are written, without those that are not there."""
        return {key: self.table[key] for key in keys if self.has(key)}

    def make(
        self,
        build: Callable[..., Made],
        arguments: Mapping[str, Any],
        names: Mapping[str, str] = {},
    ) -> Made | None:
        """What a constructor makes of the values; None after faults, which get keys of this table.

        Args:
            build: raises a `CoverableError` with everything that is wrong with its arguments.
            arguments: of the constructor.
            names: the key of each argument, where it differs.
        """
        if not self.is_table:
            return None
        try:
            return build(**arguments)
        except CoverableError as error:
            for fault in error.faults:
                self.keep(fault.renamed(names))
            return None

    def text(self, key: str, expected: str = "", *, required: bool = False) -> str | None:
        """A string with something in it; `expected` says what, where the reference does not."""
        if not self.has(key) and not (required and self.is_table):
            return None
        value = self.table.get(key, MISSING)
        if is_text(value):
            return str(value)
        self.wrong(key, value, f"must be {expected or self.keys[key].type}")
        return None

    def path(self, key: str = "file", *, required: bool = False) -> dict[str, str]:
        """The file that a key names, as {key: absolute path}; empty where there is none."""
        text = self.text(key, required=required)
        return {} if text is None else {key: absolute(text)}

    def word(self, key: str, options: Sequence[str], *, required: bool = False) -> str | None:
        """One of some words."""
        if not self.has(key) and not (required and self.is_table):
            return None
        before = len(self.faults)
        found = self.choice(key, self.table.get(key, MISSING), options)
        return found if len(self.faults) == before else None

    def refuse_others(self, hints: Mapping[str, str] = {}) -> None:
        """Keep a fault for every key that there is not.

        Args:
            hints: what to say about keys that do not belong here.
        """
        known = tuple(self.keys) or tuple(dict.fromkeys(self._read))
        unknown = [key for key in self.table if key in hints or key not in known]
        for number, key in enumerate(unknown):
            guess = close(key, known) if number < MOST_GUESSES else ""
            remedy = f"did you mean {guess}?" if guess else self._elsewhere(key, known)
            text = hints.get(key, f"is not known here; {remedy}")
            self.fault(printable(key), text)

    def _elsewhere(self, key: str, known: Sequence[str]) -> str:
        """Which other table of a case has a key that this one has not, or the keys of this one."""
        tables = [other.table for other in all_keys() if other.name == key]
        tables += [key] if keys_of(key) else []
        if not tables or not self.keys:
            return f"known are {', '.join(known)}"
        return f"it belongs to {alternatives([f'[{name}]' for name in dict.fromkeys(tables)])}"


def table_words(name: str) -> str:
    """What a table is: its keys, and an example of those that it needs, or of the first.

    Example:
        >>> table_words("surface.cut")  # doctest: +ELLIPSIS
        'a table [surface.cut] with the keys point, normal, such as { point = [0, 0, 0.1], ...
    """
    keys = tuple(keys_of(name).values())
    if not keys:
        return f"a table [{name}]"
    needed = [key.written for key in keys if key.default is None] or [keys[0].written]
    names = ", ".join(key.name for key in keys)
    return f"a table [{name}] with the keys {names}, such as {{ {', '.join(needed)} }}"


def with_example(fault: Fault, keys: Mapping[str, Key]) -> Fault:
    """The fault; where a key is missing, with an example of it."""
    key = keys.get(fault.key)
    if key is None or fault.fault != "is missing" or "such as" in fault.expected:
        return fault
    return fault._replace(expected=f"{fault.expected}, such as {key.written}")


def is_text(value: Any) -> bool:
    """True for a string that is not empty and can be written as UTF-8 without NUL bytes."""
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        return False
    try:
        value.encode()
    except UnicodeEncodeError:
        return False
    return True


def absolute(path: str) -> str:
    """A path of a case, independent of the working directory."""
    return os.path.abspath(os.path.expanduser(path))


def frozen(value: Any, exact: bool = False) -> Any:
    """A value of a case as it is kept: arrays as tuples, numbers as floats unless `exact`."""
    if isinstance(value, Mapping):
        return {key: frozen(item, exact) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return tuple(frozen(item, exact) for item in value)
    return float(value) if is_number(value) and not exact else value
