"""What is being decided: of each page the newest question alone.

Two threads answer: one has quick looks, which are bounded, and one certified answers, which may
take long, so that no slider has to wait for a certificate. A question that a newer one has replaced
is dropped where it waits, and given up where it is worked on.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable
from typing import Any

Answer = dict[str, Any]

ALONE = 60.0  # [s] without anybody asking for an answer, after which it is given up


class Superseded(Exception):
    """A newer question has come, or the page is gone: nobody waits for this answer."""


class Job:
    """One question of a page, until it is answered or dropped."""

    def __init__(self, session: str, number: int, final: bool, values: object) -> None:
        """A question that nobody works on yet.

        Args:
            session: of the page.
            number: of the question, rising.
            final: a certified answer is wanted, not a quick look.
            values: of the controls.
        """
        self.session, self.number, self.final, self.values = session, number, final, values
        self.answer: Answer | None = None
        self.said = ""
        """How far it is, for the page that waits."""
        self._heard = time.monotonic()
        self._dropped = threading.Event()
        self._ended = threading.Event()

    def drop(self) -> None:
        """The answer is not wanted any more."""
        self._dropped.set()
        self._ended.set()

    @property
    def dropped(self) -> bool:
        """Is the answer not wanted any more, or was nobody there for long to take it?"""
        if time.monotonic() - self._heard > ALONE:
            self.drop()
        return self._dropped.is_set()

    def finish(self, answer: Answer) -> None:
        """Hand over the answer."""
        self.answer = answer
        self._ended.set()

    def wait(self, seconds: float) -> bool:
        """Wait until the job is answered or dropped; False where it is not by then."""
        self._heard = time.monotonic()
        return self._ended.wait(seconds)


Work = Callable[[Job], Answer]


class Lane:
    """A thread that works on one job after the other, at most one waiting for each page."""

    def __init__(self, name: str, work: Work) -> None:
        """Start the thread.

        Args:
            name: of the thread.
            work: makes the answer; raises `Superseded` where the job is dropped meanwhile.
        """
        self._work = work
        self._waiting: OrderedDict[str, Job] = OrderedDict()
        self._changed = threading.Condition()
        self._closed = False
        self.thread = threading.Thread(target=self._run, name=name, daemon=True)
        self.thread.start()

    def put(self, job: Job) -> None:
        """Have a job done, in place of one that still waits for the same page."""
        with self._changed:
            self._waiting[job.session] = job  # a page keeps its turn
            self._changed.notify()

    def close(self) -> None:
        """Begin no other job."""
        with self._changed:
            self._closed = True
            self._waiting.clear()
            self._changed.notify()

    def _run(self) -> None:
        """Work until closed."""
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._closed)
                if self._closed:
                    return
                _, job = self._waiting.popitem(last=False)
            if job.dropped:
                continue
            try:
                job.finish(self._work(job))
            except Superseded:
                job.drop()
