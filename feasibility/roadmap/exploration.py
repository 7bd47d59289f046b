"""One exploration in progress: the roadmap, what it covers, and the methods that make it grow."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.clock import Clock
from feasibility.roadmap.expansion import JOINED, Grower
from feasibility.roadmap.graph import Roadmap
from feasibility.roadmap.motions.search_arrays import SearchArrays, passable
from feasibility.roadmap.motions.working_memory import Work, work_for
from feasibility.roadmap.proofs.ruling import Ruling
from robots.robot import Robot
from surfaces.adjacency import components
from surfaces.cells import Cells

if TYPE_CHECKING:
    from feasibility.cut_tree import CutTree
    from feasibility.roadmap.blockers import Blockers

BUDGET = 8_000  # evaluations of the arm between two checks of the clock


@dataclass
class Exploration:
    """The state of one search; `explore` drives it and `complete_search` reads it."""

    robot: Robot
    cells: Cells
    arrays: SearchArrays
    seed: int
    clock: Clock = field(default_factory=Clock)
    blockers: Blockers | None = None
    """Proofs that collisions keep the arm from cells; None where they are not looked for."""
    work: Work = field(init=False)
    roadmap: Roadmap = field(init=False)
    rulings: dict[int, Ruling] = field(default_factory=dict)
    """Outcomes of branch and bound, by cell."""
    boxes: int = 0
    rounds: int = 0
    early: bool = False
    """Does it end with the first proof that a cell is uncoverable?"""
    stopped: bool = False
    """Were there as many rounds as there may be, while they still gained something?"""
    cut_tree: CutTree | None = None
    """The proof that no motion covers every cell, once there is one."""
    finest: int = 1
    """Into how many by how many each cell was cut for a search in finer cells."""
    tried: dict[tuple[int, int], int] = field(default_factory=dict)
    """How often a bridge between two nodes was tried."""
    pairs: Ints = field(init=False)
    """(M,) state of each neighbouring pair, see `Grower.close_pairs`."""

    begun: int | None = None
    """The node of the arm's start, where it has one: the motion has to begin there."""

    def __post_init__(self) -> None:
        """Set up the empty roadmap, the random numbers and the neighbours."""
        self.work = work_for(self.robot.n)
        self.roadmap = Roadmap(len(self.cells))
        self.rng = np.random.default_rng(self.seed)
        lower, upper = np.array(self.robot.lower), np.array(self.robot.upper)
        wide = ~(upper - lower <= 2.0 * np.pi) & ~self.robot.prismatic
        bounded = np.isfinite(lower) & np.isfinite(upper)
        middle = 0.5 * (np.where(bounded, lower, 0.0) + np.where(bounded, upper, 0.0))
        # A joint with a range of more than a full turn is seeded over one turn: other windings are
        # reached by motion, or not at all.
        self.low: Array = np.where(wide, middle - np.pi, lower)
        self.high = np.where(wide, middle + np.pi, upper)
        # A prismatic joint is seeded as far as the cells, the arm and the other slides reach.
        ends = np.where(bounded & self.robot.prismatic, np.maximum(abs(lower), abs(upper)), 0.0)
        far = self.arrays.scale + np.abs(self.arrays.points).sum(axis=1).max(initial=0.0)
        far = far + ends.sum() - ends
        self.low = np.where(self.robot.prismatic, np.clip(-far, lower, upper), self.low)
        self.high = np.where(self.robot.prismatic, np.clip(far, lower, upper), self.high)
        self.pairs = np.zeros(len(self.cells.pairs), dtype=np.int64)
        self._told = self._next_look = 0

    @cached_property
    def parts(self) -> Ints:
        """(N,) which part of the surface each cell is in, as the curves join them."""
        return components(self.cells.pairs[passable(self.arrays)], len(self.cells))

    @property
    def best(self) -> int:
        """Root of the component that covers most cells, or of the start (0 when there is none)."""
        if self.begun is not None:
            return self.roadmap.root_of(self.begun)
        return self.roadmap.root(self.roadmap.largest) if self.roadmap.parent else 0

    @property
    def covered(self) -> Mask:
        """(N,) cells of the best component."""
        return self.covers(self.best)

    @property
    def n_covered(self) -> int:
        """How many cells the best component covers."""
        return self.roadmap.size[self.best] if self.roadmap.parent else 0

    @property
    def complete(self) -> bool:
        """Does the best component cover every cell?"""
        return self.n_covered == len(self.cells)

    @property
    def reached(self) -> Mask:
        """(N,) cells that some component covers."""
        return self.roadmap.reached.copy()

    @property
    def proved(self) -> bool:
        """Is a cell proved uncoverable?"""
        return Ruling.PROVED in self.rulings.values()

    @property
    def apart(self) -> bool:
        """Does the best component miss a cell that another one covers?"""
        return not bool(self.covered[self.reached].all())

    @property
    def n_edges(self) -> int:
        """Neighbouring pairs of cells with a motion between them, see `close_pairs`."""
        return int((self.pairs == JOINED).sum())

    def roots(self) -> list[int]:
        """Root components, the largest first; of several as large `best` is first."""
        parent, size, best = self.roadmap.parent, self.roadmap.size, self.best
        roots = (component for component, whole in enumerate(parent) if whole == component)
        return sorted(roots, key=lambda root: (-size[root], root != best))

    def sizes(self, most: int | None = None) -> tuple[int, ...]:
        """How many cells the components cover, the largest ones first."""
        return tuple(self.roadmap.size[root] for root in self.roots()[:most])

    def covers(self, component: int) -> Mask:
        """(N,) cells of a component."""
        if not self.roadmap.parent:
            return np.zeros(len(self.cells), dtype=bool)
        return self.roadmap.cover[self.roadmap.root(component)].copy()

    def posture(self, component: int) -> Array:
        """(n,) a configuration of a component."""
        roadmap, root = self.roadmap, self.roadmap.root(component)
        nodes = reversed(roadmap.over[int(roadmap.cover[root].argmax())])
        return next(roadmap.q[node].copy() for node in nodes if roadmap.root_of(node) == root)

    def tick(self, text: str, more: int = 0) -> None:
        """Report progress, and stop when the time is up.

        Args:
            text: what is being done.
            more: evaluations since the last time that `work` has not counted.

        Raises:
            OutOfTime: the deadline has passed, or the clock allows no more evaluations.
        """
        count = int(self.work.counts[0])
        spent, self._told = count - self._told + more, count
        self._next_look = count + self.clock.affordable(BUDGET)
        self.clock.tick(self.n_covered, len(self.cells), text, spent)

    def take_over(self, counted: int) -> None:
        """Count evaluations of another search, of which the clock has been told."""
        self.work.counts[0] += counted
        self._told += counted

    def tick_at_times(self, text: str) -> None:
        """`tick`, where the arm has been evaluated often enough since the last time.

        Raises:
            OutOfTime: see `tick`.
        """
        if self.work.counts[0] > self._next_look:
            self.tick(text)

    @property
    def grower(self) -> Grower:
        """What adds to the roadmap."""
        return Grower(self.arrays, self.work, self.roadmap, self.tick_at_times)

    @cached_property
    def neighbours(self) -> list[list[tuple[int, int]]]:
        """Of each cell: those beside it, and the curve between the two."""
        indptr, indices = self.cells.neighbours
        beside = list(zip(indices.tolist(), self.cells.links.tolist(), strict=True))
        return [beside[first:last] for first, last in pairwise(indptr.tolist())]

    def guesses(self, k: int) -> Array:
        """(k, n) random configurations inside the limits."""
        return self.rng.uniform(self.low, self.high, (k, self.robot.n))

    def spread(self) -> bool:
        """Spread all queued nodes; True when one component (of the start) covers every cell."""
        return self.grower.spread(self.neighbours, self._enough)

    def _enough(self, root: int) -> bool:
        """Does a component that may be the best cover every cell?"""
        full = self.roadmap.size[root] == len(self.cells)
        return full and (self.begun is None or root == self.best)

    def begin_at(self, cell: int, q: Array) -> None:
        """Make the start, a configuration over a cell, the first node, and spread from it."""
        self.begun = self.grower.add_node(cell, q, self.roadmap.add_component())
        self.spread()

    def add_seeds(self, cell: int, guesses: Iterable[Array]) -> int:
        """Seed a cell and spread the new nodes; returns how many guesses could be projected."""
        found = 0
        for guess in guesses:
            self.tick_at_times("looking for configurations")
            found += self.grower.seed(cell, guess)
            if self.roadmap.queue and self.spread():
                break
        return found

    def curve(self, cell: int, other: int) -> int:
        """The curve between two neighbouring cells."""
        return dict(self.neighbours[cell])[other]

    def close_pairs(self, state: Ints, root: int) -> None:
        """Search a motion of a component between every two neighbouring cells.

        Args:
            state: (M,) of each pair, see `Grower.close_pairs`; filled here.
            root: the root component.
        """
        roadmap = self.roadmap
        for x, y, _ in roadmap.edges:
            beside = dict(self.neighbours[roadmap.cell[x]])
            if roadmap.cell[y] in beside and roadmap.root_of(x) == root:
                state[beside[roadmap.cell[y]]] = JOINED
        self.grower.close_pairs(self.cells.pairs, state, root)
