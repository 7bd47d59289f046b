"""What the command line writes to: stdout for answers, stderr for messages and progress."""

from __future__ import annotations

import os
import sys
import time
from contextlib import ExitStack, suppress
from typing import Any, TextIO

from coverable.errors import CoverableError, Fault, shown
from feasibility.interrupts import at_leave
from feasibility.search_settings import Progress

THREADS = "NUMBA_NUM_THREADS"
MOST_THREADS = 1_024
PAUSE = 0.05  # [s] between two updates of the progress bar
CLEAN = b"\r\x1b[2K\x1b[?25h"  # to a terminal: the line of a bar is empty, the cursor is shown


def prepare() -> None:
    """Make sure that messages and answers cannot go astray.

    Characters that the terminal's encoding lacks are written as escapes. A stream that the process
    was started without goes nowhere: otherwise the next file that is opened would take its place,
    and get what libraries print.

    Raises:
        CoverableError: an environment variable that numba reads is no number.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
    threads = os.environ.get(THREADS, "1")
    if not (threads.isdecimal() and 1 <= int(threads[:9]) <= MOST_THREADS):
        expected = f"must be a whole number in 1 .. {MOST_THREADS:,}"
        found = f"got {shown(threads)} from the environment; unset it"
        raise CoverableError(Fault(THREADS, found, expected=expected))


def print_out(text: str) -> None:
    """Write an answer to stdout. A reader that has gone away (`| head`) is no error.

    Raises:
        OSError: stdout cannot be written for another reason, such as a full disk.
    """
    with suppress(BrokenPipeError):
        _write(sys.stdout, text)


def print_err(text: str) -> None:
    """Write a message to stderr, if there is one that takes it."""
    with suppress(OSError):
        _write(sys.stderr, text)


def _write(stream: TextIO | None, text: str) -> None:
    """Write a line. After a failure the buffered rest goes nowhere, so as not to fail again."""
    if stream is None:
        return
    try:
        stream.write(text + "\n")
        stream.flush()
    except OSError:
        with suppress(OSError, ValueError):  # a stream without a file
            descriptor = stream.fileno()
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, descriptor)
            os.close(nowhere)
        raise


class Bar:
    """A progress bar on a terminal's stderr; nothing elsewhere.

    A search reports to it, and it appears with the first report.
    """

    def __init__(self) -> None:
        """Look whether there is a terminal."""
        self.shown = sys.stderr is not None and sys.stderr.isatty()
        self._bar: Any = None
        self._task: Any = None
        self._last = -1.0
        self._ends = ExitStack()

    def __call__(self, done: int, total: int | None, text: str) -> None:
        """Show that `done` of `total` parts (None: unknown how many) are done."""
        now = time.monotonic()
        if not self.shown or (now - self._last < PAUSE and done != total):
            return
        self._last = now
        bar = self._start() if self._bar is None else self._bar
        bar.update(self._task, completed=done, total=total, description=text)

    def _start(self) -> Any:
        """Draw the bar for the first time; the bar."""
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
        from rich.progress import TimeElapsedColumn as Elapsed

        text = TextColumn("{task.description}", markup=False)
        columns = (text, BarColumn(), MofNCompleteColumn(), Elapsed())
        # On this very stream: what a command says inside of another one may go elsewhere.
        self._bar = Progress(*columns, console=Console(file=sys.stderr), transient=True)
        self._task = self._bar.add_task("", total=None)
        self._ends.enter_context(at_leave(lambda: os.write(2, CLEAN)))
        return self._ends.enter_context(self._bar)

    def __enter__(self) -> Bar:
        """Nothing is drawn yet."""
        return self

    def __exit__(self, *exception: object) -> None:
        """Remove the bar."""
        self._ends.close()


def with_rate(bar: Progress, what: str = "") -> Progress:
    """Progress in pieces, with their rate and an estimate of the time left.

    Args:
        bar: what shows it.
        what: is being done; by default the text of each report.
    """
    began, first = time.monotonic(), -1

    def report(done: int, total: int | None, text: str) -> None:
        nonlocal first
        first = done if first < 0 else first  # what an earlier run has done has no rate
        bar(done, total, f"{what or text}{_rate(done - first, done, total, began)}")

    return report


def _rate(here: int, done: int, total: int | None, began: float) -> str:
    """', 12.3/s, 2 min left'; empty until something is done."""
    took = time.monotonic() - began
    if here <= 0 or total is None or took <= 0.0:
        return ""
    left = (total - done) * took / here
    words = f"{left:.0f} s" if left < 100 else f"{left / 60:.0f} min"
    return f", {here / took:.1f}/s, {words} left"
