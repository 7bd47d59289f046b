"""Untrusted files: a regular file is opened and read with a cap, or refused with a sentence.

Shared by the packages, which know nothing of each other; each gives the error its own class and
the file's name.
"""

from __future__ import annotations

import os
import stat
from collections.abc import Callable, Iterable
from io import BufferedReader
from pathlib import Path
from typing import Generic, Protocol, TypeVar

from coverable.errors import CoverableError

LONGEST_NAME = 100  # characters of a file's name in a message


class FileFault(CoverableError):
    """What is wrong with a file, without its name."""


def open_regular(
    path: str | os.PathLike[str], cap: int, what: str, if_larger: str = ""
) -> BufferedReader:
    """Open a regular file of at most `cap` bytes.

    Pipes and devices are refused without waiting for them.

    Args:
        path: the file.
        cap: largest size, bytes.
        what: what the file should be, for the messages ("a case file").
        if_larger: what to do about a file that is too large, for the message.

    Raises:
        FileFault: there is no such file, it is not a regular one, or it is too large.
    """
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | getattr(os, "O_CLOEXEC", 0))
    except FileNotFoundError as error:
        raise FileFault(f"there is no such file; expected {what}") from error
    except OSError as error:
        raise FileFault(f"cannot be opened: {reason(error)}") from error
    except ValueError as error:  # a NUL byte, or half of a character
        raise FileFault("cannot be opened: no file can have that name") from error
    status = os.fstat(handle)
    fault = ""
    if stat.S_ISDIR(status.st_mode):
        fault = f"is a folder; expected {what}"
    elif not stat.S_ISREG(status.st_mode):
        fault = f"is not a regular file but a pipe, socket or device; expected {what}"
    elif status.st_size > cap:
        fault = too_large(cap, what, if_larger)
    if fault:
        os.close(handle)
        raise FileFault(fault)
    return open(handle, "rb")


def read_regular(path: str | os.PathLike[str], cap: int, what: str, if_larger: str = "") -> bytes:
    """Read a regular file of at most `cap` bytes; arguments as for `open_regular`.

    Raises:
        FileFault: there is no such file, it is not a regular one, it cannot be read, or it is too
            large.
    """
    with open_regular(path, cap, what, if_larger) as stream:
        try:
            data = stream.read(cap + 1)
        except OSError as error:
            raise FileFault(f"cannot be read: {reason(error)}") from error
    if len(data) > cap:
        raise FileFault(too_large(cap, what, if_larger))
    return data


def read_text(path: str | os.PathLike[str], cap: int, what: str) -> str:
    """Read a text file in UTF-8, without its byte order mark; arguments as for `open_regular`.

    Raises:
        FileFault: as `read_regular`, or it is not such text.
    """
    try:
        return read_regular(path, cap, what).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFault(f"is not text in UTF-8, at byte {error.start}; expected {what}") from error


def stamps(paths: Iterable[str]) -> tuple[tuple[int, int] | None, ...]:
    """Time (ns) and size (bytes) of files or folders, by which a change is noticed.

    None for one that is not there.
    """
    found: list[tuple[int, int] | None] = []
    for path in paths:
        try:
            status = os.stat(path)
        except (OSError, ValueError):  # ValueError: a NUL byte in the name
            found.append(None)
        else:
            found.append((status.st_mtime_ns, status.st_size))
    return tuple(found)


class _OfFiles(Protocol):
    @property
    def files(self) -> tuple[str, ...]: ...


T = TypeVar("T", bound=_OfFiles)


class Remembered(Generic[T]):
    """Values made from files, each kept until one of its `files` changes."""

    def __init__(self, most: int) -> None:
        """Start with none; at most `most` are kept."""
        self._most = most
        self._kept: dict[object, tuple[T, tuple[tuple[int, int] | None, ...]]] = {}

    def get(self, key: object, make: Callable[[], T]) -> T:
        """The value of that key, made where there is none that still holds."""
        if key in self._kept:
            value, before = self._kept[key]
            if stamps(value.files) == before:
                return value
        value = make()
        if len(self._kept) >= self._most:
            self._kept.clear()
        self._kept[key] = value, stamps(value.files)
        return value


def too_large(cap: int, what: str, advice: str = "") -> str:
    """The sentence about a file of more than `cap` bytes."""
    return f"is larger than {size(cap)}, too large for {what}" + (f"; {advice}" if advice else "")


def shown_name(path: str | os.PathLike[str]) -> str:
    """The name of a file for a message, quoted; a long one is cut short."""
    name = Path(os.fsdecode(path)).name
    return repr(name if len(name) <= LONGEST_NAME else f"{name[:LONGEST_NAME]}...")


def reason(error: Exception) -> str:
    """What an error says, without its number and file name."""
    return (getattr(error, "strerror", None) or str(error) or type(error).__name__).lower()


def size(count: int) -> str:
    """A number of bytes for people."""
    for unit, name in ((1 << 30, "GB"), (1 << 20, "MB"), (1 << 10, "kB")):
        if count >= unit:
            return f"{count / unit:.3g} {name}"
    return f"{count} bytes"
