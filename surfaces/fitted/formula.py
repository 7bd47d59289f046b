"""`parametric`: a patch from a user's own formula g(u, v).

The formula is only called, never differentiated: a spline of degree 5 takes its place, through
enough points that it deviates by less than a ten-millionth of its size. Derivatives, closest
points, bounds and proofs are the spline's. By how much it deviates is measured between its points,
stated, and taken off the tolerance and the cone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from coverable.arrays import Array
from coverable.errors import Fault, shown
from surfaces.arguments import ORIGIN, Checks
from surfaces.fitted.calls import HOW, Formula
from surfaces.fitted.fitted_patch import (
    FittedPatch,
    coinciding_ends,
    extent_of,
    outward_words,
    poles_of,
    spline_through,
)
from surfaces.fitted.nurbs import SplineMap
from surfaces.fitted.nurbs_checks import regularity_faults
from surfaces.surface import Side, SurfaceError

DEGREE = 5
FEWEST, MOST = 9, 129  # points along each parameter
CLOSE = 1e-7  # of the extent: a spline this near is near enough
FARTHEST = 1e-4  # of the extent: one that is further off is refused
BETWEEN = (0.21, 0.5)  # shares of the distance between two points where the deviation is measured
MORE = 1.5  # times as much is stated, for the places between these
STEP = 1e-3  # of a range: of differences, for normals
EDGES = 1e-3  # of a range, what a pole is to be cut off by, at least


def parametric(
    g: Callable[..., Any],
    u: Sequence[float],
    v: Sequence[float],
    side: Side = "inside",
    position: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
) -> FittedPatch:
    """A patch of a user's own formula.

    Args:
        g: a function of two NumPy arrays of one shape, u and v, that returns x, y and z (m): three
            arrays of that shape (or constants), or one array of them. It has to be smooth.
        u: (low, high), in whatever g counts in: radians, metres.
        v: (low, high).
        side: 'outside' for a tool on the side of g_u x g_v, 'inside' for one on the other; `notes`
            says which way that is.
        position: see `plane`, as for rpy_deg.

    Returns:
        The patch. Ends of u or v at which g is the same, smoothly, are joined.

    Raises:
        SurfaceError: g cannot be called so, is not finite or smooth, or has no normal somewhere,
            as at a pole; or other arguments are wrong. All that is known is named.

    Example:
        >>> import numpy as np
        >>> def ball(u, v):
        ...     return np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)
        >>> dome = parametric(ball, u=(0.2, 1.5), v=(0.2, 3.0))
        >>> len(dome.cells(4, 6)), dome.deviations[0] < 1e-7
        (24, True)
    """
    check = Checks("parametric")
    if not callable(g):
        check.keep(Fault("g", f"got {shown(g)}", expected=f"must be a function; {HOW}"))
    ranges = (
        check.interval("u", u, "as g counts it", (0.0, 1.0)),
        check.interval("v", v, "as g counts it", (0.0, 1.0)),
    )
    pose = check.pose(side, position, rpy_deg)
    check.done()
    formula = Formula(g)
    _refuse_poles(formula, ranges)
    found = _best(formula, ranges)
    faults = regularity_faults(found.net)
    if faults:
        raise SurfaceError([Fault("g", text) for text in faults], "parametric")
    middle = np.array([[(low + high) / 2.0 for low, high in ranges]])
    m, n = found.counts
    off = (MORE * found.off, MORE * _normal_deviation(formula, found.net, ranges, found.counts))
    words = (
        f"A spline through {m} x {n} points replaces g; it deviates by at most "
        f"{1e3 * off[0]:.2g} mm and {np.degrees(off[1]):.2g} deg, as measured between "
        "them, which is taken off tolerance and cone.",
        outward_words(found.net.normal(middle)),
        *found.words,
    )
    return FittedPatch(
        u_range=ranges[0], v_range=ranges[1], net=found.net, made_from="parametric",
        off=off, words=words, **pose,
    )  # fmt: skip


class _Fit(NamedTuple):
    """A spline in place of a formula."""

    net: SplineMap
    off: float
    """m, the largest deviation that was measured."""
    counts: tuple[int, int]
    words: tuple[str, ...] = ()


Ranges = tuple[tuple[float, float], tuple[float, float]]


def _lines(ranges: Ranges, counts: Sequence[int]) -> tuple[Array, Array]:
    """Parameters at equal steps."""
    u, v = (np.linspace(*ends, count) for ends, count in zip(ranges, counts, strict=True))
    return u, v


def _grid(formula: Formula, ranges: Ranges, counts: Sequence[int]) -> tuple[Array, Any]:
    """Points (m, n, 3) at equal steps, and the two lines of parameters."""
    lines = _lines(ranges, counts)
    return formula(*np.meshgrid(*lines, indexing="ij")), lines


def _refuse_poles(formula: Formula, ranges: Ranges) -> None:
    """Refuse borders that are one point: there is no normal there."""
    points, _ = _grid(formula, ranges, (FEWEST, FEWEST))
    if extent_of(points) == 0.0:
        raise SurfaceError(Fault("g", "is one point all over; it must be a surface"), "parametric")
    faults = []
    for axis, end in poles_of(points):
        name, (low, high) = "uv"[axis], ranges[axis]
        at, cut = (low, high)[end], EDGES * (high - low)
        instead = (low + cut, high) if end == 0 else (low, high - cut)
        expected = f"must stop short of {at:.4g}, as ({instead[0]:.4g}, {instead[1]:.4g}) does"
        faults.append(Fault(name, "g is one point there, a pole without a normal", "", expected))
    if faults:
        raise SurfaceError(faults, "parametric")


def _best(formula: Formula, ranges: Ranges) -> _Fit:
    """The spline of as few points as are near enough; closed where that is as near."""
    points, _ = _grid(formula, ranges, (FEWEST, FEWEST))
    coincide = coinciding_ends(points)
    found = _refined(formula, ranges, coincide)
    if any(coincide) and found.off > CLOSE * extent_of(points):
        kinked = _refined(formula, ranges, (False, False))
        if kinked.off < 0.1 * found.off:
            word = "Where its ends meet g has a kink, so they are not joined."
            found = kinked._replace(words=(word,))
    if found.off > FARTHEST * extent_of(points):
        raise SurfaceError(
            Fault(
                "g",
                f"even a spline through {found.counts[0]} x {found.counts[1]} points is "
                f"{1e3 * found.off:.3g} mm off; make a patch of each smooth part, and join them "
                "with surfaces.piecewise",
                expected="must be smooth, without creases or jumps",
            ),
            "parametric",
        )
    return found


def _refined(formula: Formula, ranges: Ranges, closed: tuple[bool, bool]) -> _Fit:
    """Twice as many points along the parameter that is further off, until it is near enough."""
    counts = [FEWEST, FEWEST]
    while True:
        points, lines = _grid(formula, ranges, counts)
        net = spline_through(points, lines, DEGREE, closed)
        both = _deviation(formula, net, lines, None)
        coarse = [axis for axis in (0, 1) if counts[axis] < MOST]
        if both <= CLOSE * extent_of(points) or not coarse:
            return _Fit(net, both, (counts[0], counts[1]))
        off = [_deviation(formula, net, lines, axis) for axis in (0, 1)]
        rough = [axis for axis in coarse if off[axis] > 0.1 * max(off)]
        for axis in rough or coarse:
            counts[axis] = min(2 * counts[axis] - 1, MOST)


def _between(line: Array, share: float) -> Array:
    return line[:-1] + share * np.diff(line)


def _deviation(
    formula: Formula, net: SplineMap, lines: tuple[Array, Array], axis: int | None
) -> float:
    """m, the largest deviation between the points along one parameter, or along both."""
    worst = 0.0
    for share in BETWEEN:
        places = [
            _between(line, share) if axis in (k, None) else line for k, line in enumerate(lines)
        ]
        u, v = np.meshgrid(*places, indexing="ij")
        off = formula(u, v) - net.point(np.stack([u, v], axis=-1))
        worst = max(worst, float(np.linalg.norm(off, axis=-1).max()))
    return worst


def _normal_deviation(
    formula: Formula, net: SplineMap, ranges: Ranges, counts: tuple[int, int]
) -> float:
    """[1] the largest deviation of normals in the middles between points; g by differences."""
    middles = [_between(line, 0.5) for line in _lines(ranges, counts)]
    u, v = np.meshgrid(*middles, indexing="ij")
    slopes = []
    for axis in (0, 1):
        step = min(STEP, 0.1 / counts[axis]) * (ranges[axis][1] - ranges[axis][0])
        shifts = [(k * step * (axis == 0), k * step * (axis == 1)) for k in (-2, -1, 1, 2)]
        far, near, ahead, beyond = (formula(u + du, v + dv) for du, dv in shifts)
        slopes.append((8.0 * (ahead - near) - (beyond - far)) / (12.0 * step))
    cross = np.cross(slopes[0], slopes[1])
    length = np.linalg.norm(cross, axis=-1, keepdims=True)
    normal = cross / np.maximum(length, 1e-300)
    off = np.linalg.norm(normal - net.normal(np.stack([u, v], axis=-1)), axis=-1)
    return float(np.nan_to_num(off, nan=2.0).max())
