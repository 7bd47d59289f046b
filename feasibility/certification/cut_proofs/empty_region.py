"""Is there no configuration in a region with the tool on the surface? Branch and bound over boxes.

A *claim* says so of one region and of the whole surface or one cell's target. The boxes of many
claims are looked at together, as a step over a thousand boxes takes hardly longer than one over
ten. Boxes that the linear models do not prove empty are contracted and cut. What is dropped is
proved empty: when no box is left, every claim holds (`box_exclusion`). Of the boxes that are left a
few give starts for a search for a configuration that refutes its claim.

Where bodies are to stay clear of each other, a box in which some overlap everywhere is empty too
(`everywhere`), and only a configuration that is clear refutes a claim. Boxes in which some nearly
do are cut along what moves the point that shows it.

The search asks `ArmCollisions`, and `never_clear`, where it cannot reach a cell: such proofs have
one engine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.collisions.every_pose import Collides
from feasibility.certification.collisions.everywhere import Overlapping
from feasibility.certification.cut_proofs.box_exclusion import (
    JointRegion,
    contract,
    directions_for,
    nearest,
    separated,
    smaller,
)
from feasibility.certification.cut_proofs.linear_models import (
    Allowed,
    Boxes,
    Models,
    Parts,
    cell_parts,
    models_of,
)
from feasibility.certification.cut_proofs.refutation import Refuter
from feasibility.certification.faults import Judged
from feasibility.certification.lever_bounds import out_of_line
from feasibility.collisions.problem_bodies import Bodies
from feasibility.task import Task
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

BATCH = 2048  # boxes at a time
FIRST_TRY = 300  # boxes after which a refutation is first tried
RARER = 4  # times as many boxes until the next try
NEARLY = 8.0  # [1] times as far as it may that a point moves in a box that nearly is ruled out
DEEP = 0.05  # [1] of the typical lever, that bodies overlap by there
STARTS = 24  # of a search for a configuration that refutes a claim, shared by all


class Claim(NamedTuple):
    """A region that is to be empty of configurations with the tool where it has to be."""

    what: str
    """What claims it, in words."""
    region: JointRegion
    cell: int | None
    """The cell whose target it is; None where the tool may be anywhere on the surface."""
    part: int
    """That target, or all of the surface, as a part."""


@dataclass(frozen=True, slots=True)
class ProofCheck(Judged):
    """What became of a proof."""

    boxes: int
    """How many boxes of joints and surface, or of the tool's tilt and roll, were looked at."""
    faults: tuple[str, ...] = ()
    """Why it is refused; none when every claim is confirmed."""


@dataclass(eq=False, slots=True)
class Emptiness:
    """Proves regions empty of configurations with the tool on the surface, or at cells' targets."""

    kinematics: Kinematics
    """Of the arm."""
    parts: Parts
    """Of the surface, and targets of cells as parts of their own."""
    allowed: Allowed
    """How far the tool may be off."""
    tick: Callable[[], object]
    """Called between batches; may raise."""
    overlapping: Overlapping | None = None
    """Finds boxes in which bodies overlap; None where they may."""
    blamed: set[int] = field(default_factory=set)
    """Indices of the pairs that were found to overlap all over some box."""

    def test(self, claims: list[Claim], refuter: Refuter, most: int) -> ProofCheck:
        """Confirm all claims, refute one, or give up after `most` boxes."""
        regions = [claim.region.folded(self.kinematics.robot.prismatic) for claim in claims]
        first = [k for k, region in enumerate(regions) if not region.empty]
        done, next_try, n = 0, FIRST_TRY, self.kinematics.robot.n
        waiting = Boxes(
            np.array([[*regions[k].low, -1.0, -1.0] for k in first]).reshape(-1, n + 2),
            np.array([[*regions[k].high, 1.0, 1.0] for k in first]).reshape(-1, n + 2),
            np.array([claims[k].part for k in first], dtype=np.int64),
            np.array(first, dtype=np.int64),
        )
        while len(waiting):
            if done >= most:
                what = f"{claims[int(waiting.claim.min())].what} cannot be confirmed"
                return ProofCheck(done, (f"{what}: after {done:,} boxes it is still open",))
            self.tick()
            # The newest first, so that few wait.
            boxes, waiting = waiting.of(slice(-BATCH, None)), waiting.of(slice(-BATCH))
            done += len(boxes)
            left, models, place = self.examine(boxes)
            if not len(left):
                continue
            if done >= next_try:
                next_try *= RARER
                some = _spread(left)
                starts = (left.centre[some] + place[some])[:, :n]
                at = [(regions[k], claims[k].cell) for k in left.claim[some]]
                found = refuter.find(starts, at)
                if found is not None and (
                    self.overlapping is None or self.overlapping.clear(found[1])
                ):
                    claim = claims[int(left.claim[some[found[0]]])]
                    where = "on the surface" if claim.cell is None else "at its target"
                    values = ", ".join(f"{value:.4f}" for value in found[1])
                    said = f"{claim.what} is wrong: the tool can be {where} at q = [{values}]"
                    return ProofCheck(done, (said,))
            new = smaller(left, models, self.parts, self.allowed.length)
            waiting = Boxes.join(waiting, new)
        return ProofCheck(done)

    def examine(self, boxes: Boxes) -> tuple[Boxes, Models, Array]:
        """The boxes that are not proved empty, their models, and where these come nearest."""
        models = models_of(self.kinematics, boxes, self.parts, self.allowed)
        normals = self.parts.centre[boxes.part, 3:]
        low, high = contract(models, directions_for(models, normals))
        kept = np.asarray(~(low > high).any(axis=1))
        models, boxes, low, high = models.of(kept), boxes.of(kept), low[kept], high[kept]
        models = replace(models, low=low, high=high)
        place, missed = nearest(models)
        kept = ~separated(models, missed)
        boxes, models, place = boxes.of(kept), models.of(kept), place[kept]
        if self.overlapping is None:
            return boxes, models, place
        kept, reach = self._overlap(self.overlapping, boxes, models)
        models = replace(models, reach=reach)
        return boxes.of(kept), models.of(kept), place[kept]

    def _overlap(
        self, overlapping: Overlapping, boxes: Boxes, models: Models
    ) -> tuple[Mask, Array]:
        """(m,) boxes, as far as their models leave them, in which no bodies overlap everywhere.

        And along what they are cut, (m, n + 2) m.
        """
        n, parts, part = self.kinematics.robot.n, self.parts, boxes.part
        low, high = boxes.centre + models.low, boxes.centre + models.high
        at, half = 0.5 * (low + high)[:, n:], 0.5 * (high - low)[:, n:]
        slopes = parts.slopes[part][..., :3]
        target = parts.centre[part, :3] + (at[..., None] * slopes).sum(axis=1)
        off = self.allowed.position + parts.radius[part, 0]
        off = off + (half * np.linalg.norm(slopes, axis=2)).sum(axis=1)
        found = overlapping.deepest(low[:, :n], high[:, :n], target, off)
        ruled_out = found.ratio < 1.0
        self.blamed |= set(found.pair[ruled_out].tolist())
        # (Around shallow overlaps there would be no end of ever smaller boxes.)
        deep = found.effect.sum(axis=1) > found.ratio * DEEP * self.allowed.length
        reach = models.reach.copy()
        reach[:, :n] = np.where(
            ((found.ratio < NEARLY) & deep)[:, None], found.effect, reach[:, :n]
        )
        return ~ruled_out, reach


def _spread(boxes: Boxes) -> Ints:
    """Indices of a few boxes of every claim."""
    claims = np.unique(boxes.claim)
    share = -(-STARTS // len(claims))
    chosen = []
    for claim in claims:
        (rows,) = np.nonzero(boxes.claim == claim)
        chosen.append(rows[:: -(-len(rows) // share)])
    return np.concatenate(chosen)


class ArmCollisions:
    """Looks for proofs that bodies of one problem collide wherever the tool is over a cell."""

    def __init__(self, robot: Robot, cells: Cells, task: Task, bodies: Bodies) -> None:
        """Of `bodies` those pairs count that are checked."""
        self._robot, self._cells, self._task, self._bodies = robot, cells, task, bodies
        self._targets = task.targets(cells)
        self._region = JointRegion(robot.lower, robot.upper).folded(robot.prismatic)

    @cached_property
    def _overlapping(self) -> Overlapping:
        """Points are placed in bodies when they are first needed."""
        return Overlapping(self._robot, self._bodies)

    @property
    def possible(self) -> bool:
        """May anything be proved of this arm?"""
        finite = bool(np.isfinite(self._region.high - self._region.low).all())
        return finite and bool(self._bodies.pairs) and not out_of_line(self._robot)

    def any_clear(self, q: Array, cell: int) -> bool:
        """Is nothing known to overlap at one of some configurations (k, n) over a cell?

        Then nothing is proved there.
        """
        target = np.broadcast_to(self._targets.points[cell], (len(q), 3))
        off = np.full(len(q), self._task.effective_tolerance)
        return bool((self._overlapping.deepest(q, q, target, off).pair < 0).any())

    def check(self, cell: int, tick: Callable[[], object], most: int) -> Collides:
        """Is it confirmed, by so many boxes, that something collides wherever it covers a cell?

        `tick` is called between batches of them; it may raise.
        """
        allowed = Allowed.by(self._task, self._robot, self._region.low, self._region.high)
        parts = cell_parts(self._targets)
        engine = Emptiness(Kinematics(self._robot), parts, allowed, tick, self._overlapping)
        refuter = Refuter(self._robot, self._cells, self._task, allowed.length)
        found = engine.test([Claim("", self._region, cell, cell)], refuter, most)
        if not found.accepted:
            return Collides(False, found.boxes)
        pairs = [self._bodies.pairs[k] for k in sorted(engine.blamed)]
        return Collides(True, found.boxes, tuple((pair.first, pair.second) for pair in pairs))
