"""Which two bodies come nearest at each row of a motion, and where: for pictures, no evidence.

Coal is called only where two bodies may be the nearest. From row to row their distance changes by
at most the way M that a point of one moves as seen from the other (`relative_motion`), so what was
measured at one row bounds the distance at all others.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from coverable_arrays import Array, Mask
from feasibility.certification.collisions.collision_replay import ready_bodies
from feasibility.certification.collisions.first_look import Body, CoupledBodies, FirstLook
from feasibility.certification.collisions.pieces import Below, coal_distance
from feasibility.certification.collisions.relative_motion import ArmMotion, Stretches
from feasibility.collisions import Bodies
from robots import Kinematics, Robot

Names = tuple[str, str]


@dataclass(frozen=True, eq=False, slots=True)
class NearPair:
    """Two owners of bodies, where they are the nearest of all."""

    names: Names
    rows: NDArray[np.intp]
    """(r,) the rows where they are, rising, and the row behind each run of them."""
    points: Array
    """(r, 2, 3) m, in the root frame: the ends of the shortest line between them."""


@dataclass(frozen=True, eq=False, slots=True)
class NearestAlong:
    """What comes nearest along a motion, row by row."""

    distances: Array
    """(m,) m, of the nearest pair; at most 0 where it overlaps."""
    which: NDArray[np.intp]
    """(m,) index of that pair in `pairs`."""
    pairs: tuple[NearPair, ...]


def nearest_along(robot: Robot, bodies: Bodies, q: Array) -> NearestAlong | None:
    """The nearest pair of bodies at each row of a motion; None where there is no pair.

    Distances are those of the exact bodies, less the deviation of the surface's triangles. Meshes
    have no inside here: this is for motions that were accepted.

    Args:
        robot: the arm.
        bodies: all of the problem.
        q: (m, n) rows, finite, m >= 1.

    Raises:
        ArgumentError: a pair names what has no body.
    """
    if not bodies.pairs:
        return None
    motion = ArmMotion(robot, np.repeat(q, 2, axis=0) if len(q) == 1 else q)
    ready = ready_bodies(bodies)
    named = [
        ((pair.first, pair.second), couple)
        for pair in bodies.pairs
        for couple in ready.couples(pair)
    ]
    look = FirstLook(motion, CoupledBodies([couple for _, couple in named]))
    couples = [
        _Couple(names, *couple, motion, look.stretches(k))
        for k, (names, couple) in enumerate(named)
    ]
    distances, found = _searched(couples, len(q))
    names = list(dict.fromkeys(couples[k].names for k in found))
    which = np.array([names.index(couples[k].names) for k in found], dtype=np.intp)
    frames = Kinematics(robot).joints(q)
    return NearestAlong(
        distances,
        which,
        tuple(
            _lines(name, couples, found, which == k, frames.rotations, frames.points)
            for k, name in enumerate(names)
        ),
    )


class _Couple:
    """One body of each owner of a pair, along one motion."""

    def __init__(
        self, names: Names, first: Body, second: Body, motion: ArmMotion, s: Stretches
    ) -> None:
        """Bodies a and b, carried by `joints` (i, j), i <= j, and the segments of the motion."""
        self.names, self.motion = names, motion
        self.a, self.b = a, b = first.piece, second.piece
        self.deviation = deviation = first.deviation + second.deviation
        self.joints = first.joint, second.joint
        self.exact = isinstance(a, Below) or (a.exact and b.exact)
        self.way = np.concatenate([[0.0], np.cumsum(s.moved)])
        centres = np.concatenate([s.first.moved(b.centre), s.last.moved(b.centre)[-1:]])
        apart = np.linalg.norm(centres - a.centre, axis=1) - a.ball - b.ball - deviation
        self.low = apart
        """(m,) m, the distance at each row is at least this."""

    def measure(self, row: int, exactly: bool) -> float:
        """The distance (m) at a row, of the bodies or of the hulls of meshes; improves `low`."""
        distance = self.line(row, exactly)[0] - self.deviation
        self.low = np.maximum(self.low, distance - np.abs(self.way - self.way[row]))
        return distance

    def line(self, row: int, exactly: bool = True) -> tuple[float, Array]:
        """The distance (m) at a row, and the ends (2, 3) m of the line in the frame of a."""
        pose = self.motion.pose(*self.joints, row, 0.0)
        rotation, point = pose.rotations[0], pose.points[0]
        if isinstance(self.a, Below):
            n = self.a.thin
            own = self.b.farthest(-(rotation.T @ n)[None])[0]
            end = rotation @ own - self.b.radius * n + point
            height = float((end - self.a.centre) @ n)
            return height, np.stack([end - height * n, end])
        a, b = (self.a.truth, self.b.truth) if exactly else (self.a, self.b)
        distance, near_a, near_b = coal_distance(a, b, rotation, point)
        ends = np.stack([near_a, near_b])
        if not (distance > 0.0 and np.isfinite(ends).all()):  # meshes that overlap have no points
            middle = ends.mean(axis=0)
            middle = middle if np.isfinite(middle).all() else rotation @ b.centre + point
            ends = np.stack([middle, middle])
        return distance, ends


def _searched(couples: list[_Couple], count: int) -> tuple[Array, NDArray[np.intp]]:
    """(m,) the least distance at each row, m, and the couple that it is of."""
    distances, found = np.full(count, np.inf), np.zeros(count, dtype=np.intp)
    low = np.stack([couple.low for couple in couples])
    for row in range(count):
        hulls: set[int] = set()
        while True:
            k = int(np.argmin(low[:, row]))
            if low[k, row] >= distances[row]:
                break
            exactly = couples[k].exact or k in hulls
            distance = couples[k].measure(row, exactly)
            low[k] = couples[k].low
            hulls.add(k)
            if exactly and distance < distances[row]:
                distances[row], found[row] = distance, k
    return distances, found


def _lines(
    names: Names,
    couples: list[_Couple],
    found: NDArray[np.intp],
    here: Mask,
    rotations: Array,
    points: Array,
) -> NearPair:
    """The lines of one pair, with one more behind each run of its rows."""
    of = {int(row): int(found[row]) for row in np.flatnonzero(here)}
    for row, behind in pairwise(range(len(here))):
        if here[row] and not here[behind]:
            of[behind] = int(found[row])
    rows = np.array(sorted(of), dtype=np.intp)
    lines = []
    for row in rows:
        couple = couples[of[row]]
        joint = couple.joints[0]
        lines.append(couple.line(row)[1] @ rotations[row, joint].T + points[row, joint])
    return NearPair(names, rows, np.array(lines))
