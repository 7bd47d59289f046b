"""Check a control net and its knots, and whether the patch they make has a normal everywhere."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np

from coverable.arrays import Array
from coverable.errors import Fault, shown
from surfaces.arguments import LARGEST_RATIO, metres, table
from surfaces.fitted.nurbs import SplineMap

MOST_POINTS = 40_000  # control points
MOST_DEGREE = 9
_LEAST = 1e-6  # of the extent, and of a right angle's sine
_KNOT_GAP = 1e-9  # of the range
_KINK = 1e-6  # [rad]
_SAMPLES = 8  # in each span
_MOST_SAMPLES = 600  # along each parameter, if that leaves two for each span


def checked_points(points: Any, faults: list[Fault]) -> Array | None:
    """The control net (m, n, 3), or None after a fault."""
    expected = "rows of points (x, y, z) in metres, such as 4 x 4 x 3"
    return metres("points", points, (None, None, 3), expected, 3 * MOST_POINTS, faults)


def checked_degree(degree: Any, shape: tuple[int, ...], faults: list[Fault]) -> tuple[int, int]:
    """The two degrees, each less than the number of points along it."""
    try:
        p, q = (operator.index(value) for value in degree)
        if any(isinstance(value, bool) for value in degree):
            raise TypeError
    except (TypeError, ValueError):
        p, q = 0, 0
    if not (1 <= p <= MOST_DEGREE and 1 <= q <= MOST_DEGREE):
        expected = f"must be two whole numbers in 1 .. {MOST_DEGREE}, along u and v"
        faults.append(Fault("degree", f"got {shown(degree)}", expected=expected))
        return 1, 1
    for name, order, count in (("rows", p, shape[0]), ("columns", q, shape[1])):
        if count <= order:
            expected = f"must have at least {order + 1} {name} for the degree {order}"
            got = f"got {count}; add points or lower the degree"
            faults.append(Fault("points", got, expected=expected))
    return p, q


def checked_weights(weights: Any, shape: tuple[int, ...], faults: list[Fault]) -> Array | None:
    """The weights (m, n), or None where none are given or after a fault."""
    if weights is None:
        return None
    expected = f"one number > 0 for each point, {shape[0]} x {shape[1]}"
    found = table("weights", weights, (shape[0], shape[1]), expected, MOST_POINTS, faults)
    if found is None or not found.size:
        return None
    if found.min() <= 0.0 or found.max() > LARGEST_RATIO * found.min():
        i, j = np.unravel_index(int(np.argmin(found)), found.shape)
        expected = f"must be > 0 and differ by a factor of at most {LARGEST_RATIO:g}"
        got = f"got {found.min():g} at [{i}][{j}] and {found.max():g} as the largest"
        faults.append(Fault("weights", got, expected=expected))
        return None
    return found


def checked_knots(name: str, knots: Any, count: int, degree: int, faults: list[Fault]) -> Array:
    """A knot vector (count + degree + 1,); clamped and uniform over 0..1 where none is given."""
    clamped = np.concatenate(
        [np.zeros(degree), np.linspace(0.0, 1.0, max(count - degree + 1, 2)), np.ones(degree)]
    )
    if knots is None:
        return clamped
    length = count + degree + 1
    expected = f"{length} numbers that never fall ({count} points + degree {degree} + 1), or None"
    found = table(name, knots, (length,), expected, length + MOST_POINTS, faults)
    if found is None:
        return clamped
    steps = np.diff(found)
    if (steps < 0.0).any():
        k = int(np.argmax(steps < 0.0))
        got = f"got {found[k]:g} and then {found[k + 1]:g} at [{k + 1}]"
        faults.append(Fault(name, got, expected="must never fall"))
        return clamped
    low, high = found[degree], found[count]
    gaps = steps[steps > 0.0]
    if not low < high or gaps.min() < _KNOT_GAP * (found[-1] - found[0]):
        expected = (
            f"must span a range from [{degree}] to [{count}], its knots equal or at least "
            f"{_KNOT_GAP:g} of it apart"
        )
        faults.append(Fault(name, f"got {low:g} .. {high:g}", expected=expected))
        return clamped
    values, times = np.unique(found, return_counts=True)
    inner = (values > low) & (values < high)
    if (times > degree + 1).any() or (inner & (times > degree)).any():
        worst = values[np.argmax(np.where(inner, times + 1, times))]
        text = (
            f"must hold no knot more than {degree} times, {degree + 1} times at its ends; "
            f"{worst:g} is there more often, and the patch would break apart there"
        )
        faults.append(Fault(name, text))
        return clamped
    return found


def regularity_faults(spline: SplineMap) -> list[str]:
    """Where the patch has no normal, has a kink or folds, as far as a dense grid shows it.

    The grid has 8 samples in each knot span (fewer where there are more than 75 spans), and looks
    at a knot from both sides. Between samples the normal is taken to turn by less than a right
    angle; a fold turns it over, so that it shows even where no sample meets the crease.
    """
    lines = [_both_sides(spline, axis) for axis in (0, 1)]
    mesh = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    along_u, along_v = spline.tangents(mesh)
    cross = np.cross(along_u, along_v)
    length_u, length_v = (np.linalg.norm(t, axis=-1) for t in (along_u, along_v))
    width = np.subtract(spline.high, spline.low)
    area = np.linalg.norm(cross, axis=-1)
    least = _LEAST * spline.extent
    bad = (length_u * width[0] <= least) | (length_v * width[1] <= least)
    bad |= area <= _LEAST * length_u * length_v
    if bad.any():
        return [
            f"the patch must have a normal everywhere, but has none near {_place(mesh[bad][0])}: "
            f"its points meet or lie along one line there; move them apart, "
            f"or leave that part out with a narrower range of u or v"
        ]
    normal = cross / area[..., None]
    for axis in (0, 1):
        before, after = (
            np.take(normal, range(*ends), axis=axis)
            for ends in ((0, len(lines[axis]) - 1), (1, len(lines[axis])))
        )
        turn = np.linalg.norm(after - before, axis=-1)  # 2 sin(angle / 2)
        at_knot = np.diff(lines[axis]) < _KNOT_GAP / 2.0 * width[axis]
        at_knot = at_knot[:, None] if axis == 0 else at_knot[None, :]
        kink, fold = at_knot & (turn > _KINK), turn >= np.sqrt(2.0)
        for wrong, text in ((kink, "has a kink"), (fold, "folds over or bends too sharply")):
            if wrong.any():
                place = mesh[tuple(np.argwhere(wrong)[0])]
                return [
                    f"the patch must be smooth, but {text} near {_place(place)}; "
                    f"move the points there, or cut it into two patches"
                ]
    return []


def _both_sides(spline: SplineMap, axis: int) -> Array:
    """Sample values along one parameter, with the last number before each inner knot too."""
    breaks = spline.breaks(axis)
    each = max(2, min(_SAMPLES, _MOST_SAMPLES // (len(breaks) - 1)))
    before = np.nextafter(breaks[1:-1], -np.inf)
    return np.unique(np.concatenate([spline.line(axis, 0, each), before]))


def _place(x: Array) -> str:
    return f"(u, v) = ({x[0]:.4g}, {x[1]:.4g})"
