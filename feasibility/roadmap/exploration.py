"""One exploration in progress: the roadmap, what it covers, and the methods that make it grow."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, partial

import numpy as np

from coverable_arrays import Array, Ints, Mask
from feasibility.clock import Clock, OutOfTime
from feasibility.cut_tree import CutTree
from feasibility.roadmap.branch_and_bound import Boxes, Ruling, rule
from feasibility.roadmap.bridging import NARROWEST, WIDEST, bridge, nearest_pairs
from feasibility.roadmap.expansion import close_pairs, explore_self_motions, spread_out
from feasibility.roadmap.graph import (
    BEST,
    COMPONENTS,
    COVERED,
    DONE,
    FULL,
    HEAD,
    TAIL,
    WAYPOINTS,
    Roadmap,
    add_node,
    empty_roadmap,
    grown,
    joined_pairs,
    nodes_over,
    root_of,
)
from feasibility.roadmap.joint_boxes import Blockers
from feasibility.roadmap.motions import SearchArrays, Work, passable, work_for
from feasibility.roadmap.seeding import seed_cell
from robots import Robot
from surfaces import Cells, components

BUDGET = 8_000  # evaluations of the arm between two checks of the clock
GUESSES = 4  # of one `explore_self_motions`
BRIDGES = 6  # pairs of nodes that one round tries to bridge
PATIENCE = 60  # failed connections of two components before `explore_self_motions` gives them up


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
    stopped: bool = False
    """Were there as many rounds as there may be, while they still gained something?"""
    cut_tree: CutTree | None = None
    """The proof that no motion covers every cell, once there is one."""
    finest: int = 1
    """Into how many by how many each cell was cut for a search in finer cells."""
    tried: dict[tuple[int, int], int] = field(default_factory=dict)
    """How often a bridge between two nodes was tried."""
    pairs: Ints = field(init=False)
    """(M + 1,) state of each neighbouring pair, see `close_pairs`."""

    begun: tuple[int, int] | None = None
    """Node and component of the arm's start, where it has one: the motion has to begin there."""

    def __post_init__(self) -> None:
        """Set up the empty roadmap, the random numbers and the neighbours."""
        n = self.robot.n
        self.work = work_for(n)
        self.roadmap = empty_roadmap(len(self.cells), n)
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
        self.indptr, self.indices = self.cells.neighbours
        self.links = self.cells.links
        self.pairs = np.zeros(len(self.cells.pairs) + 1, dtype=np.int64)

    # -- reading the roadmap -------------------------------------------------------------------

    @cached_property
    def parts(self) -> Ints:
        """(N,) which part of the surface each cell is in, as the curves join them."""
        return components(self.cells.pairs[passable(self.arrays)], len(self.cells))

    @property
    def best(self) -> int:
        """Root of the component that covers most cells, or of the start (0 when there is none)."""
        if self.begun is not None:
            return int(root_of(self.roadmap, self.begun[1]))
        return int(root_of(self.roadmap, self.roadmap.counters[BEST]))

    @property
    def covered(self) -> Mask:
        """(N,) cells of the best component."""
        return self.roadmap.cover[self.best].astype(bool)

    @property
    def n_covered(self) -> int:
        """How many cells the best component covers."""
        return int(self.roadmap.size[self.best])

    @property
    def complete(self) -> bool:
        """Does the best component cover every cell?"""
        return int(self.roadmap.size[self.best]) == len(self.cells)

    @property
    def reached(self) -> Mask:
        """(N,) cells that some component covers."""
        return self.roadmap.first_node >= 0

    @property
    def proved(self) -> bool:
        """Is a cell proved uncoverable?"""
        return Ruling.PROVED in self.rulings.values()

    @property
    def apart(self) -> bool:
        """Does the best component miss a cell that another one covers?"""
        return not bool(self.covered[self.reached].all())

    @property
    def improvable(self) -> bool:
        """Could motions along the curves between centres gain anything?

        Not where some component covers all that is reached of each part of the surface, as these
        curves join it: over a sharp crease, or from one piece to another that it does not touch,
        there is no motion.
        """
        reached = self.reached
        if self.parts.max(initial=0) == 0:
            return self.apart
        cover = self.roadmap.cover[self.roots()].astype(bool)
        parts = [(self.parts == part) & reached for part in range(self.parts.max() + 1)]
        return not all(cover[:, part].all(axis=1).any() for part in parts if part.any())

    @property
    def n_edges(self) -> int:
        """Neighbouring pairs of cells with a motion between them, found by `close`."""
        return int((self.pairs[:-1] == 1).sum())

    def roots(self) -> list[int]:
        """Root components, the largest first; of several as large `best` is first."""
        slots = np.arange(self.roadmap.counters[COMPONENTS])
        roots = slots[self.roadmap.parent[slots] == slots]
        order = np.lexsort((roots != self.best, -self.roadmap.size[roots]))
        return [int(r) for r in roots[order]]

    def sizes(self, most: int | None = None) -> tuple[int, ...]:
        """How many cells the components cover, the largest ones first."""
        return tuple(int(self.roadmap.size[r]) for r in self.roots()[:most])

    def covers(self, component: int) -> Mask:
        """(N,) cells of a component."""
        return self.roadmap.cover[root_of(self.roadmap, component)].astype(bool)

    def posture(self, component: int) -> Array:
        """(n,) a configuration of a component."""
        root = root_of(self.roadmap, component)
        nodes = nodes_over(self.roadmap, int(self.covers(root).argmax()))
        mine = (x for x in nodes if root_of(self.roadmap, self.roadmap.component[x]) == root)
        return np.array(self.roadmap.q[next(mine)])

    # -- growing it ----------------------------------------------------------------------------

    def tick(self, text: str) -> None:
        """Report progress, and stop when the time is up.

        Raises:
            OutOfTime: the deadline has passed, or the clock allows no more evaluations.
        """
        self.clock.tick(int(self.roadmap.size[self.best]), len(self.cells), text)
        if self.work.counts[0] > self.clock.evaluations:
            raise OutOfTime

    def budget(self) -> int:
        """Evaluations of the arm that compiled loops may use before they return to `tick`."""
        return BUDGET

    def guesses(self, k: int) -> Array:
        """(k, n) random configurations inside the limits."""
        return self.rng.uniform(self.low, self.high, (k, self.robot.n))

    def spread(self) -> bool:
        """Spread all queued nodes; True when one component (of the start) covers every cell."""
        while True:
            case = self.arrays, self.work, self.roadmap
            status = spread_out(*case, self.indptr, self.indices, self.links, self.budget())
            if status == COVERED and (self.begun is None or self.complete):
                return True
            if status == DONE:
                self.roadmap.counters[HEAD] = self.roadmap.counters[TAIL] = 0
                return False
            if status == FULL:
                self.roadmap = grown(self.roadmap)
            self.tick("spreading over the surface")

    def begin_at(self, cell: int, q: Array) -> None:
        """Make the start, a configuration over a cell, the first node, and spread from it."""
        self.roadmap = grown(self.roadmap)
        component = int(self.roadmap.counters[COMPONENTS])
        self.roadmap.counters[COMPONENTS] += 1
        node = add_node(self.arrays, self.work, self.roadmap, cell, q, component)
        self.begun = int(node), component
        self.spread()

    def add_seeds(self, cell: int, guesses: Array) -> int:
        """Seed a cell and spread the new nodes; returns how many guesses could be projected."""
        found = 0
        for guess in guesses:
            self.roadmap = grown(self.roadmap)
            hits, made = seed_cell(self.arrays, self.work, self.roadmap, cell, guess[None])
            found += hits
            if made and self.spread():
                break
        return found

    def explore_self_motions(self, cell: int) -> None:
        """Explore the self-motion manifold over one cell and spread the new nodes."""
        guesses = self.guesses(GUESSES)
        while True:
            status, used, _ = explore_self_motions(
                self.arrays, self.work, self.roadmap, cell, guesses, PATIENCE
            )
            guesses = guesses[used:]
            if status != FULL:
                break
            self.roadmap = grown(self.roadmap)
        self.spread()

    def bridge(self, one: int, other: int, most: int = BRIDGES) -> None:
        """Try to bridge two components between cell centres, the nearest nodes first."""
        tries = 0
        nodes = nearest_pairs(self.roadmap, self.cells.pairs, one, other)
        for x, y in nodes[: 2 * most * (1 + self.rounds)].tolist():
            if self.tried.get((x, y), 0) > self.rounds // 4:
                continue
            self.tried[x, y] = self.tried.get((x, y), 0) + 1
            share = float(self.rng.uniform(NARROWEST, WIDEST))
            curve = self.curve(int(self.roadmap.cell[x]), int(self.roadmap.cell[y]))
            if bridge(self.arrays, self.work, self.reserve, x, y, curve, share):
                self.spread()
                return
            tries += 1
            if tries == most:
                return

    def curve(self, cell: int, other: int) -> int:
        """The curve between two neighbouring cells."""
        entries = slice(self.indptr[cell], self.indptr[cell + 1])
        return int(self.links[entries][self.indices[entries] == other][0])

    def join(self, state: Ints, component: int) -> None:
        """Search a motion of a component between every two neighbouring cells.

        Args:
            state: (M + 1,) of each pair, see `close_pairs`; filled here.
            component: its root.
        """
        pairs = self.cells.pairs
        joined_pairs(self.roadmap, pairs, component, state)
        while True:
            case = self.arrays, self.work, self.roadmap
            status = close_pairs(*case, pairs, state, component, self.budget())
            if status == DONE:
                return
            if status == FULL:
                self.roadmap = grown(self.roadmap)
            self.tick("joining neighbouring cells")

    def reserve(self, rows: int) -> Roadmap:
        """The roadmap, grown until an edge and so many rows of `waypoints` fit."""
        self.roadmap = grown(self.roadmap)
        while self.roadmap.counters[WAYPOINTS] + rows > len(self.roadmap.waypoints):
            self.roadmap = grown(self.roadmap)
        return self.roadmap

    def border(self, component: int) -> Ints:
        """Cells of a component with a neighbour that it does not cover."""
        inside = self.covers(component)
        owners = np.repeat(np.arange(len(self.cells)), np.diff(self.indptr))
        return np.unique(owners[inside[owners] & ~inside[self.indices]])

    def tool_collides(self, cell: int) -> bool:
        """Is it proved that the tool collides in every pose over a cell? Sets its ruling."""
        if self.blockers is None or not self.blockers.tool_collides(self.arrays, cell):
            return False
        self.rulings[cell] = Ruling.PROVED
        return True

    def prove_collisions(self, cell: int) -> None:
        """Try to prove that something of the arm collides wherever the tool is over a cell."""
        tick = partial(self.tick, "proving that the arm collides")
        if self.blockers and self.blockers.arm_collides(self.arrays, self.work, cell, tick):
            self.rulings[cell] = Ruling.PROVED

    def rule(self, cell: int, boxes: Boxes, most: int) -> Ruling:
        """Branch and bound on one cell; a configuration that it finds becomes a seed."""
        ruling, examined = Ruling.OPEN, int(boxes.counts[1])
        while ruling is Ruling.OPEN and boxes.counts[1] < most:
            budget = min(most, self.budget())
            ruling, q = rule(self.arrays, self.work, cell, boxes, budget)
            self.tick("proving cells out of reach")
        self.boxes += int(boxes.counts[1]) - examined
        self.rulings[cell] = ruling
        # A box left undecided is mostly at the border of the tolerance: a good start for Newton.
        # (Boxes of a prismatic joint without limits have no middle.)
        if ruling in (Ruling.REACHED, Ruling.UNKNOWN) and np.isfinite(q).all():
            self.add_seeds(cell, wound(self.arrays, q)[None])
        return ruling


def wound(arrays: SearchArrays, q: Array) -> Array:
    """(n,) the same placement of the arm, with windings that bring joints inside their limits."""
    turn = np.where(arrays.chain.prismatic, 0.0, 2.0 * np.pi)
    q = q + turn * np.ceil(np.maximum(arrays.lower - q, 0.0) / (2.0 * np.pi))
    q = q - turn * np.ceil(np.maximum(q - arrays.upper, 0.0) / (2.0 * np.pi))
    return np.clip(q, arrays.lower, arrays.upper)  # rounding
