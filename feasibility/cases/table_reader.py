"""Reading one table of a case: every value checked, every fault kept with its key."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

MOST_SHOWN = 50  # faults in one message
MOST_GUESSES = 20  # unknown keys for which a known one is looked up
LARGEST_WHOLE = 2**63 - 1
DEG = "degrees"
METRES = "metres"

Pair = tuple[float, float]
Triple = tuple[float, float, float]

ORIGIN: Triple = (0.0, 0.0, 0.0)


class Fault(NamedTuple):
    """One thing that is wrong with a case."""

    key: str
    """Where: `table.key`, or the table; empty for the file as a whole."""
    message: str
    """What was expected, and what was found."""


class CaseError(ValueError):
    """A case that cannot be used: all that is wrong with it, together.

    Attributes:
        source: the file or name of the case.
        faults: what is wrong, each with its key.
    """

    def __init__(self, source: str, faults: Iterable[Fault]) -> None:
        """All faults of the case that came from `source`."""
        self.source = source
        self.faults = tuple(faults)
        lines = [f"{key}: {message}" if key else message for key, message in self.faults]
        if len(lines) > MOST_SHOWN:
            lines[MOST_SHOWN:] = [f"... and {len(lines) - MOST_SHOWN} more"]
        if len(lines) == 1:
            super().__init__(f"{source}: {lines[0]}")
        else:
            rows = "".join(f"\n  {line}" for line in lines)
            super().__init__(f"{source}: {len(self.faults)} faults:{rows}")

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle as a call of the constructor."""
        return (CaseError, (self.source, self.faults))


class BuildError(ValueError):
    """One thing that came to light only when a part of a case was built, with its key."""

    def __init__(self, fault: Fault) -> None:
        """An error that carries `fault`."""
        self.fault = fault
        super().__init__(f"{fault.key}: {fault.message}")

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle as a call of the constructor."""
        return (BuildError, (self.fault,))


def shown(value: Any) -> str:
    """A value for a message: on one line, and short."""
    if isinstance(value, bool):
        return str(value).lower()  # as TOML writes it
    try:
        text = repr(value)
    except ValueError:  # more digits than Python prints
        return "a whole number of thousands of digits"
    return text if len(text) <= 80 else text[:60] + "..." + text[-15:]


def is_number(value: Any) -> bool:
    """True for a finite real number; truth values are none."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


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


def close(value: Any, options: Sequence[str]) -> str:
    """The option that `value` is most like, quoted; empty where none is."""
    if not isinstance(value, str) or len(value) > 60:
        return ""
    same = [option for option in options if option.lower() == value.lower()]
    found = same or difflib.get_close_matches(value, options, n=1, cutoff=0.6)
    return f'"{found[0]}"' if found else ""


def alternatives(options: Sequence[str]) -> str:
    """'a, b or c'."""
    *front, last = options
    return f"{', '.join(front)} or {last}" if front else last
