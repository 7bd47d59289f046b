"""Certified clearance of two bodies along a motion.

Seen from body a, no point of body b moves further than M along a stretch of the motion (`motion`).
So where the two are further apart than c + M / 2 in its middle, they are nowhere nearer than c
(Schwarzer, Saha and Latombe 2005). And as points of b keep to their chords but for delta, a plane
across n parts the bodies all along a stretch by

    min(low(0), low(1)) - h_a(n) - delta,    low(s) = n . t(s) - h_b(-R(s)^T n),

with h the supports of `shapes`, and R, t the pose of b at an end. What joints deviate from straight
lines by, and what bodies stand out by, is taken off both.

Planes are tried on all segments at once, across the line between the centres, then across that of
the nearest points of hulls. What is left is cut in halves, and asked for in its middle: of convex
bodies, how far a plane parts them there; of others, coal, which says yes or no of a margin in a
twentieth of the time that it takes for a distance. A half space has its own plane alone.

A plane certifies bodies with all that is inside them. Triangles have no inside for coal, so of
solid meshes neither body may begin inside the other; as their distance never vanishes, neither
gets there.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.bisection import runs
from feasibility.certification.collisions.judged_shapes import COAL, Body, one_inside_other
from feasibility.certification.collisions.motion import ArmMotion, Chords
from feasibility.collisions.problem_bodies import Pair

ROUNDING = 1e-9  # [m] of placements, and what keeps distances from vanishing
ENOUGH = 0.82  # [1] share of the least distance met, that will do where less is needed
EASY = (1_000, 4)  # coal calls for two bodies, and for each row, after which ...
LITTLE = 0.6  # [1] ... that share of the least distance will do
NEAR = 0.95  # [1] share of the least distance met that planes are to show
COSTLY = 1 << 19  # corners of a hull times segments, from which on one plane is tried for all
FAILURES = 3  # of planes in a row, after which none are tried on whole segments any more
MOST_PARTS = 16  # of a stretch, looked at next
PARTS = 32  # of a motion, in each of which its least distance is looked for
DEEPEST = 2.0**-10  # [1] share of a segment, to which what is refused is looked at
CALLS = (20_000, 1_000)  # most coal calls for two bodies: so many, and so many for each row


class Pairing:
    """Two bodies along one motion, and what is known of their distance."""

    def __init__(self, pair: Pair, a: Body, b: Body, motion: ArmMotion, bends: Chords) -> None:
        """Begin with what balls say: the centre of b keeps to its chords but for delta.

        Body b is on the joint of a or on one behind, unless a is a half space; `bends` are those of
        b seen from a, (m - 1,) each.
        """
        self.a, self.b, self.motion = a, b, motion
        self.names, self.needed = (pair.first, pair.second), pair.clearance
        self._delta, moved, self._off = bends
        straight = motion.chord_lengths(a.joint, b.joint, b.centre, b.ball) + 4.0 * self._delta
        self._poses = rotations, points = motion.poses(a.joint, b.joint)
        """(m, 3, 3) and (m, 3) m, of b seen from a at the rows."""
        self._ahead = rotations @ b.centre + points - a.centre
        start, way = self._ahead[:-1], np.diff(self._ahead, axis=0)
        square = np.maximum((way * way).sum(axis=1), 1e-300)
        share = np.clip(-(start * way).sum(axis=1) / square, 0.0, 1.0)
        away = np.linalg.norm(start + share[:, None] * way, axis=1) - a.ball - b.ball - a.deviation
        self.low = away - b.deviation - self._delta - self._off - ROUNDING
        """(m - 1,) m, lower bounds of their distance along each segment."""
        moved = np.minimum(moved, straight)
        self._rows, self.way = np.arange(len(moved) + 1.0), np.append(0.0, np.cumsum(moved))
        """(m,) m, that no point has moved further since the first row."""
        self.convex = self.a.half_space or (self.a.convex and self.b.convex)
        """Do planes decide? They do for a half space, whatever is above it."""
        self.calls = 0
        self.refused: float | None = None
        """At which instant, in rows, they are too near."""
        self.distance = math.inf
        """m, measured there; NaN where that was not decided."""
        self.inside = False
        """Is one wholly within the other there?"""
        self._aim, self._hulls_part, self.met = self.needed, True, 0.0
        self._failures = FAILURES if self.a.half_space else 0

    @property
    def bound(self) -> float:
        """m, certified along the whole motion, or measured where they are refused."""
        return float(self.low.min()) if self.refused is None else self.distance

    def lines(self, times: Array, hulls: bool = False) -> tuple[Array, Array]:
        """Distances at instants (k,), in rows, on the straight lines between them.

        (k,) m, and the ends (k, 2, 3) m of the shortest lines, seen from a; of overlaps any points.
        With `hulls` of these, which may be nearer.
        """
        a, b, hulls = self.a, self.b, hulls or self.a.half_space
        found, ends = np.empty(len(times)), np.empty((len(times), 2, 3))
        for k, place in enumerate(b.placed(*self._placed(times))):
            self.calls += 1
            found[k], *ends[k] = a.distance(b, place, hulls)
            if found[k] <= 0.0 and not self.convex:  # of triangles that overlap coal knows no depth
                found[k] = min(0.0, a.distance(b, place, hulls=True)[0])
        return found - a.deviation - b.deviation, np.nan_to_num(ends)

    def least_measured(self, finest: float, also: float | None = None) -> tuple[float, float]:
        """An instant, in rows, and the distance (m) there: the least that is met on the motion.

        Looked for at the row with the lowest bound in each of several parts of the motion, and from
        the best of them in ever shorter steps to both sides, down to a `finest` share of a segment.
        It begins at an instant `also`, too: by default where the least was met.
        """
        last = len(self.low)
        parts = np.array_split(self.low, min(PARTS, last))
        begin = np.cumsum([0, *map(len, parts)])[:-1]
        rows = [float(k + np.argmin(part)) for k, part in zip(begin, parts, strict=True)]
        also = self.met if also is None else also
        times = np.append(rows, also if finest < 1.0 else np.floor(also))
        step = 2.0 ** math.ceil(math.log2(last / len(parts)))
        found = self.lines(times)[0]
        while True:
            least, time = float(found.min()), float(times[np.argmin(found)])
            if step < finest:
                return time, least
            times = np.array([time - step, time, time + step]).clip(0.0, last)
            found = np.append(self.lines(times[::2])[0], least)[[0, 2, 1]]
            step *= 0.5

    def certify(self, nearest: float, most: tuple[int, int] = CALLS) -> None:
        """Certify what is needed, and most of what is over it: raise `low`, or refuse.

        The least distance of any two bodies that was met is `nearest` (m). After so many calls, see
        `CALLS`, it is given up, and refused.
        """
        self._aim = max(self.needed, ENOUGH * nearest)
        wanted = max(self.needed, NEAR * nearest)
        if (self.low >= wanted).all():
            return
        if not np.isfinite(self.way[-1] + self._delta.sum() + self._off.sum()):
            return self._refuse(0.0, math.nan)
        self._part(wanted)
        open_ = ~(self.low >= self._aim)
        if not open_.any() or self._begins_inside():
            return
        parts = np.flatnonzero(open_)[:, None] if self.convex else runs(open_)  # one for a plane
        ends = np.array([(part[0], part[-1] + 1.0) for part in parts])
        while len(ends) and self.refused is None:
            if self.calls + len(ends) > most[0] + most[1] * len(self._rows):
                return self._refuse(float(ends[0].mean()), math.nan)
            ends = self._cut(ends)
            if self.calls > EASY[0] + EASY[1] * len(self._rows):
                self._aim = min(self._aim, max(self.needed, LITTLE * nearest))
        if self.refused is None:
            self.low[open_] = np.maximum(self.low[open_], self._aim)

    def look_closer(self, wanted: Array, calls: float) -> None:
        """Raise `low` of an accepted motion to what is wanted (m - 1,) m, or to less.

        By so many calls at most, with which all is certified or nothing.
        """
        most = float(wanted[self.low < wanted].max(initial=self.needed))
        self.certify(most / ENOUGH, (self.calls + int(calls), 0))
        self.refused, self.distance = None, math.inf

    def _part(self, wanted: float) -> None:
        """Raise the bounds of segments by planes between the hulls, up to what is wanted (m).

        A plane is tried on all of them. It stays with a, or turns with b: as a link swings about
        the base, so does the plane between them.
        """
        turns, ahead = len(self.a.corners) * len(self.low) < COSTLY, self._ahead
        tried = self._raised(wanted, ahead[:-1] + ahead[1:] if turns else ahead[:1])
        while self._failures < FAILURES and not tried.all():
            worst = int(np.argmin(np.where(tried, np.inf, self.low)))
            tried |= self.part_at(worst, wanted, turns)
            self._failures = 0 if tried[worst] else self._failures + 1
            tried[worst] = True

    def part_at(self, row: int, wanted: float | Array, turns: bool = False) -> Mask:
        """(m - 1,) which segments have what is wanted (m), with a plane that parts at a row."""
        rotations, points = self._poses
        (apart,), n = self.gaps(rotations[[row]], points[[row]])
        if apart > 0.0:
            self._raised(wanted, n)
            if turns:
                self._raised(wanted, rotations[:-1] @ (rotations[row].T @ n[0]))
        return np.asarray(self.low >= wanted)

    def _raised(self, wanted: float | Array, n: Array) -> Mask:
        """(m - 1,) which segments have what is wanted (m), with planes across n (m - 1 or 1, 3)."""
        some = np.flatnonzero(~(self.low >= wanted))
        ends = np.asarray(np.column_stack([some, some + 1.0]), dtype=float)
        found = self.parted(ends, n if len(n) == 1 else n[some])
        self.low[some] = np.maximum(self.low[some], found)
        return np.asarray(self.low >= wanted)

    def _cut(self, ends: Array) -> Array:
        """What is left to certify of stretches from row to row (k, 2), in parts; may refuse."""
        way = np.interp(ends, self._rows, self.way)
        half, off = 0.5 * (way[:, 1] - way[:, 0]), self._most(self._off, ends)
        within = np.floor(ends[:, 0]) + 1.0 >= ends[:, 1]

        def at(share: Array, some: Any) -> Array:
            first, last = ends[some].T
            along = np.interp(way[some, 0] + share * 2.0 * half[some], self.way, self._rows)
            straight = first + share * (last - first)
            inner = np.where(within[some], straight, along).clip(first, last)
            return np.where(share <= 0.0, first, np.where(share >= 1.0, last, inner))

        middle = at(np.full(len(ends), 0.5), slice(None))
        poses = self.motion.poses(self.a.joint, self.b.joint, middle)
        parts = np.full(len(ends), 2)
        if not self.convex:
            parts = self._parts_by_coal(self.b.placed(*poses), middle, half, off)
        some = (parts > 0) & within & self._hulls_part
        if some.any() and self.refused is None:
            apart, n = self.gaps(*(one[some] for one in poses))
            apart -= off[some] + ROUNDING
            if not (self.convex and self._near(apart, middle[some])):
                self._hulls_part = self.convex or bool((apart >= self._aim).any())
                clear = self.parted(ends[some], n) >= self._aim
                clear |= apart - half[some] >= self._aim
                parts[some] = np.where(clear, 0, parts[some])
        cut = np.repeat(np.arange(len(ends)), parts)
        number = np.arange(len(cut)) - np.repeat(np.cumsum(parts) - parts, parts)
        return np.column_stack([at((number + k) / parts[cut], cut) for k in (0, 1)])

    def _parts_by_coal(self, places: list[Any], middle: Array, half: Array, off: Array) -> Ints:
        """(k,) in how many parts to look at stretches again, by places in their middles.

        None of those that coal calls far enough apart; of others at least as many as will be
        needed, by the distance that it met.
        """
        parts = np.zeros(len(places), dtype=np.int64)
        bodies = off + self.a.deviation + self.b.deviation
        for k, place in enumerate(places):
            self.calls += 1
            found = self.a.meets(self.b, place, float(self._aim + half[k] + bodies[k]))
            if found is not None:
                spare = found - float(bodies[k])
                if self._near(np.array([spare - 2.0 * COAL]), middle[[k]]):
                    break
                room = max(spare - self._aim, half[k] / MOST_PARTS)
                parts[k] = max(2, math.ceil(half[k] / room)) if room > 0.0 else 2
        return parts

    def _near(self, spare: Array, times: Array) -> bool:
        """Look at distances (k,) m at instants: refuse the least, or let it limit what is aimed at.

        They are less all that is taken off.
        """
        worst = int(np.argmin(spare))
        if not spare[worst] >= self.needed:
            self._refuse(*self.least_measured(DEEPEST, float(times[worst])))
            return True
        limit = max(self.needed, ENOUGH * float(spare[worst]))
        if limit < self._aim:
            self._aim, self.met = limit, float(times[worst])
        return False

    def gaps(self, rotations: Array, points: Array) -> tuple[Array, Array]:
        """(k,) m, how far planes part the hulls with b at poses, and their normals (k, 3).

        From a to b, less what bodies stand out by, across the shortest line that coal finds. Where
        they overlap, as deep as that, and any normal.
        """
        n, found = np.tile(self.a.axis, (len(points), 1)), np.ones(len(points))
        self.calls += len(points)
        for k, place in enumerate(() if self.a.half_space else self.b.placed(rotations, points)):
            found[k], here, there = self.a.distance(self.b, place, hulls=True)
            length = float(np.linalg.norm(there - here))
            if length > 0.0:
                n[k] = (there - here) / length
            else:
                found[k] = min(found[k], 0.0)
        apart = self._low(n, rotations, points) - self.a.highest(n)
        apart = np.where(found > 0.0, apart, found)
        return apart - self.a.deviation - self.b.deviation, n

    def parted(self, ends: Array, n: Array) -> Array:
        """(k,) m, how far planes across n (k, 3) part them along stretches (k, 2).

        Each stretch lies within one segment; n has any length, and may be the same (1, 3) for all.
        """
        if not len(ends):
            return np.empty(0)
        length = np.linalg.norm(n, axis=1, keepdims=True)
        n = np.where(length > 0.0, n / np.where(length > 0.0, length, 1.0), [0.0, 0.0, 1.0])
        n = self.a.axis[None] if self.a.half_space else n
        both = n if len(n) == 1 else np.concatenate([n, n])  # at both ends at once
        lows = self._low(both, *self._placed(ends.T.ravel())).reshape(2, -1)
        row = ends[:, 0].astype(np.intp)
        bent = self._delta[row] * (ends[:, 1] - ends[:, 0]) ** 2
        least = lows.min(axis=0) - self.a.highest(n) - bent - self._off[row]
        return np.asarray(least - self.a.deviation - self.b.deviation - ROUNDING)

    def _placed(self, times: Array) -> tuple[Array, Array]:
        """Poses of b at instants, in rows."""
        rows = times.astype(np.intp)
        if (rows != times).any():
            return self.motion.poses(self.a.joint, self.b.joint, times)
        return self._poses[0][rows], self._poses[1][rows]

    def _low(self, n: Array, rotations: Array, points: Array) -> Array:
        """(k,) m, the least that b reaches along n (k, 3) at poses."""
        turned = np.einsum("ki,kij->kj", np.broadcast_to(n, points.shape), rotations)
        return np.asarray((points * n).sum(axis=1) - self.b.highest(-turned))

    def _most(self, values: Array, ends: Array) -> Array:
        """(k,) the most of values (m - 1,) of segments on stretches (k, 2)."""
        first, last = np.floor(ends[:, 0]).astype(np.intp), np.ceil(ends[:, 1]).astype(np.intp)
        borders = np.column_stack([first, np.maximum(last, first + 1)]).ravel()
        return np.asarray(np.maximum.reduceat(np.append(values, 0.0), borders)[::2])

    def _begins_inside(self) -> bool:
        """Is one body inside the other at the first row? Refuses then."""
        if self.low[0] > 0.0 or self.a.half_space:
            return False
        rotations, points = self._poses
        if one_inside_other(self.a, self.b, rotations[0], points[0]):
            self.inside, (place,) = True, self.b.placed(rotations[:1], points[:1])
            self._refuse(0.0, min(self.a.distance(self.b, place, hulls=True)[0], 0.0))
        return self.inside

    def _refuse(self, time: float, distance: float) -> None:
        self.refused, self.distance = time, distance
