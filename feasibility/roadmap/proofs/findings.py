"""What attempts at a proof find out and keep: points of the motion set, and statements.

The points are configurations that hold the tool on the surface, found by Newton. Nothing that is
proved rests on them: they show where a cut cannot be, and give the search motions that it does not
know.
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.roadmap.motions.projection import project_onto_cell
from feasibility.roadmap.motions.search_arrays import SearchArrays, with_free_roll
from feasibility.roadmap.motions.working_memory import Work, work_for
from feasibility.roadmap.proofs.boxes import place_at_rest, toward_middle
from feasibility.roadmap.proofs.branching import PlaceParts
from feasibility.roadmap.proofs.regions import JointRegion, folded
from feasibility.roadmap.proofs.statements import Statement
from feasibility.roll import projected as across
from robots.chain import tool

SAMPLES = 100  # Newton tries onto the motion set, each attempt
MOST_SAMPLES = 600
CUT_TRIES = 30  # Newton tries on a cut before branch and bound
ENOUGH = 3  # hits on a cut that end them
LEAF_TRIES = 8  # Newton tries on a cell
MOST_KEPT = 200  # unfinished statements
NEWTON_STEPS = np.int64(16)  # of a try: most that succeed need fewer, and the rest are many


class ProvedCut(NamedTuple):
    """In the region the tool is nowhere on the surface with q_j = t."""

    region: JointRegion
    joint: int
    """j"""
    value: float
    """t"""


class ProvedLeaf(NamedTuple):
    """In the region the cell cannot be covered."""

    region: JointRegion
    cell: int


@dataclass(eq=False)
class CutFindings:
    """What is known of the motion set of `arrays` over `places`."""

    arrays: SearchArrays
    places: PlaceParts
    rng: np.random.Generator
    newton: bool
    work: Work = field(init=False)
    over_places: SearchArrays = field(init=False)
    """`arrays`, with any roll where it is not known over all places."""
    samples: Array = field(init=False)
    """(k, n) points of the motion set, at any winding."""
    cuts: list[ProvedCut] = field(default_factory=list)
    leaves: list[ProvedLeaf] = field(default_factory=list)
    uncovered: list[tuple[int, Array]] = field(default_factory=list)
    """(cell, configuration) that refuted a leaf, in this attempt."""
    on_cuts: list[tuple[int, Array]] = field(default_factory=list)
    """(nearest cell, configuration) that refuted a cut, in this attempt."""
    unfinished: dict[tuple[object, ...], Statement] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Working memory, and no samples yet."""
        n = len(self.arrays.lower)
        self.work = work_for(n)
        # Where proofs leave roll out, a configuration with any roll refutes them.
        finest = self.places.children[:, 0] < 0
        left_out = np.isinf(self.places.radius[finest, 2]).any()
        self.over_places = with_free_roll(self.arrays) if left_out else self.arrays
        self.samples = np.empty((0, n))

    def look_around(self, limits: JointRegion) -> None:
        """More points of the motion set inside the limits, unless there are enough."""
        if self.newton and len(self.samples) < MOST_SAMPLES:
            targets = random_targets(self.places, SAMPLES, self.rng)
            q = projected(self.over_places, self.work, limits, targets, SAMPLES, self.rng)
            self.samples = np.vstack([self.samples, q])

    def on_cut(self, on: JointRegion) -> bool:
        """Is the tool found on the surface in the region of a cut? It is kept, and a seed."""
        if not self.newton:
            return False
        targets = random_targets(self.places, CUT_TRIES, self.rng)
        q = projected(self.over_places, self.work, on, targets, ENOUGH, self.rng)
        self.keep(q)
        return len(q) > 0

    def covers(self, region: JointRegion, cell: int) -> bool:
        """Is a configuration of the region found that covers a cell? It is kept, and a seed."""
        if not self.newton:
            return False
        targets = np.tile(place_at_rest(self.arrays, cell).centre, (LEAF_TRIES, 1))
        q = projected(self.arrays, self.work, region, targets, 1, self.rng)
        self.keep(q, cell)
        return len(q) > 0

    def keep(self, q: Array, cell: int = -1) -> None:
        """Keep points of the motion set (k, n), the first of which refutes a leaf or a cut.

        Args:
            q: what is not finite is left out.
            cell: that of the leaf; -1 for a cut.
        """
        q = q[np.isfinite(q).all(axis=1)]
        self.samples = np.vstack([self.samples, q])
        for first in q[:1]:
            if cell < 0:
                self.on_cuts.append((self._nearest(first), first))
            else:
                self.uncovered.append((cell, first))

    def forget_seeds(self) -> None:
        """Start a new attempt."""
        self.uncovered.clear()
        self.on_cuts.clear()

    def samples_in(self, region: JointRegion, opened: dict[int, float]) -> Array:
        """(k, n) those in a region, with opened joints inside their turn."""
        q = folded(self.samples, opened)
        return q[region.inside(q)]

    def _nearest(self, q: Array) -> int:
        """The cell whose target point is nearest to the tool point."""
        point, _ = tool(self.arrays.chain, q)
        return int(np.argmin(np.linalg.norm(self.arrays.points - point, axis=1)))

    def statement(self, region: JointRegion, cell: int = -1) -> Statement:
        """'In the region the tool is nowhere on the surface', or not over a cell, as left."""
        key = (region.low.tobytes(), region.high.tobytes(), cell)
        if key not in self.unfinished:
            if len(self.unfinished) >= MOST_KEPT:
                del self.unfinished[next(iter(self.unfinished))]
            places, parameters = self.places, 2
            if cell >= 0:
                places = place_at_rest(self.arrays, cell)
                parameters = 0
            self.unfinished[key] = Statement(region, places, parameters)
        return self.unfinished[key]

    def known_leaf(self, region: JointRegion, missed: Mask) -> int | None:
        """A cell of `missed` (N,) that is proved already for the region."""
        proved = (f.cell for f in self.leaves if missed[f.cell] and f.region.holds(region))
        return next(proved, None)


def projected(
    arrays: SearchArrays,
    work: Work,
    region: JointRegion,
    targets: Array,
    enough: int,
    rng: np.random.Generator,
) -> Array:
    """Random configurations of a region, projected onto targets, one each.

    Args:
        arrays, work: of the search.
        region: one turn of it takes the place of the limits.
        targets: (k, 9) as `PlaceParts.centre`.
        enough: hits after which no more are tried.
        rng: draws the guesses.

    Returns:
        (hits, n) configurations.
    """
    box, approaches = region.over_one_turn(), targets[:, 3:6].copy()
    toward = toward_middle(approaches, targets[:, 6:], -arrays.roll[0])
    over = arrays._replace(
        lower=box.low, upper=box.high, points=targets[:, :3].copy(), approaches=approaches,
        references=across(toward, approaches)[0] if arrays.roll[1] < np.inf else toward,
    )  # fmt: skip
    found = []
    for k, q in enumerate(rng.uniform(box.low, box.high, (len(targets), len(box.low)))):
        if project_onto_cell(over, work, k, q, NEWTON_STEPS):
            found.append(q)
        if len(found) == enough:
            break
    hits = np.array(found).reshape(-1, len(box.low))
    return hits[region.inside(hits)]


def random_targets(places: PlaceParts, k: int, rng: np.random.Generator) -> Array:
    """(k, 9) targets at random places of the surface, up to the radius of the finest parts."""
    finest = np.flatnonzero(places.children[:, 0] < 0)
    part = rng.choice(finest, k)
    x = rng.uniform(-1.0, 1.0, (k, 2, 1))
    targets = places.centre[part] + (x * places.slopes[part]).sum(axis=1)
    targets[:, 3:6] /= np.linalg.norm(targets[:, 3:6], axis=1)[:, None]
    return targets
