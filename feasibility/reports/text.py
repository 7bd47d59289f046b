"""Parts of texts: wrapped rows, aligned tables, counts, and tables as CSV."""

from __future__ import annotations

import csv
import io
import re
import textwrap
from collections.abc import Iterable, Sequence
from typing import Any

WIDTH = 100  # columns
_UNIT = re.compile(r"(?<=\d) (?=(?:deg|mm|m2|m/s|m|s)\b|%)")
_UNBROKEN = "\u00a0"  # textwrap breaks at plain blanks only


def filled(head: str, text: str) -> str:
    """Text behind a head, wrapped and indented, with no number parted from its unit.

    Example:
        >>> print(filled("path  ", "along " * 13 + "0.1234567890123456 deg"))
        path  along along along along along along along along along along along along along
              0.1234567890123456 deg
    """
    wrapped = textwrap.fill(
        _UNIT.sub(_UNBROKEN, text),
        WIDTH,
        initial_indent=head,
        subsequent_indent=" " * len(head),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return wrapped.replace(_UNBROKEN, " ")


def summary(head: str, rows: Iterable[tuple[str, str]], width: int = 12) -> list[str]:
    """The answer in one line, an empty line, and named rows; rows without text are left out."""
    return [head, "", *(filled(f"  {name:<{width}}", text) for name, text in rows if text)]


def aligned(table: Sequence[Sequence[str]], justify: str = "<") -> list[str]:
    """Rows with columns of equal width, to the left ("<") or to the right (">")."""
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return [
        "  ".join(f"{cell:{justify}{width}}" for cell, width in zip(row, widths, strict=True))
        for row in table
    ]


def counted(number: int, noun: str) -> str:
    """A number of things.

    Example:
        >>> counted(1, "cell"), counted(1200, "cell")
        ('1 cell', '1,200 cells')
    """
    return f"{number:,} {noun}{'' if number == 1 else 's'}"


def percent(share: float) -> str:
    """A share, 0 to 1, in percent."""
    return f"{100.0 * share:.1f} %"


def csv_text(rows: Iterable[Iterable[Any]]) -> str:
    """Rows as CSV; None is an empty field."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
