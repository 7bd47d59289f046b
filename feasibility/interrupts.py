"""Ctrl-C: heard at any moment, answered once, never lost.

Python raises KeyboardInterrupt wherever the program happens to be, and there it may be dropped: in
a callback of the interpreter, in a library's `except BaseException`, in an import, whose library
then reports that it is broken. So a command notes it, raises it outside of imports only, and asks
again (`settle`) wherever something would be put in place or said. A time limit (`limited`) comes
the same way.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

INTERRUPTED = 130
IMPORTER = "importlib._bootstrap"
AGAIN = 0.01  # [s] after which a Ctrl-C that came during an import is tried again
LONGEST = 0.5  # [s] between two looks at a time limit: clocks are put forward, machines sleep
MESSAGE = "coverable: interrupted"


@dataclass(slots=True)
class _State:
    """Of this process."""

    heard: bool = False
    """There has been a Ctrl-C."""
    due: bool = False
    """It has not been raised yet, or in vain."""
    unfinished: set[str] = field(default_factory=set)
    """Files that are being written."""
    active: bool = False
    """Is there a block of `interruptible`?"""
    limit: _Limit | None = None
    """Of the block of `limited`, until it is reached."""
    raised: _Limit | None = None
    """The same from then on, to the end of the block."""


@dataclass(slots=True)
class _Limit:
    """A time limit of a block."""

    left: Callable[[], float]
    error: type[Exception]
    reached: bool = False


_state = _State()


def leave(*_: object) -> None:
    """End the process at once, as a handler of SIGINT; no half-written file is left."""
    for path in _state.unfinished:
        with suppress(OSError):
            os.unlink(path)
    with suppress(OSError):
        os.write(2, f"{MESSAGE}\n".encode())
    os._exit(INTERRUPTED)


def leave_at_once() -> None:
    """From now on Ctrl-C ends the process: nothing is at work that would have to be ended first."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, leave)


def settle() -> None:
    """Raise KeyboardInterrupt if there has been a Ctrl-C: call it before something is put in place.

    Raises:
        KeyboardInterrupt: there has been one, in a block of `interruptible`.
    """
    if _state.heard:
        _state.due = False
        raise KeyboardInterrupt


def forgive() -> None:
    """A Ctrl-C was the user's way to end what has ended: it is no interruption."""
    _state.heard = _state.due = False


@contextmanager
def limited(left: Callable[[], float], error: type[Exception]) -> Iterator[None]:
    """Raise an error in the block, wherever it is, when its time is up; not during an import.

    Does nothing outside of `interruptible`, nor inside another such block: the outer limit counts,
    be it longer.

    Args:
        left: seconds until then; it may grow meanwhile.
        error: what to raise.
    """
    if not _state.active or _state.limit is not None:
        yield
        return
    limit = _state.limit = _Limit(left, error)
    _wake()
    try:
        yield
    finally:
        _state.limit = _state.raised = None
    if limit.reached:  # and a library dropped the error
        raise error


@contextmanager
def unfinished(path: str) -> Iterator[None]:
    """Remove a file at the end of the block, if it is still there, however the block ends."""
    _state.unfinished.add(path)
    try:
        yield
    finally:
        with suppress(FileNotFoundError):
            os.unlink(path)
        _state.unfinished.discard(path)


@contextmanager
def interruptible() -> Iterator[None]:
    """Let the first Ctrl-C in the block raise KeyboardInterrupt, at the latest at its end.

    A second one ends the process. Where Ctrl-C is ignored, or has a handler of someone else's, it
    is left alone.

    Raises:
        KeyboardInterrupt: there was a Ctrl-C, whatever the block raised or returned.
    """
    before = signal.getsignal(signal.SIGINT)
    mine = before in (signal.default_int_handler, leave)
    if not mine or threading.current_thread() is not threading.main_thread():
        yield
        return
    alarm = signal.signal(signal.SIGALRM, _again)
    hooks = sys.unraisablehook, sys.excepthook

    def dropped(what: Any) -> None:
        if not _later(what.exc_type):
            hooks[0](what)

    def printed(kind: type[BaseException], error: BaseException, trace: Any) -> None:
        """Compiled modules print what they drop."""
        if not _later(kind):
            hooks[1](kind, error, trace)

    sys.unraisablehook, sys.excepthook = dropped, printed
    signal.signal(signal.SIGINT, _hear)
    _state.active = True
    try:
        yield
    except (Exception, SystemExit):
        settle()  # an interrupted library may raise an error of its own
        raise
    else:
        settle()
    finally:
        _state.heard = _state.due = _state.active = False
        _state.limit = _state.raised = None
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGINT, before)
        signal.signal(signal.SIGALRM, alarm)
        sys.unraisablehook, sys.excepthook = hooks


def _hear(number: int, frame: FrameType | None) -> None:
    """A Ctrl-C: the first is raised, now or after an import, the second ends the process."""
    if _state.heard:
        leave()
    _state.heard = _state.due = True
    _again(number, frame)


def _again(number: int, frame: FrameType | None) -> None:
    """Raise what is due, a Ctrl-C or the end of the time, unless a module is being imported."""
    late = _state.limit is not None and _state.limit.left() <= 0.0
    if not (_state.due or late) or _importing(frame):
        _wake()
    elif _state.due:
        _state.due = False
        _wake()
        raise KeyboardInterrupt
    elif _state.limit is not None:
        error, _state.limit.reached = _state.limit.error, True
        _state.limit, _state.raised = None, _state.limit
        _wake()
        raise error


def _wake() -> None:
    """See that `_again` is called in time, and again until it has done its work.

    Python may miss a single signal that comes while another thread runs.
    """
    seconds = 0.0
    if _state.limit is not None:
        seconds = min(max(_state.limit.left(), AGAIN), LONGEST)
    if _state.due:
        seconds = AGAIN
    signal.setitimer(signal.ITIMER_REAL, seconds, seconds)


def _later(dropped: type[BaseException]) -> bool:
    """Come back in a moment to what was raised and dropped; False if that was not from here."""
    if issubclass(dropped, KeyboardInterrupt):
        _state.due = True
    elif _state.raised is not None and issubclass(dropped, _state.raised.error):
        _state.limit, _state.raised = _state.raised, None
    else:
        return False
    _wake()
    return True


def _importing(frame: FrameType | None) -> bool:
    """Is a module being imported there?"""
    while frame is not None and frame.f_globals.get("__name__") != IMPORTER:
        frame = frame.f_back
    return frame is not None
