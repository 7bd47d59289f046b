"""How far couples of bodies stay apart by the balls and boxes around them, all couples at once.

Most bodies of an arm are far from each other all along a motion, and need no more than this.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.collisions.pieces import Piece
from feasibility.certification.collisions.relative_motion import Motion, Stretches

Array = NDArray[np.float64]


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
        self._couples = np.array([(numbers[id(a)], numbers[id(b)]) for a, b in couples])
        self._joints = np.array([body.joint for body in bodies], dtype=np.intp)
        centres = np.array([body.piece.centre for body in bodies])
        balls = np.array([body.piece.ball for body in bodies])
        # A half space, whose ball has no end, is at rest.
        finite = np.where(np.isfinite(balls), balls, 0.0)
        self._sways = motion.sways(self._joints, centres, finite)
        halves = np.array([body.piece.half for body in bodies])
        self.low: Array = motion.outer_bounds(
            self._sways, self._joints, centres, balls, halves, self._couples
        )
        """(k, m - 1) m, lower bounds of each couple's distance along each segment."""

    def stretches(self, couple: int) -> Stretches:
        """The segments, as the second body of a couple moves as seen from the first."""
        a, b = self._couples[couple].tolist()
        joints = int(self._joints[a]), int(self._joints[b])
        return self._motion.stretches_of(self._sways, *joints, b, self.low[couple])
