"""How far couples of bodies stay apart by the balls and boxes around them, all couples at once.

Most bodies of an arm are far from each other all along a motion, and need no more than this.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coverable_arrays import Array
from feasibility.certification.collisions.pieces import Piece
from feasibility.certification.collisions.relative_motion import ArmMotion, Stretches


@dataclass(frozen=True, eq=False, slots=True)
class Body:
    """One body with its owner's joint."""

    joint: int
    piece: Piece
    deviation: float
    """m, how far it may stand out from the piece."""


class CoupledBodies:
    """Couples of bodies in plain numbers, whatever the motion."""

    def __init__(self, couples: Sequence[tuple[Body, Body]]) -> None:
        """The first body of each couple is the one nearer to the root."""
        numbers: dict[int, int] = {}
        bodies: list[Body] = []
        for body in (body for couple in couples for body in couple):
            if numbers.setdefault(id(body), len(bodies)) == len(bodies):
                bodies.append(body)
        self.couples = np.array([(numbers[id(a)], numbers[id(b)]) for a, b in couples])
        """(c, 2) two bodies each."""
        self.joints = np.array([body.joint for body in bodies], dtype=np.intp)
        """(B,) which joint carries each body."""
        self.centres = np.array([body.piece.centre for body in bodies])
        """(B, 3) m, of a ball and a box around each."""
        self.balls = np.array([body.piece.ball for body in bodies])
        """(B,) m, radii."""
        self.halves = np.array([body.piece.half for body in bodies])
        """(B, 3) m, half the sides of boxes."""


class FirstLook:
    """Couples of bodies along one motion."""

    def __init__(self, motion: ArmMotion, known: CoupledBodies) -> None:
        """Bound the distances of all of them."""
        self._motion, self._known = motion, known
        # A half space, whose ball has no end, is at rest.
        finite = np.where(np.isfinite(known.balls), known.balls, 0.0)
        self._moving = motion.body_motions(known.joints, known.centres, finite)
        self.low: Array = motion.outer_bounds(
            self._moving, known.joints, known.centres, known.balls, known.halves, known.couples
        )
        """(c, m - 1) m, lower bounds of each couple's distance along each segment."""

    def stretches(self, couple: int) -> Stretches:
        """The segments, as the second body of a couple moves as seen from the first."""
        a, b = self._known.couples[couple].tolist()
        joints = int(self._known.joints[a]), int(self._known.joints[b])
        return self._motion.stretches_of(self._moving, *joints, b, self.low[couple])
