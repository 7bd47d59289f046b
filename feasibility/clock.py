"""How long a search may take, and whom it keeps informed."""

from __future__ import annotations

import math
import time

from feasibility.search import Progress


class OutOfTime(Exception):
    """The time limit has run out."""


class Clock:
    """The time limit of a search and its progress callback.

    Attributes:
        began: `time.monotonic()` at which the work began, its kernels loaded; NaN before that.
        deadline: `time.monotonic()` after which `tick` raises `OutOfTime`; inf for no limit.
    """

    def __init__(self, limit: float | None = None, progress: Progress | None = None) -> None:
        """A clock that does not run yet.

        Args:
            limit: seconds from `start` on; None for no limit.
            progress: called as progress(done, total, text). What it raises ends the search.
        """
        self._limit = math.inf if limit is None else limit
        self._progress = progress
        self.began, self.deadline = math.nan, math.inf

    def start(self) -> Clock:
        """Let the time run from now on; a clock that runs already is left alone."""
        if math.isnan(self.began):
            self.began = time.monotonic()
            self.deadline = self.began + self._limit
        return self

    @property
    def out_of_time(self) -> bool:
        """Has the deadline passed?"""
        return time.monotonic() > self.deadline

    @property
    def left(self) -> float:
        """Seconds until the deadline, negative after it."""
        return self.deadline - time.monotonic()

    def report(self, done: int, total: int | None, text: str) -> None:
        """Tell the progress callback, if there is one."""
        if self._progress is not None:
            self._progress(done, total, text)

    def tick(self, done: int, total: int | None, text: str) -> None:
        """Report progress, and stop when the time is up.

        Raises:
            OutOfTime: the deadline has passed.
        """
        self.report(done, total, text)
        if self.out_of_time:
            raise OutOfTime
