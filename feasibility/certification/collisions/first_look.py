"""How far couples of bodies stay apart by the balls around them, all couples at once.

Most bodies of an arm are far from each other all along a motion, and need no more than this.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.collisions.parting import nearest_points
from feasibility.certification.collisions.pieces import Piece
from feasibility.certification.collisions.relative_motion import Motion, Stretches

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

AT_ONCE = 1 << 16  # segments of couples, which keeps the arrays small


@dataclass(frozen=True, eq=False, slots=True)
class Body:
    """One body with its owner's joint."""

    joint: int
    piece: Piece
    deviation: float
    """m, how far it may stand out from the piece."""


class FirstLook:
    """Couples of bodies along one motion."""

    def __init__(self, motion: Motion, couples: Sequence[tuple[Body, Body]]) -> None:
        """The first body of each couple is the one nearer to the root."""
        self._motion = motion
        numbers: dict[int, int] = {}
        bodies: list[Body] = []
        for body in (body for couple in couples for body in couple):
            if numbers.setdefault(id(body), len(bodies)) == len(bodies):
                bodies.append(body)
        self._joints = np.array([body.joint for body in bodies], dtype=np.intp)
        self._centres = np.array([body.piece.centre for body in bodies])
        self._balls = np.array([body.piece.ball for body in bodies])
        self._first = np.array([numbers[id(a)] for a, _ in couples], dtype=np.intp)
        self._second = np.array([numbers[id(b)] for _, b in couples], dtype=np.intp)
        # A half space, whose ball has no end, is at rest.
        finite = np.where(np.isfinite(self._balls), self._balls, 0.0)
        self._sways = motion.sways(self._joints, self._centres, finite)
        self.low: Array = self._ball_bounds()
        """(k, m - 1) m, lower bounds of each couple's distance along each segment."""

    def stretches(self, couple: int) -> Stretches:
        """The segments, as the second body of a couple moves as seen from the first."""
        a, b = self._first[couple], self._second[couple]
        joints = int(self._joints[a]), int(self._joints[b])
        return self._motion.stretches_of(self._sways, *joints, int(b), self.low[couple])

    def _ball_bounds(self) -> Array:
        """See `low`: distances of balls whose centres move along chords, less what they sway."""
        low = np.empty((len(self._first), len(self._motion.q) - 1))
        points = self._motion.centres(self._joints, self._centres)
        most = max(1, AT_ONCE // len(points))
        for joint in np.unique(self._joints[self._first]):
            found = np.flatnonzero(self._joints[self._first] == joint)
            for some in np.split(found, range(most, len(found), most)):
                a, b = self._first[some], self._second[some]
                ahead = self._motion.seen_from(joint, points[:, b]) - self._centres[a]
                chords = nearest_points(ahead[:-1], np.diff(ahead, axis=0))
                away = np.sqrt(np.einsum("mki,mki->mk", chords, chords))
                less = self._sways.delta[joint][:, b] + self._sways.stray[joint][:, b]
                low[some] = (away - less - self._balls[a] - self._balls[b]).T
        return low
