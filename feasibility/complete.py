"""The complete search: does one component of the roadmap cover every cell?

In this order, because each step is cheap where the next one is dear:

1. Seed a pivot cell in the middle, and spread each seed at once into the cells that its component
   does not cover yet. Most feasible cases end here.
2. Rule on every cell that nothing has reached: branch and bound either proves that no
   configuration covers it, or finds one (which becomes a seed).
3. Rounds: seed cells that the best component misses; stir the fibres at the border of the largest
   components, where a configuration may hide that reaches further; stir where two of them meet.
   The search is exhausted when some rounds in a row have gained nothing.

The verdict does not lean on the order or on luck where a witness or a proof is at hand; where
neither is, it says "exhausted", and what was tried.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from feasibility.fibre import roomy
from feasibility.growth import close_pairs, seed_cell, spread_out, stir
from feasibility.meeting import NARROWEST, WIDEST, meet, nearest_pairs
from feasibility.problem import Problem, Work, problem_of, work_for
from feasibility.proof import Boxes, Ruling, root_box, rule
from feasibility.roadmap import (
    BEST,
    COMPONENTS,
    COVERED,
    DONE,
    EDGES,
    FULL,
    HEAD,
    NODES,
    TAIL,
    WAYS,
    Roadmap,
    empty_roadmap,
    grown,
    joined_pairs,
    root_of,
)
from robots import Robot
from surfaces import Cells

BUDGET = 8_000  # evaluations of the arm between two looks at the clock
PIVOT_SEEDS = 8
TOP = 5  # components that a round works on
DRY_ROUNDS = 24  # rounds without gain after which the search is exhausted
MOST_ROUNDS = 200
GUESSES = 4  # of one stir
SEEDS = 6  # guesses at a missed cell, each round
MEETINGS = 6  # pairs of nodes that one round tries to join between two centres
PATIENCE = 60  # failed connections of two components that stirring allows
FIRST_BOXES = 1000  # boxes for each cell that nothing has reached
MORE_BOXES = 20_000  # boxes once Newton has failed there too
DEEP_BOXES = 2_000_000  # boxes for the few cells that are looked at until one is proved
DEEP_CELLS = 3
MOST_RULED = 500  # cells ruled on in a row without reaching any; on a fine grid the rest are alike
NEWTON_STARTS = 25

Progress = Callable[[int, int | None, str], None]


class OutOfTime(Exception):
    """The time limit has run out."""


@dataclass
class Explorer:
    """The state of one search; `explore` drives it and `checking` reads it."""

    robot: Robot
    cells: Cells
    problem: Problem
    seed: int
    deadline: float = np.inf
    """`time.monotonic()` after which `OutOfTime` is raised."""
    progress: Progress | None = None
    work: Work = field(init=False)
    roadmap: Roadmap = field(init=False)
    rulings: dict[int, Ruling] = field(default_factory=dict)
    """What branch and bound said of the cells that it was asked about."""
    boxes: int = 0
    rounds: int = 0
    met: dict[tuple[int, int], int] = field(default_factory=dict)
    """How often two nodes were tried for a meeting."""
    pairs: NDArray[np.int64] = field(init=False)
    """(M + 1,) state of each neighbouring pair, see `close_pairs`."""

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
        # A joint of more than a full turn is seeded over one turn: other windings are reached by
        # motion, or not at all.
        self.low: NDArray[np.float64] = np.where(wide, middle - np.pi, lower)
        self.high = np.where(wide, middle + np.pi, upper)
        # A slide is seeded as far as the cells, the arm and its other slides reach.
        ends = np.where(bounded & self.robot.prismatic, np.maximum(abs(lower), abs(upper)), 0.0)
        far = self.problem.scale + np.abs(self.problem.points).sum(axis=1).max(initial=0.0)
        far = far + ends.sum() - ends
        self.low = np.where(self.robot.prismatic, np.clip(-far, lower, upper), self.low)
        self.high = np.where(self.robot.prismatic, np.clip(far, lower, upper), self.high)
        self.indptr, self.indices = self.cells.neighbours
        self.pairs = np.zeros(len(self.cells.pairs) + 1, dtype=np.int64)

    # -- reading the roadmap -------------------------------------------------------------------

    @property
    def best(self) -> int:
        """Root of the component that covers most cells (0 when there is none)."""
        return int(root_of(self.roadmap, self.roadmap.counters[BEST]))

    @property
    def covered(self) -> NDArray[np.bool_]:
        """(N,) cells of the best component."""
        return self.roadmap.cover[self.best].astype(bool)

    @property
    def complete(self) -> bool:
        """Does the best component cover every cell?"""
        return int(self.roadmap.size[self.best]) == len(self.cells)

    @property
    def reached(self) -> NDArray[np.bool_]:
        """(N,) cells that some component covers."""
        return self.roadmap.first_node >= 0

    @property
    def n_edges(self) -> int:
        """Neighbouring pairs of cells that `close` found a motion for."""
        return int((self.pairs[:-1] == 1).sum())

    def roots(self) -> list[int]:
        """Root components, the largest first."""
        slots = np.arange(self.roadmap.counters[COMPONENTS])
        roots = slots[self.roadmap.parent[slots] == slots]
        return [int(r) for r in roots[np.argsort(-self.roadmap.size[roots], kind="stable")]]

    def covers(self, component: int) -> NDArray[np.bool_]:
        """(N,) cells of a component."""
        return self.roadmap.cover[root_of(self.roadmap, component)].astype(bool)

    # -- growing it ----------------------------------------------------------------------------

    def tick(self, text: str) -> None:
        """Report progress, and stop when the time is up.

        Raises:
            OutOfTime: the deadline has passed.
        """
        if self.progress is not None:
            self.progress(int(self.roadmap.size[self.best]), len(self.cells), text)
        if time.monotonic() > self.deadline:
            raise OutOfTime

    def guesses(self, k: int) -> NDArray[np.float64]:
        """(k, n) random configurations inside the limits."""
        return self.rng.uniform(self.low, self.high, (k, self.robot.n))

    def spread(self) -> bool:
        """Spread all queued nodes; True when one component covers every cell."""
        while True:
            status = spread_out(
                self.problem, self.work, self.roadmap, self.indptr, self.indices, BUDGET
            )
            if status == COVERED:
                return True
            if status == DONE:
                self.roadmap.counters[HEAD] = self.roadmap.counters[TAIL] = 0
                return False
            if status == FULL:
                self.roadmap = grown(self.roadmap)
            self.tick("spreading over the surface")

    def plant(self, cell: int, guesses: NDArray[np.float64]) -> int:
        """Seed a cell and spread what is new; returns how many guesses led onto the fibre."""
        found = 0
        for guess in guesses:
            self.roadmap = grown(self.roadmap)
            hits, made = seed_cell(self.problem, self.work, self.roadmap, cell, guess[None])
            found += hits
            if made and self.spread():
                break
        return found

    def stir(self, cell: int) -> None:
        """Explore the fibre over one cell and spread what is new."""
        guesses = self.guesses(GUESSES)
        while True:
            status, used, _ = stir(self.problem, self.work, self.roadmap, cell, guesses, PATIENCE)
            guesses = guesses[used:]
            if status != FULL:
                break
            self.roadmap = grown(self.roadmap)
        self.spread()

    def meet(self, one: int, other: int) -> None:
        """Try to join two components between cell centres, where they come nearest first."""
        tries = 0
        nodes = nearest_pairs(self.roadmap, self.cells.pairs, one, other)
        for x, y in nodes[: 2 * MEETINGS * (1 + self.rounds)].tolist():
            if self.met.get((x, y), 0) > self.rounds // 4:
                continue
            self.met[x, y] = self.met.get((x, y), 0) + 1
            share = float(self.rng.uniform(NARROWEST, WIDEST))
            if meet(self.problem, self.work, self.room, x, y, share):
                self.spread()
                return
            tries += 1
            if tries == MEETINGS:
                return

    def room(self, rows: int) -> Roadmap:
        """The roadmap, grown until an edge and so many rows of `ways` fit."""
        self.roadmap = grown(self.roadmap)
        while self.roadmap.counters[WAYS] + rows > len(self.roadmap.ways):
            self.roadmap = grown(self.roadmap)
        return self.roadmap

    def border(self, component: int) -> NDArray[np.int64]:
        """Cells of a component that have a neighbour which it does not cover."""
        inside = self.covers(component)
        owners = np.repeat(np.arange(len(self.cells)), np.diff(self.indptr))
        return np.unique(owners[inside[owners] & ~inside[self.indices]])

    def wound(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """(n,) the same placement of the arm, joints brought inside their limits by full turns."""
        lower, upper = self.problem.lower, self.problem.upper
        turn = np.where(self.robot.prismatic, 0.0, 2.0 * np.pi)
        q = q + turn * np.ceil(np.maximum(lower - q, 0.0) / (2.0 * np.pi))
        q = q - turn * np.ceil(np.maximum(q - upper, 0.0) / (2.0 * np.pi))
        return np.clip(q, lower, upper)  # rounding

    def rule(self, cell: int, boxes: Boxes, most: int) -> Ruling:
        """Branch and bound on one cell; a configuration that it finds is planted."""
        ruling, looked = Ruling.OPEN, int(boxes.counts[1])
        while ruling is Ruling.OPEN and boxes.counts[1] < most:
            ruling, q = rule(self.problem, self.work, cell, boxes, min(most, BUDGET))
            self.tick("proving cells out of reach")
        self.boxes += int(boxes.counts[1]) - looked
        self.rulings[cell] = ruling
        # A box that is left undecided mostly straddles the tolerance: Newton starts well from it.
        # (A slide without ends has boxes without a middle.)
        if ruling in (Ruling.REACHED, Ruling.UNKNOWN) and np.isfinite(q).all():
            self.plant(cell, self.wound(q)[None])
        return ruling


def explore(explorer: Explorer) -> None:
    """Run the search to its end; the explorer holds the result.

    Raises:
        OutOfTime: the deadline passed; what was found until then stands.
    """
    if len(explorer.cells) == 0 or _pivot(explorer):
        return
    _unreached(explorer)
    _rounds(explorer)


def _pivot(explorer: Explorer) -> bool:
    """Step 1; True when one component covers every cell."""
    nu, nv = explorer.cells.shape
    pivot = explorer.cells.index(nu // 2, nv // 2)
    explorer.tick("looking for configurations")
    guesses = explorer.guesses(PIVOT_SEEDS)
    room = roomy(explorer.problem, explorer.work, pivot, guesses)
    # The one with most room first: it is the least likely to get stuck.
    for k in np.argsort(-room, kind="stable"):
        if room[k] >= 0.0:
            explorer.plant(pivot, guesses[k : k + 1])
        if explorer.complete:
            return True
    return False


def _unreached(explorer: Explorer) -> None:
    """Step 2: a ruling on every cell that nothing has reached."""
    distance = np.linalg.norm(
        explorer.problem.points - explorer.robot.model.jointPlacements[1].translation, axis=1
    )
    beyond = distance > explorer.robot.reach + explorer.problem.tolerance
    for cell in np.flatnonzero(beyond).tolist():
        explorer.rulings[cell] = Ruling.PROVED
    open_boxes: dict[int, Boxes] = {}
    fruitless = 0
    for cell in evenly(np.flatnonzero(~explorer.reached & ~beyond)).tolist():
        if explorer.reached[cell]:
            fruitless = 0
            continue  # reached from a cell ruled on before it
        fruitless += 1
        if fruitless > MOST_RULED:
            break
        boxes = root_box(explorer.problem)
        if explorer.rule(cell, boxes, FIRST_BOXES) is Ruling.OPEN:
            if explorer.plant(cell, explorer.guesses(NEWTON_STARTS)) == 0:
                open_boxes[cell] = boxes
        elif explorer.rulings[cell] is Ruling.UNKNOWN:
            explorer.plant(cell, explorer.guesses(NEWTON_STARTS))
    for cell, boxes in open_boxes.items():
        if not explorer.reached[cell]:
            explorer.rule(cell, boxes, MORE_BOXES)
    if Ruling.PROVED in explorer.rulings.values():
        return
    # One proof is enough for the verdict: look deeper at the furthest of what is left.
    left = [c for c in open_boxes if explorer.rulings[c] is Ruling.OPEN and not explorer.reached[c]]
    for cell in sorted(left, key=lambda c: -distance[c])[:DEEP_CELLS]:
        if explorer.rule(cell, open_boxes[cell], DEEP_BOXES) is Ruling.PROVED:
            return


def evenly(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """The same cells in an order whose every beginning is spread over all of them."""
    golden = 0.5 * (np.sqrt(5.0) - 1.0)
    return cells[np.argsort(np.modf(golden * np.arange(len(cells)))[0], kind="stable")]


def _rounds(explorer: Explorer) -> None:
    """Step 3: rounds of seeding and stirring, until some in a row have gained nothing."""
    dry = 0
    for _ in range(MOST_ROUNDS):
        roots = explorer.roots()
        if not roots or explorer.covered[explorer.reached].all():
            return  # nothing is missed that anything reaches
        before = _standing(explorer)
        _round(explorer, roots[:TOP])
        explorer.rounds += 1
        dry = dry + 1 if _standing(explorer) == before else 0
        if explorer.complete or dry >= DRY_ROUNDS:
            return


def _standing(explorer: Explorer) -> tuple[int, ...]:
    """What a round must change to have gained something."""
    roots = explorer.roots()[:TOP]
    return tuple(int(explorer.roadmap.size[r]) for r in roots)


def _round(explorer: Explorer, top: list[int]) -> None:
    """One round: seed what the best component misses, stir borders and meeting places."""
    rng = explorer.rng
    missed = np.flatnonzero(~explorer.covered & explorer.reached)
    if len(missed):
        explorer.plant(int(rng.choice(missed)), explorer.guesses(SEEDS))
    for component in top:
        if explorer.complete:
            return
        explorer.tick("stirring the borders of components")
        border = explorer.border(component)
        if len(border):
            explorer.stir(int(rng.choice(border)))
    for a in range(len(top)):
        for b in range(a):
            one, other = (int(root_of(explorer.roadmap, top[k])) for k in (a, b))
            # Every pair every round would cost too much where there are many.
            if one == other or (len(top) > 3 and rng.random() > 0.3):
                continue
            explorer.tick("joining components where they meet")
            explorer.meet(one, other)
            shared = np.flatnonzero(explorer.covers(one) & explorer.covers(other))
            if explorer.complete:
                return
            if len(shared):
                explorer.stir(int(rng.choice(shared)))


def close(explorer: Explorer) -> None:
    """Try to join every neighbouring pair of cells of the best component (graph G's edges).

    Raises:
        OutOfTime: the deadline passed.
    """
    if explorer.roadmap.counters[NODES] == 0:
        return
    pairs = explorer.cells.pairs
    joined_pairs(explorer.roadmap, pairs, explorer.best, explorer.pairs)
    while True:
        status = close_pairs(
            explorer.problem, explorer.work, explorer.roadmap, pairs, explorer.pairs,
            explorer.best, BUDGET,
        )  # fmt: skip
        if status == DONE:
            return
        if status == FULL:
            explorer.roadmap = grown(explorer.roadmap)
        explorer.tick("joining neighbouring cells")


def pair_edges(explorer: Explorer) -> dict[tuple[int, int], int]:
    """One edge of the best component for each pair of cells that has any."""
    roadmap, best = explorer.roadmap, explorer.best
    edges: dict[tuple[int, int], int] = {}
    for e in range(roadmap.counters[EDGES]):
        x, y = roadmap.ends[e]
        i, j = int(roadmap.cell[x]), int(roadmap.cell[y])
        if i != j and root_of(roadmap, roadmap.component[x]) == best:
            edges.setdefault((min(i, j), max(i, j)), e)
    return edges


__all__ = ["Explorer", "OutOfTime", "close", "explore", "pair_edges", "problem_of"]
