"""Profile: a smooth curve beside an axis, through given points."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from coverable.arrays import Array, Mask, Protected
from coverable.errors import Fault
from surfaces.enclosures import Enclosure
from surfaces.patches.closest_on_patch import ClosestPointSearch, Jet
from surfaces.slopes import Slope

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline


_SAMPLES = 16  # of each piece of the spline, for starts and for crossings
_LEAST = 1e-6  # of the profile's extent: lengths below this are none


@dataclass(frozen=True, eq=False)
class Profile(Protected):
    """A cubic spline over the chord length s, twice continuously differentiable.

    An end on the axis is a pole: there the curve leaves the axis at a right angle and r has no
    second derivative, so that the surface is smooth across it. At other ends the third derivative
    is that of the next piece (not-a-knot).
    """

    points: Array
    """(n, 2) m, r and z."""

    @cached_property
    def knots(self) -> Array:
        """(n,) m, chord length up to each point."""
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def length(self) -> float:
        """Of all chords, m."""
        return float(self.knots[-1])

    @property
    def poles(self) -> tuple[bool, bool]:
        """Whether the first and the last point lie on the axis."""
        return bool(self.points[0, 0] == 0.0), bool(self.points[-1, 0] == 0.0)

    @cached_property
    def _splines(self) -> tuple[CubicSpline, CubicSpline]:
        from scipy.interpolate import CubicSpline  # takes longer to load than many a search

        ends = [[(k, 0.0) if pole else "not-a-knot" for pole in self.poles] for k in (2, 1)]
        r, z = (
            CubicSpline(self.knots, values, bc_type=tuple(at))
            for values, at in zip(self.points.T, ends, strict=True)
        )
        return r, z

    def at(self, s: Array, order: int = 0) -> Array:
        """(..., 2) r and z, or their derivative of the given order, at chord lengths s."""
        return np.stack([spline(s, order) for spline in self._splines], axis=-1)

    def fractions(self, count: int) -> Array:
        """Chord lengths that cut each piece into `count` equal ones."""
        steps = np.arange(count) / count
        inner = self.knots[:-1, None] + steps * np.diff(self.knots)[:, None]
        return np.append(inner.reshape(-1), self.knots[-1])

    def curve(self, s: Any, order: int = 0) -> tuple[Any, Any]:
        """r and z, or derivatives of an order up to 2, of numbers or over single cubics."""
        if isinstance(s, Slope):
            both = zip(self.curve(s.value, order), self.curve(s.value, order + 1), strict=True)
            r, z = (Slope(value, rate * s.by) for value, rate in both)
            return r, z
        if not isinstance(s, Enclosure):
            r, z = np.moveaxis(self.at(s, order), -1, 0)
            return r, z
        low, high = s.net[:, 0]
        left = 3 - order  # the degree, and Bernstein's coefficients by slopes at both ends
        step = ((high - low) / left)[:, None]
        first, last = self.at(low, order), self.at(high, order)
        inner = [first + step * self.at(low, order + 1)] if left > 1 else []
        if left == 3:
            inner.append(last - step * self.at(high, order + 1))
        r, z = np.moveaxis(np.stack([first, *inner, last])[:, None], -1, 0)
        return Enclosure(r), Enclosure(z)

    @cached_property
    def search(self) -> ClosestPointSearch:
        """Nearest points of the curve in the half plane."""

        def jet(x: Array) -> Jet:
            s = x[:, 0]
            return Jet(self.at(s), self.at(s, 1)[:, None], self.at(s, 2)[:, None, None])

        line = self.fractions(_SAMPLES)
        return ClosestPointSearch(lambda x: self.at(x[:, 0]), jet, (line,), (False,))

    def faults(self) -> list[Fault]:
        """What keeps the curve from making a smooth surface; empty if nothing does."""
        extent = float(np.abs(self.points - self.points.mean(axis=0)).max())
        return self._spot_faults(extent) or [
            Fault("profile", text)
            for text in (self._axis_fault(), self._speed_fault(), self._crossing_fault())
            if text
        ]

    def _spot_faults(self, extent: float) -> list[Fault]:
        """Faults of the points themselves."""
        faults = []
        r = self.points[:, 0]
        for k in np.flatnonzero(r < _LEAST * max(extent, float(r.max()))).tolist():
            if r[k] != 0.0 or 0 < k < len(r) - 1:
                expected = (
                    "must keep clear of the axis (r > 0), where only the first and the last point "
                    "may be (r = 0)"
                )
                faults.append(Fault(f"profile[{k}]", f"got r = {r[k]:g}", expected=expected))
        steps = np.linalg.norm(np.diff(self.points, axis=0), axis=1)
        for k in np.flatnonzero(steps <= _LEAST * extent).tolist():
            text = "is the point before it; leave one of them out"
            faults.append(Fault(f"profile[{k + 1}]", text))
        ends = np.linalg.norm(self.points[0] - self.points[-1])
        if len(r) > 2 and not faults and ends <= _LEAST * extent:
            text = "must not end where it begins; use a torus, or two profiles"
            faults.append(Fault("profile", text))
        return faults

    def _axis_fault(self) -> str:
        """Where the curve reaches the axis between the points: exact, from its extrema."""
        radius = self._splines[0]
        turns = radius.derivative().roots(extrapolate=False)
        turns = turns[(turns > 0.0) & (turns < self.length)]
        if len(turns):
            lowest = turns[np.argmin(radius(turns))]
            if radius(lowest) <= _LEAST * float(self.points[:, 0].max()):
                r, z = self.at(lowest)
                return (
                    f"must stay clear of the axis between its points; the smooth curve "
                    f"reaches r = {r:g} near z = {z:g}; add points there"
                )
        return ""

    def _speed_fault(self) -> str:
        """Where the curve stops or turns back.

        The second derivative is linear on each piece, so its ends bound how much the first one
        changes between samples: no place between them is missed.
        """
        s = self.fractions(_SAMPLES)
        speed = np.linalg.norm(self.at(s, 1), axis=1)
        second = np.linalg.norm(self.at(self.knots, 2), axis=1)
        most = np.repeat(np.maximum(second[:-1], second[1:]), _SAMPLES)
        least = np.minimum(speed[:-1], speed[1:]) - most * np.diff(s) / 2.0
        worst = int(np.argmin(least))
        wrong_way = [
            (end, turn)
            for end, turn, pole in ((0, 1.0, self.poles[0]), (-1, -1.0, self.poles[1]))
            if pole and turn * self.at(self.knots[end], 1)[0] <= 0.0
        ]
        if least[worst] > 0.0 and not wrong_way:
            return ""
        place = self.knots[wrong_way[0][0]] if wrong_way else s[worst]
        r, z = self.at(np.asarray(place))
        return (
            f"must not turn back on itself; the smooth curve does near (r, z) = "
            f"({r:.4g}, {z:.4g}); space the points evenly, or add some there"
        )

    def _crossing_fault(self) -> str:
        """Where the curve crosses itself, looked for on the chords between its samples."""
        from scipy.spatial import cKDTree

        points = self.at(self.fractions(_SAMPLES))
        a, b = points[:-1], points[1:]
        tree = cKDTree((a + b) / 2.0)
        longest = float(np.linalg.norm(b - a, axis=1).max())
        pairs = tree.query_pairs(longest, output_type="ndarray")
        pairs = pairs[np.abs(pairs[:, 0] - pairs[:, 1]) > 1]
        i, j = pairs.T
        apart = (np.minimum(a[i], b[i]) > np.maximum(a[j], b[j])).any(axis=1)
        apart |= (np.minimum(a[j], b[j]) > np.maximum(a[i], b[i])).any(axis=1)
        crossing = ~apart & _straddles(a[i], b[i], a[j], b[j]) & _straddles(a[j], b[j], a[i], b[i])
        if not crossing.any():
            return ""
        r, z = a[i[np.argmax(crossing)]]
        return (
            f"must not cross itself; the smooth curve does near (r, z) = "
            f"({r:.4g}, {z:.4g}); add points there, or cut it into two surfaces"
        )


def _straddles(a: Array, b: Array, c: Array, d: Array) -> Mask:
    """True where c and d do not lie strictly on one side of the line through a and b."""
    along = b - a
    first, second = (along[:, 0] * (e - a)[:, 1] - along[:, 1] * (e - a)[:, 0] for e in (c, d))
    return np.asarray(np.sign(first) * np.sign(second) <= 0.0)
