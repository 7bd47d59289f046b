"""Which two bodies come nearest at each row of a motion, and where: for pictures, no evidence.

Coal is called only where two bodies may be the nearest. From row to row their distance changes by
at most the way M that a point of one moves as seen from the other (`motion`), so what was measured
at one row bounds the distance at all others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array, Mask
from feasibility.certification.collisions.collision_replay import couples_of
from feasibility.certification.collisions.motion import ArmMotion
from feasibility.certification.collisions.pairing import Pairing
from feasibility.collisions.problem_bodies import Bodies
from robots.robot import Robot

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
    have no inside here: this is for motions q (m, n), m >= 1, that were accepted.

    Raises:
        ArgumentError: a pair names what has no body.
    """
    if not bodies.pairs:
        return None
    motion = ArmMotion(robot, np.repeat(q, 2, axis=0) if len(q) == 1 else q)
    pairings = couples_of(bodies).along(motion)
    distances, found = _searched(pairings, len(q))
    names = list(dict.fromkeys(pairings[k].names for k in found))
    which = np.array([names.index(pairings[k].names) for k in found], dtype=np.intp)
    lines = (_lines(name, pairings, found, which == k) for k, name in enumerate(names))
    return NearestAlong(distances, which, tuple(lines))


def _searched(pairings: list[Pairing], count: int) -> tuple[Array, NDArray[np.intp]]:
    """(m,) the least distance at each row, m, and the pairing that it is of."""
    distances, found = np.full(count, np.inf), np.zeros(count, dtype=np.intp)
    low = np.stack([np.append(one.low, one.low[-1])[:count] for one in pairings])
    for row in range(count):
        known = set[int]()
        while True:
            k = int(np.argmin(low[:, row]))
            if low[k, row] >= distances[row]:
                break
            one = pairings[k]  # of meshes the hulls, first
            exactly = one.convex or k in known
            distance = one.lines(np.array([float(row)]), hulls=not exactly)[0][0]
            low[k] = np.maximum(low[k], distance - np.abs(one.way - one.way[row])[:count])
            known.add(k)
            if exactly and distance < distances[row]:
                distances[row], found[row] = distance, k
    return distances, found


def _lines(names: Names, pairings: list[Pairing], found: NDArray[np.intp], here: Mask) -> NearPair:
    """The lines of one pair, with one more behind each run of its rows."""
    behind = np.flatnonzero(here[:-1] & ~here[1:]) + 1
    of = np.where(here, found, -1)
    of[behind] = found[behind - 1]
    rows = np.flatnonzero(of >= 0)
    lines = []
    for row in rows.tolist():
        one = pairings[of[row]]
        (ends,), frames = one.lines(np.array([float(row)]))[1], one.motion.frames
        at = row, one.a.joint
        lines.append(ends @ frames.rotations[at].T + frames.points[at])
    return NearPair(names, rows, np.array(lines))
