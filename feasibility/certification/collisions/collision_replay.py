"""The replay of a motion among bodies: does everything stay clear that has to?

It uses Pinocchio's placements, coal's geometry and the bodies as the URDF and the scene give them,
and shares no code with the search (`feasibility.collisions` holds its kernels).
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from coverable_arrays import Array
from coverable_errors import ArgumentError
from feasibility.certification.collisions.first_look import Body, CoupledBodies, FirstLook
from feasibility.certification.collisions.measured import least_measured
from feasibility.certification.collisions.pairing import ROUNDING, Pairing, Place
from feasibility.certification.collisions.pieces import Below
from feasibility.certification.collisions.plane_search import NEAR
from feasibility.certification.collisions.relative_motion import ArmMotion
from feasibility.certification.collisions.shape_pieces import piece_of, sheet_piece
from feasibility.certification.faults import Judged, MotionFault
from feasibility.collisions import Bodies, Pair
from feasibility.verdict import Certificate
from robots import Robot

TOUCHING = 5e-7  # [m] overlap that is called touching
MEASURED = 8  # couples, with the lowest certified distances, of which coal measures the least
KEPT = 8  # bodies of so many problems are kept ready, for motions replayed one after another


@dataclass(frozen=True, slots=True)
class CollisionFault(MotionFault):
    """Two owners of bodies that come too near, and where."""

    pair: tuple[str, str]
    distance: float
    """m, between them; negative where they overlap, as deep as that; NaN where not decided."""


@dataclass(frozen=True, slots=True)
class CollisionReplay(Judged):
    """What the replay found."""

    min_clearance: float | None
    """m, certified: no pair comes nearer along an accepted motion; None where there is no pair. Of
    a refused one, the least distance that was measured."""
    nearest_pair: tuple[str, str] | None
    """The pair that it is of."""
    measured_clearance: float | None
    """m, the least distance that coal measured along an accepted motion: the truth lies between
    `min_clearance` and this. None where there is no pair, and of a refused motion."""
    faults: tuple[CollisionFault, ...]
    """One for each pair that comes too near, the nearest first; none when it is accepted."""
    calls: int
    """How often coal was called for what is certified."""

    def added_to(self, certificate: Certificate) -> Certificate:
        """The certificate of the same motion, with what was found."""
        return replace(
            certificate,
            min_clearance=self.min_clearance,
            measured_clearance=self.measured_clearance,
            nearest_pair=self.nearest_pair,
        )


@dataclass(frozen=True, eq=False, slots=True)
class Couple:
    """Two bodies of a pair, the one nearer to the root first."""

    pair: Pair
    a: Body
    b: Body
    deviation: float
    """m, how far they may stand out from what is known of them."""


class BodiesOfOwners:
    """The bodies of one problem, ready for coal; not to be pickled."""

    def __init__(self, bodies: Bodies) -> None:
        """Build what coal needs of every owner that a pair names.

        Raises:
            ArgumentError: a pair names what has no body, or a body is malformed.
        """
        named = {name for pair in bodies.pairs for name in (pair.first, pair.second)}
        self._of: dict[str, list[Body]] = {name: [] for name in named}
        for solid in bodies.solids:
            if solid.owner in named:
                piece = piece_of(solid.geometry, solid.placement)
                self._of[solid.owner].append(Body(solid.joint, piece, 0.0))
        scene = {thing.name for thing in bodies.scene}
        for thing in bodies.scene:
            if thing.name in named:
                piece = piece_of(thing.geometry, thing.placement, at_rest=True)
                self._of[thing.name].append(Body(0, piece, 0.0))
        for soup in bodies.soups:
            if soup.owner in named and soup.owner not in scene:
                piece = sheet_piece(soup.triangles, soup.closed)
                self._of[soup.owner].append(Body(0, piece, soup.deviation))
        empty = sorted(name for name, parts in self._of.items() if not parts)
        if empty:
            raise ArgumentError(f"pairs name what has no body: {', '.join(empty)}")
        checked = [
            Couple(pair, a, b, a.deviation + b.deviation)
            for pair in bodies.pairs
            for a, b in self.couples(pair)
        ]
        self.ordered = tuple(sorted(checked, key=_outermost))
        """All couples of all pairs, what is furthest from the base first."""
        self.known = CoupledBodies([(one.a, one.b) for one in self.ordered])

    def couples(self, pair: Pair) -> list[tuple[Body, Body]]:
        """Each body of one owner with each of the other, the one nearer to the root first."""
        found = []
        for one in self._of[pair.first]:
            for other in self._of[pair.second]:
                swapped = other.joint < one.joint or isinstance(other.piece, Below)
                found.append((other, one) if swapped else (one, other))
        return found


@lru_cache(maxsize=KEPT)
def ready_bodies(bodies: Bodies) -> BodiesOfOwners:
    """The bodies of a problem, kept for the next motion among them."""
    return BodiesOfOwners(bodies)


def collision_replay(
    robot: Robot, bodies: Bodies, q: Array, deviations: Array | None = None
) -> CollisionReplay:
    """Judge a motion that is straight in joint space between its rows.

    Args:
        robot: the arm.
        bodies: everything that can collide, and the pairs that are checked.
        q: (m, n) rows, rad or m, unwrapped. Values that are not finite refuse.
        deviations: (m - 1, n) bounds on how far each joint is from the straight lines, for motions
            that are curved between rows; none by default.

    Raises:
        ArgumentError: the bodies are malformed, or q or deviations do not have that shape.
    """
    rows = np.ascontiguousarray(q, dtype=float)
    if rows.ndim != 2 or rows.shape[1] != robot.n:
        raise ArgumentError(f"q must have shape (m, {robot.n}), got {rows.shape}")
    if deviations is not None and np.shape(deviations) != (max(len(rows) - 1, 0), robot.n):
        raise ArgumentError(
            f"deviations must have a row for each segment, got {np.shape(deviations)}"
        )
    finite = np.isfinite(rows).all(axis=1)
    if deviations is not None:
        finite[:-1] &= np.isfinite(deviations).all(axis=1)
    if not finite.all():
        row = int(np.argmin(finite))
        fault = CollisionFault(row, 0.0, "a joint value is not finite", ("", ""), np.nan)
        return CollisionReplay(None, None, None, (fault,), 0)
    ready = ready_bodies(bodies)
    if not len(rows) or not bodies.pairs:
        return CollisionReplay(None, None, None, (), 0)
    if len(rows) == 1:  # an arm at rest: a motion that goes nowhere
        rows, deviations = np.repeat(rows, 2, axis=0), None
    motion = ArmMotion(robot, rows, None if deviations is None else np.abs(deviations))
    return _judged(ready, motion)


class _Checked:
    """Two bodies of a pair."""

    def __init__(self, couple: Couple) -> None:
        """Nothing is known of them yet."""
        self.pair, self.a, self.b = couple.pair, couple.a, couple.b
        self.deviation = couple.deviation
        self.needed = self.pair.clearance + self.deviation
        """m, of what is known of them."""
        self.low = -np.inf
        """m, certified by balls and boxes."""
        self.pairing: Pairing | None = None
        """Made where these do not tell enough."""

    @property
    def distance(self) -> float:
        """m, certified, or measured where they are refused."""
        if self.pairing is None:
            return self.low - ROUNDING - self.deviation
        place, bound = self.pairing.place, self.pairing.bound
        return (bound - ROUNDING if place is None else place.distance) - self.deviation


def _judged(ready: BodiesOfOwners, motion: ArmMotion) -> CollisionReplay:
    """All pairs, the nearest first: how near they come sets what is aimed at."""
    checked = [_Checked(couple) for couple in ready.ordered]
    look = FirstLook(motion, ready.known)
    for one, low in zip(checked, look.low.min(axis=1).tolist(), strict=True):
        one.low = low

    def paired(number: int) -> Pairing:
        one = checked[number]
        if one.pairing is None:
            joints, stretches = (one.a.joint, one.b.joint), look.stretches(number)
            one.pairing = Pairing(one.a.piece, one.b.piece, joints, motion, stretches)
        return one.pairing

    nearest, heap = np.inf, [(one.low - one.deviation, k, False) for k, one in enumerate(checked)]
    heapq.heapify(heap)
    while heap and heap[0][0] < nearest:
        low, number, guessed = heapq.heappop(heap)
        if guessed:
            nearest = min(nearest, paired(number).meet() - checked[number].deviation)
        else:
            seems = paired(number).guess() - checked[number].deviation
            heapq.heappush(heap, (max(low, seems), number, True))
    for number, one in enumerate(checked):
        aim = max(one.needed, NEAR * nearest + one.deviation)
        if one.pairing is not None or one.low < aim + ROUNDING:
            paired(number).certify(one.needed, aim)
    return _outcome(checked)


def _outcome(checked: list[_Checked]) -> CollisionReplay:
    """What was found, in words."""
    faults: dict[tuple[str, str], CollisionFault] = {}
    pairings = [one.pairing for one in checked if one.pairing is not None]
    for one in checked:
        if one.pairing is not None and one.pairing.place is not None:
            fault = _fault(one.pair, one.pairing.place, one.distance)
            known = faults.get(fault.pair)
            if known is None or not fault.distance >= known.distance:
                faults[fault.pair] = fault
    least = min(checked, key=_decided)
    measured = math.inf
    if not faults:
        for one in sorted(checked, key=_decided)[:MEASURED]:
            if one.pairing is not None and one.distance < measured:
                measured = min(measured, least_measured(one.pairing) + one.deviation)
    ordered = sorted(faults.values(), key=_decided)
    return CollisionReplay(
        min_clearance=float(least.distance),
        nearest_pair=(least.pair.first, least.pair.second),
        measured_clearance=None if faults else max(measured, float(least.distance)),
        faults=tuple(ordered),
        calls=sum(pairing.calls for pairing in pairings),
    )


def _outermost(one: Couple) -> tuple[object, ...]:
    """Brings what is furthest from the base, and often the nearest, to the front.

    So the answer does not depend on the order in which bodies and pairs are given.
    """
    names, a, b = sorted((one.pair.first, one.pair.second)), one.a.piece, one.b.piece
    return (-one.b.joint, *names, *a.centre, *b.centre)


def _decided(one: _Checked | CollisionFault) -> float:
    """m, its distance; infinite where that was not decided."""
    return math.inf if math.isnan(one.distance) else one.distance


def _fault(pair: Pair, place: Place, distance: float) -> CollisionFault:
    """A pair that is refused, in words."""
    names = f"{pair.first} and {pair.second}"
    wanted = f"{1e3 * pair.clearance:g} mm are needed"
    if np.isnan(distance) or distance >= pair.clearance + TOUCHING:
        text = f"not certified: {names} may come nearer than {1e3 * pair.clearance:g} mm"
    elif place.inside:
        text = f"{names} overlap, one is inside the other"
    elif distance <= ROUNDING and distance > -TOUCHING:
        text = f"{names} touch, {wanted}"
    elif distance <= 0.0:
        text = f"{names} overlap by {-1e3 * distance:.3g} mm"
    else:
        text = f"{names} are {1e3 * distance:.4g} mm apart, {wanted}"
    return CollisionFault(place.row, place.share, text, (pair.first, pair.second), distance)
