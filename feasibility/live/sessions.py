"""The pages that are open, each with a question of its own."""

from __future__ import annotations

import secrets
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from feasibility.live.jobs import Job, Lane, Work

MOST = 8  # pages at once
LEASE = 150.0  # [s] without a word after which a page counts as gone; hidden ones speak each minute


class TooManyPages(Exception):
    """As many pages are open as may be."""


class Gone(Exception):
    """The page is not known here: it was closed, or nothing was heard of it for long."""


@dataclass(slots=True)
class _Page:
    """One page."""

    heard: float
    job: Job | None = None
    """Its newest question."""


@dataclass(eq=False)
class Sessions:
    """All pages of one server.

    They share nothing but the threads that answer: a page sends all that is asked with each
    question, and gets the answer to its own questions alone.
    """

    work: Work
    now: Callable[[], float] = time.monotonic
    _pages: dict[str, _Page] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def __post_init__(self) -> None:
        """Start the threads."""
        self._lanes = {
            final: Lane(f"coverable-live-{'certified' if final else 'quick'}", self.work)
            for final in (False, True)
        }

    def open(self) -> str:
        """The name of a new page.

        Raises:
            TooManyPages: there are as many as may be.
        """
        with self._lock:
            for name, page in list(self._pages.items()):
                if self.now() - page.heard > LEASE:
                    self._forget(name)
            if len(self._pages) >= MOST:
                raise TooManyPages
            name = secrets.token_urlsafe(16)
            self._pages[name] = _Page(self.now())
        return name

    def __len__(self) -> int:
        """How many pages are open."""
        return len(self._pages)

    def beat(self, name: str) -> None:
        """A page is still there.

        Raises:
            Gone: it is not known.
        """
        with self._lock:
            self._page(name)

    def ask(self, name: str, number: int, final: bool, values: object) -> Job:
        """The newest question of a page: this one, unless there is a newer one.

        Args:
            name: of the page.
            number: of the question; the same number asks again for the same answer.
            final: a certified answer is wanted.
            values: of the controls.

        Raises:
            Gone: the page is not known.
        """
        with self._lock:
            page = self._page(name)
            newest = page.job
            if newest is not None and newest.number >= number:
                if newest.number == number:
                    return newest
                late = Job(name, number, final, values)
                late.drop()
                return late
            if newest is not None:
                newest.drop()
            page.job = job = Job(name, number, final, values)
            self._lanes[final].put(job)
        return job

    def close(self, name: str) -> None:
        """A page is gone; whatever it asked is given up."""
        with self._lock:
            self._forget(name)

    def close_all(self) -> None:
        """Give up everything, and end the threads."""
        with self._lock:
            for name in list(self._pages):
                self._forget(name)
        for lane in self._lanes.values():
            lane.close()

    def _page(self, name: str) -> _Page:
        """The page, of which something has been heard now."""
        if name not in self._pages:
            raise Gone
        page = self._pages[name]
        page.heard = self.now()
        return page

    def _forget(self, name: str) -> None:
        page = self._pages.pop(name, None)
        if page is not None and page.job is not None:
            page.job.drop()
