"""Places of a smooth patch: its parameters u and v.

A model of points or normals over a box of parameters holds within its radius r all over it, so
along any line from one place of the box to another they are within 2 r of straight.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array
from surfaces.patches.patch import Patch
from surfaces.places.places import ROUNDING, OffsetSurface, PlacePaths, Places
from surfaces.surface import SurfaceError

SAMPLES = np.linspace(0.0, 1.0, 9)  # of a line, where no model is known
MEASURED = 2.0  # times what is measured counts there
DIFFERENCE = 1e-5  # [1] of a range of parameters
STEPS, LONGEST = 8, 0.1  # of Newton's, [1] of a range


@dataclass(frozen=True, eq=False)
class PatchPlaces(OffsetSurface):
    """The places of one patch. Paths run straight in u and v, and so stay on the patch."""

    patch: Patch
    sign: float = 1.0
    """-1.0 where the patch's own normal is turned over."""

    def at(self, places: Places) -> tuple[Array, Array, Array]:
        """See `OffsetSurface.at`."""
        points, normals = self.placed(places.x)
        none = np.full_like(normals, np.nan)
        return points, normals, self._along(places.x)[0] if self.directed else none

    def placed(self, x: Array) -> tuple[Array, Array]:
        """Points and normals (..., 3) at u and v (..., 2)."""
        normals = self.sign * self.patch.normal(x[..., 0], x[..., 1])
        return self.patch.point(x[..., 0], x[..., 1]) + self.height * normals, normals

    def _along(self, x: Array) -> tuple[Array]:
        """Unit u directions (..., 3), likewise."""
        return (self.patch.tangent(x[..., 0], x[..., 1]),)

    def closest(self, points: Array) -> Places:
        """See `OffsetSurface.closest`."""
        found = self.patch.closest(points)
        u, v = np.clip(found.u, *self.patch.u_range), np.clip(found.v, *self.patch.v_range)
        return Places(np.zeros(len(u), dtype=np.int64), np.stack([u, v], axis=-1))

    def approached(self, points: Array, start: Places) -> Places:
        """See `OffsetSurface.approached`: Gauss and Newton's steps, by differences."""
        low, high = np.transpose([self.patch.u_range, self.patch.v_range])
        x, by, most = start.x, np.diag(DIFFERENCE * (high - low)), LONGEST * (high - low)
        for _ in range(STEPS):
            back, ahead = (np.clip(x[:, None] + way, low, high) for way in (-by, by))
            off = self.placed(ahead)[0] - self.placed(back)[0]
            rates = off / np.diagonal(ahead - back, axis1=1, axis2=2)[..., None]
            off = points - self.placed(x)[0]
            step = np.einsum("ki,kij->kj", off, np.linalg.pinv(rates))
            x = np.clip(x + np.clip(step, -most, most), low, high)
        return Places(start.chart, x)

    def between(self, start: Places, end: Places, share: Array) -> Places:
        """Places at shares (k,) of the straight ways from places to places."""
        x = start.x + share[:, None] * self._step(start, end)
        ranges = (self.patch.u_range, self.patch.v_range)
        for axis, (period, (low, _)) in enumerate(zip(self.patch.periods, ranges, strict=True)):
            if period:
                x[:, axis] = low + np.mod(x[:, axis] - low, period)
        return Places(start.chart, x)

    def _step(self, start: Places, end: Places) -> Array:
        """(k, 2) from place to place, the shorter way round."""
        step = end.x - start.x
        for axis, period in enumerate(self.patch.periods):
            if period:
                step[:, axis] -= period * np.round(step[:, axis] / period)
        return step

    def paths(self, start: Places, end: Places) -> PlacePaths:
        """See `OffsetSurface.paths`."""
        stop = start.x + self._step(start, end)
        off = np.full((len(stop), 3), np.inf)
        off[:, :2] = _deviations(self._bent, self.placed, start.x, stop)
        if self.directed:
            off[:, 2] = 0.0
            some = np.flatnonzero((start.x != stop).any(axis=1))
            off[some, 2:] = _deviations(self._turned, self._along, start.x[some], stop[some])
        ends = self.at(start), self.at(end)
        return PlacePaths.straight(start, Places(end.chart, stop), ends, off)

    def _bent(self, low: Array, high: Array) -> Array:
        """(k, 2) radii of models of offset points (m) and normals over boxes."""
        radius = _known(self.patch.local_models(low, high)[0].radius)
        leaning = abs(self.height) * radius[:, 1] if self.height else 0.0  # which may be inf
        return np.stack([radius[:, 0] + leaning, radius[:, 1]], axis=1)

    def _turned(self, low: Array, high: Array) -> Array:
        """(k, 1) those of u directions."""
        return _known(self.patch.tangent_models(low, high).radius[:, 1:])


def _known(radius: Array) -> Array:
    """Enclosures have room for their own rounding; inf where nothing is known."""
    return np.where(np.isnan(radius), np.inf, radius * ROUNDING)


def _deviations(
    radii: Callable[[Array, Array], Array],
    values: Callable[[Array], Sequence[Array]],
    start: Array,
    stop: Array,
) -> Array:
    """(k, c) how far c values are from straight between the ends of lines (k, 2) of parameters.

    By radii of models over boxes.
    """
    try:
        return 2.0 * radii(np.minimum(start, stop), np.maximum(start, stop))
    except SurfaceError:  # of a kind of one's own, whose formulas cannot be followed: no proof
        share = SAMPLES[:, None, None]
        found = np.stack(values(start + share * (stop - start)))
        line = found[:, :1] + share * (found[:, -1:] - found[:, :1])
        off = np.linalg.norm(found - line, axis=-1)
        return np.asarray(MEASURED * off.max(axis=1).T)
