"""Certified clearance of two bodies along a motion.

First, planes between the whole bodies are tried (`parting`): across the line between the centres,
then across that of coal's nearest points at the stretch with the lowest bound, each on all
stretches at once. Many triangles are looked at box by box instead (`descent`). What is left is cut:
meshes into ever smaller parts, and last the stretch in time. Where the hull of a link's mesh is too
large, the distances of the mesh itself decide (`budgets`).

A plane certifies bodies with all that is inside them. Triangles of a closed mesh have no inside:
where they are used, neither body may begin inside the other. As their distance never vanishes,
neither gets there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coverable_arrays import Array, Mask
from feasibility.certification.collisions.budgets import Budget, TooNear
from feasibility.certification.collisions.descent import Descent, rough_bounds
from feasibility.certification.collisions.inside import one_inside_other
from feasibility.certification.collisions.mesh_pieces import MeshPart
from feasibility.certification.collisions.parting import by_balls, guesses, lows, parted
from feasibility.certification.collisions.pieces import (
    COAL,
    FEW,
    Below,
    Piece,
    can_be_cut,
    coal_distance,
    cut,
    is_exact,
)
from feasibility.certification.collisions.plane_search import NEAR, Couples
from feasibility.certification.collisions.relative_motion import ArmMotion, Stretches

ROUNDING = 1e-9  # [m] of placements, and what keeps distances from vanishing
FAILURES = 3  # of coal's directions in a row, after which something else is tried
PATIENCE, TIRED = 4, 0.92  # stretches measured, after which that share is aimed at
ENOUGH = 0.75  # [1] share of what is aimed at, which will do of the hulls of meshes
HALVINGS = 3  # of stretches that no plane parts from a triangle, before coal is called
LOOKS = 3  # at stretches that no plane parts from triangles: are they too near?
SHORTEST = 2.0**-24  # [1] share of a segment, below which a stretch is not halved again
CALLS = (500, 20)  # most coal calls for two bodies: so many, and so many for each segment

Task = tuple[Piece, Piece, Stretches]
"""Two pieces, and stretches along which they are not certified yet."""


@dataclass(frozen=True, slots=True)
class Place:
    """An instant at which two bodies are too near, or where that was not decided."""

    row: int
    share: float
    """How far the motion has come from that row to the next, 0..1."""
    distance: float
    """m, between them; as deep as they overlap where it is negative; NaN where not decided."""
    inside: bool = False
    """Is one of them wholly within the other?"""


@dataclass(frozen=True, eq=False, slots=True)
class Measured:
    """What coal says of two pieces at an end of a stretch."""

    stretch: int
    end: bool
    distance: float
    """m, negative where they overlap."""
    n: Array | None
    """(3,) from the first piece to the other; None where they touch."""


class Pairing:
    """Two bodies, the stretches of one motion, and what is known of their distance."""

    def __init__(
        self, a: Piece, b: Piece, joints: tuple[int, int], motion: ArmMotion, stretches: Stretches
    ) -> None:
        """Bodies a and b, carried by `joints` (i, j), i <= j, and the segments of the motion."""
        self.a, self.b, self.joints, self.motion = a, b, joints, motion
        self.calls = 0
        self.bound = np.inf
        """m, certified lower bound of their distance along what is accepted so far."""
        self.place: Place | None = None
        """Why it is refused."""
        self._most = CALLS[0] + CALLS[1] * len(motion.q)
        self.stretches = stretches
        self.hints = stretches.bound
        """(m - 1,) m, about how near they come along each segment, or nearer."""

    def guess(self) -> float:
        """Improve the bounds without coal; how near (m) the bodies seem to come, at least."""
        s = self.stretches
        if isinstance(self.a, MeshPart) and self.a.triangles > FEW:
            self.hints = rough_bounds(self.a.tree, self.b, s)
            if not self.a.closed:
                self.stretches = replace(s, bound=np.maximum(s.bound, self.hints))
        else:
            for n in guesses(self.a, self.b, s):
                s = _raised(self.a, self.b, s, n)
            self.stretches, self.hints = s, s.bound
        return float(self.hints.min())

    def meet(self) -> float:
        """The distance (m) at the row that seemed worst when it was guessed, by coal.

        That of the bodies themselves: their hulls may be much nearer.
        """
        s = self.stretches
        measured = self._measured(self.a, self.b, s, int(np.argmin(self.hints)))
        if not (isinstance(self.a, MeshPart) and self.a.triangles > FEW):
            self.stretches = _raised_along(self.a, self.b, s, measured, np.inf)
        if is_exact(self.a, self.b):
            return measured.distance
        pose = s.first.of(np.array([measured.stretch]))
        self.calls += 1
        return coal_distance(self.a.truth, self.b.truth, pose.rotations[0], pose.points[0])[0]

    def certify(self, needed: float, aim: float) -> None:
        """Certify `needed` (m) everywhere, and `aim` >= needed where that takes little.

        Sets `bound` and, where it is refused, `place`.
        """
        self.bound, self.place = np.inf, None
        needed, aim = needed + ROUNDING, aim + ROUNDING
        tasks = [(self.a, self.b, self._accepted(self.stretches, aim))]
        while tasks and self.place is None:
            a, b, s = tasks.pop()
            if len(s.row):
                tasks += self._looked_at(a, b, s, needed, aim)

    def _looked_at(self, a: Piece, b: Piece, s: Stretches, needed: float, aim: float) -> list[Task]:
        """Certify stretches as far as it goes; what is left to do. May set `place`."""
        whole = a is self.a and b is self.b
        if isinstance(a, MeshPart) and a.triangles > FEW:
            inside = whole and self._begins_inside(s, needed)
            return [] if inside else self._box_by_box(a, b, s, needed, aim)
        if not whole or (s.length < 1.0).any():
            s = self._cheaply(a, b, s, aim)
        s = self._by_coal(a, b, s, needed, aim)
        if self.place is not None or not len(s.row):
            return []
        if whole and self._begins_inside(s, needed):
            return []
        if can_be_cut(a, b):
            return [(*pieces, s) for pieces in cut(a, b)]
        if is_exact(a, b):
            s = self._accepted(s, needed, (s.length <= 0.25) & (s.bound >= needed))
            if len(s.row) and (s.length.min() < SHORTEST or self.calls > self._most):
                self.place = _middle(s)
                return []
        else:  # hulls may be near where the bodies are not
            enough = max(needed, ENOUGH * aim)
            s = self._accepted(s, enough, (s.length <= 0.25) & (s.bound >= enough))
            curved = (s.length > 0.25) & (s.bound + s.delta >= enough)
            if not curved.all():
                self._by_budget(a.truth, b.truth, s.of(~curved), needed, aim)
            s = s.of(curved)
        return [(a, b, self.motion.halves(s, *self.joints))] if len(s.row) else []

    def _accepted(self, s: Stretches, wanted: float, also: Mask | None = None) -> Stretches:
        """Keep the lowest of the bounds that will do; the stretches that are left."""
        good = s.bound >= wanted if also is None else also
        self.bound = min(self.bound, float(np.min(s.bound[good], initial=np.inf)))
        return s.of(~good)

    def _cheaply(self, a: Piece, b: Piece, s: Stretches, aim: float) -> Stretches:
        """Certify by balls, the planes of longer stretches, and guessed directions."""
        s = self._accepted(replace(s, bound=np.maximum(s.bound, by_balls(a, b, s))), aim)
        for n in (s.across, *guesses(a, b, s)) if len(s.row) else ():
            s = _raised(a, b, s, n)
        return self._accepted(s, aim)

    def _by_coal(self, a: Piece, b: Piece, s: Stretches, needed: float, aim: float) -> Stretches:
        """Certify by directions from coal; what is left, with its bounds. May set `place`."""
        exact, whole = is_exact(a, b), a is self.a and b is self.b
        left, failures, asked = [s.of(np.zeros(len(s.row), dtype=bool))], 0, 0
        while len(s.row) and not (failures >= FAILURES and (can_be_cut(a, b) or not exact)):
            if not can_be_cut(a, b):  # a plane is there, and shorter stretches are less curved
                curved = (s.bound < aim) & (s.bound + s.delta >= aim) & (s.delta > ROUNDING)
                left.append(s.of(curved))
                s = s.of(~curved)
                if not len(s.row):
                    break
            asked += 1
            if asked == PATIENCE:
                aim = max(needed, TIRED * aim)
            worst = int(np.argmin(s.bound))
            for end in (False, True):
                measured = self._measured(a, b, s, worst, end)
                if whole and exact:  # no higher bound can be found than what was measured
                    aim = max(needed, min(aim, NEAR * measured.distance))
                if exact and self._too_near(a, b, s, measured, needed):
                    return s
                s = _raised_along(a, b, s, measured, aim)
                if measured.n is None or s.bound[worst] >= aim or s.delta[worst] < ROUNDING:
                    break
            if s.bound[worst] < aim:
                failures += 1
                left.append(s.of(np.array([worst])))
                s = s.of(np.arange(len(s.row)) != worst)
            else:
                failures = 0
            s = self._accepted(s, aim)
        return Stretches.join(*left, s)

    def _box_by_box(
        self, a: MeshPart, b: Piece, s: Stretches, needed: float, aim: float
    ) -> list[Task]:
        """Certify many triangles; which of them are left to do. May set `place`."""
        descent = Descent(a.tree, b, needed, aim)
        couples = descent.parted(s)
        exact = is_exact(a, b)
        if exact and self._measured_too_near(a, b, s, couples, needed):
            return []
        for _ in range(HALVINGS if exact and len(couples.at) else 0):
            used, at = np.unique(couples.at, return_inverse=True)
            s = self.motion.halves(s.of(used), *self.joints)
            boxes, low = np.tile(couples.boxes, 2), np.tile(couples.low, 2)
            halves = Couples(np.concatenate([at, at + len(used)]), boxes, low)
            couples = descent.again(s, halves)
        good = couples.low >= (needed if exact else aim)
        descent.keep(couples, good)
        self.bound = min(self.bound, descent.bound)
        left = couples.of(~good)
        if exact:
            return [
                (a.of(a.tree.last[[box]]), b, s.of(left.at[left.boxes == box]))
                for box in np.unique(left.boxes)
            ]
        if len(left.at):
            triangles, rest = a.of(a.tree.last[np.unique(left.boxes)]), s.of(np.unique(left.at))
            self._by_budget(triangles, b.truth, rest, needed, aim)
        return []

    def _measured_too_near(
        self, a: Piece, b: Piece, s: Stretches, couples: Couples, needed: float
    ) -> bool:
        """Are they nearer than needed at the worst of what no plane parts? Sets `place` if so."""
        worst = couples.of(couples.low < needed)
        at = worst.at[np.argsort(worst.low)]
        for k in at[np.sort(np.unique(at, return_index=True)[1])][:LOOKS]:
            for end in (False, True):
                if self._too_near(a, b, s, self._measured(a, b, s, int(k), end), needed):
                    return True
        return False

    def _measured(self, a: Piece, b: Piece, s: Stretches, k: int, end: bool = False) -> Measured:
        """Ask coal at an end of stretch k."""
        poses = (s.last if end else s.first).of(np.array([k]))
        if isinstance(a, Below):
            n = a.thin[None]
            return Measured(k, end, float(lows(b, poses, n)[0] - a.support(n)[0]), n[0])
        self.calls += 1
        distance, near_a, near_b = coal_distance(a, b, poses.rotations[0], poses.points[0])
        apart = near_b - near_a
        length = float(np.linalg.norm(apart))
        clear = distance > 0.0 and length > 0.0
        return Measured(k, end, distance, apart / length if clear else None)

    def _too_near(
        self, a: Piece, b: Piece, s: Stretches, measured: Measured, needed: float
    ) -> bool:
        """Are exact pieces nearer than `needed` where they were measured? Sets `place` if so.

        What coal calls far enough, but no plane of its own shows, is at the edge to rounding.
        """
        k, deviation = measured.stretch, float(s.deviation[measured.stretch])
        near = measured.distance - deviation < needed
        if not near and measured.n is not None and not can_be_cut(a, b):
            poses, n = (s.last if measured.end else s.first).of(np.array([k])), measured.n[None]
            near = float(lows(b, poses, n)[0] - a.support(n)[0]) - deviation < needed
        if near:
            row, share = int(s.row[k]), float(s.share[k] + (s.length[k] if measured.end else 0.0))
            over = share == 1.0
            self.place = Place(row + over, 0.0 if over else share, measured.distance)
        return near

    def _by_budget(self, a: Piece, b: Piece, s: Stretches, needed: float, aim: float) -> None:
        """Certify meshes by their distances alone; sets `bound`, or `place`."""
        whole = self.stretches

        def distance(row: int, share: float) -> float:
            self.calls += 1
            pose = self.motion.pose(*self.joints, row, share)
            return coal_distance(a, b, pose.rotations[0], pose.points[0])[0] - COAL

        moved = np.zeros(len(self.motion.q) - 1)
        moved[whole.row] = whole.moved
        budget = Budget(distance, moved, self._most - self.calls)
        rows, first = np.unique(s.row, return_index=True)
        try:
            bound = budget.certify(rows, needed + s.deviation[first], aim)
            self.bound = min(self.bound, bound - float(s.deviation.max()))
        except TooNear as near:
            pose = self.motion.pose(*self.joints, near.row, near.share)
            depth = coal_distance(self.a, self.b, pose.rotations[0], pose.points[0])[0]
            overlap = near.distance <= 0.0
            self.place = Place(near.row, near.share, min(depth, 0.0) if overlap else near.distance)

    def _begins_inside(self, s: Stretches, needed: float) -> bool:
        """Is one body inside the other at the first row? Sets `place` if so."""
        at = np.flatnonzero((s.row == 0) & (s.share == 0.0) & (s.bound < needed))
        if not len(at):
            return False
        pose = s.first.of(at[:1])
        if one_inside_other(self.a.truth, self.b.truth, pose.rotations[0], pose.points[0]):
            distance = coal_distance(self.a, self.b, pose.rotations[0], pose.points[0])[0]
            self.place = Place(0, 0.0, min(distance, 0.0), inside=True)
        return self.place is not None


def _raised_along(a: Piece, b: Piece, s: Stretches, measured: Measured, aim: float) -> Stretches:
    """Stretches with the bounds that the plane where bodies were measured gives, below `aim`.

    It stays with the first body on all of them, or turns with the other: as a link swings about
    the base, so does the plane between them.
    """
    if measured.n is None:
        return s
    there = (s.last if measured.end else s.first).rotations[measured.stretch]
    s = _raised(a, b, s, measured.n)
    if (s.bound >= aim).all():
        return s
    return _raised(a, b, s, s.first.rotations @ (there.T @ measured.n))


def _raised(a: Piece, b: Piece, s: Stretches, n: Array) -> Stretches:
    """Stretches with the bounds that planes across n, (3,) or (k, 3), give."""
    found = parted(a, b, s, n)
    better = (found > s.bound)[:, None]
    across = np.where(better, n, s.across)
    return replace(s, bound=np.maximum(s.bound, found), across=across)


def _middle(s: Stretches) -> Place:
    """Where the shortest of stretches is, which could not be certified."""
    k = int(np.argmin(s.length))
    return Place(int(s.row[k]), float(s.share[k] + 0.5 * s.length[k]), np.nan)
