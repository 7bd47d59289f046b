"""The family of errors: what is wrong with an input, as facts, and the one message they make."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context, Decimal
from difflib import get_close_matches
from functools import partial
from numbers import Integral, Real
from typing import Any, Final, NamedTuple, TypeGuard, TypeVar

MOST_SHOWN = 20  # faults in one message; `faults` has them all
LONGEST_SHOWN = 80  # characters of a value in a message
LARGEST_WHOLE = 2**63 - 1
# Of any length, angle or time: squares and cubes of these are still numbers.
SMALLEST, LARGEST = 1e-12, 1e12

Word = TypeVar("Word", bound=str)


class Fault(NamedTuple):
    """One thing that is wrong with an input.

    Example:
        >>> fault = Fault("polar_deg", "got -3", expected="must lie in 0 .. 180 (degrees)")
        >>> worded(fault)
        'polar_deg must lie in 0 .. 180 (degrees), got -3'
        >>> worded(fault.renamed({"polar_deg": "u_deg"}, "surface"), ": ")
        'surface.u_deg: must lie in 0 .. 180 (degrees), got -3'
    """

    key: str
    """The argument's name in Python, the key in a file; empty for the input as one."""
    fault: str
    """What was wrong, with the value."""
    place: str = ""
    """File, line or table, where there is one."""
    expected: str = ""
    """What would do: "must ...", or a remedy."""

    @property
    def message(self) -> str:
        """The sentence without key and place: what was expected, and what was found."""
        if self.expected.startswith("must "):
            return f"{self.expected}, {self.fault}"
        return f"{self.fault}; {self.expected}" if self.expected else self.fault

    def renamed(self, names: Mapping[str, str], table: str = "") -> Fault:
        """The fault with its argument called as a table of a file calls it.

        Args:
            names: the key of each argument, where it differs.
            table: put before the key.
        """
        argument = re.split(r"[.\[]", self.key, maxsplit=1)[0]
        key = names.get(argument, argument) + self.key[len(argument) :]
        return self._replace(key=".".join(part for part in (table, key) if part))


def worded(fault: Fault, after_key: str = " ") -> str:
    """A fault as one sentence: its key, its place, what was expected and what was found."""
    if not fault.place:
        return f"{fault.key}{after_key}{fault.message}" if fault.key else fault.message
    return ": ".join(part for part in (fault.key, fault.place, fault.message) if part)


class CoverableError(ValueError):
    """An input that cannot be used: everything that is wrong with it, and what would do.

    Attributes:
        faults: what is wrong.
        source: what the faults are of: a file, a case, a kind of surface; empty where one message
            says it all.
    """

    after_key = " "
    """Between key and message."""

    def __init__(
        self, faults: str | Fault | Iterable[str | Fault], source: str | None = None
    ) -> None:
        """An error with these faults; a text is a fault of the input as one."""
        given = (faults,) if isinstance(faults, (str, Fault)) else faults
        self.faults = tuple(Fault("", one) if isinstance(one, str) else one for one in given)
        self.source = source or ""
        lines = [worded(fault, self.after_key) for fault in self.faults[:MOST_SHOWN]]
        if len(self.faults) > MOST_SHOWN:
            lines.append(f"... and {len(self.faults) - MOST_SHOWN} more")
        if len(lines) > 1:
            lines.insert(0, f"{len(self.faults)} faults:")
        text = "\n  ".join(lines)
        super().__init__(f"{self.source}: {text}" if self.source else text)

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle as a call of the constructor, so that workers can report it."""
        return (partial(type(self), source=self.source), (self.faults,))


class ArgumentError(CoverableError):
    """Arguments of a call that make no sense."""


class Missing:
    """Stands for an argument that a file leaves out and that has no default."""

    def __repr__(self) -> str:
        """As in a message."""
        return "nothing"


MISSING: Final = Missing()


class Checks:
    """Reads arguments one by one, keeps what is wrong, and raises once at the end.

    After a fault a value that does no harm is returned, so that the next argument can be read.

    Example:
        >>> checks = Checks("a task")
        >>> checks.number("cone_deg", "steep", "must lie in 0 .. 180 (degrees)", 0.0, 180.0)
        0.0
        >>> checks.done()
        Traceback (most recent call last):
        coverable.errors.ArgumentError: a task: cone_deg must lie in 0 .. 180 (degrees), got 'steep'
    """

    def __init__(self, source: str = "", error: type[CoverableError] = ArgumentError) -> None:
        """Start with no faults.

        Args:
            source: what the arguments are of.
            error: what `done` raises.
        """
        self.source = source
        self.error = error
        self.faults: list[Fault] = []

    def wrong(self, key: str, value: object, expected: str) -> None:
        """Keep the fault that `value` is not what was expected.

        Args:
            key: the argument.
            value: what was given; `MISSING` where nothing was.
            expected: "must be ...".
        """
        if value is MISSING:
            self.keep(Fault(key, "is missing", expected=f"it {expected}"))
        else:
            self.keep(Fault(key, f"got {shown(value)}", expected=expected))

    def keep(self, fault: Fault) -> None:
        """Keep a fault."""
        self.faults.append(fault)

    def number(
        self, key: str, value: object, expected: str, low: float = -math.inf, high: float = math.inf
    ) -> float:
        """A finite number, `low` .. `high`."""
        number = real(value)
        if self._is_beyond(key, number, expected):
            return max(low, -LARGEST)
        if math.isfinite(number) and low <= number <= high:
            return number
        self.wrong(key, value, expected)
        return low if math.isfinite(low) else 0.0

    def positive(self, key: str, value: object, unit: str = "metres") -> float:
        """A finite number > 0."""
        number, expected = real(value), f"must be a finite number > 0 ({unit})"
        if self._is_beyond(key, number, expected):
            return 1.0
        if SMALLEST <= number < math.inf:
            return number
        if 0.0 < number < SMALLEST:
            self.keep(Fault(key, f"got {shown(value)}, below {SMALLEST:g}", expected=expected))
        else:
            self.wrong(key, value, expected)
        return 1.0

    def _is_beyond(self, key: str, number: float, expected: str) -> bool:
        """Keep a fault of a number whose square may be none."""
        beyond = LARGEST < abs(number) < math.inf
        if beyond:
            self.keep(Fault(key, f"got {number:g}, beyond {LARGEST:g}", expected=expected))
        return beyond

    def whole(
        self, key: str, value: object, low: int, high: int = LARGEST_WHOLE, or_word: str = ""
    ) -> int:
        """A whole number, `low` .. `high`; `or_word` is what else is accepted."""
        if is_whole(value, low, high):
            return int(value)
        some = f">= {low} (64 bits)" if high == LARGEST_WHOLE else f"in {low} .. {high:,}"
        either = f"{or_word} or " if or_word else ""
        self.wrong(key, value, f"must be {either}a whole number {some}")
        return low

    def choice(self, key: str, value: object, options: Sequence[Word]) -> Word:
        """One of some words."""
        for option in options:
            if isinstance(value, str) and value == option:
                return option
        expected = f"must be {alternatives([repr(option) for option in options])}"
        guess = close(value, options)
        if guess:
            self.keep(Fault(key, f"got {shown(value)}; did you mean {guess}?", expected=expected))
        else:
            self.wrong(key, value, expected)
        return options[0]

    def numbers(
        self,
        key: str,
        value: Any,
        count: int,
        expected: str,
        largest: float = LARGEST,
        remedy: str = "",
    ) -> list[float] | None:
        """Some finite numbers, none beyond `largest`, or else a remedy; None after a fault."""
        items = value.tolist() if hasattr(value, "tolist") else value
        if isinstance(items, Sequence) and not isinstance(items, (str, bytes)):
            found = [real(item) for item in items]
            if len(found) == count and all(map(math.isfinite, found)):
                if max(map(abs, found), default=0.0) <= largest:
                    return found
                what = f"got {shown(value)}, with a number beyond {largest:g}{remedy}"
                self.keep(Fault(key, what, expected=expected))
                return None
        self.wrong(key, value, expected)
        return None

    def interval(
        self, key: str, value: Any, unit: str, after_fault: tuple[float, float] = (0.0, 1.0)
    ) -> tuple[float, float]:
        """Two finite numbers, the first below the second."""
        expected = f"must be a pair (low, high) of finite numbers with low < high ({unit})"
        found = self.numbers(key, value, 2, expected)
        if found is None:
            return after_fault
        low, high = found
        if low < high:
            return low, high
        what = "an empty range" if low == high else "the wrong way round"
        self.keep(Fault(key, f"got {shown(value)}, {what}", expected=expected))
        return after_fault

    def direction(self, key: str, value: Any) -> list[float]:
        """Three finite numbers that are not all zero; of any length."""
        expected = "must be three finite numbers that are not all zero, such as (0, 0, 1)"
        found = self.numbers(key, value, 3, expected, math.inf)
        if found is not None and max(map(abs, found)) >= 1e-12:
            return found
        if found is not None:
            self.wrong(key, value, expected)
        return [0.0, 0.0, 1.0]

    def done(self) -> None:
        """Raise if anything was wrong.

        Raises:
            CoverableError: of the kind given to the constructor, with every fault found.
        """
        if self.faults:
            raise self.error(self.faults, self.source)


def real(value: object) -> float:
    """The value as a float, or NaN if it is not a real number; truth values are none."""
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return math.inf
    return math.nan


def is_number(value: object) -> bool:
    """True for a finite real number; truth values are none."""
    return math.isfinite(real(value))


def is_whole(value: object, low: int, high: int = LARGEST_WHOLE) -> TypeGuard[int]:
    """True for a whole number, `low` .. `high`; truth values are none."""
    if not isinstance(value, Integral) or isinstance(value, bool):
        return False
    return low <= int(value) <= high


def number_in(word: str) -> float:
    """The number that a word of a text file stands for, or NaN if it is none."""
    try:
        return float(word)
    except ValueError:
        return math.nan


def shown(value: object) -> str:
    """A value for a message: on one line, and short."""
    try:
        text = repr(value)
    except ValueError:  # more digits than Python prints
        return "a whole number of thousands of digits"
    text = text if text.isprintable() else " ".join(text.split())
    return text if len(text) <= LONGEST_SHOWN else text[:60] + "..." + text[-15:]


def printable(key: str) -> str:
    """A key for a message."""
    return key if key.isprintable() and 0 < len(key) <= 60 else shown(key)


def close(value: Any, options: Sequence[str]) -> str:
    """The option that `value` is most like, quoted; empty where none is."""
    found = close_matches(value, options)
    return f'"{found[0]}"' if found else ""


def close_matches(
    value: Any, options: Iterable[str], most: int = 1, cutoff: float = 0.6
) -> list[str]:
    """At most `most` options that `value` was probably meant to be, the closest first."""
    if not isinstance(value, str) or len(value) > 60:  # matching takes time; nobody misspells these
        return []
    options_by_lower = {option.lower(): option for option in options}
    found = get_close_matches(value.strip().lower(), options_by_lower, most, cutoff)
    return [options_by_lower[word] for word in found]


def at_most(value: float, digits: int) -> str:
    """A number to some significant digits that is no less: a bound that still holds as printed.

    Example:
        >>> at_most(0.12341, 3), at_most(0.5, 3), at_most(0.0, 3)
        ('0.124', '0.5', '0')
    """
    return _rounded(value, digits, ROUND_CEILING)


def at_least(value: float, digits: int) -> str:
    """A number to some significant digits that is no more.

    Example:
        >>> at_least(12.999, 3), at_least(-0.12341, 3)
        ('12.9', '-0.124')
    """
    return _rounded(value, digits, ROUND_FLOOR)


def _rounded(value: float, digits: int, rounding: str) -> str:
    """A number with so many significant digits, rounded one way; inf stays inf."""
    if math.isfinite(value):
        value = float(Context(prec=digits, rounding=rounding).create_decimal(Decimal(value)))
    return f"{value:.{digits}g}"


def counted(number: int, one: str, several: str = "") -> str:
    """A number of things.

    Example:
        >>> counted(1, "cell"), counted(1200, "cell"), counted(2, "pass", "passes")
        ('1 cell', '1,200 cells', '2 passes')
    """
    return f"{number:,} {one if number == 1 else several or one + 's'}"


def listed(names: Sequence[object], most: int) -> str:
    """At most so many names or numbers, and how many more there are.

    Example:
        >>> listed(["a", "b", "c", "d"], 2), listed([7, 8], 2)
        ('a, b and 2 more', '7, 8')
    """
    more = f" and {len(names) - most:,} more" if len(names) > most else ""
    return ", ".join(map(str, names[:most])) + more


def alternatives(options: Sequence[str]) -> str:
    """'a, b or c'."""
    *front, last = options
    return f"{', '.join(front)} or {last}" if front else last
