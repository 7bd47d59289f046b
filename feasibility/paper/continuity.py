"""Continuity between neighbouring E-cells, from Python: one arm, one start, one call at a time."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from coverable.arrays import Array, Ints
from coverable.errors import ArgumentError
from feasibility.clock import Clock
from feasibility.paper import algorithm_1 as jcells
from feasibility.paper.jcell_grid import Grid, cell_of, place_tool
from feasibility.paper.jcell_steps import Steps
from feasibility.search_settings import Search
from feasibility.task import Task
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.patches.grid_cells import GridCells

CAP = 20_000  # J-cells of one call at the step below, unless the search says otherwise
CAP_STEP_DEG = 0.01
BUDGET = 500_000  # neighbours between two looks at the clock: 0.2 s at most, so Ctrl-C is heard
MOST_JCELLS = 20_000_000  # of one call, whatever its cap: about 1 GB
FAR = 2**30  # offset that stands for "no limit": 100,000 degrees at the smallest step


class CallOutcome(StrEnum):
    """How a call of Algorithm 1 ended."""

    FOUND = "found"
    """A path of J-cells enters the target cell."""
    EXHAUSTED = "exhausted"
    """No unchecked neighbour was left: the paper's `Continuity = false`."""
    CAPPED = "capped"
    """The cap was reached first: unknown, not "no"."""
    OUT_OF_TIME = "out of time"
    """The time limit was reached first."""


@dataclass(frozen=True, eq=False, slots=True)
class Continuity:
    """What one call of Algorithm 1 found."""

    outcome: CallOutcome
    jcells: NDArray[np.int32]
    """(k, n) offsets of the path from the J-cell it began at to the first in the target cell; no
    rows unless found."""
    q: Array
    """(k, n) their configurations, rad or m."""
    checked: int
    """J-cells evaluated."""


class JSpace:
    """The J-cells around one start configuration of one robot, with Algorithm 1 on them.

    Holds the working memory of the search, so use one per thread.

    Attributes:
        start: (n,) q_start, rad or m.
        steps: the moves between neighbouring J-cells, and the tolerance.
    """

    def __init__(
        self,
        robot: Robot,
        cells: Cells,
        task: Task,
        start: ArrayLike,
        search: Search | None = None,
        steps: Steps | None = None,
    ) -> None:
        """The grid of J-cells through `start` (n,).

        Args:
            robot: the arm.
            cells: the E-cells.
            task: what makes a J-cell feasible.
            start: (n,) q_start, rad or m.
            search: step, moves and cap; the defaults of `Search` without it.
            steps: `Steps.of` the same, when they are at hand.
        """
        search = Search(method="greedy") if search is None else search
        origin = np.array(start, dtype=float)
        if origin.shape != (robot.n,) or not np.isfinite(origin).all():
            raise ArgumentError(
                f"start must be {robot.n} finite joint values, got {origin.tolist()}"
            )
        self.start = origin
        self.steps = Steps.of(robot, cells, task, search) if steps is None else steps
        size, triangles = self.steps.size, self.steps.triangles
        self._chain, self._cells = robot.chain, cells
        self._place = (
            cells.patch_kernel if triangles is None and isinstance(cells, GridCells) else None,
            None if triangles is None else triangles.kernel,
        )
        approach, reference = task.fixed_approach(cells), task.fixed_reference(cells)
        margin, cosine = self.steps.tolerance - self.steps.sag, self.steps.cone_cosine
        self._points = task.targets(cells).points
        cap = search.cap or round(CAP * max(1.0, CAP_STEP_DEG / search.step_deg))
        self._cap = min(cap, MOST_JCELLS)
        self._grid = Grid(
            origin=origin,
            step=size,
            lowest=-_last_offset(-origin, size, -robot.lower),
            highest=_last_offset(origin, size, robot.upper),
            moves_all=search.moves == "all",
            side=float(cells.surface.side_sign),
            height=float(cells.surface.side_sign) * task.standoff,
            tolerance=np.append(margin, margin.min(initial=np.inf)),
            cone_cosine=np.append(cosine, cosine.max(initial=-np.inf)),
            approach=np.empty(0) if approach is None else approach,
            roll=self.steps.roll,
            reference=np.empty(0) if reference is None else reference,
        )
        self._memory = _memory(robot.n, self._cap + 1)

    def load(self) -> None:
        """Load the compiled kernels, or compile them, before anything is timed."""
        here = np.zeros(len(self.start), dtype=np.int32)
        self.cell_of(here)
        target = np.zeros(3)
        jcells.begin_search(self._chain, self._grid, here, target, self._memory)
        jcells.extend_search(
            self._chain, *self._place, self._grid, target, 0, 0, self._cap, self._memory
        )

    def q(self, jcells: ArrayLike) -> Array:
        """Configurations (..., n) of J-cells given as offsets (..., n)."""
        return self.start + np.asarray(jcells) * self.steps.size

    def cell_of(self, jcell: ArrayLike) -> int:
        """Flat index of the E-cell of a feasible J-cell (n,); -1 for one that is not feasible."""
        offsets = np.asarray(jcell, dtype=np.int32)
        if (offsets < self._grid.lowest).any() or (offsets > self._grid.highest).any():
            return -1
        placed = self._memory.placed
        place_tool(self._chain, self._grid, offsets, self._memory.q, placed)
        cell = int(cell_of(*self._place, self._grid, placed[-3:]))
        on_border = cell == len(self._cells)
        return int(self._cells.locate(placed[-3:-2])[0]) if on_border else cell

    def continuity(
        self, jcell: ArrayLike, target_cell: int, clock: Clock | None = None
    ) -> Continuity:
        """Algorithm 1: search a path of J-cells from `jcell` into `target_cell`.

        Args:
            jcell: (n,) offsets of a feasible J-cell; all zero at `start`.
            target_cell: flat index of ec_T, a neighbour of the cell of `jcell`.
            clock: when to give up.
        """
        offsets = np.ascontiguousarray(jcell, dtype=np.int32)
        target = self._points[target_cell]
        jcells.begin_search(self._chain, self._grid, offsets, target, self._memory)
        while True:
            jcells.extend_search(
                self._chain, *self._place, self._grid, target, target_cell, BUDGET, self._cap,
                self._memory,
            )  # fmt: skip
            state = self._memory.counters[jcells.STATE]
            if state != jcells.RUNNING:
                break
            if clock is not None and clock.out_of_time:
                return self._result(CallOutcome.OUT_OF_TIME)
        ended = {jcells.FOUND: CallOutcome.FOUND, jcells.EXHAUSTED: CallOutcome.EXHAUSTED}
        return self._result(ended.get(int(state), CallOutcome.CAPPED))

    def _result(self, outcome: CallOutcome) -> Continuity:
        """Read the result of the call out of the working memory."""
        memory = self._memory
        counters = memory.counters
        path = np.empty((0, memory.nodes.shape[1]), dtype=np.int32)
        if outcome is CallOutcome.FOUND:
            stack = memory.stack_node[: counters[jcells.DEPTH] + 1]
            path = memory.nodes[np.append(stack, counters[jcells.NODES] - 1)]
        return Continuity(
            outcome=outcome, jcells=path, q=self.q(path), checked=int(counters[jcells.NODES]) - 1
        )


def _last_offset(origin: Array, step: Array, upper: Array) -> Ints:
    """The greatest integer k (n,) with origin + k * step <= upper, as floating point rounds it."""
    last = np.clip(np.floor((upper - origin) / step), -FAR, FAR).astype(np.int64)
    last[origin + last * step > upper] -= 1
    last[(origin + (last + 1) * step <= upper) & (last < FAR)] += 1
    return last


def _memory(n: int, most: int) -> jcells.Memory:
    """Empty working memory for `most` J-cells of n joints, all of which may be on the stack."""
    return jcells.Memory(
        counters=np.zeros(4, dtype=np.int64),
        table=np.zeros(1 << (2 * most).bit_length(), dtype=np.int64),
        nodes=np.empty((most, n), dtype=np.int32),
        stack_node=np.empty(most, dtype=np.int64),
        stack_next=np.empty(most, dtype=np.int64),
        stack_away=np.empty(most),
        offsets=np.empty(n, dtype=np.int64),
        delta=np.empty(n, dtype=np.int64),
        q=np.empty(n),
        placed=np.empty((2 * n + 3, 3)),
    )
