"""Reading one table of a case: every value checked, every fault kept with its key."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

from coverable_errors import CoverableError, Fault, alternatives, close, is_number, shown

MOST_GUESSES = 20  # unknown keys for which a known one is looked up
LARGEST_WHOLE = 2**63 - 1
DEG = "degrees"
METRES = "metres"

Pair = tuple[float, float]
Triple = tuple[float, float, float]

Made = TypeVar("Made")

ORIGIN: Triple = (0.0, 0.0, 0.0)


class CaseError(CoverableError):
    """A case that cannot be used: all that is wrong with it, together, each with its key."""

    after_key = ": "


class Section:
    """One table of a case while it is read."""

    def __init__(self, name: str, table: Any, faults: list[Fault]) -> None:
        """Read `table`; what is wrong is added to `faults`.

        Args:
            name: of the table, the front part of its keys.
            table: what the file holds there; anything but a table is a fault.
            faults: of the whole case.
        """
        self.name = name
        self.faults = faults
        self._known: list[str] = []
        if not isinstance(table, Mapping):
            self.fault("", f"must be a table [{name}], got {shown(table)}")
            self.is_table = False
            table = {}
        else:
            self.is_table = True
        self.table: Mapping[str, Any] = table

    def fault(self, key: str, message: str) -> None:
        """Keep a fault of a key of this table, or of the table itself."""
        self.faults.append(Fault(f"{self.name}.{key}" if key else self.name, message))

    def has(self, key: str) -> bool:
        """Whether the key is written; it counts as known from here on."""
        self._known.append(key)
        return key in self.table

    def wants(self, key: str, expected: str, required: bool) -> bool:
        """Whether there is a value to check; a required one that is missing is a fault."""
        if self.has(key):
            return True
        if required and self.is_table:
            self.fault(key, f"is missing; expected {expected}")
        return False

    def wrong(self, key: str, expected: str) -> None:
        """Keep the fault that the value of `key` is not what is expected."""
        self.fault(key, f"must be {expected}, got {shown(self.table[key])}")

    def take(self, *keys: str) -> dict[str, Any]:
        """The values of some keys as they are written, without those that are not there."""
        return {key: self.table[key] for key in keys if self.has(key)}

    def make(
        self,
        build: Callable[..., Made],
        arguments: Mapping[str, Any],
        names: Mapping[str, str] = {},
    ) -> Made | None:
        """What a constructor makes of the values; None after faults, which get this table's keys.

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
            self.faults += [fault.renamed(names, self.name) for fault in error.faults]
            return None

    def number(self, key: str, expected: str, *, required: bool = False) -> float | None:
        """A finite number."""
        if not self.wants(key, expected, required):
            return None
        value = self.table[key]
        if not is_number(value):
            self.wrong(key, expected)
            return None
        return float(value)

    def positive(self, key: str, expected: str, *, required: bool = False) -> float | None:
        """A finite number > 0."""
        number = self.number(key, expected, required=required)
        if number is not None and not number > 0.0:
            self.wrong(key, expected)
            return None
        return number

    def whole(self, key: str, expected: str) -> int | None:
        """A whole number of at most 64 bits."""
        if not self.wants(key, expected, required=False):
            return None
        value = self.table[key]
        if isinstance(value, bool) or not isinstance(value, int) or abs(value) > LARGEST_WHOLE:
            self.wrong(key, expected)
            return None
        return value

    def numbers(
        self, key: str, count: int, expected: str, *, required: bool = False
    ) -> tuple[float, ...] | None:
        """An array of `count` finite numbers."""
        if not self.wants(key, expected, required):
            return None
        value = self.table[key]
        if not isinstance(value, list) or len(value) != count or not all(map(is_number, value)):
            self.wrong(key, expected)
            return None
        return tuple(map(float, value))

    def interval(self, key: str, unit: str) -> Pair | None:
        """A required pair [low, high], low < high."""
        expected = f"[low, high] in {unit} with low < high"
        self.wants(key, expected, required=True)
        return self.pair(key, self.table[key], unit) if key in self.table else None

    def pair(self, key: str, value: Any, unit: str) -> Pair | None:
        """A value of this table that must be a pair [low, high], low < high."""
        expected = f"[low, high] in {unit} with low < high"
        if not isinstance(value, list) or len(value) != 2 or not all(map(is_number, value)):
            self.fault(key, f"must be {expected}, two finite numbers, got {shown(value)}")
            return None
        low, high = map(float, value)
        if low < high:
            return low, high
        what = "an empty range" if low == high else "the wrong way round"
        self.fault(key, f"must be {expected}; {shown(value)} is {what}")
        return None

    def text(self, key: str, expected: str, *, required: bool = False) -> str | None:
        """A string with something in it."""
        if not self.wants(key, expected, required):
            return None
        value = self.table[key]
        if not is_text(value):
            self.wrong(key, expected)
            return None
        return str(value)

    def choice(self, key: str, options: Sequence[str], *, required: bool = False) -> str | None:
        """One of some words."""
        expected = alternatives([f'"{option}"' for option in options])
        if not self.wants(key, expected, required):
            return None
        value = self.table[key]
        if value not in options:
            guess = f"; did you mean {close(value, options)}?" if close(value, options) else ""
            self.fault(key, f"must be {expected}, got {shown(value)}{guess}")
            return None
        return str(value)

    def later(self, key: str, remedy: str) -> None:
        """A key that has a meaning, but not yet."""
        if self.has(key):
            self.fault(key, f"is not supported yet; {remedy}")

    def done(self, hints: Mapping[str, str] | None = None) -> None:
        """Keep a fault for every key that nothing has asked for.

        Args:
            hints: what to say about keys that belong elsewhere.
        """
        unknown = [key for key in self.table if key not in self._known]
        for number, key in enumerate(unknown):
            if hints and key in hints:
                self.fault(printable(key), hints[key])
                continue
            guess = close(key, self._known) if number < MOST_GUESSES else ""
            remedy = f"did you mean {guess}?" if guess else f"known are {', '.join(self._known)}"
            self.fault(printable(key), f"is not known here; {remedy}")


def is_text(value: Any) -> bool:
    """True for a string that is not empty and can be written as UTF-8 without NUL bytes."""
    if not isinstance(value, str) or not value.strip() or "\0" in value:
        return False
    try:
        value.encode()
    except UnicodeEncodeError:
        return False
    return True


def printable(key: str) -> str:
    """A key for a message."""
    return key if key.isprintable() and 0 < len(key) <= 60 else shown(key)
