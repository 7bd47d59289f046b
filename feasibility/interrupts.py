"""Ctrl-C: heard at any moment, answered once, never lost.

Python raises KeyboardInterrupt wherever the program happens to be, and there it may be dropped: in
a callback of the interpreter, in a library's `except BaseException`, in an import, whose library
then reports that it is broken. So a command notes it, raises it outside of imports only, and asks
again (`settle`) wherever something would be put in place or said.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

INTERRUPTED = 130
IMPORTER = "importlib._bootstrap"
AGAIN = 0.01  # [s] after which a Ctrl-C that came during an import is tried again
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
    hook, alarm = sys.unraisablehook, signal.signal(signal.SIGALRM, _again)

    def dropped(what: Any) -> None:
        if issubclass(what.exc_type, KeyboardInterrupt):
            _later()
        else:
            hook(what)

    sys.unraisablehook = dropped
    signal.signal(signal.SIGINT, _hear)
    try:
        yield
    except (Exception, SystemExit):
        settle()  # an interrupted library may raise an error of its own
        raise
    else:
        settle()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGINT, before)
        signal.signal(signal.SIGALRM, alarm)
        sys.unraisablehook = hook
        _state.heard = _state.due = False


def _hear(number: int, frame: FrameType | None) -> None:
    """A Ctrl-C: the first is raised, now or after an import, the second ends the process."""
    if _state.heard:
        leave()
    _state.heard = _state.due = True
    _again(number, frame)


def _again(number: int, frame: FrameType | None) -> None:
    """Raise a Ctrl-C that is due, unless a module is being imported."""
    if not _state.due:
        return
    if _importing(frame):
        _later()
        return
    _state.due = False
    raise KeyboardInterrupt


def _later() -> None:
    """Come back to a Ctrl-C in a moment."""
    _state.due = True
    signal.setitimer(signal.ITIMER_REAL, AGAIN)


def _importing(frame: FrameType | None) -> bool:
    """Is a module being imported there?"""
    while frame is not None and frame.f_globals.get("__name__") != IMPORTER:
        frame = frame.f_back
    return frame is not None
