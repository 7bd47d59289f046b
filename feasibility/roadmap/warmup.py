"""The kernels of the complete search, loaded ahead of the work."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from feasibility.notices import compiling_notice


class SharedLock(Protocol):
    """A lock that processes share, such as `multiprocessing.Lock()`."""

    def acquire(self, block: bool = True) -> bool:
        """Take it; without `block`, only if nobody holds it."""

    def release(self) -> None:
        """Give it back."""


def warm_up_in_turn(lock: SharedLock, say: Callable[[], None]) -> None:
    """`warm_up` in one of several new processes: one of them compiles, the others load the result.

    Args:
        lock: shared by these processes.
        say: called in the process that compiles, if that takes long.
    """
    first = lock.acquire(False)
    if not first:
        lock.acquire()  # waits until the first process is done
        lock.release()
    try:
        with compiling_notice(say=say):
            warm_up()
    finally:
        if first:
            lock.release()


def warm_up() -> None:
    """Load (or compile) the kernels of the complete search, by a search over two small cells.

    Its result is discarded; timings afterwards are those of the search, without the compiler.
    """
    global _warm
    if _warm:
        return
    from feasibility.certification import replay
    from feasibility.roadmap.branch_and_bound import root_box
    from feasibility.roadmap.causes import diagnose
    from feasibility.roadmap.exploration import Exploration
    from feasibility.roadmap.motions import arrays_of
    from feasibility.roadmap.proving import Proving
    from feasibility.roadmap.search import close, explore
    from feasibility.roadmap.walk import covering_walk
    from feasibility.task import Task
    from robots import load_robot
    from surfaces.patches import plane

    robot = load_robot("puma560")
    cells = plane(width=(0.7, 0.72), length=(0.1, 0.12), side="outside").cells(1, 2)
    task = Task(standoff=0.01, cone_deg=60)
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), 0)
    explore(exploration)
    close(exploration)
    exploration.explore_self_motions(0)
    exploration.rule(0, root_box(exploration.arrays), 1)
    Proving(exploration, task).attempt(1)
    diagnose(exploration, 0)
    beyond = plane(width=(5.0, 5.02), length=(0.1, 0.12), side="outside").cells(1, 2)
    diagnose(Exploration(robot, beyond, arrays_of(robot, beyond, task), 0), 0)
    replay(
        robot,
        cells,
        task,
        covering_walk(exploration.roadmap, exploration.best),
        exploration.covered,
    )
    _warm = True


_warm = False
