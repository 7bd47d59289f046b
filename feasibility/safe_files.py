"""New files appear complete or not at all."""

from __future__ import annotations

import os
import secrets
import stat
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from coverable.files import reason
from feasibility.interrupts import at_leave
from feasibility.read_files import FileError, shown_path


def check_writable(path: str | os.PathLike[str]) -> None:
    """Say early that a file cannot be written, before the work whose outcome it shall hold.

    Raises:
        FileError: the folder does not exist or cannot be written to, or `path` is a folder.
    """
    file, name = Path(path), shown_path(path)
    try:
        if file.is_dir():
            raise FileError("is a folder; give the name of a file to write", name)
        folder = file.parent
        if not folder.is_dir():
            raise FileError(
                f"there is no folder {shown_path(folder)}; make it first, or choose another", name
            )
    except (OSError, ValueError) as error:
        if isinstance(error, FileError):
            raise
        raise FileError(f"cannot be written: {reason(error)}", name) from error
    if _is_special(file):
        if not os.access(file, os.W_OK):
            raise FileError("cannot be written to", name)
        return
    if not os.access(folder, os.W_OK | os.X_OK):
        raise FileError(f"the folder {shown_path(folder)} cannot be written to", name)


def write_whole(path: str | os.PathLike[str], write: Callable[[IO[bytes]], object]) -> Path:
    """Write a file under another name beside it, then put it in place in one step.

    What was there before stays until the new file is complete.

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
    temporary = os.fspath(file.with_name(f".{file.name[:40]}.{secrets.token_hex(8)}"))
    try:
        mode = _mode(file)
        with _unfinished(temporary):
            with open(temporary, "xb", opener=None if mode is None else _private) as stream:
                write(stream)
                stream.flush()
                os.fsync(stream.fileno())
            if mode is not None:
                os.chmod(temporary, mode)
            os.replace(temporary, file)
    except OSError as error:
        raise FileError(f"cannot be written: {reason(error)}", shown_path(path)) from error
    return Path(path)


@contextmanager
def _unfinished(path: str) -> Generator[None]:
    """Remove a file at the end of the block, if it is still there, however the block ends."""

    def remove() -> None:
        with suppress(FileNotFoundError):
            os.unlink(path)

    with at_leave(remove):
        try:
            yield
        finally:
            remove()


def _private(path: str, flags: int) -> int:
    """Open a new file that nobody else reads until it has its permissions."""
    return os.open(path, flags, 0o600)


def _is_special(file: Path) -> bool:
    """Is it a pipe or a device, such as /dev/stdout, which cannot be replaced?"""
    return file.exists() and not file.is_file() and not file.is_dir()


def _write_through(file: Path, write: Callable[[IO[bytes]], object]) -> Path:
    """Write to something that is not a regular file, such as /dev/null."""
    try:
        with open(file, "wb") as stream:
            write(stream)
    except OSError as error:
        raise FileError(f"cannot be written: {reason(error)}", shown_path(file)) from error
    return file


def _mode(file: Path) -> int | None:
    """The permissions of a file; None where there is none, and the system gives them."""
    return stat.S_IMODE(file.stat().st_mode) if file.exists() else None
