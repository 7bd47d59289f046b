"""Places of a smooth patch: its parameters u and v."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coverable_arrays import Array, Ints, Mask
from surfaces.patches import Patch
from surfaces.patches.nurbs import SplinePatch
from surfaces.places.patch_bounds import BoxBounds, box_bounds
from surfaces.places.places import ROUNDING, OffsetSurface, PlacePaths, Places
from surfaces.places.spline_bounds import kinks

TANGENT_STEP = 1e-5  # [1], share of the range of u: of differences
SLOWER = 1.0 - 1e-6  # covers their error
GUESSES = 6  # closest points that lead from a guess to a place
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

    def nearest(self, points: Array, ahead: Array, within: float) -> Places:
        """See `OffsetSurface.nearest`: under closest points, first of the given points themselves.

        Parallel surfaces share their normals, so the closest point of the patch is under that of
        the offset surface, unless another part of the patch is nearer.
        """
        x = self.closest(points)
        away = self._away(x, points)
        rest = np.flatnonzero(~(away <= within))
        guess = ahead[rest].copy()
        for _ in range(GUESSES if len(rest) else 0):
            found = self.closest(guess)
            offset, normal = self._at(found)
            there = np.linalg.norm(points[rest] - offset, axis=1)
            nearer = there < away[rest]
            x[rest[nearer]], away[rest[nearer]] = found[nearer], there[nearer]
            guess = points[rest] - self.height * normal
        return Places(np.zeros(len(x), dtype=np.int64), x)

    def closest(self, points: Array) -> Array:
        """(k, 2) u and v of the patch's places closest to points (k, 3) m, or nearly so."""
        found = self.patch.closest(points)
        limits = (self.patch.u_range, self.patch.v_range)
        both = (np.clip(x, *ends) for x, ends in zip((found.u, found.v), limits, strict=True))
        return np.stack(list(both), axis=-1)

    def _away(self, x: Array, points: Array) -> Array:
        return np.asarray(np.linalg.norm(points - self._at(x)[0], axis=-1))

    def paths(self, start: Places, end: Places) -> PlacePaths:
        """See `OffsetSurface.paths`."""
        step = end.x - start.x
        for axis, period in enumerate(self.patch.periods):
            if period:
                step[:, axis] -= period * np.round(step[:, axis] / period)
        made = PlacePaths.straight(
            (self._at(start.x), self._at(end.x)),
            self._bends(start.x, start.x + step),
            start,
            Places(end.chart, start.x + step),
        )
        self._over_kinks(made, start.x, step, end.x)
        for pole, is_one in enumerate(self.patch.poles):
            if is_one:
                self._over_pole(made, start.x, end.x, np.abs(step[:, 1]) > AROUND, pole)
        return made

    def _bends(self, start: Array, stop: Array) -> Array:
        """(k, 2) see `PlacePaths.bends`, for straight lines in u and v."""
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

    def turning(self, start: Places, end: Places) -> Array:
        """See `OffsetSurface.turning`: of f_u / |f_u|, at most |f_uu u' + f_uv v'| / |f_u|."""
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

    def _over_kinks(self, made: PlacePaths, start: Array, step: Array, end: Array) -> None:
        """Cut paths in two where they cross a line on which the surface has a kink."""
        count = np.zeros(len(start), dtype=np.int64)
        share = np.zeros(len(start))
        across, at = np.zeros(len(start), dtype=np.int64), np.zeros(len(start))
        for axis, lines in enumerate(self._kinks):
            limits = (self.patch.u_range, self.patch.v_range)[axis]
            width, period = limits[1] - limits[0], self.patch.periods[axis]
            if period:
                lines = np.unique(np.concatenate([lines - period, lines, lines + period]))
            low = np.minimum(start[:, axis], start[:, axis] + step[:, axis]) + AT * width
            high = np.maximum(start[:, axis], start[:, axis] + step[:, axis]) - AT * width
            first = np.searchsorted(lines, low, side="right")
            crossed = np.maximum(np.searchsorted(lines, high, side="left") - first, 0)
            count += crossed
            some = np.flatnonzero(crossed)
            at[some], across[some] = lines[first[some]], axis
            share[some] = (at[some] - start[some, axis]) / step[some, axis]
        many = count > 1
        made.bends[many] = np.inf
        some = np.flatnonzero(count == 1)
        if len(some):
            made.put(some, self._in_two(start[some], step[some], end[some], share[some],
                                        across[some], at[some]))  # fmt: skip

    def _in_two(
        self, start: Array, step: Array, end: Array, share: Array, axis: Ints, at: Array
    ) -> PlacePaths:
        """Paths of two pieces, from `start` along `step` to where u or v is `at`, and on."""
        row = np.arange(len(start))
        middle = start + share[:, None] * step
        ahead = np.sign(step[row, axis])
        before, after = middle.copy(), middle.copy()
        before[row, axis] = np.nextafter(at, at - ahead)
        after[row, axis] = np.nextafter(at, at + ahead)
        onward = after + (1.0 - share)[:, None] * step
        shift = np.zeros_like(end)
        for k, period in enumerate(self.patch.periods):
            if period:  # the second piece may lie on the other side of the seam
                shift[:, k] = period * np.round((end[:, k] - onward[:, k]) / period)
        places = [self._at(x) for x in (start, before, after + shift, end)]
        zero = np.zeros(len(start))
        bends = [self._bends(start, before), np.zeros((len(start), 2)),
                 self._bends(after + shift, end)]  # fmt: skip
        return PlacePaths(
            np.stack([zero, share, share, zero + 1.0], axis=1),
            np.stack([point for point, _ in places], axis=1),
            np.stack([normal for _, normal in places], axis=1),
            np.stack(bends, axis=1),
            np.zeros((len(zero), 4), dtype=np.int64),
            np.stack([start, before, after + shift, end], axis=1),
        )

    def _over_pole(self, made: PlacePaths, start: Array, end: Array, some: Mask, pole: int) -> None:
        """Lead paths over a pole where that bends less: straight to it along u, and away again."""
        row = np.flatnonzero(some)
        if not len(row):
            return
        a, b = start[row], end[row]
        at = self.patch.u_range[pole]
        before, after = a.copy(), b.copy()
        before[:, 0] = after[:, 0] = at
        places = [self._at(x) for x in (a, before, after, b)]
        to, fro = np.abs(a[:, 0] - at), np.abs(b[:, 0] - at)
        share = np.divide(to, to + fro, out=np.zeros_like(to), where=to + fro > 0.0)
        zero = np.zeros(len(row))
        over = PlacePaths(
            np.stack([zero, share, share, zero + 1.0], axis=1),
            np.stack([point for point, _ in places], axis=1),
            np.stack([normal for _, normal in places], axis=1),
            np.stack(
                [self._bends(a, before), np.zeros((len(row), 2)), self._bends(after, b)], axis=1
            ),
            np.zeros((len(row), 4), dtype=np.int64),
            np.stack([a, before, after, b], axis=1),
        )
        ends = np.linalg.norm(over.points[:, 3] - over.points[:, 0], axis=1)
        detour = np.linalg.norm(np.diff(over.points, axis=1), axis=2).sum(axis=1) - ends
        better = over.bends[:, :, 0].max(axis=1) + 8.0 * detour < made.bends[row, :, 0].max(axis=1)
        made.put(row[better], over.of(better))
