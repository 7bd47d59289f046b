"""Places of poses: how far along the curve between two of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from coverable.arrays import Array, Ints
from surfaces.places.places import ROUNDING, OffsetSurface, PlacePaths, Places, share_of
from surfaces.toolpaths.arcs import arc_angles, arc_at
from surfaces.toolpaths.pose_surface import PoseSurface

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

NEAREST = 4  # places on curves around a point, whose curves and their neighbours are looked at
TURN = 1e-3  # m: what a turn of the tool by 1 rad counts, where places have to be distinguished


@dataclass(frozen=True, eq=False)
class PosePlaces(OffsetSurface):
    """The places on the curves of some poses; x is (t, 0) on the curve of a pair.

    Instead of normals these are the directions against the tool axis wanted ('outside'), or along
    it ('inside'): what normals are to any other surface.
    """

    poses: PoseSurface

    @property
    def bends_evenly(self) -> bool:
        """See `OffsetSurface.bends_evenly`."""
        return True

    @property
    def least_look(self) -> float:
        """See `OffsetSurface.least_look`."""
        return TURN

    @cached_property
    def _points(self) -> Array:
        """(N, 3) m, target points."""
        return self.poses.placed_points + self.height * self.poses.turned(self.poses.outward)

    @cached_property
    def _directions(self) -> Array:
        """(N, 3) see the class."""
        poses = self.poses
        if poses.axes is None:
            return poses.turned(poses.outward)
        return -poses.side_sign * poses.turned(poses.axes)

    @cached_property
    def _ahead(self) -> Array:
        """(M, 3) m, from the first to the second target of each pair."""
        i, j = self.poses.pairs.T
        return self._points[j] - self._points[i]

    @cached_property
    def _turn(self) -> Array:
        """(M,) rad, by how much the direction turns from the first to the second pose of each."""
        i, j = self.poses.pairs.T
        return arc_angles(self._directions[i], self._directions[j])

    @cached_property
    def _lengths(self) -> Array:
        """(M,) m, of the curves; turns count a little."""
        return np.hypot(np.linalg.norm(self._ahead, axis=1), TURN * self._turn)

    @cached_property
    def _tree(self) -> tuple[cKDTree, Ints, float]:
        """Places all along the curves, the curve of each, and how far they are apart on it (m)."""
        from scipy.spatial import cKDTree

        i, ahead = self.poses.pairs[:, 0], self._ahead
        length = np.linalg.norm(ahead, axis=1)
        wide = max(float(np.median(length)), 1e-2 * float(length.max()), 1e-12)
        parts = np.ceil(length / wide).astype(np.int64) + 1
        curve = np.repeat(np.arange(len(parts)), parts)
        number = np.arange(len(curve)) - np.repeat(np.cumsum(parts) - parts, parts)
        share = number / np.maximum(parts[curve] - 1, 1)
        return cKDTree(self._points[i[curve]] + share[:, None] * ahead[curve]), curve, wide

    @cached_property
    def _around(self) -> tuple[Ints, Ints]:
        """(N + 1,) and (2 M,): the curves of each pose."""
        ends = self.poses.pairs.reshape(-1)
        order = np.argsort(ends, kind="stable")
        count = np.bincount(ends, minlength=len(self._points))
        return np.concatenate([[0], np.cumsum(count)]), order // 2

    @cached_property
    def _same(self) -> Ints:
        """(N,) the first of the poses that each is equal to: a curve between two has no length."""
        both = np.column_stack([self._points, self._directions])
        _, first, group = np.unique(both, axis=0, return_index=True, return_inverse=True)
        return np.asarray(first[group.reshape(-1)])

    def at(self, places: Places) -> tuple[Array, Array]:
        """See `OffsetSurface.at`."""
        chart, known = places.chart, np.flatnonzero(places.chart >= 0)
        points, directions = np.full((2, len(chart), 3), np.nan)
        i, j = self.poses.pairs[chart[known]].T
        share = places.x[known, 0]
        points[known] = self._points[i] + share[:, None] * self._ahead[chart[known]]
        directions[known], _ = arc_at(self._directions[i], self._directions[j], share)
        return points, directions

    def nearest(
        self, points: Array, ahead: Array, within: float, only: Ints | None = None
    ) -> Places:
        """See `OffsetSurface.nearest`: on the curves of the poses around, by point and direction.

        The tool looks towards `ahead`, which distinguishes places where it turns on the spot.
        """
        chart, t = np.full(len(points), -1, dtype=np.int64), np.zeros(len(points))
        known = np.flatnonzero(np.isfinite(points).all(axis=1) & np.isfinite(ahead).all(axis=1))
        axes = -self.poses.side_sign * (ahead[known] - points[known])
        length = np.linalg.norm(axes, axis=1, keepdims=True)
        axes = np.divide(axes, length, out=np.zeros_like(axes), where=length > 0.0)
        if not len(self.poses.pairs) or not len(known):
            return _placed(chart, t)
        if only is not None:
            share, _ = self._closest(only[known], points[known], axes)
            chart[known], t[known] = only[known], share
            return _placed(chart, t)

        def put(row: Ints, curve: Ints) -> None:
            share, cost = self._closest(curve, points[known[row]], axes[row])
            order = np.lexsort((cost, row))
            best = order[np.searchsorted(row[order], np.unique(row))]
            chart[known[row[best]]], t[known[row[best]]] = curve[best], share[best]

        tree, curves, wide = self._tree
        count = min(NEAREST, len(curves))
        near = curves[tree.query(points[known], k=count)[1].reshape(len(known), count)]
        put(*self._curves_of(self.poses.pairs[near].reshape(len(known), -1)))
        # Where these are all too far off, any curve that is not: it has a place as near as this.
        off = np.linalg.norm(points[known] - self.at(_placed(chart[known], t[known]))[0], axis=1)
        (far,) = np.nonzero(off > within)
        some = tree.query_ball_point(points[known[far]], np.hypot(min(within, 1e9), 0.5 * wide))
        row = np.repeat(far, [len(one) for one in some])
        put(row, curves[np.concatenate([[], *some]).astype(np.int64)])
        return _placed(chart, t)

    def _curves_of(self, around: Ints) -> tuple[Ints, Ints]:
        """Which row, and which curve, of all curves of some poses (k, c)."""
        starts, curves = self._around
        pose = around.reshape(-1)
        count = starts[pose + 1] - starts[pose]
        row = np.repeat(np.repeat(np.arange(len(around)), around.shape[1]), count)
        within = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
        keys = np.unique(np.stack([row, curves[np.repeat(starts[pose], count) + within]]), axis=1)
        return keys[0], keys[1]

    def _closest(self, chart: Ints, points: Array, axes: Array) -> tuple[Array, Array]:
        """(k,) t on each curve, and its cost: the squared distance, with a little of the turn."""
        i, j = self.poses.pairs[chart].T
        begin, ahead, angle = self._points[i], self._ahead[chart], self._turn[chart]
        square = (ahead**2).sum(axis=1)
        known = np.linalg.norm(axes, axis=1) > 0.0
        weight = np.where(known, (TURN * angle) ** 2, 0.0)
        along = np.divide(((points - begin) * ahead).sum(axis=1), square,
                          out=np.zeros(len(chart)), where=square > 0.0)  # fmt: skip
        _, slope = arc_at(self._directions[i], self._directions[j], np.zeros(len(chart)))
        turned = np.arctan2((axes * slope).sum(axis=1),
                            angle * (axes * self._directions[i]).sum(axis=1))  # fmt: skip
        turned = np.divide(turned, angle, out=np.zeros(len(chart)), where=angle > 0.0)
        turned = np.clip(turned, 0.0, 1.0)
        t = np.divide(square * along + weight * turned, square + weight,
                      out=np.zeros(len(chart)), where=square + weight > 0.0)  # fmt: skip
        t = np.clip(t, 0.0, 1.0)
        target, direction = self.at(_placed(chart, t))
        leans = np.where(known, ((axes - direction) ** 2).sum(axis=1), 0.0)
        return t, ((points - target) ** 2).sum(axis=1) + TURN**2 * leans

    def along(self, places: Places) -> Array | None:
        """See `OffsetSurface.along`."""
        if not self.poses.in_order:
            return None
        starts = np.concatenate([[0.0], np.cumsum(self._lengths)])
        here = self._length(places.chart, places.x[:, 0])
        return np.where(places.chart >= 0, starts[places.chart] + here, np.nan)

    def paths(self, start: Places, end: Places) -> PlacePaths:
        """See `OffsetSurface.paths`: along one curve, or over the pose that two share."""
        ends = self.at(start), self.at(end)
        known = (start.chart >= 0) & (end.chart >= 0)
        made = PlacePaths.straight(ends, np.full((len(start.chart), 2), np.inf), start, end)
        same = np.flatnonzero(known & (start.chart == end.chart))
        off = self._deviations(start.chart[same], start.x[same, 0], end.x[same, 0])
        made.deviations[same, 2] = off
        rest = np.flatnonzero(known & (start.chart != end.chart))
        if len(rest):
            self._over_poses(made, rest, start.of(rest), end.of(rest))
        return made

    def _deviations(self, chart: Ints, t0: Array, t1: Array) -> Array:
        """(k, 2) see `PlacePaths.deviations`; a direction that turns at an even speed."""
        turn = (t1 - t0) * self._turn[chart]
        return np.stack([np.zeros(len(chart)), ROUNDING * turn**2 / 8.0], axis=1)

    def _over_poses(self, made: PlacePaths, rows: Ints, start: Places, end: Places) -> None:
        """Paths from one curve to another, where they share a pose."""
        one, other = (self._same[self.poses.pairs[places.chart]] for places in (start, end))
        same = one[:, :, None] == other[:, None, :]
        some = np.flatnonzero(same.any(axis=(1, 2)))
        leave, enter = np.divmod(same[some].reshape(-1, 4).argmax(axis=1), 2)
        start, end, rows = start.of(some), end.of(some), rows[some]
        to, fro = leave.astype(float), enter.astype(float)
        share = share_of(
            self._length(start.chart, np.abs(start.x[:, 0] - to)),
            self._length(end.chart, np.abs(end.x[:, 0] - fro)),
        )
        off = (
            self._deviations(start.chart, start.x[:, 0], to),
            self._deviations(end.chart, fro, end.x[:, 0]),
        )
        four = [start, _placed(start.chart, to), _placed(end.chart, fro), end]
        made.put(rows, PlacePaths.over(four, [self.at(places) for places in four], share, off))

    def tangents(self, places: Places) -> Array:
        """See `OffsetSurface.tangents`: between the tangents of both poses."""
        found = super().tangents(places)
        if self.poses.along is None:
            return found
        along = self.poses.turned(self.poses.along)
        known = np.flatnonzero(places.chart >= 0)
        i, j = self.poses.pairs[places.chart[known]].T
        found[known], _ = arc_at(along[i], along[j], places.x[known, 0])
        return found

    @property
    def square(self) -> bool:
        """Only at the poses."""
        return False

    def tangent_deviations(self, start: Places, end: Places) -> Array:
        """See `OffsetSurface.tangent_deviations`: of an arc that is run at an even speed."""
        if self.poses.along is None:
            return super().tangent_deviations(start, end)
        along = self.poses.turned(self.poses.along)
        i, j = self.poses.pairs[start.chart].T
        angle = arc_angles(along[i], along[j])
        turn = np.abs(end.x[:, 0] - start.x[:, 0]) * angle * ROUNDING
        same = (start.chart >= 0) & (start.chart == end.chart)
        return np.where(same, turn**2 / 8.0, np.inf)

    def _length(self, chart: Ints, share: Array) -> Array:
        """(k,) m, of parts of curves."""
        return np.asarray(share * self._lengths[chart])


def _placed(chart: Ints, t: Array) -> Places:
    """Places at t (k,) of curves."""
    return Places(chart, np.stack([t, np.zeros(len(t))], axis=1))
