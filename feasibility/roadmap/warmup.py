"""The kernels of the complete search, loaded ahead of the work."""

from feasibility.task import Task
from robots.robot import Robot
from surfaces.cells import Cells


def warm_up(rarely_used: bool = False) -> None:
    """Load (or compile) the kernels of the complete search, by a search over two small cells.

    Its result is discarded; timings afterwards are those of the search, without the compiler.

    Args:
        rarely_used: those too that a search needs where it does not reach every cell. They are
            compiled when first used; processes that begin together would all do that.
    """
    global _warm, _rare
    if not _warm:
        _explore_two_cells()
        _warm = True
    if rarely_used and not _rare:
        _look_for_reasons()
        _rare = True


def _two_cells(width: tuple[float, float]) -> tuple[Robot, Cells, Task]:
    """An arm over two small cells, this far to the side."""
    from robots.library import load_robot
    from surfaces.patches.plane import plane

    cells = plane(width=width, length=(0.1, 0.12), side="outside").cells(1, 2)
    return load_robot("puma560"), cells, Task(standoff=0.01, cone_deg=60)


def _explore_two_cells() -> None:
    """Cover two cells in one motion, and replay it."""
    from feasibility.certification.motion_replay import replay
    from feasibility.roadmap.exploration import Exploration
    from feasibility.roadmap.motions.search_arrays import arrays_of
    from feasibility.roadmap.search import seed_middle
    from feasibility.roadmap.walk import covering_walk

    robot, cells, task = _two_cells((0.7, 0.72))
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), 0)
    seed_middle(exploration)
    exploration.close_pairs(exploration.pairs, exploration.best)
    walk = covering_walk(exploration.roadmap, exploration.best)
    replay(robot, cells, task, walk, exploration.covered)


def _look_for_reasons() -> None:
    """Rule cells out, cut, and say why they are missed."""
    from feasibility.roadmap.causes.diagnosis import diagnose
    from feasibility.roadmap.exploration import Exploration
    from feasibility.roadmap.motions.search_arrays import arrays_of
    from feasibility.roadmap.proofs.branching import root_box
    from feasibility.roadmap.proving import Proving
    from feasibility.roadmap.rounds import explore
    from feasibility.roadmap.rulings import rule

    robot, cells, task = _two_cells((0.7, 0.72))
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), 0)
    explore(exploration)
    rule(exploration, 0, root_box(exploration.arrays), 1)
    Proving(exploration, task).attempt(1)
    diagnose(exploration, 0)
    robot, cells, task = _two_cells((5.0, 5.02))
    diagnose(Exploration(robot, cells, arrays_of(robot, cells, task), 0), 0)


_warm = _rare = False
