"""Compiled functions, kept on disk for as long as none of their sources changes.

numba keeps what it has compiled until the file of that function changes. What a kernel calls, and
the constants that it reads, are compiled into it, whichever files they stand in: with another
version of those, a kernel that was kept would run on with the old ones, and give wrong results
without a word. So all kernels are compiled anew once a file changes in any folder that holds some.

Take `njit` and `cfunc` from here, not from numba.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from numba import cfunc, njit
from numba.core import caching

__all__ = ["cfunc", "njit"]

HERE = Path(__file__).resolve().parent
PACKAGES = ("robots", "surfaces", "feasibility")
MARKS = (b"njit", b"cfunc", b"@kernel", b"@inlined", b"@allocating")


def _sources() -> Iterator[bytes]:
    """This file, the files that hold kernels, and all others in their rooms."""
    yield Path(__file__).read_bytes()
    for package in PACKAGES:
        rooms: dict[Path, list[bytes]] = {}
        for path in sorted((HERE / package).rglob("*.py")):
            rooms.setdefault(path.parent, []).append(path.read_bytes())
        for room, texts in rooms.items():
            with_kernels = [text for text in texts if any(mark in text for mark in MARKS)]
            # What stands beside the packages' doors is no part of kernels unless it holds some.
            yield from with_kernels if room.parent == HERE or not with_kernels else texts


@cache
def content_stamp() -> str:
    """One hash of all sources of kernels."""
    found = hashlib.sha256()
    for text in _sources():
        found.update(hashlib.sha256(text).digest())
    return found.hexdigest()


def _stamp_by_content() -> None:
    """Have all sources of kernels be the stamp of a file of ours, in place of its time and size.

    What was compiled in one copy of the project then holds in every other with the same sources.
    """
    of_file = caching._SourceFileBackedLocatorMixin.get_source_stamp

    def get_source_stamp(locator: Any) -> Any:
        ours = HERE in Path(locator._py_file).resolve().parents
        return content_stamp() if ours else of_file(locator)

    setattr(caching._SourceFileBackedLocatorMixin, "get_source_stamp", get_source_stamp)  # noqa: B010


def _forget_what_is_elsewhere() -> None:
    """Have numba compile anew where a list of kept kernels names a class that has moved."""
    load = caching.IndexDataCacheFile._load_index

    def load_index(kept: Any) -> Any:
        try:
            return load(kept)
        except (ImportError, AttributeError):
            return {}

    setattr(caching.IndexDataCacheFile, "_load_index", load_index)  # noqa: B010


_stamp_by_content()
_forget_what_is_elsewhere()
