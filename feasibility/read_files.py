"""Files from elsewhere are read with a cap, and named where they cannot be."""

from __future__ import annotations

import os
from collections.abc import Generator
from contextlib import contextmanager

import coverable.files
from coverable.errors import CoverableError


class FileError(CoverableError):
    """A file that cannot be read or written: which one, why, and what would do."""


def read_regular(path: str | os.PathLike[str], cap: int, what: str) -> bytes:
    """Read a regular file of at most `cap` bytes.

    See `coverable.files.read_regular` for the arguments.

    Raises:
        FileError: there is no such file, it is not a regular one, or it is too large.
    """
    with _named(path):
        return coverable.files.read_regular(path, cap, what)


def read_text(path: str | os.PathLike[str], cap: int, what: str) -> str:
    """Read a text file in UTF-8, as `coverable.files.read_text` does.

    Raises:
        FileError: as `read_regular`, or it is not such text.
    """
    with _named(path):
        return coverable.files.read_text(path, cap, what)


@contextmanager
def _named(path: str | os.PathLike[str]) -> Generator[None]:
    """A fault of a file becomes a `FileError` with its name."""
    try:
        yield
    except coverable.files.FileFault as error:
        raise FileError(error.faults, shown_path(path)) from error


def shown_path(path: str | os.PathLike[str]) -> str:
    """A path for a message, on one line: as it is, or quoted where it holds odd characters."""
    text = os.fspath(path)
    short = text if len(text) <= 200 else text[:90] + "..." + text[-90:]
    return short if short.isprintable() and short else repr(short)
