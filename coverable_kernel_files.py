"""Files of compiled kernels: what they are named by, where they lie, and which of them are read.

A file's name says all that the kernel in it depends on: its function, the stamp of what it was
compiled from, the types of its arguments, the processor that it is for, and the versions of Python,
numba and LLVM. So there is no list to keep, no time to compare, and no way to take one kernel for
another: where nothing has that very name, there is no such kernel, and it is compiled.

Kernels lie

- in `NUMBA_CACHE_DIR`, if that is set; else beside the code, or where that cannot be written, in
  the cache of the home folder. They were compiled on this machine, for its processor;
- in `coverable_shipped_kernels`, if a wheel brought them (`tools/make_wheel.py`). They are for any
  processor of a kind.

numba's form of a kernel is a pickle of machine code, and whoever could change one could run
anything. So a file is read only where it is as safe as the code beside it: it and its folder belong
to the user, to root, or to whom the code belongs; and nobody else may write there, but for a group
that may write to the code as well.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import pickle
import stat
import sys
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

SHIPPED = Path(__file__).parent / "coverable_shipped_kernels"
ENDING = ".kernel"
GENERIC = "generic", ""  # a processor without anything that not all of its kind have, to LLVM


class Processor(NamedTuple):
    """What machine code is for, in LLVM's words."""

    triple: str
    name: str
    features: str


class Kernel(NamedTuple):
    """A compiled function, by all that it depends on."""

    function: str
    """Its module and name."""
    stamp: str
    """A hash of all that it was compiled from."""
    types: str
    """Of its arguments."""
    processor: Processor

    def file(self) -> str:
        """The name of its file."""
        return f"{_beginning(self)}{_hash(repr(self.types), *self.processor)}{ENDING}"

    def for_any_processor(self) -> Kernel:
        """The same, for every processor of the kind."""
        return self._replace(processor=Processor(self.processor.triple, *GENERIC))


def load(kernel: Kernel, source: Path) -> Any:
    """What was kept of a kernel, or shipped; None where there is nothing that may be read.

    Args:
        kernel: which.
        source: the file that its function is in.
    """
    for folder in _own_folders(source):
        with contextlib.suppress(OSError, ValueError, ImportError, AttributeError):
            return _read(folder / kernel.file(), source.parent)
    with contextlib.suppress(OSError, ValueError, ImportError, AttributeError):
        return _read(SHIPPED / kernel.for_any_processor().file(), source.parent)
    return None


def keep(kernel: Kernel, source: Path, content: bytes) -> Path | None:
    """Write a kernel where it is found again; the folder, or None if nothing can be written.

    Args:
        kernel: which.
        source: the file that its function is in.
        content: numba's form of it, pickled.
    """
    for folder in _own_folders(source):
        with contextlib.suppress(OSError):
            _write(folder, kernel, content, source.parent)
            return folder
    return None


def is_safe(found: os.stat_result, code: os.stat_result, user: int) -> bool:
    """May a file or folder be trusted like the code?

    Args:
        found: its owner and permissions.
        code: those of the folder that the code is in.
        user: who runs it.

    Example:
        >>> here = os.stat(__file__)
        >>> is_safe(here, here, here.st_uid), is_safe(os.stat("/tmp"), here, here.st_uid)
        (True, False)
    """
    if found.st_uid not in (user, 0, code.st_uid) or found.st_mode & stat.S_IWOTH:
        return False
    same_group = code.st_mode & stat.S_IWGRP and found.st_gid == code.st_gid
    return bool(same_group) or not found.st_mode & stat.S_IWGRP


def _own_folders(source: Path) -> Iterator[Path]:
    """Where kernels of this machine may lie, the best place first."""
    from numba.core import config
    from numba.misc.appdirs import AppDirs

    inside = f"{source.parent.name}_{_hash(str(source.parent.resolve()))}"
    chosen = vars(config)["CACHE_DIR"]
    if chosen:
        yield Path(chosen) / inside
        return
    yield source.parent / "__pycache__"
    home = Path(AppDirs("coverable", appauthor=False).user_cache_dir)
    if home.is_absolute():  # else there is no home folder
        yield home / inside


def _read(path: Path, code: Path) -> Any:
    """The kernel in a file.

    Raises:
        OSError: if there is no file, or it is not safe.
        ValueError: if it is not whole.
        ImportError, AttributeError: if it names a class that has moved.
    """
    beside, user = code.stat(), os.geteuid()
    with path.open("rb") as file:
        for found in (os.fstat(file.fileno()), path.parent.stat()):
            if not is_safe(found, beside, user):
                raise PermissionError(f"{path} is not as safe as the code")
        whole = file.read()
    content = whole[hashlib.sha256().digest_size :]
    if whole != _sealed(path.name, content):
        raise ValueError(f"{path} is not whole")
    return pickle.loads(content)


def _write(folder: Path, kernel: Kernel, content: bytes, code: Path) -> None:
    """Write a file in one step, in place of those of other versions.

    Raises:
        OSError: if that is not possible, or the folder is not safe.
    """
    in_code = folder.parent == code
    folder.mkdir(parents=True, exist_ok=True, mode=0o777 if in_code else 0o700)
    if not is_safe(folder.stat(), code.stat(), os.geteuid()):
        raise PermissionError(f"{folder} is not as safe as the code")
    path = folder / kernel.file()
    part = path.with_name(f"{path.name}.{uuid.uuid4().hex[:8]}")
    opened = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
    try:
        with os.fdopen(opened, "wb") as file:
            file.write(_sealed(path.name, content))
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise
    version, whole_name = _beginning(kernel), _function(kernel)
    for other in folder.iterdir():
        if other.name.startswith(whole_name) and not other.name.startswith(version):
            other.unlink(missing_ok=True)


def _sealed(name: str, content: bytes) -> bytes:
    """What is written: a hash of the name and the content, and the content."""
    return hashlib.sha256(name.encode() + content).digest() + content


def _function(kernel: Kernel) -> str:
    """The beginning of the names of all files of a function, for this Python."""
    plain = (letter if letter.isalnum() or letter in "._" else "_" for letter in kernel.function)
    name = "".join(plain)
    return f"{name}.{sys.implementation.cache_tag}-"


def _beginning(kernel: Kernel) -> str:
    """The beginning of the names of all files of a function as it is."""
    return f"{_function(kernel)}{_hash(kernel.stamp, *_versions())}-"


def _versions() -> tuple[str, ...]:
    """Of what made the machine code, and of what reads it."""
    import llvmlite
    import numba

    return sys.abiflags, numba.__version__, llvmlite.__version__


def _hash(*texts: str) -> str:
    """A short hash."""
    return hashlib.sha256(repr(texts).encode()).hexdigest()[:24]
