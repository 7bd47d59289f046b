"""Certified area: the part of a surface over which one motion is known to reach every place.

A tile, a connected piece of a cell, is certified where there is a continuous map x -> q(x) over it
with the tool point on its target T(x), the axis in the cone at x and the joints inside their
limits, and where q over its middle is joined to the motion that was found by a certified motion
over the surface. Any curve in such a tile can be run, and the tiles can be reached from each other.
What is not certified is not proved to be out of reach.

The kernels find tiles (`feasibility.area.kernels`), the judge has the last word
(`feasibility.certification.areas`): only what it accepts counts.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable_arrays import Array, Ints, Mask
from coverable_errors import ArgumentError
from feasibility.area.kernels import tile_memory
from feasibility.area.lines import Lander
from feasibility.area.nodes import HeldTiles, Nodes
from feasibility.area.spreading import spread_over
from feasibility.certification import less_deviations
from feasibility.certification.areas import joined, tiles_hold
from feasibility.notices import AREAS, compiling_notice
from feasibility.roadmap.motions import arrays_of, work_for
from feasibility.task import Task
from feasibility.verdict import Verdict, Walk
from robots import Robot
from surfaces import Cells
from surfaces.cell_tiles import CellTiles, Tiles, cell_tiles

BUDGET = 2000  # evaluations of the arm for each cell,
LEAST_BUDGET = 300_000  # and at least so many in all
FACE_BUDGET = 20  # more for each face of a mesh
NO_SURFACE = "without a surface between the cells"
NO_GAINS = np.zeros((0, 0, 3))


@dataclass(frozen=True, eq=False, slots=True)
class CertifiedArea:
    """The tiles that are certified, and what share of the surface they are."""

    cells: Cells
    tiles: Tiles
    """k tiles, none of which overlap."""
    areas: Array
    """(k,) m^2."""
    q: Array
    """(k, n) rad or m, the configuration over the middle of each."""
    gains: Array
    """(k, n, 3) how the joints follow the tool point over it, to begin with."""
    nodes: Nodes
    """Configurations that join all of these to the motion they began at."""
    evaluations: int
    """Of the arm."""
    budget: int
    """Evaluations after which no more tiles were looked at."""

    @property
    def area(self) -> float:
        """m^2."""
        return float(self.areas.sum())

    @property
    def share(self) -> float:
        """Of the area of all cells, 0 to 1."""
        return min(self.area / float(self.cells.areas.sum()), 1.0)

    @property
    def shares(self) -> Array:
        """(N,) of each cell."""
        found = np.bincount(self.tiles.cell, weights=self.areas, minlength=len(self.cells))
        return np.minimum(found / self.cells.areas, 1.0)

    @property
    def exhausted(self) -> bool:
        """Whether the budget ran out before all tiles were looked at."""
        return self.evaluations >= self.budget


def _why_no_area(cells: Cells, task: Task) -> str:
    """Why there is no certified area for a question; empty where there is."""
    if task.collision is not None:
        return "where collisions are checked: how near bodies come all over a tile is not known"
    if task.min_manipulability is not None:
        return "where the distance from singularities is limited: it is not known all over a tile"
    if task.roll is not None:
        return "where the roll is limited: how it changes all over a tile is not known"
    if cells.approaches is not None or not len(cells) or not cells.areas.sum() > 0.0:
        return NO_SURFACE
    return ""


def certified_area(verdict: Verdict, budget: int | None = None) -> CertifiedArea:
    """The certified area of the motion, or of the best component, that a verdict found.

    Args:
        verdict: of the complete search.
        budget: see `area_from`.

    Raises:
        ArgumentError: collisions are checked, the roll is limited, there is no surface between the
            cells, or the search was the greedy one, which keeps no configurations over centres.

    Example:
        >>> from feasibility import Task, check
        >>> from robots import load_robot
        >>> from surfaces import plane
        >>> patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> verdict = check(load_robot("ur5"), patch.cells(3, 3), Task(standoff=0.02, cone_deg=30))
        >>> certified_area(verdict).share
        1.0
    """
    if verdict.method == "greedy":
        raise _none("for the greedy search, which keeps no configurations over the cells' centres")
    cell, q = _over_centres(verdict)
    return area_from(verdict.robot, verdict.cells, verdict.task, cell, q, budget)


def area_from(
    robot: Robot,
    cells: Cells,
    task: Task,
    cell: Ints,
    q: Array,
    budget: int | None = None,
    within: Mask | None = None,
) -> CertifiedArea:
    """The certified area of one motion.

    Args:
        robot, cells, task: the question.
        cell: (k,) different cells, whose centres the motion visits.
        q: (k, n) its configurations over them, rad or m.
        budget: evaluations of the arm after which no more tiles are looked at; by default 2,000 for
            each cell and 20 for each face of a mesh, and at least 300,000.
        within: (N,) the cells that are looked at; all by default.

    Raises:
        ArgumentError: see `certified_area`.
    """
    why = _why_no_area(cells, task)
    cut = None if why else cell_tiles(cells, cells.surface.side_sign * task.standoff)
    if cut is None:
        raise _none(why or NO_SURFACE)
    which = np.arange(len(cells)) if within is None else np.flatnonzero(within)
    some = np.isin(cell, which)
    cell, q = np.asarray(cell)[some], np.asarray(q, dtype=float)[some]
    tighter = less_deviations(task, cells.surface)
    if not len(cell):
        none = HeldTiles(cut.of_cells(np.zeros(0, np.int64)), np.zeros(0, np.int64), NO_GAINS)
        nodes = Nodes(np.zeros((0, robot.n)), none.tiles.middles, np.zeros(0, np.int64))
        return _made(cells, cut, none, nodes, 0, 0)
    faces = len(cut.touching[0]) if cut.touching is not None else 0
    if budget is None:
        budget = max(BUDGET * len(which) + FACE_BUDGET * faces, LEAST_BUDGET)
    with compiling_notice(notice=AREAS):
        lander = Lander(
            arrays_of(robot, cells, tighter), work_for(robot.n), tile_memory(robot.n), cut,
            task.fixed_approach(cells), budget,
        )  # fmt: skip
        held = spread_over(lander, which, cell, q)
    nodes, number = lander.nodes.back_from(held.node)
    held = held._replace(node=number[held.node])
    good = _judged(robot, cells, tighter, cut, held, nodes)
    return _made(cells, cut, held.of(good), nodes, lander.evaluations, budget)


def _made(
    cells: Cells, cut: CellTiles, held: HeldTiles, nodes: Nodes, evaluations: int, budget: int
) -> CertifiedArea:
    """The answer."""
    return CertifiedArea(
        cells=cells,
        tiles=held.tiles,
        areas=cut.areas(held.tiles),
        q=nodes.q[held.node],
        gains=held.gains,
        nodes=nodes,
        evaluations=evaluations,
        budget=budget,
    )


def _judged(
    robot: Robot, cells: Cells, task: Task, cut: CellTiles, held: HeldTiles, nodes: Nodes
) -> Mask:
    """(k,) which tiles the judge accepts."""
    if not len(held.node):
        return np.zeros(0, dtype=bool)
    right = joined(robot, cells, task, cut.offset, *nodes)
    good = tiles_hold(robot, task, cut, held.tiles, nodes.q[held.node], held.gains)
    return np.asarray(good & right[held.node])


def _over_centres(verdict: Verdict) -> tuple[Ints, Array]:
    """Cells, and a configuration of the best component over the centre of each."""
    walk, n = verdict.witness, verdict.robot.n
    if walk is not None:
        return visited(walk)
    found = verdict.graph.nodes(data="q")
    some = [(cell, q) for cell, q in found if q is not None and verdict.covered[cell]]
    cells = np.array([cell for cell, _ in some], dtype=np.int64)
    return cells, np.array([q for _, q in some], dtype=float).reshape(len(some), n)


def visited(walk: Walk) -> tuple[Ints, Array]:
    """The cells that a motion visits, and its first configuration over each."""
    cell, first = np.unique(walk.cell, return_index=True)
    return cell[cell >= 0], walk.q[first[cell >= 0]]


def _none(why: str) -> ArgumentError:
    """That there is no certified area, to be raised."""
    return ArgumentError(f"there is no certified area {why}")
