"""`grid`: a bicubic spline through a user's grid of points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from coverable.arrays import Array
from coverable.errors import Fault
from surfaces.arguments import ORIGIN, Checks, metres
from surfaces.fitted.fitted_patch import (
    ONE_PLACE,
    FittedPatch,
    coinciding_ends,
    extent_of,
    outward_words,
    poles_of,
    spline_through,
)
from surfaces.fitted.nurbs import SplineMap
from surfaces.fitted.nurbs_checks import MOST_POINTS, regularity_faults
from surfaces.surface import Side, SurfaceError

DEGREE = 3
SAMPLES = 8  # along each side of a field between four points, where the two surfaces are compared
SEAM = 2.0  # times as sharp as any other bend: there the ends are not joined
FLAT = np.radians(2.0)


def grid(
    points: Any,
    side: Side = "inside",
    position: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
) -> FittedPatch:
    """A freeform surface through a grid of points: the bicubic spline, u along rows.

    u and v count from 0 to 1, by the mean distance of rows, and of columns. Where the first and the
    last row (or column) are the same points, and do not meet at a crease, the surface is closed.

    Args:
        points: (m, n, 3) m, at least 2 x 2.
        side: 'outside' for a tool on the side of (u direction) x (v direction), 'inside' for one on
            the other; `notes` says which way that is. With rows along x and columns along y
            outward is +z.
        position: see `plane`, as for rpy_deg.

    Raises:
        SurfaceError: these are no such points: not finite, equal to their neighbours, a pole, a
            fold. What is known is named.

    Example:
        >>> import numpy as np
        >>> x, y = np.meshgrid(np.linspace(0, 1, 6), np.linspace(0, 1, 5), indexing="ij")
        >>> hill = grid(np.stack([x, y, 0.3 * np.sin(2 * x) * np.cos(y)], axis=2))
        >>> len(hill.cells(4, 4)), hill.u_range
        (16, (0.0, 1.0))
    """
    check = Checks("grid")
    given = np.asarray(points, dtype=float) if _is_array(points) else points
    expected = "rows of points (x, y, z) in metres, such as 20 x 30 x 3"
    found = metres("points", given, (None, None, 3), expected, 3 * MOST_POINTS, check.faults)
    if found is not None:
        _refuse_degenerate(found, check)
    pose = check.pose(side, position, rpy_deg)
    check.done()
    if found is None:  # cannot be: without points there are faults
        raise SurfaceError("grid: there are no points")
    lines = (_line(found), _line(found.swapaxes(0, 1)))
    coincide = coinciding_ends(found)
    closed = (coincide[0] and _smooth(found), coincide[1] and _smooth(found.swapaxes(0, 1)))
    net = spline_through(found, lines, DEGREE, closed)
    faults = regularity_faults(net)
    if faults:
        raise SurfaceError([Fault("points", text) for text in faults], "grid")
    return FittedPatch(
        u_range=(0.0, 1.0), v_range=(0.0, 1.0), net=net, made_from="grid", off=(0.0, 0.0),
        words=_words(net, found, lines, coincide, closed), **pose,
    )  # fmt: skip


def _is_array(points: Any) -> bool:
    return isinstance(points, np.ndarray) and points.dtype.kind in "fiu"


def _refuse_degenerate(points: Array, check: Checks) -> None:
    """Keep faults of grids that are too small, or of points that meet."""
    m, n, _ = points.shape
    if m < 2 or n < 2:
        check.keep(Fault("points", f"got {m} x {n}", expected="must be at least 2 x 2 points"))
        return
    poles = poles_of(points)
    for axis, end in poles:
        what = ("row", "column")[axis]
        number = 0 if end == 0 else points.shape[axis] - 1
        fault = f"{what} {number} is one point, a pole, where there is no normal"
        check.keep(Fault("points", fault, expected=f"leave that {what} out"))
    if poles:
        return
    least = ONE_PLACE * extent_of(points)
    for axis, what in ((1, "column"), (0, "row")):
        same = np.argwhere(np.linalg.norm(np.diff(points, axis=axis), axis=-1) <= least)
        if len(same):
            i, j = same[0].tolist()
            more = f", and {len(same) - 1} more" if len(same) > 1 else ""
            text = f"[{i}][{j}] is the same point as in the next {what}{more}"
            check.keep(Fault("points", text, expected="leave one of the two out"))


def _line(points: Array) -> Array:
    """(m,) rising from 0 to 1, by the mean distance of one row to the next."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=-1).mean(axis=1)
    line = np.concatenate([[0.0], np.cumsum(steps)])
    return np.asarray(line / line[-1])


def _smooth(points: Array) -> bool:
    """Whether the last row, which is the first again, meets it as smoothly as others meet."""
    steps = np.diff(points, axis=0)
    steps = np.concatenate([steps, steps[:1]])
    ahead, before = steps[1:], steps[:-1]
    across = np.linalg.norm(np.cross(before, ahead), axis=-1)
    turns = np.arctan2(across, (before * ahead).sum(axis=-1)).max(axis=1)
    return bool(turns[-1] <= SEAM * turns[:-1].max() + FLAT)


def _words(
    net: SplineMap,
    points: Array,
    lines: tuple[Array, Array],
    coincide: tuple[bool, bool],
    closed: tuple[bool, bool],
) -> tuple[str, ...]:
    """What a user should know."""
    m, n, _ = points.shape
    words = [
        f"A bicubic spline runs through the {m} x {n} points; between them it differs from the "
        f"bilinear surface by up to {1e3 * _from_bilinear(net, points, lines):.3g} mm, which shows "
        "how far the points leave the surface open.",
        outward_words(net.normal(np.array([[0.5, 0.5]]))),
    ]
    for what, touch, joined in zip(("rows", "columns"), coincide, closed, strict=True):
        if touch and not joined:
            words.append(f"The first and last {what} meet at a crease, so they are not joined.")
    return tuple(words)


def _from_bilinear(net: SplineMap, points: Array, lines: tuple[Array, Array]) -> float:
    """m, the largest distance of the spline from the bilinear surface at the same u and v."""
    worst = 0.0
    inner = (np.arange(SAMPLES) + 0.5) / SAMPLES
    u, v = (line[:-1, None] + inner * np.diff(line)[:, None] for line in lines)
    for k, s in enumerate(inner):
        side = (1.0 - s) * points[:-1] + s * points[1:]
        for m, t in enumerate(inner):
            flat = (1.0 - t) * side[:, :-1] + t * side[:, 1:]
            x = np.stack(np.meshgrid(u[:, k], v[:, m], indexing="ij"), axis=-1)
            worst = max(worst, float(np.linalg.norm(net.point(x) - flat, axis=-1).max()))
    return worst
