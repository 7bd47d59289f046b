"""How long a command or a search may take, and whom it keeps informed."""

from __future__ import annotations

import math
import sys
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager
from typing import Any

from feasibility.interrupts import limited
from feasibility.search_settings import Progress

GRACE = 0.4  # [s] past the limit that is left to what looks at the clock itself ...
GRACE_SHARE = 0.05  # [1] ... and this share of the limit; starting and answering take some too
LEAST = 100  # evaluations between two looks, however few are left


class OutOfTime(Exception):
    """The time limit has run out, or the limit of evaluations."""


class _Compiling:
    """How long numba has compiled in this process; loading a kernel from its cache does not count.

    numba compiles what a kernel calls while it compiles the kernel: the outermost counts.
    """

    def __init__(self) -> None:
        """Nothing has been compiled."""
        self.total, self.depth, self.since, self.known = 0.0, 0, 0.0, False
        self.lock = threading.Lock()

    def listen(self) -> None:
        """Hear of compilations from now on, once numba is there: an alarm may ring as it loads."""
        if self.known or not hasattr(sys.modules.get("numba"), "vectorize"):
            return
        from numba.core import event

        watch = self

        class Listener(event.Listener):
            """Begin and end of each compilation."""

            def on_start(self, about: Any) -> None:
                """A kernel that is in no cache begins to be compiled."""
                watch.change(+1)

            def on_end(self, about: Any) -> None:
                """It has been."""
                watch.change(-1)

        event.register("numba:compile", Listener())
        self.known = True

    def change(self, by: int) -> None:
        """One more compilation goes on, or one fewer."""
        with self.lock:
            now = time.monotonic()
            self.total += now - self.since if self.depth else 0.0
            self.depth, self.since = max(0, self.depth + by), now

    def seconds(self) -> float:
        """So far, with the compilation that goes on."""
        return self.total + (time.monotonic() - self.since if self.depth else 0.0)


compiling = _Compiling()


class Clock:
    """A time limit and a progress callback, of a search or of a command.

    The clock stands still while kernels are compiled, which happens once on a machine.

    Attributes:
        began: `time.monotonic()` at which the work began; NaN before that.
        loaded: the same, at which the search itself did, its kernels loaded.
        limit: seconds; inf for no limit.
        evaluations: of the arm, which may still be spent before a search stops as at the deadline;
            a box of a proof counts as one. inf for no limit, negative where more were spent.
    """

    def __init__(self, limit: float | None = None, progress: Progress | None = None) -> None:
        """A clock that does not run yet.

        Args:
            limit: seconds from `start` on; None for no limit.
            progress: called as progress(done, total, text). What it raises ends the search.
        """
        self.limit = math.inf if limit is None else limit
        self.evaluations = math.inf
        self._progress = progress
        self.began, self.loaded = math.nan, math.nan
        self._compiled = 0.0

    def begin(self, began: float) -> Clock:
        """Let the time run since `time.monotonic()` was `began`, as for a command."""
        self.began, self._compiled = began, compiling.seconds()
        return self

    def start(self) -> Clock:
        """A search begins; the time runs from now on, unless it does already."""
        if math.isnan(self.loaded):
            self.loaded = time.monotonic()
        if math.isnan(self.began):
            self.began, self._compiled = self.loaded, compiling.seconds()
        return self

    def allow(self, evaluations: int | None) -> Clock:
        """A search begins that may evaluate the arm so often; None for no limit."""
        self.evaluations = math.inf if evaluations is None else evaluations
        return self

    def affordable(self, most: int) -> int:
        """How many evaluations of `most` there may be before the next look at the clock."""
        return int(min(most, max(self.evaluations, LEAST)))

    def part(self, share: float, progress: Progress | None = None) -> Clock:
        """A clock that runs now, for a share of the time that is left."""
        return Clock(share * self.left, progress).begin(time.monotonic())

    @property
    def deadline(self) -> float:
        """`time.monotonic()` after which `tick` raises `OutOfTime`; inf for no limit."""
        if math.isnan(self.began) or math.isinf(self.limit):
            return math.inf
        compiling.listen()
        return self.began + self.limit + compiling.seconds() - self._compiled

    @contextmanager
    def enforced(self) -> Generator[None]:
        """Raise `OutOfTime` in the block, wherever it is, soon after the deadline.

        For work of a command that does not look at the clock itself and leaves nothing half done
        that would be used. Elsewhere than in a command it does nothing.
        """
        if math.isinf(self.limit):
            yield
            return
        grace = GRACE + GRACE_SHARE * self.limit
        with limited(lambda: self.left + grace, OutOfTime):
            yield

    @property
    def out_of_time(self) -> bool:
        """Has the deadline passed, or was more evaluated than is allowed?"""
        late = not math.isinf(self.limit) and time.monotonic() > self.deadline
        return late or self.evaluations < 0

    @property
    def limits(self) -> str:
        """Which limit has run out, in words."""
        return "limit of evaluations" if self.evaluations < 0 else "time limit"

    @property
    def left(self) -> float:
        """Seconds until the deadline, negative after it."""
        return self.deadline - time.monotonic()

    def report(self, done: int, total: int | None, text: str) -> None:
        """Tell the progress callback, if there is one."""
        if self._progress is not None:
            self._progress(done, total, text)

    def tick(self, done: int, total: int | None, text: str, spent: int = 0) -> None:
        """Report progress, and stop when the time is up.

        Args:
            done, total, text: for the progress callback.
            spent: evaluations of the arm since the last time.

        Raises:
            OutOfTime: the deadline has passed, or the evaluations are used up.
        """
        self.evaluations -= spent
        self.report(done, total, text)
        if self.out_of_time:
            raise OutOfTime
