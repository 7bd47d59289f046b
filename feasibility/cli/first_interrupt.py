"""A first Ctrl-C that ends a block of work, and not the process; see `interrupts`."""

from __future__ import annotations

import signal
from collections.abc import Callable, Generator
from contextlib import contextmanager
from types import FrameType

from feasibility.interrupts import importing, in_main_thread, leave


@contextmanager
def raised() -> Generator[Callable[[], None]]:
    """Let the first Ctrl-C in the block raise KeyboardInterrupt; the second one ends the process.

    Where Ctrl-C is ignored, or has a handler of someone else's, it is left alone.

    Returns:
        What raises it again, if it was dropped or came during an import: to be called now and then.
    """
    heard = False

    def hear(number: int, frame: FrameType | None) -> None:
        nonlocal heard
        if heard:
            leave()
        heard = True
        if not importing(frame):
            raise KeyboardInterrupt

    def again() -> None:
        if heard:
            raise KeyboardInterrupt

    before = signal.getsignal(signal.SIGINT)
    if before not in (signal.default_int_handler, leave) or not in_main_thread():
        yield again
        return
    signal.signal(signal.SIGINT, hear)
    try:
        yield again
    finally:
        signal.signal(signal.SIGINT, before)
