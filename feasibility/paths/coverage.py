"""A coverage path: one continuous motion over all cells in a chosen order, as one would run it.

The cells are put in order (`order`), a configuration is chosen over each (`ladder`), the motion is
replayed like any witness, and measured (`metrics`).

Rows may be followed from any corner of a grid, and where the surface closes on itself from any row.
An arm whose joint has to turn with the surface cannot always go on over its seam: where a path gets
stuck is where it had better begin.
"""

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, field

import networkx as nx
import numpy as np

from coverable.arrays import Array, Ints, Mask, Protected
from feasibility.certification.followed import lifted_faults
from feasibility.certification.motion_replay import replay
from feasibility.paths.ladder import JointRoute, joint_route
from feasibility.paths.metrics import PathFigures, figures_of, unwound
from feasibility.paths.motion_graph import MotionGraph, motion_graph_of
from feasibility.paths.order import (
    GRID_ORDERS,
    Order,
    PathError,
    check_order,
    closed_sides,
    grid_order,
    shortest_order,
    usual_order,
)
from feasibility.task import Task
from feasibility.verdict import Answer, Certificate, Verdict, Walk
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

MOST_CELLS = 6000  # cells that are passed in all attempts together, so that large grids end too
MOST_TRIED = 24  # attempts at one order
FLIPS = ((False, False), (True, True), (True, False), (False, True))  # corners to begin at


@dataclass(frozen=True, eq=False, slots=True)
class CoveragePath(Protected):
    """One continuous motion that visits cells in a chosen order."""

    robot: Robot
    cells: Cells
    task: Task
    order: Order
    needed: Mask
    """(N,) cells that the path visits; it may pass over others."""
    walk: Walk
    """The motion: straight lines in joint space between waypoints."""
    certificate: Certificate
    """What the independent replay of the walk measured."""
    figures: PathFigures

    @staticmethod
    def of(
        robot: Robot, cells: Cells, task: Task, order: Order, walk: Walk, needed: Mask,
        certificate: Certificate,
    ) -> "CoveragePath":  # fmt: skip
        """A motion that the replay has accepted, measured."""
        figures = figures_of(robot, cells, task, walk, certificate, needed)
        return CoveragePath(robot, cells, task, order, needed, walk, certificate, figures)

    @property
    def visits(self) -> Ints:
        """Flat indices of cells in the order in which the path passes their centres."""
        return self.walk.cell[self.walk.cell >= 0]

    def through_surface(self, q: Array, working: Mask | None = None) -> str:
        """Where the tool point of a motion q (k, n) goes through the surface, or may; or nothing.

        Between two rows that are `working` (k,) nothing is looked at.
        """
        lifted = np.arange(len(q) - 1.0)
        if working is not None:
            lifted = lifted[~(working[:-1] & working[1:])]
        kinematics, tolerance = Kinematics(self.robot), self.task.effective_tolerance
        ends = lifted, lifted + 1.0
        found = lifted_faults(self.cells.surface.wall, q, ends, kinematics, tolerance)
        return "; ".join(fault.text for fault in found)

    def __repr__(self) -> str:
        """One line: cells, order and lengths."""
        figures = self.figures
        return (
            f"CoveragePath({int(self.needed.sum())} cells, order {self.order!r}, "
            f"{figures.length:.3f} m, {figures.revisited:.3f} m of it again)"
        )


def coverage_path(verdict: Verdict, order: Order | None = None) -> CoveragePath:
    """A path over the surface of a feasible verdict of the complete search, replayed and measured.

    Args:
        verdict: where a covering motion is known.
        order: "rows" runs along the grid's rows (v), back and forth, "columns" along its columns
            (u), "spiral" from outside to the middle; "shortest" is the shortest order found, for
            any cells; "given" is that of poses, and the only one of a toolpath. None for rows of a
            grid, the given order of a toolpath, and else the shortest.

    Raises:
        PathError: the verdict is not feasible, there is no such order, or no path was found that
            the replay accepts.

    Example:
        >>> from coverable import Task, check
        >>> from coverable import load_robot
        >>> from coverable import plane
        >>> plate = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> verdict = check(load_robot("ur5"), plate.cells(2, 3), Task(standoff=0.02, cone_deg=30))
        >>> path = coverage_path(verdict, "rows")
        >>> path.visits.tolist()
        [0, 1, 2, 5, 4, 3]
        >>> round(path.figures.length, 3), round(path.figures.revisited_share, 3)
        (0.367, 0.0)
    """
    cells = verdict.cells
    order = usual_order(cells) if order is None else order
    check_order(order, cells.surface.kind, len(cells.shape) == 2, cells.in_order)
    witness = _witness(verdict)
    needed = np.ones(len(cells), dtype=bool)
    robot, task = verdict.robot, verdict.task
    refusal = ""
    for walk in _tried(verdict, order, witness):
        walk = unwound(robot, task, walk)
        replayed = replay(robot, cells, task, walk, needed)
        if replayed.accepted:
            return CoveragePath.of(robot, cells, task, order, walk, needed, replayed.certificate)
        refusal = refusal or replayed.refusal
    raise PathError(f"the independent replay refuses the path: {refusal}")


def _witness(verdict: Verdict) -> Walk:
    """The motion that is known.

    Raises:
        PathError: there is none over the centres of all cells.
    """
    witness = verdict.witness
    if verdict.method != "complete":
        raise PathError(
            f"a path needs a verdict of the complete search; this one is of the {verdict.method} "
            "search, whose motions do not pass the centres of cells; take method = 'complete'"
        )
    if not len(verdict.cells):
        raise PathError("there are no cells to cover")
    if verdict.answer is not Answer.FEASIBLE or witness is None:
        raise PathError(
            f"no path over this surface is known: the verdict is {verdict.answer} with "
            f"{verdict.n_covered} of {len(verdict.cells)} cells covered by the best single motion; "
            "divide the surface"
        )
    return witness


def _tried(verdict: Verdict, order: Order, witness: Walk) -> Iterator[Walk]:
    """Motions over cells in an order: of all that are known, then of those of the witness alone.

    The witness has the margins that were asked for; other motions may be shorter and have less.

    Raises:
        PathError: no motion leads from cell to cell.
    """
    if verdict.cells.in_order:
        first, last = np.flatnonzero(witness.cell >= 0)[[0, -1]]
        yield Walk(q=witness.q[first : last + 1], cell=witness.cell[first : last + 1])
        return

    def walk(alone: bool) -> Walk:
        graph = motion_graph_of(verdict, witness_alone=alone)
        found = _Attempts(graph, verdict.cells).least_revisiting(order)
        grown, nodes, start = found.graph, found.nodes, verdict.robot.start
        if start is not None:
            begin = grown.nearest(start)
            path = nx.shortest_path(grown.edges, begin, nodes[0], weight="length")
            nodes = [*path[:-1], *nodes]
        return grown.walk(nodes)

    yield walk(alone=False)
    with suppress(PathError):  # then it is said why the first one is refused
        yield walk(alone=True)


@dataclass
class _Attempts:
    """Motions that have been tried, of which the best is kept."""

    graph: MotionGraph
    cells: Cells
    found: JointRoute | None = None
    faults: list[PathError] = field(default_factory=list)

    def least_revisiting(self, order: Order) -> JointRoute:
        """The motion over cells in an order that revisits least, of those that are tried.

        Raises:
            PathError: no motion leads from cell to cell.
        """
        cells = self.cells
        if order in GRID_ORDERS:
            self.along_grid(order)
        elif order == "given":
            self.along(np.arange(len(cells)))
        else:
            self.along(shortest_order(cells, self.graph.joined_cells()))
            for grid in GRID_ORDERS if len(cells.shape) == 2 and self.left() else ():
                self.along_grid(grid)
        if self.found is None:
            raise self.faults[0]
        return self.found

    def left(self) -> bool:
        """Is there anything to gain?"""
        return self.found is None or self.found.revisited > 0.0

    def along(self, visits: Ints) -> list[int]:
        """Try an order; the cells at which it got stuck."""
        for wind in (True, False):
            most = math.inf if self.found is None else self.found.revisited
            try:
                found = joint_route(
                    self.graph.copy(), self.cells, visits, wind=wind, most_revisited=most
                )
            except PathError as error:
                self.faults.append(error)
                continue
            if self.found is None or found.rank < self.found.rank:
                self.found = found
            return found.stuck
        return []

    def along_grid(self, order: Order) -> None:
        """Try an order of a grid from its corners, and from where the best one got stuck."""
        rows, columns = int(self.cells.shape[0]), int(self.cells.shape[1])
        close = closed_sides(self.cells)
        left = max(1, min(MOST_TRIED, MOST_CELLS // len(self.cells)))
        begins = [(0, 0)]
        for begin in begins:  # grows
            for flipped in FLIPS:
                if left <= 0:
                    return
                left -= 1
                stuck = self.along(grid_order(order, rows, columns, begin, flipped))
                if not self.left():
                    return
                for cell in stuck:
                    row, column = divmod(cell, columns)
                    new = (row if close[0] else 0, column if close[1] else 0)
                    if new not in begins:
                        begins.append(new)
