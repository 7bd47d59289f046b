"""Reading one table of a case: which keys there are; constructors judge their values."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from coverable_errors import (
    MISSING,
    Checks,
    CoverableError,
    Fault,
    close,
    is_number,
    printable,
    shown,
)
from feasibility.safe_files import shown_path

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
    """One table of a case while it is read; every fault gets the table's name before its key."""

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
        self._known: list[str] = []
        self.is_table = isinstance(table, Mapping)
        self.table: Mapping[str, Any] = table if self.is_table else {}
        if not self.is_table:
            self.fault("", f"must be a table [{name}], got {shown(table)}")

    def keep(self, fault: Fault) -> None:
        """Keep a fault of a key of this table, or of the table itself."""
        super().keep(fault.renamed({}, self.name))

    def fault(self, key: str, message: str) -> None:
        """Keep a fault that one sentence says."""
        self.keep(Fault(key, message))

    def has(self, key: str) -> bool:
        """Whether the key is written; it counts as known from here on."""
        self._known.append(key)
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

    def text(self, key: str, expected: str, *, required: bool = False) -> str | None:
        """A string with something in it."""
        if not self.has(key) and not (required and self.is_table):
            return None
        value = self.table.get(key, MISSING)
        if is_text(value):
            return str(value)
        self.wrong(key, value, f"must be {expected}")
        return None

    def word(self, key: str, options: Sequence[str], *, required: bool = False) -> str | None:
        """One of some words."""
        if not self.has(key) and not (required and self.is_table):
            return None
        before = len(self.faults)
        found = self.choice(key, self.table.get(key, MISSING), options)
        return found if len(self.faults) == before else None

    def refuse_others(self, hints: Mapping[str, str] = {}) -> None:
        """Keep a fault for every key that was not read.

        Args:
            hints: what to say about keys that belong elsewhere.
        """
        unknown = [key for key in self.table if key not in self._known]
        for number, key in enumerate(unknown):
            guess = close(key, self._known) if number < MOST_GUESSES else ""
            remedy = f"did you mean {guess}?" if guess else f"known are {', '.join(self._known)}"
            text = hints.get(key, f"is not known here; {remedy}")
            self.fault(printable(key), text)


def is_text(value: Any) -> bool:
    """True for a string that is not empty and can be written as UTF-8 without NUL bytes."""
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        return False
    try:
        value.encode()
    except UnicodeEncodeError:
        return False
    return True


def frozen(value: Any, whole: bool = False) -> Any:
    """A value of a case as it is kept: arrays as tuples, numbers as floats unless `whole`."""
    if isinstance(value, Mapping):
        return {key: frozen(item, whole) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return tuple(frozen(item, whole) for item in value)
    return float(value) if is_number(value) and not whole else value


def in_file(error: CoverableError, file: str, table: str) -> list[Fault]:
    """The faults of a file that a table of the case names."""
    return [
        Fault(f"{table}.file", f"{fault.key} {fault.message}".strip(), shown_path(file))
        for fault in error.faults
    ]
