"""Certified clearance of two bodies along a motion, by planes between them.

Seen from body a, the points of body b move nearly along chords (`relative_motion`). So, for any
unit vector n, their distance along a stretch is at least

    min(low(0), low(1)) - h_a(n) - delta - stray,    low(s) = n . t(s) - h_b(-R(s)^T n),

with h the supports of `pieces`, and R, t the pose of b at an end of the stretch. That n parts them
is checked by this formula alone; it does not matter where n is from. First comes the line between
the centres, then coal's nearest points at the stretch with the lowest bound, each tried on all
stretches at once. What they do not certify is cut: sheets and meshes of the scene into ever smaller
parts, and last the stretch in time. Where the hull of a link's mesh is too large, the distances of
the mesh itself decide (`budgets`).

A plane certifies bodies with all that is inside them. Triangles of a closed mesh have no inside:
where they are used, neither body may begin inside the other. As their distance never vanishes,
neither gets there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.collisions.budgets import Budget, TooNear
from feasibility.certification.collisions.inside import one_inside_other
from feasibility.certification.collisions.pieces import Below, Piece
from feasibility.certification.collisions.relative_motion import (
    Motion,
    Poses,
    Stretches,
    joined,
)

Array = NDArray[np.float64]

NEAR = 0.9  # [1] share of the distances met, that is aimed at where it costs little
ROUNDING = 1e-9  # [m] of placements, and what keeps distances from vanishing
COAL = 1e-6  # [m] more than coal's distances are off, which stops at GJK = 1e-8
GJK = 1e-8  # [m]
FAILURES = 3  # of coal's directions in a row, after which another way is taken
FEW = 8  # triangles, into no less of which a sheet is cut for a hull, which is larger than its mesh
SHORTEST = 2.0**-24  # [1] share of a segment, below which a stretch is not halved again
CALLS = (500, 20)  # most coal calls for two bodies: so many, and so many for each segment


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


class Pairing:
    """Two bodies, the stretches of one motion, and what is known of their distance."""

    def __init__(self, a: Piece, b: Piece, joints: tuple[int, int], motion: Motion) -> None:
        """Bodies a and b, carried by `joints` (i, j), i <= j."""
        self.a, self.b, self.joints, self.motion = a, b, joints, motion
        self.stretches = motion.stretches(*joints, b.centre, b.ball)
        self.calls = 0
        self.bound = np.inf
        """m, certified lower bound of their distance along what is accepted so far."""
        self.place: Place | None = None
        """Why it is refused."""
        bound = _by_balls(a, b, self.stretches)
        self.stretches = replace(self.stretches, bound=bound)

    def glance(self) -> float:
        """Improve the bounds by two directions; a distance (m) at the row that seems worst.

        The distance is that of the hulls, a hint of how near the bodies are at all.
        """
        s = self.stretches
        if not len(s.row):
            return np.inf
        bound = s.bound
        for guess in _guesses(self.a, self.b, s):
            bound = np.maximum(bound, _parted(self.a, self.b, s, guess))
        distance, n = self._asked(self.a, self.b, s, int(np.argmin(bound)), False)
        if n is not None:
            bound = np.maximum(bound, _parted(self.a, self.b, s, n))
        self.stretches = replace(s, bound=bound)
        return distance

    def certify(self, needed: float, aim: float) -> None:
        """Certify `needed` (m) everywhere, and `aim` >= needed where that takes little.

        Sets `bound` and, where it is refused, `place`.
        """
        needed, aim = needed + ROUNDING, aim + ROUNDING
        tasks = [(self.a, self.b, self._accepted(self.stretches, aim))]
        while tasks and self.place is None:
            a, b, s = tasks.pop()
            if not len(s.row):
                continue
            if a is not self.a or b is not self.b:
                s = self._cheaply(a, b, s, aim)
            s = self._by_coal(a, b, s, needed, aim)
            if self.place is not None or not len(s.row):
                continue
            if (a is self.a and b is self.b) and self._begins_inside(s, needed):
                return
            if _can_be_cut(a, b):
                tasks += _cut(a, b, s)
                continue
            if not _is_exact(a, b):
                self._by_budget(a.truth, b.truth, s, needed, aim)
                continue
            s = self._accepted(s, needed, (s.length <= 0.25) & (s.bound >= needed))
            if len(s.row) and (s.length.min() < SHORTEST or self.calls > self._most()):
                self.place = _middle(s)
                return
            tasks.append((a, b, self.motion.halves(s, *self.joints)))

    def _accepted(
        self, s: Stretches, wanted: float, also: NDArray[np.bool_] | None = None
    ) -> Stretches:
        """Keep the lowest of the bounds that will do; the stretches that are left."""
        good = s.bound >= wanted if also is None else also
        self.bound = min(self.bound, float(np.min(s.bound[good], initial=np.inf)))
        return s.of(~good)

    def _cheaply(self, a: Piece, b: Piece, s: Stretches, aim: float) -> Stretches:
        """Certify by balls and by guessed directions."""
        s = self._accepted(replace(s, bound=np.maximum(s.bound, _by_balls(a, b, s))), aim)
        for n in _guesses(a, b, s) if len(s.row) else ():
            s = replace(s, bound=np.maximum(s.bound, _parted(a, b, s, n)))
        return self._accepted(s, aim)

    def _by_coal(self, a: Piece, b: Piece, s: Stretches, needed: float, aim: float) -> Stretches:
        """Certify by directions from coal; what is left, with its bounds. May set `place`."""
        left, failures = [s.of(np.zeros(len(s.row), dtype=bool))], 0
        while len(s.row) and not (
            failures >= FAILURES and (_can_be_cut(a, b) or not _is_exact(a, b))
        ):
            worst = int(np.argmin(s.bound))
            for end in (False, True):
                distance, n = self._asked(a, b, s, worst, end)
                if (
                    a is self.a and b is self.b and _is_exact(a, b)
                ):  # no higher bound can be found than what was met
                    aim = max(needed, min(aim, NEAR * distance))
                if _is_exact(a, b) and self._too_near(a, b, s, worst, end, distance, n, needed):
                    return s
                if n is not None:
                    s = replace(s, bound=np.maximum(s.bound, _parted(a, b, s, n)))
                if n is None or s.bound[worst] >= aim or s.delta[worst] < ROUNDING:
                    break
            if s.bound[worst] < aim:
                failures += 1
                left.append(s.of(np.array([worst])))
                s = s.of(np.arange(len(s.row)) != worst)
            else:
                failures = 0
            s = self._accepted(s, aim)
        return _all_of([*left, s])

    def _asked(
        self, a: Piece, b: Piece, s: Stretches, k: int, end: bool
    ) -> tuple[float, Array | None]:
        """Coal's distance (m) at an end of stretch k, and the direction from a to b as (m, 3)."""
        poses = s.last if end else s.first
        rotation, point = poses.rotations[k], poses.points[k]
        if isinstance(a, Below):
            low = _lows(b, Poses(rotation[None], point[None]), a.thin[None])
            return float(low[0] - a.support(a.thin[None])[0]), a.thin[None].repeat(len(s.row), 0)
        self.calls += 1
        distance, near_a, near_b = coal_distance(a, b, rotation, point)
        apart = near_b - near_a
        length = float(np.linalg.norm(apart))
        if not (distance > 0.0 and length > 0.0):
            return distance, None
        return distance, (apart / length)[None].repeat(len(s.row), 0)

    def _too_near(
        self,
        a: Piece,
        b: Piece,
        s: Stretches,
        k: int,
        end: bool,
        distance: float,
        n: Array | None,
        needed: float,
    ) -> bool:
        """Are exact pieces nearer than `needed` at an end of stretch k? Sets `place` if so.

        What coal calls far enough, but no plane of its own shows, is at the edge to rounding.
        """
        stray = float(s.stray[k])
        near = distance - stray < needed
        if not near and n is not None and not _can_be_cut(a, b):
            poses = (s.last if end else s.first).of(np.array([k]))
            near = float(_lows(b, poses, n[:1])[0] - a.support(n[:1])[0]) - stray < needed
        if near:
            self.place = _place(s, k, end, distance)
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
        budget = Budget(distance, moved, self._most() - self.calls)
        try:
            bound = budget.certify(s.row, needed + s.stray, aim)
            self.bound = min(self.bound, bound - float(s.stray.max()))
        except TooNear as met:
            pose = self.motion.pose(*self.joints, met.row, met.share)
            depth = coal_distance(self.a, self.b, pose.rotations[0], pose.points[0])[0]
            overlap = met.distance <= 0.0
            self.place = Place(met.row, met.share, min(depth, 0.0) if overlap else met.distance)

    def _most(self) -> int:
        """How often coal may be asked."""
        return CALLS[0] + CALLS[1] * len(self.motion.q)

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


def _is_exact(a: Piece, b: Piece) -> bool:
    """Are they no larger than the bodies? For a half space, a hull is its mesh."""
    return isinstance(a, Below) or (a.exact and b.exact)


def _can_be_cut(a: Piece, b: Piece) -> bool:
    """May smaller pieces be clear where these are not?"""
    return not isinstance(a, Below) and (_worth_cutting(a, b) or _worth_cutting(b, a))


def _worth_cutting(piece: Piece, other: Piece) -> bool:
    """Has it parts, and not so few triangles that the other's hull is what hinders?"""
    return bool(piece.parts) and (other.exact or not piece.exact or piece.triangles > FEW)


def _cut(a: Piece, b: Piece, s: Stretches) -> list[tuple[Piece, Piece, Stretches]]:
    """The larger of two pieces that are worth it, cut into its parts."""
    if _worth_cutting(a, b) and (a.ball >= b.ball or not _worth_cutting(b, a)):
        return [(part, b, s) for part in a.parts]
    return [(a, part, s) for part in b.parts]


def _all_of(parts: list[Stretches]) -> Stretches:
    """Several sets of stretches as one."""
    whole = parts[0]
    for part in parts[1:]:
        whole = joined(whole, part)
    return whole


def _place(s: Stretches, k: int, end: bool, distance: float) -> Place:
    """An end of stretch k."""
    row, share = int(s.row[k]), float(s.share[k] + (s.length[k] if end else 0.0))
    return Place(row + 1, 0.0, distance) if share == 1.0 else Place(row, share, distance)


def _middle(s: Stretches) -> Place:
    """Where the shortest of stretches is, which could not be certified."""
    k = int(np.argmin(s.length))
    return Place(int(s.row[k]), float(s.share[k] + 0.5 * s.length[k]), np.nan)


def _lows(b: Piece, poses: Poses, n: Array) -> Array:
    """(k,) m, least n . x over the points of b, for directions (k, 3)."""
    turned = np.einsum("kji,kj->ki", poses.rotations, n)
    return np.einsum("ki,ki->k", n, poses.points) - b.support(-turned)


def _parted(a: Piece, b: Piece, s: Stretches, n: Array) -> Array:
    """(k,) m, how far the planes across n (k, 3) part a and b along stretches, see the module."""
    if isinstance(a, Below):
        n = np.broadcast_to(a.thin, n.shape)
    low = np.minimum(_lows(b, s.first, n), _lows(b, s.last, n))
    return np.asarray(low - a.support(n) - s.delta - s.stray)


def _guesses(a: Piece, b: Piece, s: Stretches) -> list[Array]:
    """Directions (k, 3) that cost nothing: between the centres, and across thin parts of a mesh."""
    ahead = 0.5 * (s.first.moved(b.centre) + s.last.moved(b.centre)) - a.centre
    away = np.linalg.norm(ahead, axis=1, keepdims=True)
    found = [np.where(away > 0.0, ahead / np.where(away > 0.0, away, 1.0), [0.0, 0.0, 1.0])]
    if a.thin is not None:
        found.append(np.where(ahead @ a.thin >= 0.0, 1.0, -1.0)[:, None] * a.thin)
    return found


def _by_balls(a: Piece, b: Piece, s: Stretches) -> Array:
    """(k,) m, distances of balls around a and b along stretches, at least."""
    start = s.first.moved(b.centre) - a.centre
    way = s.last.moved(b.centre) - a.centre - start
    square = np.maximum((way**2).sum(axis=1), np.finfo(float).tiny)
    nearest = np.clip(-(start * way).sum(axis=1) / square, 0.0, 1.0)
    away = np.linalg.norm(start + nearest[:, None] * way, axis=1)
    return np.asarray(away - a.ball - b.ball - s.delta - s.stray)


@cache
def _coal() -> tuple[Any, Any, Any]:
    """Coal's module, and a request that keeps to its tolerances."""
    import coal

    request = coal.DistanceRequest()
    request.enable_signed_distance, request.gjk_tolerance = True, GJK
    return coal, request, coal.DistanceResult


def coal_distance(a: Piece, b: Piece, rotation: Array, point: Array) -> tuple[float, Array, Array]:
    """Coal's distance (m) of two pieces, b at a pose in the frame of a, and its nearest points."""
    coal, request, result_of = _coal()
    result = result_of()
    pose_a = coal.Transform3s(a.placement[:3, :3], a.placement[:3, 3])
    turned = rotation @ b.placement[:3, :3]
    pose_b = coal.Transform3s(turned, rotation @ b.placement[:3, 3] + point)
    distance = coal.distance(a.geometry, pose_a, b.geometry, pose_b, request, result)
    return float(distance), result.getNearestPoint1(), result.getNearestPoint2()
