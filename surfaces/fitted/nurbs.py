"""SplineMap: a tensor-product B-spline, plain or rational, its derivatives and closest points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from coverable.arrays import Array, Protected
from surfaces.enclosures import Enclosure
from surfaces.fitted.spline_enclosures import SpanNets
from surfaces.patches.closest_on_patch import ClosestPointSearch, Jet

if TYPE_CHECKING:
    from scipy.interpolate import NdBSpline

Pair = tuple[float, float]

_FEWEST_SAMPLES = 48  # along each parameter, for starts of the search for closest points
_SAMPLES = 3  # for each degree in each span
_MOST_SAMPLES = 600
_JOINED = 1e-9  # of the extent: ends this near are one place
_SMOOTH = 1e-6  # [rad]: normals that differ by less are one


@dataclass(frozen=True, eq=False)
class SplineMap(Protected):
    """S(u, v) = sum w_ij P_ij B_i(u) B_j(v) / sum w_ij B_i(u) B_j(v) over low..high."""

    points: Array
    """(m, n, 3) m, control points."""
    weights: Array | None
    """(m, n), or None where all are one."""
    knots: tuple[Array, Array]
    """(m + degree + 1,) and (n + degree + 1,)."""
    degree: tuple[int, int]
    low: Pair
    """Where u and v begin."""
    high: Pair
    """Where they end."""

    @cached_property
    def _spline(self) -> NdBSpline:
        """In homogeneous coordinates (w x, w y, w z, w) where there are weights."""
        from scipy.interpolate import NdBSpline  # takes longer to load than many a search

        net = self.points
        if self.weights is not None:
            w = self.weights[:, :, None]
            net = np.concatenate([w * net, w], axis=-1)
        return NdBSpline(self.knots, net, self.degree)

    @cached_property
    def extent(self) -> float:
        """m, the longest side of the box around the control points."""
        return float(np.ptp(self.points, axis=(0, 1)).max())

    def breaks(self, axis: int) -> Array:
        """Rising values of u (axis 0) or v (axis 1) between which the map is smooth."""
        knots = np.unique(self.knots[axis])
        inner = knots[(knots > self.low[axis]) & (knots < self.high[axis])]
        return np.concatenate([[self.low[axis]], inner, [self.high[axis]]])

    def line(self, axis: int, least: int, each: int) -> Array:
        """Values from end to end: each span in equal steps, at least `each`, `least` in all."""
        breaks = self.breaks(axis)
        spans = len(breaks) - 1
        count = max(each, -(-least // spans))
        steps = np.arange(count) / count
        inner = breaks[:-1, None] + steps * np.diff(breaks)[:, None]
        return np.append(inner.reshape(-1), breaks[-1])

    def point(self, x: Array) -> Array:
        """Points (..., 3) m at parameters (..., 2)."""
        return self._point(self._wrapped(x))

    def tangents(self, x: Array) -> tuple[Array, Array]:
        """S_u and S_v (..., 3) at parameters (..., 2)."""
        return self._tangents(self._wrapped(x))

    def _point(self, x: Array) -> Array:
        value = self._spline(x)
        return np.asarray(value if self.weights is None else value[..., :3] / value[..., 3:])

    def _tangents(self, x: Array) -> tuple[Array, Array]:
        along_u, along_v = (self._spline(x, nu=order) for order in ((1, 0), (0, 1)))
        if self.weights is None:
            return along_u, along_v
        value = self._spline(x)
        point, w = value[..., :3] / value[..., 3:], value[..., 3:]
        return (
            (along_u[..., :3] - point * along_u[..., 3:]) / w,
            (along_v[..., :3] - point * along_v[..., 3:]) / w,
        )

    def jet(self, x: Array) -> Jet:
        """Point and derivatives up to the second at parameters (n, 2)."""
        x = self._wrapped(x)
        orders = ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
        s, u, v, uu, uv, vv = (self._spline(x, nu=order) for order in orders)
        if self.weights is not None:
            # A = w S differentiated: A_u = w_u S + w S_u, and so on.
            w, wu, wv, wuu, wuv, wvv = (array[:, 3:] for array in (s, u, v, uu, uv, vv))
            s, u, v, uu, uv, vv = (array[:, :3] / w for array in (s, u, v, uu, uv, vv))
            wu, wv, wuu, wuv, wvv = wu / w, wv / w, wuu / w, wuv / w, wvv / w
            u, v = u - wu * s, v - wv * s
            uu = uu - wuu * s - 2.0 * wu * u
            uv = uv - wuv * s - wu * v - wv * u
            vv = vv - wvv * s - 2.0 * wv * v
        first = np.stack([u, v], axis=1)
        second = np.stack([np.stack([uu, uv], axis=1), np.stack([uv, vv], axis=1)], axis=1)
        return Jet(s, first, second)

    def normal(self, x: Array) -> Array:
        """S_u x S_v over its length, (..., 3) at parameters (..., 2)."""
        cross = np.cross(*self.tangents(x))
        return np.asarray(cross / np.linalg.norm(cross, axis=-1, keepdims=True))

    def element(self, u: Array, v: Array) -> Array:
        """|S_u x S_v| at parameters of one shape."""
        return np.asarray(np.linalg.norm(np.cross(*self.tangents(np.stack([u, v], -1))), axis=-1))

    @cached_property
    def closed(self) -> tuple[bool, bool]:
        """Whether the ends of u, and those of v, are one smooth seam: same points and normals."""
        return self._joined(0), self._joined(1)

    def _joined(self, axis: int) -> bool:
        across = self.line(1 - axis, _FEWEST_SAMPLES, _SAMPLES)
        ends = np.empty((2, len(across), 2))
        ends[:, :, 1 - axis] = across
        ends[0, :, axis], ends[1, :, axis] = self.low[axis], self.high[axis]
        point = self._point(ends)
        if np.abs(point[0] - point[1]).max() > _JOINED * self.extent:
            return False
        cross = np.cross(*self._tangents(ends))
        length = np.linalg.norm(cross, axis=-1, keepdims=True)
        if not (length > 0.0).all():
            return False
        normal = cross / length
        return bool(np.linalg.norm(normal[0] - normal[1], axis=-1).max() <= _SMOOTH)

    def _wrapped(self, x: Array) -> Array:
        """Closed parameters brought into the range; the far end stays what it is."""
        x = np.asarray(x, dtype=float)
        if not any(self.closed):
            return x
        low, high = np.array(self.low), np.array(self.high)
        turned = low + np.mod(x - low, high - low)
        return np.where(np.array(self.closed) & ((x < low) | (x > high)), turned, x)

    @cached_property
    def spans(self) -> SpanNets:
        """The same as polynomials."""
        breaks = self.breaks(0), self.breaks(1)
        return SpanNets(self.points, self.weights, self.knots, self.degree, breaks)

    def lines(self, axis: int) -> Array:
        """Values of u (axis 0) or v (axis 1) where it is not smooth, beyond closed ends, too."""
        breaks = self.breaks(axis)
        if not self.closed[axis]:
            return breaks[1:-1]
        period = breaks[-1] - breaks[0]
        return np.unique(np.concatenate([breaks - period, breaks, breaks + period]))

    def turned_in(self, x: Enclosure, axis: int) -> Enclosure:
        """u or v over intervals that each lie in one span, brought into a closed range."""
        if not self.closed[axis]:
            return x
        low, period = self.low[axis], self.high[axis] - self.low[axis]
        turns = np.floor((x.net.mean(axis=(0, 1)) - low) / period)
        return x - turns * period

    @cached_property
    def search(self) -> ClosestPointSearch:
        """Nearest points of the patch."""
        lines = []
        for axis in (0, 1):
            line = self.line(axis, _FEWEST_SAMPLES, _SAMPLES * self.degree[axis])
            spans = len(self.breaks(axis)) - 1
            if len(line) > _MOST_SAMPLES:
                line = self.line(axis, 0, max(1, _MOST_SAMPLES // spans))
            lines.append(line)
        return ClosestPointSearch(self.point, self.jet, lines, self.closed)
