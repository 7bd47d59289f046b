"""Numbers in columns: CSV text with a header, read with caps, and every fault by its line.

Columns are parted by commas, semicolons or tabs. Lines that begin with # say nothing, and empty
ones neither.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from coverable.errors import CoverableError, Fault, number_in, shown

COMMENT = "#"
DELIMITERS = ",;\t"
DIGITS = 9  # of a whole number, at most
MOST_FAULTS = 1000  # lines that are named


class Kind(NamedTuple):
    """What the words of a column stand for."""

    expected: str
    value: Callable[[str], float]
    """Of a word without blanks around it; NaN where it is wrong."""


def _finite(word: str) -> float:
    value = number_in(word)
    return value if math.isfinite(value) else math.nan


def _whole(word: str) -> float:
    return float(word) if word.isascii() and word.isdigit() and len(word) <= DIGITS else math.nan


NUMBER = Kind("a finite number", _finite)
WHOLE = Kind("a whole number >= 0", _whole)
WHOLE_OR_NOTHING = Kind(
    "a whole number >= 0 or nothing", lambda word: _whole(word) if word else -1.0
)
FLAG = Kind("0 or 1", lambda word: {"0": 0.0, "1": 1.0}.get(word, math.nan))


class Columns(NamedTuple):
    """The words of a CSV text; `numbers` says what they are worth."""

    head: list[str]
    """Names of the columns."""
    place: str
    """Where they stand: "line 1"."""
    lines: list[int]
    rows: list[list[str]]
    """For each line of numbers its words, as many as there are."""

    def numbers(self, kinds: Mapping[int, Kind]) -> Array:
        """(m, k) the values in k of the columns, by their places in the header.

        Raises:
            CoverableError: no lines, or some that hold more or fewer words than the header, or
                other words; the first 1,000 are named.
        """
        if not self.rows:
            raise CoverableError("has no numbers below its first line")
        found, faults = np.empty((len(self.rows), len(kinds))), list[Fault]()
        for k, (line, row) in enumerate(zip(self.lines, self.rows, strict=True)):
            if len(row) != len(self.head):
                text = f"has {len(row)} fields, not the {len(self.head)} of the first line"
                faults.append(Fault("", text, f"line {line}"))
            else:
                values = [kind.value(row[at].strip()) for at, kind in kinds.items()]
                found[k] = values
                for value, (at, kind) in zip(values, kinds.items(), strict=True):
                    if math.isnan(value):
                        got = f"must be {kind.expected}, got {shown(row[at].strip())}"
                        faults.append(Fault("", f"{self.head[at]} {got}", f"line {line}"))
            if len(faults) >= MOST_FAULTS:
                break
        if faults:
            raise CoverableError(faults)
        return found


def read_columns(text: str, most: int, what: str, delimiters: str = DELIMITERS) -> Columns:
    """Part a CSV text into words.

    Args:
        text: with a line of names, then at most `most` lines of numbers.
        most: lines.
        what: the header should say, for messages: "joint names".
        delimiters: of which the one that the header holds most often parts the columns.

    Raises:
        CoverableError: it is not CSV, has no header, or too many lines.

    Example:
        >>> read_columns("x; y\\n1; 2.5\\n", 10, "x and y").numbers({1: NUMBER, 0: WHOLE})
        array([[2.5, 1. ]])
    """
    written = (line for line in io.StringIO(text) if line.strip() and line[0] != COMMENT)
    delimiter = max(delimiters, key=next(written, "").count)
    words = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    lines: list[int] = []
    rows: list[list[str]] = []
    try:
        for row in words:
            if any(word.strip() for word in row) and not row[0].startswith(COMMENT):
                lines.append(words.line_num)
                rows.append(row)
            if len(rows) > most + 1:
                raise CoverableError(f"holds more than {most:,} lines of numbers")
    except csv.Error as error:
        raise CoverableError(f"is not CSV: {error}") from error
    if not rows:
        raise CoverableError(f"is empty; expected a first line of {what}, then numbers")
    place, head = f"line {lines[0]}", [word.strip() for word in rows[0]]
    if not any(math.isnan(number_in(word)) for word in head):
        raise CoverableError(Fault("", f"begins with numbers; expected a line of {what}", place))
    return Columns(head, place, lines[1:], rows[1:])
