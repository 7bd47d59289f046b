"""The prover: guesses a cut tree from what a search knows, and proves each of its statements.

At a region: where all components inside it miss a common cell, that cell is proved uncoverable
there, a leaf. Otherwise the gaps between components are tried as cuts, each by a few Newton tries
first, and then by branch and bound in turns. What refutes a guess are configurations that the
search did not know: they are handed back as seeds. What was proved is kept for the next attempt.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.cut_tree import Cut, CutTree, Leaf
from feasibility.roadmap.arrays import SearchArrays, Work, work_for
from feasibility.roadmap.boxes import Places, place_at_rest
from feasibility.roadmap.branch_and_bound import Ruling
from feasibility.roadmap.cuts.counting import TURNS, Counted, Statement
from feasibility.roadmap.cuts.gaps import Component, gaps
from feasibility.roadmap.cuts.opening import openings
from feasibility.roadmap.cuts.regions import (
    Region,
    folded,
    limits_of,
    turn_from,
    wide_joints,
)
from feasibility.roadmap.cuts.samples import projected, random_targets
from robots.chain import tool

SAMPLES = 100  # Newton tries onto the motion set, each attempt
MOST_SAMPLES = 600
CUT_TRIES = 60  # Newton tries on a cut before branch and bound
LEAF_TRIES = 8  # the same on a cell
ENOUGH = 3  # hits on a cut that end its tries
CANDIDATES = 8  # cuts proved in turns
LEAVES = 4  # cells of a leaf proved in turns
REFINED = 3  # times that gaps are cut anew by the points found on them
DEEPEST = 12  # cuts above each other
MOST_SEEDS = 12  # handed back by an attempt


class Blocked(NamedTuple):
    """A gap between components that points of the motion set keep open."""

    weights: NDArray[np.float64]
    """(n,) w"""
    low: float
    high: float
    """Between w . q = low and high no component is known."""
    points: int
    """Points of the motion set found there."""


@dataclass(frozen=True, eq=False, slots=True)
class Attempt:
    """What came of an attempt."""

    tree: CutTree | None
    """The proof, if there is one."""
    boxes: int
    """Boxes examined."""
    seeds: tuple[tuple[int, NDArray[np.float64]], ...]
    """(cell, (n,) configuration) that no component of the search explains; the cell is the nearest
    one where it is not covered."""
    blocked: tuple[Blocked, ...]
    """What kept it, where there is no proof: the gaps of the region that stayed open."""


class _ProvedCut(NamedTuple):
    region: Region
    weights: NDArray[np.float64]
    value: float


@dataclass(eq=False)
class Prover:
    """Proofs about one search: the motion set of `arrays` over a target surface."""

    arrays: SearchArrays
    places: Places
    rng: np.random.Generator
    newton: bool = True
    """Whether guesses are tried by Newton before branch and bound."""
    work: Work = field(init=False)
    samples: NDArray[np.float64] = field(init=False)
    """(k, n) points of the motion set, inside the limits."""
    cuts: list[_ProvedCut] = field(default_factory=list)
    leaves: list[tuple[Region, int]] = field(default_factory=list)
    opened: dict[int, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Working memory, and no samples yet."""
        n = len(self.arrays.lower)
        self.work = work_for(n)
        self.samples = np.empty((0, n))

    def attempt(
        self, components: list[Component], budget: int, tick: Callable[[], None]
    ) -> Attempt:
        """Try to prove that no motion covers every cell.

        Args:
            components: what the search knows, each with samples of its motions and its cells.
            budget: boxes that may be examined.
            tick: called between batches of boxes; may raise, and then nothing is lost but this
                attempt.
        """
        run = _Run(self, Counted(self.arrays, self.work, budget, tick))
        limits = limits_of(self.arrays, self.places)
        tree = None
        if limits.over_one_turn().is_finite:
            self._sample(limits)
            tree = self._tree(run, limits, components)
        return Attempt(
            tree=tree,
            boxes=run.counted.spent,
            seeds=() if tree is not None else tuple(run.seeds[:MOST_SEEDS]),
            blocked=() if tree is not None else tuple(run.blocked),
        )

    def _tree(self, run: _Run, limits: Region, components: list[Component]) -> CutTree | None:
        """A proof: first without cuts through wide joints, whose windings then do not matter."""
        wide = wide_joints(self.arrays)
        narrow = tuple(j for j in range(len(limits.low)) if j not in wide)
        whole = run.counted.left
        if wide:
            run.counted.left = whole // 2
        root = run.tree_of(limits, components, narrow)
        if root is not None:
            return CutTree(root)
        run.counted.left += whole - whole // 2 if wide else 0
        if wide:
            self._open(run, limits, components)
        for opened in self._openings():
            region = limits
            for joint, t in opened.items():
                region = turn_from(region, joint, t)
            bounded = tuple(np.flatnonzero(np.isfinite(region.high - region.low)).tolist())
            folds = [c._replace(q=folded(c.q, opened)) for c in components]
            run.samples = folded(run.samples, opened)
            root = run.tree_of(region, folds, bounded)
            if root is not None:
                return CutTree(root, tuple(opened.items()))
        return None

    def _openings(self) -> list[dict[int, float]]:
        """Joints to be opened: all that can be; then only those without limits."""
        free = {j: t for j, t in self.opened.items() if np.isinf(self.arrays.upper[j])}
        plans = [self.opened] if self.opened else []
        bounded = [j for j in wide_joints(self.arrays) if np.isfinite(self.arrays.upper[j])]
        return [*plans, free] if bounded and (free != self.opened or not plans) else plans

    def _open(self, run: _Run, limits: Region, components: list[Component]) -> None:
        """Open wide joints where that is possible."""
        for joint in wide_joints(self.arrays):
            if joint in self.opened:
                continue
            weights = np.eye(len(limits.low))[joint]
            cut = run.first_proved(
                (weights, t, turn_from(limits, joint, t).on(weights, t))
                for t in openings(joint, components, self.samples)
            )
            if cut is not None:
                self.opened[joint] = cut[1]

    def _sample(self, limits: Region) -> None:
        """More points of the motion set, unless there are enough."""
        if self.newton and len(self.samples) < MOST_SAMPLES:
            targets = random_targets(self.places, SAMPLES, self.rng)
            q = projected(self.arrays, self.work, limits, targets, SAMPLES, self.rng)
            self.samples = np.vstack([self.samples, q])


@dataclass(eq=False)
class _Run:
    """One attempt."""

    prover: Prover
    counted: Counted
    seeds: list[tuple[int, NDArray[np.float64]]] = field(default_factory=list)
    blocked: list[Blocked] = field(default_factory=list)
    joints: tuple[int, ...] = ()
    """Those that cuts may go through."""
    samples: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        """The points of the motion set that are known."""
        self.samples = self.prover.samples

    def tree_of(
        self, region: Region, components: list[Component], joints: tuple[int, ...]
    ) -> Cut | Leaf | None:
        """The tree of a region, with cuts through some joints only; None where none was found."""
        self.joints = joints
        return self.node(region, components, DEEPEST)

    def node(self, region: Region, components: list[Component], depth: int) -> Cut | Leaf | None:
        """The tree of a region; None where none was found."""
        inside = [c for c in components if region.inside(c.q).any()]
        cover = np.zeros(len(self.prover.arrays.points), dtype=bool)
        for component in inside:
            cover |= component.cover
        if not cover.all():
            return self.leaf(region, cover)
        if depth == 0 or len(inside) < 2:
            return None
        cut = self.cut(region, inside)
        if cut is None:
            return None
        weights, value = cut
        below, above = region.sides(weights, value)
        one = self.node(below, inside, depth - 1)
        # Without the other side there is no proof, but there may be seeds on both.
        other = self.node(above, inside, depth - 1)
        if one is None or other is None:
            return None
        return Cut(tuple(weights.tolist()), value, one, other)

    # -- leaves --------------------------------------------------------------------------------

    def leaf(self, region: Region, cover: NDArray[np.bool_]) -> Leaf | None:
        """A proof that a cell beyond `cover` (N,) cannot be covered in the region."""
        prover = self.prover
        for known, cell in prover.leaves:
            if not cover[cell] and known.holds(region):
                return Leaf(cell)
        statements: dict[int, Statement] = {}
        for cell in self._furthest(cover)[:LEAVES]:
            target = np.concatenate([prover.arrays.points[cell], prover.arrays.approaches[cell]])
            if not self._newton(region, np.tile(target, (LEAF_TRIES, 1)), cell):
                statements[cell] = Statement(region, place_at_rest(target[:3], target[3:]), 0)
        for most in TURNS:
            for cell, statement in statements.items():
                if statement.ruling is not Ruling.OPEN:
                    continue
                ruling = self.counted.examine(statement, most)
                if ruling is Ruling.PROVED:
                    prover.leaves.append((region, cell))
                    return Leaf(cell)
                if ruling is not Ruling.OPEN and np.isfinite(statement.found).all():
                    self.seeds.append((cell, statement.found))
        return None

    def _furthest(self, cover: NDArray[np.bool_]) -> list[int]:
        """Cells beyond `cover` (N,), the furthest from what it holds first."""
        points = self.prover.arrays.points
        missed = np.flatnonzero(~cover)
        kept = points[cover] if cover.any() else points.mean(axis=0)[None]
        away = np.linalg.norm(points[missed, None] - kept[None], axis=2).min(axis=1)
        return [int(cell) for cell in missed[np.argsort(-away, kind="stable")]]

    # -- cuts ----------------------------------------------------------------------------------

    def cut(
        self, region: Region, inside: list[Component]
    ) -> tuple[NDArray[np.float64], float] | None:
        """A cut w . q = t between components inside the region."""
        known = self._known(region, inside)
        if known is not None:
            return known
        for _ in range(REFINED):
            before = len(self.samples)
            found = gaps(self.joints, inside, self._samples_in(region))
            cut = self.first_proved(
                (gap.weights, gap.middle, region.on(gap.weights, gap.middle)) for gap in found
            )
            if cut is not None:
                self.prover.cuts.append(_ProvedCut(region, *cut))
                return cut
            if len(self.samples) == before or self.counted.left <= 0:
                break  # no point has made the gaps smaller: they would be the same
        self._note_blocked(region, inside)
        return None

    def first_proved(
        self, candidates: Iterable[tuple[NDArray[np.float64], float, Region]]
    ) -> tuple[NDArray[np.float64], float] | None:
        """The first of some cuts (w, t, where w . q = t) on which the tool is never.

        Those without a known point of the motion set are proved in turns.
        """
        statements: list[tuple[NDArray[np.float64], float, Statement]] = []
        for weights, value, on in candidates:
            if not self._on_cut(on):
                statements.append((weights, value, Statement(on, self.prover.places, 2)))
            if len(statements) == CANDIDATES:
                break
        for most in TURNS:
            for weights, value, statement in statements:
                if statement.ruling is not Ruling.OPEN:
                    continue
                ruling = self.counted.examine(statement, most)
                if ruling is Ruling.PROVED:
                    return weights, value
                if ruling is Ruling.REACHED:
                    self._keep(statement.found[None], -1)
        return None

    def _known(
        self, region: Region, inside: list[Component]
    ) -> tuple[NDArray[np.float64], float] | None:
        """A cut of an earlier attempt that parts the components here."""
        for known in self.prover.cuts:
            if known.region.holds(region):
                below = [bool((c.q @ known.weights < known.value).any()) for c in inside]
                if any(below) and not all(below):
                    return known.weights, known.value
        return None

    def _on_cut(self, on: Region) -> bool:
        """Is a point of the motion set found on a cut?"""
        targets = random_targets(self.prover.places, CUT_TRIES, self.prover.rng)
        return self._newton(on, targets, -1)

    def _newton(self, region: Region, targets: NDArray[np.float64], cell: int) -> bool:
        """Is a configuration of the region found over some targets? It is kept, and a seed."""
        if not self.prover.newton:
            return False
        enough = ENOUGH if cell < 0 else 1
        arrays, rng = self.prover.arrays, self.prover.rng
        q = projected(arrays, self.counted.work, region, targets, enough, rng)
        self._keep(q, cell)
        return len(q) > 0

    def _keep(self, q: NDArray[np.float64], cell: int) -> None:
        """Keep points of the motion set (k, n) as samples, and the first as a seed of a cell."""
        self.samples = np.vstack([self.samples, q])
        if len(q):
            self.seeds.append((self._nearest(q[0]) if cell < 0 else cell, q[0]))

    def _nearest(self, q: NDArray[np.float64]) -> int:
        """The cell whose target point is nearest to the tool point."""
        point, _ = tool(self.prover.arrays.chain, q)
        return int(np.argmin(np.linalg.norm(self.prover.arrays.points - point, axis=1)))

    def _samples_in(self, region: Region) -> NDArray[np.float64]:
        return self.samples[region.inside(self.samples)]

    def _note_blocked(self, region: Region, inside: list[Component]) -> None:
        """Say which gaps of a region stayed open."""
        samples = self._samples_in(region)
        seen = set()
        for gap in gaps(self.joints, inside, samples):
            along = samples @ gap.weights
            low, high = gap.between
            key = (*gap.weights.tolist(), low)
            if key not in seen:
                points = int(((along > low) & (along < high)).sum())
                self.blocked.append(Blocked(gap.weights, low, high, points))
            seen.add(key)
