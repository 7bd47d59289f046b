"""A word to whoever waits while the kernels are compiled."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager
from functools import partial
from typing import Any

COMPILING = (
    "compiling {} (first run only, up to a minute; `coverable warm-up` compiles all there is at "
    "once) ..."
)
NOTICE = COMPILING.format("the search kernels")
CUTTING = COMPILING.format("the kernels that cut a surface into cells")
COLLISIONS = COMPILING.format("the kernels that keep clear of collisions")
MORE = COMPILING.format("what else `coverable {}` needs")
REASONS = COMPILING.format("the kernels that say why cells are missed")
GREEDY = COMPILING.format("the kernels of the greedy search")
PATIENCE = 3.0  # [s]: loading them from the cache takes less, unless the machine is busy

_open: list[Any] = []  # what watches for compilations now, the innermost last


def notify(notice: str = NOTICE) -> None:
    """Write a line to stderr, if there is one."""
    if sys.stderr is not None:
        sys.stderr.write(notice + "\n")
        sys.stderr.flush()


@contextmanager
def compiling_notice(
    patience: float | None = None, say: Callable[[], None] | None = None, notice: str = NOTICE
) -> Generator[None]:
    """Say that kernels are being compiled, if they are, and the block takes longer than `patience`.

    What is compiled in a block inside, which says so itself, is not said here again.

    Args:
        patience: seconds; default `PATIENCE`.
        say: called once, from any thread; default: writes the notice to stderr.
        notice: which says what for.

    Example:
        >>> with compiling_notice():
        ...     kernels = "loaded from the cache"
    """
    from numba.core import event

    began = time.monotonic()
    wait = PATIENCE if patience is None else patience
    speak = partial(notify, notice) if say is None else say

    class Watch(event.Listener):
        """Waits from the first compilation on, in a thread: most blocks need neither."""

        def __init__(self) -> None:
            """Nothing is compiled yet."""
            self.lock, self.waiting = threading.Lock(), list[threading.Timer]()

        def on_start(self, about: Any) -> None:
            """A kernel that is in no cache begins to be compiled."""
            with self.lock:
                if self.waiting or _open[-1] is not self:
                    return
                left = max(0.0, began + wait - time.monotonic())
                timer = threading.Timer(left, speak)
                timer.daemon = True
                self.waiting.append(timer)
            if left > 0.0:
                timer.start()
            else:
                speak()

        def on_end(self, about: Any) -> None:
            """It has been."""

    watch = Watch()
    _open.append(watch)
    try:
        with event.install_listener("numba:compile", watch):
            yield
    finally:
        _open.remove(watch)
        for timer in watch.waiting:
            timer.cancel()
