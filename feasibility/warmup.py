"""A word to whoever waits while kernels are compiled for the first time."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager

NOTICE = "compiling the search kernels (first run only, up to a minute) ..."
PATIENCE = 3.0  # [s]: loading them from the cache takes less


@contextmanager
def compiling_notice(patience: float = PATIENCE, notice: str = NOTICE) -> Iterator[None]:
    """Say on stderr that kernels are being compiled, if the block takes longer than `patience`.

    Example:
        >>> with compiling_notice():
        ...     kernels = "loaded from the cache"
    """

    def say() -> None:
        if sys.stderr is not None:
            sys.stderr.write(notice + "\n")
            sys.stderr.flush()

    timer = threading.Timer(patience, say)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def warm_up() -> None:
    """Load (or compile) the kernels of the complete search, by a search over two small cells.

    What it does is thrown away; afterwards timings tell of the search, not of the compiler.
    """
    global _warm
    if _warm:
        return
    from feasibility.causes import diagnose
    from feasibility.certificate import replay
    from feasibility.complete import Explorer, close, explore, problem_of
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
    replay(robot, cells, task, covering_walk(explorer.roadmap, explorer.best), explorer.covered)
    _warm = True


_warm = False
