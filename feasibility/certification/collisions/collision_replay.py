"""The replay of a motion among bodies: does everything stay clear that has to?

It uses Pinocchio's placements, coal's geometry and the bodies as the URDF and the scene give them,
and shares no code with the search (`feasibility.collisions` holds its kernels).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial

import numpy as np

from coverable.arrays import Array
from coverable.errors import ArgumentError
from feasibility.certification.collisions.judged_shapes import Body, body_of_soup
from feasibility.certification.collisions.motion import ArmMotion, Chords
from feasibility.certification.collisions.pairing import ROUNDING, Pairing
from feasibility.certification.faults import Judged, MotionFault
from feasibility.collisions.problem_bodies import Bodies, Pair
from feasibility.verdict import Certificate
from robots.robot import Robot

TOUCHING = 5e-7  # [m] overlap that is called touching
MEASURED = 8  # couples, with the lowest certified distances, of which coal measures the least
FINEST = 1.0 / 16.0  # [1] share of a segment, within which no nearer place is looked for
KEPT = 8  # bodies of so many problems are kept ready, for motions replayed one after another


@dataclass(frozen=True, slots=True, kw_only=True)
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
    pairings: tuple[Pairing, ...] = field(default=(), compare=False, repr=False)
    """All couples of bodies, as they were judged."""

    def added_to(self, certificate: Certificate) -> Certificate:
        """The certificate of the same motion, with what was found."""
        margin = certificate.margin if self.accepted else None
        return replace(
            certificate,
            margin=partial(margin, self.pairings) if callable(margin) else None,
            min_clearance=self.min_clearance,
            measured_clearance=self.measured_clearance,
            nearest_pair=self.nearest_pair,
        )


class Couples:
    """All couples of bodies of all pairs of one problem; not to be pickled."""

    def __init__(self, bodies: Bodies) -> None:
        """Make a body of whatever a pair names.

        Raises:
            ArgumentError: a pair names what has no body.
        """
        of = {name: list[Body]() for pair in bodies.pairs for name in (pair.first, pair.second)}
        for one in (one for one in bodies.exact if one.owner in of):
            of[one.owner].append(Body(one))
        scene = {thing.owner for thing in bodies.scene}
        for soup in (one for one in bodies.soups if one.owner in of.keys() - scene):
            of[soup.owner].append(body_of_soup(soup))
        empty = sorted(name for name, parts in of.items() if not parts)
        if empty:
            raise ArgumentError(f"pairs name what has no body: {', '.join(empty)}")
        self.couples = [
            (pair, *((b, a) if b.joint < a.joint or b.half_space else (a, b)))
            for pair in bodies.pairs
            for a in of[pair.first]
            for b in of[pair.second]
        ]
        """Of each pair, the one nearer to the root first, or a half space."""
        self.couples.sort(key=lambda one: _outermost(*one))
        self.bodies = list(dict.fromkeys(body for couple in self.couples for body in couple[1:]))

    def along(self, motion: ArmMotion) -> list[Pairing]:
        """Every couple along a motion of the arm, with what balls around both say of it."""
        joints = np.array([body.joint for body in self.bodies], dtype=np.intp)
        centres, balls = np.stack([b.centre for b in self.bodies]), [b.ball for b in self.bodies]
        # A half space, whose ball has no end, is at rest.
        chords = motion.chords(joints, centres, np.where(np.isfinite(balls), balls, 0.0))
        index = {body: k for k, body in enumerate(self.bodies)}
        return [
            Pairing(pair, a, b, motion, Chords(*(one[a.joint, :, index[b]] for one in chords)))
            for pair, a, b in self.couples
        ]


couples_of = lru_cache(maxsize=KEPT)(Couples)  # for the next motion among them


def collision_replay(
    robot: Robot, bodies: Bodies, q: Array, deviations: Array | None = None
) -> CollisionReplay:
    """Judge a motion that is straight in joint space between its rows q (m, n), unwrapped rad or m.

    Values that are not finite refuse. Of motions that are curved between rows, `deviations`
    (m - 1, n) bound how far (rad or m) each joint is from the straight lines.

    Raises:
        ArgumentError: a pair names what has no body, or q or deviations have other shapes.
    """
    rows = np.ascontiguousarray(q, dtype=float)
    segments = max(len(rows) - 1, 0), robot.n
    if deviations is not None and np.shape(deviations) != segments:
        raise ArgumentError(f"deviations must have shape {segments}, got {np.shape(deviations)}")
    finite = np.asarray(np.isfinite(rows).all(axis=1))
    if deviations is not None:
        finite[:-1] &= np.isfinite(deviations).all(axis=1)
    if not finite.all():
        row = int(np.argmin(finite))
        what, nobody = "a joint value is not finite", ("", "")
        fault = CollisionFault(what, row, pair=nobody, distance=np.nan)
        return CollisionReplay(None, None, None, (fault,))
    couples = couples_of(bodies)
    if not len(rows) or not bodies.pairs:
        return CollisionReplay(None, None, None, ())
    if len(rows) == 1:  # an arm at rest: a motion that goes nowhere
        rows, deviations = np.repeat(rows, 2, axis=0), None
    motion = ArmMotion(robot, rows, deviations)
    return _judged(couples.along(motion))


def _judged(pairings: list[Pairing]) -> CollisionReplay:
    """All couples, the nearest first: how near they come sets what is aimed at."""
    nearest, met = math.inf, pairings[0]
    for one in sorted(pairings, key=lambda one: one.bound):
        if not one.bound < nearest:
            break
        distance = float(one.lines(np.array([np.argmin(one.low)], float))[0][0])
        if distance < nearest:
            nearest, met = distance, one
    for one in pairings:
        one.certify(nearest)
    refused = [_fault(one) for one in pairings if one.refused is not None]
    faults = dict[tuple[str, str], CollisionFault]()
    for fault in sorted(refused, key=lambda one: np.nan_to_num(one.distance, nan=np.inf)):
        faults.setdefault(fault.pair, fault)
    order = sorted(pairings, key=lambda one: np.nan_to_num(one.bound, nan=np.inf))
    # What is certified of many is no more than was aimed at: they need not be the nearest.
    nearby = list(dict.fromkeys([met, *order[:MEASURED]]))
    measured, near = (None, order[0]) if faults else _measured(nearby)
    return CollisionReplay(
        min_clearance=order[0].bound,
        nearest_pair=near.names,
        measured_clearance=None if measured is None else max(measured, order[0].bound),
        faults=tuple(faults.values()),
        pairings=tuple(pairings),
    )


def _measured(pairings: list[Pairing]) -> tuple[float, Pairing]:
    """m, the least distance that is met, of exact bodies, and of which.

    Bodies may stand back from what is known of them as far as they may stand out. Of a motion that
    deviates from straight lines only rows are looked at.
    """
    finest = 1.0 if pairings[0].motion.deviations.any() else FINEST
    found, near = math.inf, pairings[0]
    for one in pairings:
        if one.bound < found:
            distance = one.least_measured(finest)[1] + 2.0 * (one.a.deviation + one.b.deviation)
            if distance < found:
                found, near = distance, one
    return found, near


def _outermost(pair: Pair, a: Body, b: Body) -> tuple[object, ...]:
    """Brings what is furthest from the base to the front, in whatever order all is given."""
    return (-b.joint, *sorted((pair.first, pair.second)), *a.centre, *b.centre)


def _fault(found: Pairing) -> CollisionFault:
    """A pair that is refused, in words."""
    time, distance = found.refused or 0.0, found.distance
    row = int(time)
    names, needed = " and ".join(found.names), f"{1e3 * found.needed:g} mm"
    wanted = f"{needed} are needed"
    if not distance < found.needed + TOUCHING:
        text = f"not certified: {names} may come nearer than {needed}"
    elif found.inside:
        text = f"{names} overlap, one is inside the other"
    elif -TOUCHING < distance <= ROUNDING:
        text = f"{names} touch, {wanted}"
    elif distance <= 0.0:
        text = f"{names} overlap by {-1e3 * distance:.3g} mm"
    else:
        text = f"{names} are {1e3 * distance:.4g} mm apart, {wanted}"
    return CollisionFault(text, row, time - row, pair=found.names, distance=distance)
