"""The kernels of the complete search, loaded ahead of the work."""

from functools import cache

from feasibility.roadmap.exploration import Exploration
from feasibility.task import Task

TASK = Task(standoff=0.01, cone_deg=60)


def warm_up(rarely_used: bool = False) -> None:
    """Load (or compile) the kernels of the complete search, by a search over two small cells.

    Its result is discarded; timings afterwards are those of the search, without the compiler.

    Args:
        rarely_used: those too that a search needs where it does not reach every cell. They are
            compiled when first used; processes that begin together would all do that.
    """
    _explore_two_cells()
    if rarely_used:
        _look_for_reasons()


def _two_cells(width: tuple[float, float]) -> Exploration:
    """A search over two small cells, this far to the side, that has not begun."""
    from feasibility.roadmap.search import exploration_of
    from robots.library import load_robot
    from surfaces.patches.plane import plane

    cells = plane(width=width, length=(0.1, 0.12), side="outside").cells(1, 2)
    return exploration_of(load_robot("puma560"), cells, TASK, 0)


@cache
def _explore_two_cells() -> None:
    """Cover two cells in one motion, and replay it."""
    from feasibility.certification.motion_replay import replay
    from feasibility.roadmap.search import seed_middle
    from feasibility.roadmap.walk import covering_walk

    exploration = _two_cells((0.7, 0.72))
    seed_middle(exploration)
    exploration.close_pairs(exploration.pairs, exploration.best)
    walk = covering_walk(exploration.roadmap, exploration.best)
    replay(exploration.robot, exploration.cells, TASK, walk, exploration.covered)


@cache
def _look_for_reasons() -> None:
    """Rule cells out, cut, and say why they are missed."""
    from feasibility.roadmap.causes.diagnosis import diagnose
    from feasibility.roadmap.proofs.branching import root_box
    from feasibility.roadmap.proving import Proving
    from feasibility.roadmap.rounds import explore
    from feasibility.roadmap.rulings import rule

    exploration = _two_cells((0.7, 0.72))
    explore(exploration)
    rule(exploration, 0, root_box(exploration.arrays), 1)
    Proving(exploration, TASK).attempt(1)
    diagnose(exploration, 0)
    diagnose(_two_cells((5.0, 5.02)), 0)
