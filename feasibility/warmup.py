"""Kernels loaded ahead of the work, and a word to whoever waits while they are compiled."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Protocol

NOTICE = "compiling the search kernels (first run only, up to a minute) ..."
WAITING = (
    "waiting for the workers to load the search kernels (compiled on their first run, up to a "
    "minute) ..."
)
PATIENCE = 3.0  # [s]: loading them from the cache takes less, unless the machine is busy


class Gate(Protocol):
    """A lock that processes share, such as `multiprocessing.Lock()`."""

    def acquire(self, block: bool = True) -> bool:
        """Take it; without `block`, only if nobody holds it."""

    def release(self) -> None:
        """Give it back."""


def notify(notice: str = NOTICE) -> None:
    """Write a line to stderr, if there is one."""
    if sys.stderr is not None:
        sys.stderr.write(notice + "\n")
        sys.stderr.flush()


@contextmanager
def slow_notice() -> Iterator[None]:
    """Say something on stderr if the block takes longer than `PATIENCE` seconds."""
    timer = threading.Timer(PATIENCE, notify, [WAITING])
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


@contextmanager
def compiling_notice(
    patience: float = PATIENCE, say: Callable[[], None] = notify
) -> Iterator[None]:
    """Say that kernels are being compiled, if they are, and the block takes longer than `patience`.

    Args:
        patience: seconds.
        say: called once, from any thread.

    Example:
        >>> with compiling_notice():
        ...     kernels = "loaded from the cache"
    """
    from numba.core import event

    class Watch(event.Listener):
        """Knows when both have come: a compilation, and the end of patience."""

        def __init__(self) -> None:
            """Neither has come."""
            self.lock, self.compiling, self.late, self.said = threading.Lock(), False, False, False

        def on_start(self, about: Any) -> None:
            """A kernel that is in no cache begins to be compiled."""
            self.look(compiling=True)

        def on_end(self, about: Any) -> None:
            """It has been."""

        def look(self, compiling: bool = False, late: bool = False) -> None:
            """Say it when it is time to."""
            with self.lock:
                self.compiling, self.late = self.compiling or compiling, self.late or late
                due = self.compiling and self.late and not self.said
                self.said |= due
            if due:
                say()

    watch = Watch()
    timer = threading.Timer(patience, watch.look, kwargs={"late": True})
    timer.daemon = True
    timer.start()
    try:
        with event.install_listener("numba:compile", watch):
            yield
    finally:
        timer.cancel()


def warm_up_in_turn(gate: Gate, say: Callable[[], None]) -> None:
    """`warm_up` in one of several new processes: one of them compiles, the others load the result.

    Args:
        gate: what they share.
        say: called in the process that compiles, if that takes long.
    """
    first = gate.acquire(False)
    if not first:
        gate.acquire()  # the first one is through
        gate.release()
    try:
        with compiling_notice(say=say):
            warm_up()
    finally:
        if first:
            gate.release()


def warm_up() -> None:
    """Load (or compile) the kernels of the complete search, by a search over two small cells.

    What it does is thrown away; afterwards timings tell of the search, not of the compiler.
    """
    global _warm
    if _warm:
        return
    from feasibility.causes import diagnose
    from feasibility.certificate import replay
    from feasibility.complete import close, explore
    from feasibility.explorer import Explorer
    from feasibility.problem import problem_of
    from feasibility.proof import root_box
    from feasibility.task import Task
    from feasibility.walk import covering_walk
    from robots import load_robot
    from surfaces import plane

    robot = load_robot("puma560")
    cells = plane(width=(0.7, 0.72), length=(0.1, 0.12), side="outside").cells(1, 2)
    task = Task(standoff=0.01, cone_deg=60)
    explorer = Explorer(robot, cells, problem_of(robot, cells, task), 0)
    explore(explorer)
    close(explorer)
    explorer.stir(0)
    explorer.rule(0, root_box(explorer.problem), 1)
    diagnose(explorer, 0)
    beyond = plane(width=(5.0, 5.02), length=(0.1, 0.12), side="outside").cells(1, 2)
    diagnose(Explorer(robot, beyond, problem_of(robot, beyond, task), 0), 0)
    replay(robot, cells, task, covering_walk(explorer.roadmap, explorer.best), explorer.covered)
    _warm = True


_warm = False
