"""Text for people: a head, and lines below it, in which no number is parted from its unit."""

from __future__ import annotations

import re
import textwrap

WIDTH = 100  # columns
_UNIT = re.compile(r"(?<=\d) (?=(?:deg|mm|m2|m/s|m|s)\b|%)")
_TIE = "\u00a0"  # textwrap breaks at plain blanks only


def filled(head: str, text: str) -> str:
    """Text behind a head; the rest of a long one is indented below.

    Example:
        >>> print(filled("way  ", "along " * 13 + "0.1234567890123456 deg"))
        way  along along along along along along along along along along along along along
             0.1234567890123456 deg
    """
    wrapped = textwrap.fill(
        _UNIT.sub(_TIE, text),
        WIDTH,
        initial_indent=head,
        subsequent_indent=" " * len(head),
        break_long_words=False,
        break_on_hyphens=False,
    )
    return wrapped.replace(_TIE, " ")
