"""Places of a smooth patch: its parameters u and v."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coverable_arrays import Array, Ints, Mask
from surfaces.patches import Patch
from surfaces.patches.nurbs import SplinePatch
from surfaces.places.patch_bounds import BoxBounds, box_bounds
from surfaces.places.places import (
    ROUNDING,
    OffsetSurface,
    PlacePaths,
    Places,
    by_closest_points,
    share_of,
)
from surfaces.places.spline_bounds import kinks

TANGENT_STEP = 1e-5  # [1], share of the range of u: of differences
SLOWER = 1.0 - 1e-6  # covers their error
AT = 1e-9  # [1] of a range: a path that passes a kink by less does not cross it
AROUND = 0.5  # rad of azimuth between two places from which on a path over a pole is looked at


@dataclass(frozen=True, eq=False)
class PatchPlaces(OffsetSurface):
    """The places of one patch. Paths run straight in u and v, and so stay on the patch."""

    patch: Patch
    sign: float = 1.0
    """-1.0 where the patch's own normal is turned over."""

    @cached_property
    def _bounds(self) -> BoxBounds:
        return box_bounds(self.patch)

    @cached_property
    def _kinks(self) -> tuple[Array, Array]:
        if not isinstance(self.patch, SplinePatch):
            return np.empty(0), np.empty(0)
        return kinks(self.patch, 0), kinks(self.patch, 1)

    def at(self, places: Places) -> tuple[Array, Array]:
        """See `OffsetSurface.at`."""
        return self._at(places.x)

    def _at(self, x: Array) -> tuple[Array, Array]:
        normals = self.sign * self.patch.normal(x[..., 0], x[..., 1])
        return self.patch.point(x[..., 0], x[..., 1]) + self.height * normals, normals

    def nearest(
        self, points: Array, ahead: Array, within: float, only: Ints | None = None
    ) -> Places:
        """See `OffsetSurface.nearest`."""
        return by_closest_points(self, self.closest, points, ahead, within)

    def closest(self, points: Array) -> Places:
        """The patch's places closest to points (k, 3) m, or nearly so."""
        found = self.patch.closest(points)
        u, v = np.clip(found.u, *self.patch.u_range), np.clip(found.v, *self.patch.v_range)
        return Places(np.zeros(len(u), dtype=np.int64), np.stack([u, v], axis=-1))

    def paths(self, start: Places, end: Places) -> PlacePaths:
        """See `OffsetSurface.paths`."""
        step = end.x - start.x
        for axis, period in enumerate(self.patch.periods):
            if period:
                step[:, axis] -= period * np.round(step[:, axis] / period)
        made = PlacePaths.straight(
            (self._at(start.x), self._at(end.x)),
            self._derivative_bounds(start.x, start.x + step),
            start,
            Places(end.chart, start.x + step),
        )
        self._over_kinks(made, start, step, end)
        for pole, is_one in enumerate(self.patch.poles):
            if is_one:
                self._over_pole(made, start, end, np.abs(step[:, 1]) > AROUND, pole)
        return made

    def _derivative_bounds(self, start: Array, stop: Array) -> Array:
        """(k, 2) see `PlacePaths.derivative_bounds`, for straight lines in u and v."""
        low, high = np.minimum(start, stop), np.maximum(start, stop)
        du, dv = (high - low).T
        squares = np.stack([du * du, 2.0 * du * dv, dv * dv], axis=1)
        with np.errstate(invalid="ignore"):  # inf * 0: nothing is known
            both = (squares[:, :, None] * self._bounds(self.patch, low, high)).sum(axis=1)
            both[:, 0] += abs(self.height) * both[:, 1]
        return np.asarray(both * ROUNDING)

    def tangents(self, places: Places) -> Array:
        """See `OffsetSurface.tangents`."""
        return self.patch.tangent(places.x[:, 0], places.x[:, 1])

    def tangent_slopes(self, start: Places, end: Places) -> Array:
        """See `OffsetSurface.tangent_slopes`: at most |f_uu u' + f_uv v'| / |f_u|."""
        low, high = np.minimum(start.x, end.x), np.maximum(start.x, end.x)
        du, dv = (high - low).T
        bounds = self._bounds(self.patch, low, high)[:, :, 0]
        with np.errstate(invalid="ignore"):  # inf * 0: nothing is known
            change = bounds[:, 0] * du + bounds[:, 1] * dv
        u, v = start.x.T
        step = TANGENT_STEP * (self.patch.u_range[1] - self.patch.u_range[0])
        ends = [np.clip(u + sign * step, *self.patch.u_range) for sign in (-1.0, 1.0)]
        speed = np.linalg.norm(self.patch.point(ends[1], v) - self.patch.point(ends[0], v), axis=1)
        least = SLOWER * speed / (ends[1] - ends[0]) - change
        known = least > 0.0
        found = np.divide(change, least, out=np.full(len(u), np.inf), where=known)
        return np.where(np.isnan(found), np.inf, found * ROUNDING)

    def _over_kinks(self, made: PlacePaths, start: Places, step: Array, end: Places) -> None:
        """Cut paths in two where they cross a line on which the surface has a kink."""
        x = start.x
        count = np.zeros(len(x), dtype=np.int64)
        share, at, across = np.zeros(len(x)), np.zeros(len(x)), np.zeros(len(x), dtype=np.int64)
        for axis, lines in enumerate(self._kinks):
            limits = (self.patch.u_range, self.patch.v_range)[axis]
            width, period = limits[1] - limits[0], self.patch.periods[axis]
            if period:
                lines = np.unique(np.concatenate([lines - period, lines, lines + period]))
            low = np.minimum(x[:, axis], x[:, axis] + step[:, axis]) + AT * width
            high = np.maximum(x[:, axis], x[:, axis] + step[:, axis]) - AT * width
            first = np.searchsorted(lines, low, side="right")
            crossed = np.maximum(np.searchsorted(lines, high, side="left") - first, 0)
            count += crossed
            some = np.flatnonzero(crossed)
            at[some], across[some] = lines[first[some]], axis
            share[some] = (at[some] - x[some, axis]) / step[some, axis]
        made.derivative_bounds[count > 1] = np.inf
        some = np.flatnonzero(count == 1)
        if len(some):
            made.put(some, self._in_two(start.of(some), step[some], end.of(some), share[some],
                                        across[some], at[some]))  # fmt: skip

    def _in_two(
        self, start: Places, step: Array, end: Places, share: Array, axis: Ints, at: Array
    ) -> PlacePaths:
        """Paths of two pieces, from `start` along `step` to where u or v is `at`, and on."""
        row = np.arange(len(share))
        middle = start.x + share[:, None] * step
        ahead = np.sign(step[row, axis])
        before, after = middle.copy(), middle.copy()
        before[row, axis] = np.nextafter(at, at - ahead)
        after[row, axis] = np.nextafter(at, at + ahead)
        onward = after + (1.0 - share)[:, None] * step
        for k, period in enumerate(self.patch.periods):
            if period:  # the second piece may lie on the other side of the seam
                after[:, k] += period * np.round((end.x[:, k] - onward[:, k]) / period)
        return self._over(start, before, after, end, share)

    def _over_pole(
        self, made: PlacePaths, start: Places, end: Places, some: Mask, pole: int
    ) -> None:
        """Lead paths over a pole where that bends less: straight to it along u, and away again."""
        row = np.flatnonzero(some)
        if not len(row):
            return
        start, end = start.of(row), end.of(row)
        at = self.patch.u_range[pole]
        before, after = start.x.copy(), end.x.copy()
        before[:, 0] = after[:, 0] = at
        share = share_of(np.abs(start.x[:, 0] - at), np.abs(end.x[:, 0] - at))
        over = self._over(start, before, after, end, share)
        ends = np.linalg.norm(over.points[:, 3] - over.points[:, 0], axis=1)
        detour = np.linalg.norm(np.diff(over.points, axis=1), axis=2).sum(axis=1) - ends
        most, before_most = (
            paths.derivative_bounds[:, :, 0].max(axis=1) for paths in (over, made.of(row))
        )
        better = most + 8.0 * detour < before_most
        made.put(row[better], over.of(better))

    def _over(
        self, start: Places, before: Array, after: Array, end: Places, share: Array
    ) -> PlacePaths:
        """Paths of two pieces, straight to `before` (k, 2), and on from `after`, the same place."""
        four = [start, Places(start.chart, before), Places(end.chart, after), end]
        bounds = self._derivative_bounds(start.x, before), self._derivative_bounds(after, end.x)
        return PlacePaths.over(four, [self.at(places) for places in four], share, bounds)
