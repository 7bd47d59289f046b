"""Files at the edge: untrusted ones are read with a cap, new ones appear whole or not at all."""

from __future__ import annotations

import os
import stat
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import IO


class FileError(ValueError):
    """A file that cannot be read or written: which one, why, and what would do."""


def read_regular(path: str | os.PathLike[str], cap: int, what: str) -> bytes:
    """Read a regular file of at most `cap` bytes.

    Pipes and devices are refused without waiting for them.

    Args:
        path: the file.
        cap: largest size, bytes.
        what: what the file should be, for the messages ("a case file").

    Raises:
        FileError: there is no such file, it is not a regular one, or it is too large.
    """
    name = shown_path(path)
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK | getattr(os, "O_CLOEXEC", 0))
    except FileNotFoundError as error:
        raise FileError(f"{name}: there is no such file; expected {what}") from error
    except (OSError, ValueError) as error:  # ValueError: a NUL byte in the name
        raise FileError(f"{name}: cannot be opened: {reason(error)}") from error
    try:
        mode = os.fstat(handle).st_mode
        if stat.S_ISDIR(mode):
            raise FileError(f"{name}: is a folder; expected {what}")
        if not stat.S_ISREG(mode):
            raise FileError(f"{name}: is not a regular file; expected {what}")
        with open(handle, "rb", closefd=False) as stream:
            data = stream.read(cap + 1)
    except OSError as error:
        raise FileError(f"{name}: cannot be read: {reason(error)}") from error
    finally:
        os.close(handle)
    if len(data) > cap:
        raise FileError(f"{name}: is larger than {size(cap)}, too large for {what}")
    return data


def check_writable(path: str | os.PathLike[str]) -> None:
    """Say early that a file cannot be written, before the work whose outcome it shall hold.

    Raises:
        FileError: the folder does not exist or cannot be written to, or `path` is a folder.
    """
    file, name = Path(path), shown_path(path)
    try:
        if file.is_dir():
            raise FileError(f"{name}: is a folder; give the name of a file to write")
        folder = file.parent
        if not folder.is_dir():
            raise FileError(
                f"{name}: there is no folder {shown_path(folder)}; make it first, or choose another"
            )
    except (OSError, ValueError) as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"{name}: cannot be written: {reason(error)}") from error
    if _is_special(file):
        if not os.access(file, os.W_OK):
            raise FileError(f"{name}: cannot be written to")
        return
    if not os.access(folder, os.W_OK | os.X_OK):
        raise FileError(f"{name}: the folder {shown_path(folder)} cannot be written to")


def write_whole(path: str | os.PathLike[str], write: Callable[[IO[bytes]], object]) -> Path:
    """Write a file under another name beside it, then put it in place in one step.

    Whatever stood there before stays until the new file is complete.

    Args:
        path: the file.
        write: called with the open binary file.

    Raises:
        FileError: the file cannot be written; nothing is left behind.
    """
    check_writable(path)
    if _is_special(Path(path)):
        return _write_through(Path(path), write)
    # A link is followed, so that the file it points to is replaced and not the link.
    file = Path(os.path.realpath(path))
    temporary = ""
    try:
        handle, temporary = tempfile.mkstemp(prefix=f".{file.name[:40]}.", dir=file.parent)
        with open(handle, "wb") as stream:
            write(stream)
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(temporary, _mode(file))
        os.replace(temporary, file)
    except OSError as error:
        raise FileError(f"{shown_path(path)}: cannot be written: {reason(error)}") from error
    finally:
        if temporary and os.path.exists(temporary):
            os.unlink(temporary)
    return Path(path)


def _is_special(file: Path) -> bool:
    """Is it a pipe or a device, such as /dev/stdout, which cannot be replaced?"""
    return file.exists() and not file.is_file() and not file.is_dir()


def _write_through(file: Path, write: Callable[[IO[bytes]], object]) -> Path:
    """Write to something that is not a regular file, such as /dev/null."""
    try:
        with open(file, "wb") as stream:
            write(stream)
    except OSError as error:
        raise FileError(f"{shown_path(file)}: cannot be written: {reason(error)}") from error
    return file


def _mode(file: Path) -> int:
    """Permissions for a file: those it has, or those that a new file gets."""
    if file.exists():
        return stat.S_IMODE(file.stat().st_mode)
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def reason(error: Exception) -> str:
    """What an error says, without its number and file name."""
    return (getattr(error, "strerror", None) or str(error) or type(error).__name__).lower()


def shown_path(path: str | os.PathLike[str]) -> str:
    """A path for a message, on one line: as it is, or quoted where it holds odd characters."""
    text = os.fspath(path)
    short = text if len(text) <= 200 else text[:90] + "..." + text[-90:]
    return short if short.isprintable() and short else repr(short)


def size(count: int) -> str:
    """A number of bytes for people."""
    for unit, name in ((1 << 30, "GB"), (1 << 20, "MB"), (1 << 10, "kB")):
        if count >= unit:
            return f"{count / unit:.3g} {name}"
    return f"{count} bytes"
