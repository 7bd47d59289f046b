"""A coverage path: one continuous motion over all cells in a chosen order, as one would run it.

The witness of a verdict shows that there is a covering motion; this one is made to be run. The
cells are put in order (`order`), a configuration is chosen over each (`ladder`), the motion is
replayed like any witness, and measured (`metrics`).
"""

from __future__ import annotations

import operator
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feasibility.certification import replay
from feasibility.paths.ladder import JointRoute
from feasibility.paths.metrics import PathFigures, figures_of
from feasibility.paths.motion_graph import motion_graph_of
from feasibility.paths.order import ORDERS, Order, PathError
from feasibility.paths.start_selection import least_revisiting
from feasibility.task import Task
from feasibility.verdict import Answer, Certificate, Verdict, Walk
from robots import Robot
from surfaces import Cells


@dataclass(frozen=True, eq=False, slots=True)
class CoveragePath:
    """One continuous motion that visits cells in a chosen order."""

    robot: Robot
    cells: Cells
    task: Task
    order: Order
    needed: NDArray[np.bool_]
    """(N,) cells that the path visits; it may pass over others."""
    walk: Walk
    """The motion: straight lines in joint space between waypoints."""
    certificate: Certificate
    """What the independent replay of the walk measured."""
    figures: PathFigures

    def __post_init__(self) -> None:
        """Copy and write-protect the array."""
        needed = np.array(self.needed, dtype=bool)
        needed.flags.writeable = False
        object.__setattr__(self, "needed", needed)

    @property
    def visits(self) -> NDArray[np.int64]:
        """Flat indices of cells in the order in which the path passes their centres."""
        return self.walk.cell[self.walk.cell >= 0]

    def __repr__(self) -> str:
        """One line: cells, order and lengths."""
        figures = self.figures
        return (
            f"CoveragePath({int(self.needed.sum())} cells, order {self.order!r}, "
            f"{figures.length:.3f} m, {figures.revisited:.3f} m of it again)"
        )


def coverage_path(
    verdict: Verdict, order: Order = "rows", only: Iterable[int] | None = None
) -> CoveragePath:
    """A path over the surface of a feasible verdict.

    Args:
        verdict: of the complete search.
        order: "rows" runs along the grid's rows (v), back and forth, "columns" along its columns
            (u), "spiral" from outside to the middle; "shortest" is the shortest order found and
            the only one for cells that are no grid.
        only: flat indices of the cells to visit; all by default. They may be cells that the best
            motion of an infeasible verdict covers.

    Returns:
        The path, replayed and measured.

    Raises:
        PathError: the verdict is not feasible, a cell cannot be reached, there is no such order,
            or no path was found that the replay accepts.

    Example:
        >>> from feasibility import Task, check
        >>> from robots import load_robot
        >>> from surfaces import plane
        >>> plate = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> verdict = check(load_robot("ur5"), plate.cells(2, 3), Task(standoff=0.02, cone_deg=30))
        >>> path = coverage_path(verdict, "rows")
        >>> path.visits.tolist()
        [0, 1, 2, 5, 4, 3]
        >>> round(path.figures.length, 3), round(path.figures.revisited_share, 3)
        (0.367, 0.0)
    """
    if order not in ORDERS:
        raise PathError(f"there is no order {order!r}; the orders are {', '.join(ORDERS)}")
    needed = _needed(verdict, only)
    graph = motion_graph_of(verdict)
    found = least_revisiting(graph, verdict.cells, order, needed)
    return _replayed(verdict, order, needed, found)


def _replayed(
    verdict: Verdict, order: Order, needed: NDArray[np.bool_], found: JointRoute
) -> CoveragePath:
    """The path along a motion, once the replay has accepted it."""
    robot, cells, task = verdict.robot, verdict.cells, verdict.task
    walk = found.graph.walk(found.nodes)
    replayed = replay(robot, cells, task, walk, needed)
    if not replayed.accepted:
        raise PathError(f"the independent replay refuses the path: {replayed.refusal}")
    certificate = replayed.certificate
    figures = figures_of(robot, cells, task, walk, certificate, needed)
    return CoveragePath(robot, cells, task, order, needed, walk, certificate, figures)


def _needed(verdict: Verdict, only: Iterable[int] | None) -> NDArray[np.bool_]:
    """(N,) the cells to visit.

    Raises:
        PathError: some of them cannot be visited by one motion.
    """
    total = len(verdict.cells)
    if verdict.method != "complete":
        raise PathError(
            f"a path needs a verdict of the complete search; this one is of the {verdict.method} "
            "search, whose motions do not pass the centres of cells; ask with method = 'complete'"
        )
    if only is None:
        if verdict.answer is not Answer.FEASIBLE:
            raise PathError(
                f"no path over this surface is known: the verdict is {verdict.answer} with "
                f"{verdict.n_covered} of {total} cells covered by the best single motion; "
                "divide the surface, or name the cells to visit"
            )
        if total == 0:
            raise PathError("there are no cells to cover")
        return np.ones(total, dtype=bool)
    try:
        named = np.array(sorted({operator.index(cell) for cell in only}), dtype=np.int64)
    except (TypeError, OverflowError) as error:
        raise PathError("cells to visit must be whole numbers, their flat indices") from error
    beyond = named[(named < 0) | (named >= total)]
    within = named[(named >= 0) & (named < total)]
    missed = within[~verdict.covered[within]]
    faults = []
    if len(named) == 0:
        faults.append("no cells are named; name at least one")
    if len(beyond):
        faults.append(f"there is no cell {_listed(beyond)}; cells are 0 to {total - 1}")
    if len(missed):
        faults.append(
            f"cell {_listed(missed)} cannot be reached by the motion that covers most; leave it out"
        )
    if faults:
        raise PathError(faults)
    needed = np.zeros(total, dtype=bool)
    needed[within] = True
    return needed


def _listed(which: NDArray[np.int64]) -> str:
    """The first few of some numbers."""
    more = f" and {len(which) - 5} more" if len(which) > 5 else ""
    return ", ".join(str(k) for k in which[:5].tolist()) + more
