"""Cells that the arm reaches inside limits and cone, but only where it collides."""

import math
from dataclasses import replace

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.every_pose import Collides
from feasibility.collisions.kernels.memory import configuration_bounds
from feasibility.collisions.problem_bodies import Pair
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.off_target import project_near_cell
from feasibility.roadmap.motions.projection import PROJECTION_STEPS
from feasibility.roadmap.moving_clear import moved_clear
from feasibility.roadmap.proofs.ruling import Ruling
from feasibility.verdict import Cause, CauseKind

GUESSES = 60  # random configurations that are projected onto the cell
PUSHED = 5  # of the best of these, which are moved away from what they collide with
NAMED = 2  # pairs that the detail names, with how often they collide


def colliding(exploration: Exploration, cell: int, pairs: tuple[Pair, ...]) -> Cause | None:
    """The cause of a cell where every configuration that was found collides; None otherwise.

    Pairs are those that have to stay clear, in the order of the search's arrays.
    """
    arrays, work = exploration.arrays, exploration.work
    proof = _of_the_arm(exploration, cell)
    proved = exploration.rulings.get(cell) is Ruling.PROVED
    if not len(arrays.collisions) or (proved and proof is None):
        return None
    needed = np.array([pair.clearance for pair in pairs])
    found, spare = [], []  # spare: of each, distance beyond the clearance by pair
    for q in exploration.guesses(GUESSES):
        if project_near_cell(arrays, work, cell, q, PROJECTION_STEPS):
            found.append(q.copy())
            spare.append(configuration_bounds(arrays.collisions, q) - needed)
            if (spare[-1] > 0.0).all():
                return None
    if not spare:
        return None if proof is None else _proved(cell, proof)
    best = spare[int(np.argmax([row.min() for row in spare]))]
    for k in np.argsort([-row.min() for row in spare], kind="stable")[:PUSHED].tolist():
        if moved_clear(arrays, work, cell, found[k]):
            return None
        pushed = configuration_bounds(arrays.collisions, found[k]) - needed
        best = pushed if pushed.min() > best.min() else best
    cause = _worded(cell, np.array(spare), best, pairs)
    return cause if proof is None else _proved(cell, proof, cause)


def proved_collision(exploration: Exploration, cell: int) -> Cause | None:
    """The cause of a cell over which the tool, or the arm, is proved to collide; or None."""
    blockers = exploration.blockers
    found = None if blockers is None else blockers.tool.get(cell)
    if found is None or not found.confirmed:
        arm = _of_the_arm(exploration, cell)
        return None if arm is None else _proved(cell, arm)
    pairs = [f"{first} and {second}" for first, second in found.pairs]
    one = f"{pairs[0]} collide"
    if len(pairs) > 1:
        one = f"one of these pairs collides: {', '.join(pairs)}"
    near = f"{abs(1e3 * found.distance):.1f} mm"
    how = f"overlap by {near}" if found.distance < 0.0 else f"are {near} apart"
    detail = (
        f"in every pose of the tool there that cone and tolerance allow, {one}; at best "
        f"{pairs[0]} {how}, about"
    )
    return Cause(cell, CauseKind.COLLISION, True, detail, found.pairs[0], found.distance)


def _of_the_arm(exploration: Exploration, cell: int) -> Collides | None:
    """The proof that something of the arm collides wherever the tool is over a cell; or None."""
    found = None if exploration.blockers is None else exploration.blockers.arm.get(cell)
    return found if found is not None and found.confirmed else None


def _proved(cell: int, proof: Collides, found: Cause | None = None) -> Cause:
    """The cause of a cell from which collisions are proved to keep the arm.

    `found` is what was seen of some configurations over it.
    """
    named = ", ".join(f"{first} and {second}" for first, second in proof.pairs)
    detail = f"wherever the tool is there, one of these pairs collides: {named}"
    if found is None:
        return Cause(cell, CauseKind.COLLISION, True, detail, proof.pairs[0])
    detail = f"{detail}; {found.detail}"
    return replace(found, proved=True, detail=detail)


def _worded(cell: int, spare: Array, best: Array, pairs: tuple[Pair, ...]) -> Cause:
    """What the best configuration collides with, and which pairs collide in how many.

    Args:
        cell: the cell.
        spare: (k, P) of each configuration, distance beyond the clearance by pair, m.
        best: (P,) the same of the best one, or of one that was pushed.
        pairs: the P pairs.
    """
    pair = pairs[int(best.argmin())]
    distance = float(best.min()) + pair.clearance
    if distance < 0.0:
        how = f"overlap by {-1e3 * distance:.1f} mm"
    else:
        short = math.floor(1e4 * distance) / 10.0  # never rounded up to the clearance
        how = f"come within {short:.1f} mm, {1e3 * pair.clearance:g} mm are required"
    often = (spare <= 0.0).sum(axis=0)
    most = np.argsort(-often, kind="stable")[:NAMED]
    shares = ", ".join(
        f"{pairs[k].first} and {pairs[k].second} in {often[k]}" for k in most if often[k]
    )
    detail = (
        f"at best {pair.first} and {pair.second} {how}; of {len(spare)} configurations over the "
        f"cell none is clear; in the way: {shares}"
    )
    return Cause(cell, CauseKind.COLLISION, False, detail, (pair.first, pair.second), distance)
