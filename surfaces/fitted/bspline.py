"""A B-spline or NURBS patch over a net of control points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from coverable.errors import Fault, shown
from surfaces.arguments import ORIGIN, Checks, table
from surfaces.enclosures import Enclosure
from surfaces.fitted.nurbs import SplineMap
from surfaces.fitted.nurbs_checks import (
    MOST_DEGREE,
    checked_degree,
    checked_knots,
    checked_points,
    checked_weights,
    regularity_faults,
)
from surfaces.patches.parametric import EDGE
from surfaces.patches.quadrature import rectangle_areas
from surfaces.patches.smooth_patch import LocalClosestPoints, SmoothPatch
from surfaces.surface import Side, SurfaceError


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class SplinePatch(SmoothPatch):
    """u and v count as the knots do; the outward normal is along S_u x S_v.

    With the points' rows (u) along x and their columns (v) along y, outward is +z. Its closest
    points lie on the patch, never beyond its borders.
    """

    kind: ClassVar[str] = "bspline"
    units: ClassVar[tuple[str, str]] = ("", "")
    net: SplineMap

    @property
    def u_closed(self) -> bool:
        """True where the two ends of u are one smooth seam."""
        return self.net.closed[0]

    @property
    def v_closed(self) -> bool:
        """True where the two ends of v are one smooth seam."""
        return self.net.closed[1]

    @property
    def periods(self) -> tuple[float, float]:
        """The ranges of u and v where they are closed, else 0."""
        (u0, u1), (v0, v1) = self.u_range, self.v_range
        return (u1 - u0 if self.u_closed else 0.0, v1 - v0 if self.v_closed else 0.0)

    def local_point(self, u: Array, v: Array) -> Array:
        """The spline."""
        return self.net.point(np.stack([u, v], axis=-1))

    def local_normal(self, u: Array, v: Array) -> Array:
        """S_u x S_v over its length."""
        return self.net.normal(np.stack([u, v], axis=-1))

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """By quadrature of |S_u x S_v|, cut at the knots."""
        breaks = self.net.breaks(0), self.net.breaks(1)
        return rectangle_areas(self.net.element, u0, u1, v0, v1, *breaks)

    @property
    def part_roots(self) -> tuple[Array, Array]:
        """The ranges: closest points never lie beyond them."""
        ends = np.array([self.u_range, self.v_range])
        return ends[None, :, 0], ends[None, :, 1]

    @property
    def breaks(self) -> tuple[Array, Array]:
        """The knots, and where a closed patch begins again."""
        return self.net.lines(0), self.net.lines(1)

    def local_enclosures(self, u: Enclosure, v: Enclosure) -> tuple[Enclosure, Enclosure]:
        """See `SpanNets`."""
        return self.net.spans.over(*(self.net.turned_in(x, axis) for axis, x in enumerate((u, v))))

    def local_tangents(self, u: Enclosure, v: Enclosure) -> Enclosure:
        """See `SpanNets`."""
        turned = (self.net.turned_in(x, axis) for axis, x in enumerate((u, v)))
        return self.net.spans.tangents_over(*turned)

    def local_closest_points(self, points: Array) -> LocalClosestPoints:
        """By search; see `surfaces.patches.closest_on_patch`."""
        x = self.net.search.nearest(points)
        normal = self.net.normal(x)
        away = points - self.net.point(x)
        height = np.einsum("ni,ni->n", away, normal)
        beside = np.linalg.norm(away - height[:, None] * normal, axis=1)
        return LocalClosestPoints(x[:, 0], x[:, 1], height, normal, beside <= EDGE)


def bspline(
    points: Any,
    degree: Sequence[int] = (3, 3),
    knots: Sequence[Any] | None = None,
    weights: Any = None,
    u: Sequence[float] | None = None,
    v: Sequence[float] | None = None,
    side: Side = "inside",
    position: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
) -> SplinePatch:
    """A tensor-product B-spline patch; rational (NURBS) where weights are given.

    Whether it has a normal everywhere and neither kinks nor folds is looked at on a grid of 8
    samples in each knot span. That it does not cut through itself is not checked.

    Args:
        points: (m, n, 3) m, control points; rows along u, columns along v.
        degree: of u and of v, 1 to 9.
        knots: of u and of v, m + degree + 1 and n + degree + 1 numbers that never fall; None for
            clamped uniform ones over 0..1.
        weights: (m, n) numbers > 0, or None where all are one.
        u: (low, high) part of the knots' range to keep; all of it if None.
        v: likewise.
        side: 'outside' for a tool on the side of S_u x S_v, 'inside' for one on the other.
        position: see `plane`, as for rpy_deg.

    Raises:
        SurfaceError: one or more of the arguments do not describe a patch; all are named.

    Example:
        >>> net = [[(x, y, 0.5 * x * y) for y in (0.0, 0.5, 1.0)] for x in (0.0, 0.5, 1.0)]
        >>> saddle = bspline(net, degree=(2, 2))
        >>> saddle.closest([0.5, 0.5, 0.125]).inside.item()
        True
    """
    check = Checks("bspline")
    net = _spline_map(points, degree, knots, weights, (u, v), check.faults)
    pose = check.pose(side, position, rpy_deg)
    check.done()
    if net is None:  # cannot be: without a net there are faults
        raise SurfaceError("bspline: the points make no patch")
    return SplinePatch(
        u_range=(net.low[0], net.high[0]),
        v_range=(net.low[1], net.high[1]),
        net=net,
        **pose,
    )


def _spline_map(
    points: Any, degree: Any, knots: Any, weights: Any, ranges: tuple[Any, Any], faults: list[Fault]
) -> SplineMap | None:
    """The spline, or None after a fault."""
    net = checked_points(points, faults)
    shape = (MOST_DEGREE + 1, MOST_DEGREE + 1) if net is None else net.shape[:2]
    before = len(faults)
    p, q = checked_degree(degree, shape, faults)
    fits = net is not None and len(faults) == before
    checked = None if net is None else checked_weights(weights, shape, faults)
    if net is None or not fits:
        return None
    if knots is None:
        knots = (None, None)
    if not isinstance(knots, Sequence) or isinstance(knots, (str, bytes)) or len(knots) != 2:
        expected = "must be two lists of numbers that never fall, of u and of v"
        faults.append(Fault("knots", f"got {shown(knots)}", expected=expected))
        return None
    lines = (
        checked_knots("knots[0]", knots[0], shape[0], p, faults),
        checked_knots("knots[1]", knots[1], shape[1], q, faults),
    )
    (u0, u1), (v0, v1) = (
        _range(name, wanted, (float(line[order]), float(line[-order - 1])), faults)
        for name, wanted, line, order in zip("uv", ranges, lines, (p, q), strict=True)
    )
    if faults:
        return None
    made = SplineMap(net, checked, lines, (p, q), (u0, v0), (u1, v1))
    faults += [Fault("", text) for text in regularity_faults(made)]
    return made


def _range(
    name: str, wanted: Any, full: tuple[float, float], faults: list[Fault]
) -> tuple[float, float]:
    """The part of the knots' range to keep."""
    if wanted is None:
        return full
    expected = f"a pair (low, high) within the knots' range {full[0]:g} .. {full[1]:g}"
    pair = table(name, wanted, (2,), expected, 2, faults)
    if pair is None:
        return full
    low, high = pair.tolist()
    if not full[0] <= low < high <= full[1]:
        got = f"got {shown(wanted)}"
        faults.append(Fault(name, got, expected=f"must be {expected}, low < high"))
        return full
    return low, high
