"""Algorithms 1 and 2 as the paper prints them, over Pinocchio's frame placements.

To be read with the paper in hand. The names are its own: q, jc, ec, p, T, G, CONT, TREESEARCH.
Nothing is compiled and nothing is kept between calls, so it is slow: a reference for small cases,
which the compiled search of `algorithm_1.py` and `greedy.py` agrees with, call by call.

Where the paper's text is not definite, it is read like this:

- Eq. (5) is never met exactly on a grid of joint values, so it holds within a tolerance.
- Eqs. (3), (4) and (7) say "a.b = 0" and "a.b <= cos alpha"; its prose says "within a small angle
  alpha", which is a.b >= cos alpha, with b pointing from the tool to the surface.
- "Unchecked" J-cells are those that the running call of Algorithm 1 has not looked at.
- Algorithm 1 prints `call CONT(jc_N, ec_T)` without its result; the result is what it returns.
- An E-cell is entered once the surface point below the tool lies in it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from coverable.errors import ArgumentError
from feasibility.paper.jcell_grid import ROUNDING
from feasibility.paper.jcell_steps import Steps
from feasibility.paper.starts import candidates
from feasibility.paper.tree_replay import rolls_at
from feasibility.search_settings import Search
from feasibility.task import Task
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

JCell = tuple[int, ...]
"""A J-cell, by its offsets from the one at the start, in steps of delta q."""


@dataclass(slots=True)
class TreeAndGraph:
    """What Algorithm 2 has found: tree T and graph G, by E-cells."""

    T: dict[int, int | None] = field(default_factory=dict)
    """Each E-cell of the tree with the one it was entered from; None for ec_1."""
    G: dict[frozenset[int], tuple[JCell, ...]] = field(default_factory=dict)
    """Each edge of the graph with the path Q of J-cells that showed it."""
    calls: list[tuple[int, int, bool]] = field(default_factory=list)
    """Every call of Algorithm 1: ec, ec_T, and the continuity between them."""
    checked: int = 0
    """J-cells whose forward kinematics was computed, over all calls."""

    def exists_feasible_path(self, count: int) -> bool:
        """The last lines of Algorithm 2: G is one connected component of all `count` E-cells."""
        return len(self.T) == count


class LiteralSearch:
    """Algorithms 1 and 2 for one arm, one surface cut into E-cells, and one first J-cell.

    Example:
        >>> from coverable import load_robot
        >>> from coverable import plane
        >>> cells = plane((0.5, 0.6), (0.0, 0.1), side="outside").cells(2, 2)
        >>> search = Search(method="greedy", step_deg=2.0)
        >>> literal = LiteralSearch.of(load_robot("ur5"), cells, Task(0.1, 30), search)
        >>> literal.algorithm_2().exists_feasible_path(len(cells))
        True
    """

    def __init__(
        self, robot: Robot, cells: Cells, task: Task, start: ArrayLike, steps: Steps
    ) -> None:
        """The grid of J-cells through a configuration.

        Args:
            robot: the arm; n joints.
            cells: the E-cells.
            task: the standoff d; its tolerance and cone are those of `steps`.
            start: (n,) q of jc_1, rad or m.
            steps: delta q for each joint, tolerance and cone, with the margins that keep the
                constraints between two J-cells too.
        """
        self.start = np.array(start, dtype=float)
        self.robot, self.cells, self.task, self.steps = robot, cells, task, steps
        self.targets, self.b = task.targets(cells).points, task.fixed_approach(cells)
        self.kinematics = Kinematics(robot)
        self.found = TreeAndGraph()

    @classmethod
    def of(
        cls, robot: Robot, cells: Cells, task: Task, search: Search, start: ArrayLike | None = None
    ) -> Self:
        """The search that `check` makes compiled: its delta q, margins, and first start.

        Args:
            robot, cells, task: see `check`.
            search: step and moves; a cap is not known here.
            start: (n,) q of jc_1, rad or m; without it the arm's, or one over the middle cell.

        Raises:
            ArgumentError: no start was found over any cell.
        """
        start = robot.start if start is None else start
        steps = Steps.of(robot, cells, task, search)
        found = candidates(robot, cells, task, search, steps.usable) if start is None else [start]
        for q in found:
            literal = cls(robot, cells, task, q, steps)
            if start is not None or literal.ecell((0,) * robot.n)[0] >= 0:
                literal.found = TreeAndGraph()
                return literal
        raise ArgumentError("no start was found over any cell; give one")

    def q(self, jc: JCell) -> Array:
        """The configuration (n,) of a J-cell."""
        return np.asarray(self.start + np.array(jc) * self.steps.size)

    def neighbouring_jcells(self, jc: JCell) -> Iterator[JCell]:
        """The J-cells reached "by adjusting a q_i of q by +-delta q"; + first, base to tip.

        With `moves = "all"` any of the joints at once, which is the text of Section III.A: 3^n.
        """
        n = len(jc)
        if self.steps.moves == "single":
            for i in range(n):
                for step in (+1, -1):
                    yield (*jc[:i], jc[i] + step, *jc[i + 1 :])
            return
        for number in range(1, 3**n):
            moves = ((0, 1, -1)[number // 3**i % 3] for i in range(n))
            yield tuple(offset + move for offset, move in zip(jc, moves, strict=True))

    def ecell(self, jc: JCell) -> tuple[int, Array]:
        """The E-cell of a J-cell by forward kinematics, and p (3,) m; -1 where it is not feasible.

        A J-cell is feasible where it satisfies the joint limits, eq. (5) and inequality (7), and
        eq. (6) where the roll is limited.
        """
        q, task, steps, cells = self.q(jc), self.task, self.steps, self.cells
        if (q < self.robot.lower).any() or (q > self.robot.upper).any():
            return -1, np.full(3, np.nan)
        self.found.checked += 1
        p, a = self.kinematics.tool(q)
        ec = int(cells.locate(p[None])[0])
        below, side, b = cells.surface.closest(p), cells.surface.side_sign, self.b
        b = -side * below.normal if b is None else b
        error = abs(float(below.height) - side * task.standoff)
        feasible = error <= steps.tolerance - steps.sag[ec] - ROUNDING  # eq. (5)
        feasible &= float(a @ b) >= steps.cone_cosine[ec] + ROUNDING  # inequality (7)
        if feasible and task.roll is not None:  # eq. (6)
            off = task.roll.off(rolls_at(self.kinematics, cells, task, q[None]))
            feasible = abs(float(off[0])) <= steps.roll[1] - ROUNDING
        return (ec if feasible else -1), p

    def algorithm_1(self, jc: JCell, ec_T: int) -> tuple[JCell, ...]:
        """Continuity check in joint space between neighbouring E-cells.

        Args:
            jc: a feasible J-cell, whose E-cell is ec.
            ec_T: the target E-cell, a neighbour of ec.

        Returns:
            The path Q of J-cells from jc to the first one in ec_T; empty where there is no
            continuity.
        """
        checked = {jc}
        _, p = self.ecell(jc)
        return self.CONT(jc, p, ec_T, checked)

    def CONT(self, jc: JCell, p: Array, ec_T: int, checked: set[JCell]) -> tuple[JCell, ...]:
        """The procedure of Algorithm 1; as deep as Python's recursion goes, so keep cells small."""
        p_T = self.targets[ec_T]
        for jc_N in self.neighbouring_jcells(jc):
            if jc_N in checked:
                continue
            checked.add(jc_N)
            ec_N, p_N = self.ecell(jc_N)
            if ec_N < 0:
                continue
            if ec_N == ec_T:
                return (jc, jc_N)
            if np.linalg.norm(p_N - p_T) < np.linalg.norm(p - p_T) - ROUNDING:
                path = self.CONT(jc_N, p_N, ec_T, checked)
                if path:
                    return (jc, *path)
        return ()

    def algorithm_2(self) -> TreeAndGraph:
        """Continuity check on manifold E, from the J-cell at the start.

        Raises:
            ArgumentError: the start is not feasible, or over no E-cell.
        """
        jc_1 = (0,) * self.robot.n
        ec_1, _ = self.ecell(jc_1)
        if ec_1 < 0:
            raise ArgumentError("the start is no feasible J-cell: limits, eq. (5) or eq. (7)")
        self.found.T[ec_1] = None
        self.TREESEARCH(jc_1)
        return self.found

    def TREESEARCH(self, jc: JCell) -> None:
        """The procedure of Algorithm 2: neighbours clockwise, from the upper left one."""
        T, G = self.found.T, self.found.G
        ec, _ = self.ecell(jc)
        for ec_N in self.cells.neighbours.of(ec).tolist():
            edge = frozenset((ec, ec_N))
            if edge in G or (min(edge), max(edge)) in self.steps.barred:
                continue
            path = self.algorithm_1(jc, ec_N)
            self.found.calls.append((ec, ec_N, bool(path)))
            if path:
                G[edge] = path
                if ec_N not in T:
                    T[ec_N] = ec
                    self.TREESEARCH(path[-1])
