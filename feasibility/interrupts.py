"""Ctrl-C ends the process, at any moment; a time limit ends a block of work, wherever it is.

Nothing has to unwind for a Ctrl-C: files are put in place when they are whole, stores keep whole
transactions, and workers end with their parent. What is half made is taken away, and what there is
to say is said, by the handler itself. An exception could be dropped on its way, by a callback of
the interpreter or a library's `except BaseException`. So can that of a time limit, which therefore
rings until its block has ended.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from types import FrameType

INTERRUPTED = 130
IMPORTER = "importlib._bootstrap"
AGAIN = 0.01  # [s] after which a limit that is reached during an import is tried again
LONGEST = 0.5  # [s] between two looks at a time limit: clocks are put forward, machines sleep
MESSAGE = "coverable: interrupted"

_last: list[Callable[[], object]] = []  # what a Ctrl-C does before the process ends
_limits: list[_Limit] = []  # of blocks in blocks, the innermost last
_enforcing = False


@dataclass(slots=True, eq=False)
class _Limit:
    """A time limit of a block."""

    left: Callable[[], float]
    error: type[Exception]
    reached: bool = False


def leave(*_: object) -> None:
    """End the process at once, as a handler of SIGINT; no half-written file is left."""
    for act in reversed(_last):
        with suppress(Exception):
            act()
    with suppress(OSError):
        os.write(2, f"{MESSAGE}\n".encode())
    os._exit(INTERRUPTED)


def leave_at_once() -> None:
    """From now on Ctrl-C ends the process."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, leave)


@contextmanager
def at_leave(act: Callable[[], object]) -> Generator[None]:
    """Do something when a Ctrl-C ends the process in the block, before what was asked for outside.

    It must be quick, and is called wherever the main thread is at that moment.
    """
    _last.append(act)
    try:
        yield
    finally:
        _last.remove(act)


@contextmanager
def enforcing() -> Generator[None]:
    """Enforce time limits in the block, as in a command: by the alarm of this process."""
    global _enforcing
    if not in_main_thread():
        yield
        return
    before, was = signal.signal(signal.SIGALRM, _ring), _enforcing
    _enforcing = True
    try:
        yield
    finally:
        _enforcing = was
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


@contextmanager
def limited(left: Callable[[], float], error: type[Exception]) -> Generator[None]:
    """Raise an error in the block, wherever it is, when its time is up; not during an import.

    Does nothing outside of `enforcing`. In a block in a block the limit that ends first counts.

    Args:
        left: seconds until then; it may grow meanwhile.
        error: what to raise.
    """
    if not _enforcing or not in_main_thread():
        yield
        return
    limit = _Limit(left, error)
    _limits.append(limit)
    _wake()
    try:
        yield
    finally:
        _limits.remove(limit)
        _wake()
    if limit.reached:  # and a library dropped the error
        raise error


def _ring(number: int, frame: FrameType | None) -> None:
    """Raise the error of the outermost limit that is reached, unless a module is being imported."""
    late = next((limit for limit in _limits if limit.left() <= 0.0), None)
    if late is None or importing(frame):
        _wake()
        return
    late.reached = True
    _wake()
    raise late.error


def _wake() -> None:
    """See that `_ring` is called in time; Python may miss an alarm while another thread runs."""
    waits = [LONGEST if one.reached else max(one.left(), AGAIN) for one in _limits]
    signal.setitimer(signal.ITIMER_REAL, min([*waits, LONGEST]) if waits else 0.0, LONGEST)


def in_main_thread() -> bool:
    """Signals are heard there alone."""
    return threading.current_thread() is threading.main_thread()


def importing(frame: FrameType | None) -> bool:
    """Is a module being imported there?"""
    while frame is not None and frame.f_globals.get("__name__") != IMPORTER:
        frame = frame.f_back
    return frame is not None
