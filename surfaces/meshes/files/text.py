"""Text of untrusted mesh files, line by line, with line numbers for messages."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import BinaryIO

from surfaces.surface import SurfaceError

LONGEST_LINE = 65536  # bytes
BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # which some editors put at the start of a text


class Lines:
    """The lines of a text file that say something, split into words."""

    def __init__(self, stream: BinaryIO, comment: bytes = b"", number: int = 0) -> None:
        """Read on from where the stream stands; what follows `comment` in a line is left out."""
        self.stream = stream
        self.comment = comment
        self.number = number
        """The line read last, counted from 1."""

    def __iter__(self) -> Iterator[list[bytes]]:
        """The words of each line that has any."""
        while line := self.stream.readline(LONGEST_LINE + 1):
            self.number += 1
            if len(line) > LONGEST_LINE:
                raise self.error(f"is longer than {LONGEST_LINE} bytes; this is not a mesh as text")
            if self.number == 1:
                line = line.removeprefix(BYTE_ORDER_MARK)
            if self.comment and self.comment in line:
                line = line[: line.index(self.comment)]
            words = line.split()
            if words:
                yield words

    def next(self, expected: str) -> list[bytes]:
        """The words of the next line.

        Raises:
            SurfaceError: the file ends; `expected` says before what.
        """
        for words in self:
            return words
        raise SurfaceError(f"ends after line {self.number}, before {expected}; it was cut short")

    def error(self, fault: str) -> SurfaceError:
        """What is wrong with the line read last."""
        return SurfaceError(f"line {self.number} {fault}")

    def floats(self, words: list[bytes]) -> list[float]:
        """Numbers; NaN and infinities are let through, for what uses them to judge.

        Raises:
            SurfaceError: a word is not a number.
        """
        try:
            values = [float(word) for word in words]
        except ValueError:
            values = [math.nan]
        if len(values) != len(words) or b"_" in b"".join(words):
            raise self.error(f"should hold numbers, got {shown(b' '.join(words))}")
        return values

    def whole(self, word: bytes) -> int:
        """A whole number of at most 18 digits.

        Raises:
            SurfaceError: the word is something else.
        """
        if len(word) <= 19 and word.removeprefix(b"-").isdigit():
            value = int(word)
            if abs(value) < 10**18:
                return value
        raise self.error(f"should hold a whole number, got {shown(word)}")


def shown(data: bytes) -> str:
    """A piece of a file for a message."""
    return repr(data[:60].decode("utf-8", "replace")) + ("..." if len(data) > 60 else "")
