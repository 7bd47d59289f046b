"""A word to whoever waits while kernels are compiled for the first time."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

NOTICE = "compiling the search kernels (first run only, about 10 s) ..."
PATIENCE = 1.5  # [s]: loading them from the cache takes less


@contextmanager
def compiling_notice(patience: float = PATIENCE, notice: str = NOTICE) -> Iterator[None]:
    """Say on stderr that kernels are being compiled, if the block takes longer than `patience`.

    Example:
        >>> with compiling_notice():
        ...     kernels = "loaded from the cache"
    """

    def say() -> None:
        if sys.stderr is not None:
            sys.stderr.write(notice + "\n")
            sys.stderr.flush()

    timer = threading.Timer(patience, say)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
