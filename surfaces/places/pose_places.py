"""Places of poses: how far along the curve between two of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.places.places import ROUNDING, JoinedCharts, PlacePaths, Places
from surfaces.toolpaths.arcs import arc_angles, arc_at
from surfaces.toolpaths.pose_surface import PoseSurface

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

TURN = 1e-3  # m: what a turn of the tool by 1 rad counts, where places have to be distinguished


@dataclass(frozen=True, eq=False)
class PosePlaces(JoinedCharts):
    """The places on the curves of some poses; x is (t, 0) on the curve of a pair.

    Instead of normals these are the directions against the tool axis wanted ('outside'), or along
    it ('inside'): what normals are to any other surface.
    """

    poses: PoseSurface

    bends_evenly: ClassVar[bool] = True
    square: ClassVar[bool] = False  # but at the poses
    least_look: ClassVar[float] = TURN

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
        wide = max(float(length.mean()), 1e-12)
        parts = np.ceil(length / wide).astype(np.int64) + 1
        curve = np.repeat(np.arange(len(parts)), parts)
        number = np.arange(len(curve)) - np.repeat(np.cumsum(parts) - parts, parts)
        share = number / np.maximum(parts[curve] - 1, 1)
        return cKDTree(self._points[i[curve]] + share[:, None] * ahead[curve]), curve, wide

    @cached_property
    def _same(self) -> Ints:
        """(N,) the first of the poses that each is equal to: a curve between two has no length."""
        both = np.column_stack([self._points, self._directions])
        _, first, group = np.unique(both, axis=0, return_index=True, return_inverse=True)
        return np.asarray(first[group.reshape(-1)])

    @cached_property
    def _along(self) -> Array | None:
        """(N, 3) tangents of the poses, where there are some and they are wanted."""
        along = self.poses.along
        return self.poses.turned(along) if self.directed and along is not None else None

    def at(self, places: Places) -> tuple[Array, Array, Array]:
        """See `OffsetSurface.at`."""
        chart, known = places.chart, np.flatnonzero(places.chart >= 0)
        points, directions, tangents = np.full((3, len(chart), 3), np.nan)
        i, j = self.poses.pairs[chart[known]].T
        share = places.x[known, 0]
        points[known] = self._points[i] + share[:, None] * self._ahead[chart[known]]
        directions[known], _ = arc_at(self._directions[i], self._directions[j], share)
        if self._along is not None:
            tangents[known], _ = arc_at(self._along[i], self._along[j], share)
        return points, directions, tangents

    def nearest(
        self, points: Array, ahead: Array, within: float, only: Ints | None = None
    ) -> Places:
        """See `OffsetSurface.nearest`: on the curves of the poses around, by point and direction.

        The tool looks towards `ahead`, which distinguishes places where it turns on the spot.
        """
        chart, t = np.full(len(points), -1, dtype=np.int64), np.zeros(len(points))
        known = np.flatnonzero(np.isfinite(points).all(axis=1) & np.isfinite(ahead).all(axis=1))
        if not len(self.poses.pairs) or not len(known):
            return _placed(chart, t)
        points, axes = points[known], -self.poses.side_sign * (ahead[known] - points[known])
        length = np.linalg.norm(axes, axis=1, keepdims=True)
        axes = np.divide(axes, length, out=np.zeros_like(axes), where=length > 0.0)
        row, curve = np.arange(len(known)), None if only is None else only[known]
        if curve is None:
            tree, curves, wide = self._tree
            # No curve is nearer, turned or not, without a place as near as this.
            reach = np.hypot(np.hypot(tree.query(points)[0], 2.0 * TURN), 0.5 * wide)
            around = tree.query_ball_point(points, ROUNDING * reach)
            row, curve = np.repeat(row, [*map(len, around)]), curves[np.concatenate(around)]
        share, cost = self._closest(curve, points[row], axes[row])
        order = np.lexsort((cost, row))
        best = order[np.searchsorted(row, np.arange(len(known)))]
        chart[known], t[known] = curve[best], share[best]
        return _placed(chart, t)

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
        target, direction, _ = self.at(_placed(chart, t))
        leans = np.where(known, ((axes - direction) ** 2).sum(axis=1), 0.0)
        return t, ((points - target) ** 2).sum(axis=1) + TURN**2 * leans

    def along(self, places: Places) -> Array | None:
        """See `OffsetSurface.along`."""
        if not self.poses.in_order:
            return None
        starts = np.concatenate([[0.0], np.cumsum(self._lengths)])
        here = places.x[:, 0] * self._lengths[places.chart]
        return np.where(places.chart >= 0, starts[places.chart] + here, np.nan)

    def corners(self, chart: Ints) -> Ints:
        """See `JoinedCharts.corners`."""
        return self._same[self.poses.pairs[chart]]

    def bends(self, chart: Ints, start: Array, stop: Array) -> Array:
        """See `JoinedCharts.bends`: directions that turn at an even speed."""
        (i, j), share = self.poses.pairs[chart].T, stop[:, 0] - start[:, 0]
        found = np.full((len(chart), 3), np.inf)
        found[:, 0], found[:, 1] = 0.0, ROUNDING * (share * self._turn[chart]) ** 2 / 8.0
        if self._along is not None:
            turn = share * arc_angles(self._along[i], self._along[j])
            found[:, 2] = ROUNDING * turn**2 / 8.0
        return found

    def across(self, start: Places, end: Places, equal: Mask) -> PlacePaths:
        """See `JoinedCharts.across`."""
        leave, enter = np.divmod(equal.reshape(-1, 4).argmax(axis=1), 2)
        before, after = _placed(start.chart, 1.0 * leave), _placed(end.chart, 1.0 * enter)
        parts = (start, before), (after, end)
        first, last = (self.straight(*part) for part in parts)
        lengths = [np.abs(b.x - a.x)[:, 0] * self._lengths[a.chart] for a, b in parts]
        return PlacePaths.joined(first, last, lengths)


def _placed(chart: Ints, t: Array) -> Places:
    """Places at t (k,) of curves."""
    return Places(chart, np.stack([t, np.zeros(len(t))], axis=1))
