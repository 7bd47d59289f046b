"""FittedPatch: a spline for another surface, and tensor-product splines through grids of points."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coverable.arrays import Array
from surfaces.fitted.bspline import SplinePatch
from surfaces.fitted.nurbs import SplineMap
from surfaces.parts import PartModels

Flags = tuple[bool, bool]

ONE_PLACE = 1e-9  # of the extent: points this near are one


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class FittedPatch(SplinePatch):
    """A spline through points of a surface; outward is along S_u x S_v."""

    made_from: str
    """'parametric' for a formula, 'grid' for points."""
    off: tuple[float, float]
    """How far points (m) and normals (1) may be from those of the surface meant, at most."""
    words: tuple[str, ...]
    """What a user should know, one sentence each."""

    @property
    def kind(self) -> str:  # pyrefly: ignore[bad-override]
        """What it was made from."""
        return self.made_from

    @property
    def notes(self) -> tuple[str, ...]:
        """See `Surface.notes`."""
        return self.words

    @property
    def deviations(self) -> tuple[float, float]:
        """See `Surface.deviations`."""
        return self.off

    def placed_models(
        self, low: Array, high: Array, sign: float = 1.0, twisted: bool = False
    ) -> tuple[PartModels, Array]:
        """Of the surface meant: those of the spline, wider by what it may deviate."""
        found, twist = SplinePatch.placed_models(self, low, high, sign, twisted)
        return replace(found, radius=found.radius + np.array(self.off)), twist


def spline_through(
    points: Array, lines: tuple[Array, Array], degree: int, closed: Flags = (False, False)
) -> SplineMap:
    """The spline with these points at these parameters.

    Args:
        points: (m, n, 3) m; where it is closed, the last row or column is the first again.
        lines: rising u (m,) and v (n,).
        degree: of both, or less where there are fewer points.
        closed: whether its ends of u, and of v, are one smooth seam.
    """
    from scipy.interpolate import make_interp_spline

    net, knots, degrees = points, list[Array](), list[int]()
    for axis, line in enumerate(lines):
        order = min(degree, len(line) - 1)
        values = np.moveaxis(net, axis, 0)
        if closed[axis] and len(line) > degree:
            own, net_of = _periodic(line, values, order)
        else:
            made = make_interp_spline(line, values, k=order)
            own, net_of = np.asarray(made.t), np.asarray(made.c)
        net = np.moveaxis(net_of, 0, axis)
        knots.append(own)
        degrees.append(order)
    (u0, u1), (v0, v1) = ((float(line[0]), float(line[-1])) for line in lines)
    return SplineMap(
        points=np.ascontiguousarray(net),
        weights=None,
        knots=(knots[0], knots[1]),
        degree=(degrees[0], degrees[1]),
        low=(u0, v0),
        high=(u1, v1),
    )


def _periodic(line: Array, values: Array, degree: int) -> tuple[Array, Array]:
    """Knots, and coefficients (m + degree - 1, ...), of the closed spline of an odd degree.

    Its knots are the parameters. (SciPy solves this for one column of the values at a time.)

    Args:
        line: (m,) rising; its ends are one place.
        values: (m, ...) of which the last are the first again.
        degree: less than m.
    """
    from scipy.interpolate import BSpline

    period, count = line[-1] - line[0], len(line) - 1
    own = np.concatenate([line[-degree - 1 : -1] - period, line, line[1 : degree + 1] + period])
    basis = BSpline.design_matrix(line[:-1], own, degree).toarray()
    square = basis[:, :count]
    square[:, :degree] += basis[:, count:]
    found = np.linalg.solve(square, values[:-1].reshape(count, -1))
    found = found.reshape(count, *values.shape[1:])
    return own, np.concatenate([found, found[:degree]])


def extent_of(points: Array) -> float:
    """m, the longest side of the box around points (..., 3)."""
    flat = points.reshape(-1, 3)
    return float((flat.max(axis=0) - flat.min(axis=0)).max())


def poles_of(points: Array) -> list[tuple[int, int]]:
    """Axis and end (0 or -1) of the borders of a grid (m, n, 3) that are one point."""
    least = ONE_PLACE * max(extent_of(points), 1e-300)
    found = []
    for axis in (0, 1):
        for end in (0, -1):
            border = np.take(points, end, axis=axis)
            if extent_of(border) <= least:
                found.append((axis, end))
    return found


def coinciding_ends(points: Array) -> Flags:
    """Whether the first and last row of a grid (m, n, 3) are the same points; and the columns."""
    least = ONE_PLACE * extent_of(points)
    rows = np.abs(points[0] - points[-1]).max() <= least
    columns = np.abs(points[:, 0] - points[:, -1]).max() <= least
    return bool(rows and len(points) > 3), bool(columns and points.shape[1] > 3)


def outward_words(patch_normal: Array) -> str:
    """Which way outward is, in words."""
    x, y, z = patch_normal.reshape(3) + 0.0
    return (
        f"Outward is along the u direction x the v direction: ({x:.3g}, {y:.3g}, {z:.3g}) in the "
        "middle, in the surface's own frame; the side says on which side the tool works."
    )
