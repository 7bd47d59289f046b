"""The point of a triangle closest to a given one, compiled.

By the regions of Ericson, Real-Time Collision Detection (2005), section 5.1.5: products of
distances tell whether it lies at a corner, on a side, or inside. With a thin triangle these say
little more than how they were rounded. There the three sides and the inside are tried, each by
itself, and the nearest counts.
"""

from __future__ import annotations

import numpy as np

from coverable.kernels import allocating_entry, kernel

THIN = 1e-4  # [1], square of the sine of the first corner's angle


@kernel
def on_triangle(corners, f, x, y, z, weights):
    """m^2, the square of the distance of a point from a triangle; NaN where either is not finite.

    Args:
        corners: (F, 3, 3) m.
        f: which of them.
        x, y, z: m.
        weights: (3,) receives the weights of the corners at the closest point.
    """
    ax, ay, az = corners[f, 0, 0], corners[f, 0, 1], corners[f, 0, 2]
    bx, by, bz = corners[f, 1, 0], corners[f, 1, 1], corners[f, 1, 2]
    cx, cy, cz = corners[f, 2, 0], corners[f, 2, 1], corners[f, 2, 2]
    ux, uy, uz, vx, vy, vz = bx - ax, by - ay, bz - az, cx - ax, cy - ay, cz - az
    d1 = ux * (x - ax) + uy * (y - ay) + uz * (z - az)
    d2 = vx * (x - ax) + vy * (y - ay) + vz * (z - az)
    d3 = ux * (x - bx) + uy * (y - by) + uz * (z - bz)
    d4 = vx * (x - bx) + vy * (y - by) + vz * (z - bz)
    d5 = ux * (x - cx) + uy * (y - cy) + uz * (z - cz)
    d6 = vx * (x - cx) + vy * (y - cy) + vz * (z - cz)
    w0, w1, w2 = 1.0, 0.0, 0.0
    if d1 <= 0.0 and d2 <= 0.0:
        pass
    elif d3 >= 0.0 and d4 <= d3:
        w0, w1 = 0.0, 1.0
    elif d6 >= 0.0 and d5 <= d6:
        w0, w2 = 0.0, 1.0
    else:
        vc, vb, va = d1 * d4 - d3 * d2, d5 * d2 - d1 * d6, d3 * d6 - d5 * d4
        if not va + vb + vc > THIN * (d1 - d3) * (d2 - d6):
            return _on_thin_triangle(corners, f, x, y, z, weights)
        if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
            w1 = d1 / (d1 - d3)
            w0 = 1.0 - w1
        elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
            w2 = d2 / (d2 - d6)
            w0 = 1.0 - w2
        elif va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
            w2 = (d4 - d3) / ((d4 - d3) + (d5 - d6))
            w0, w1 = 0.0, 1.0 - w2
        else:
            total = 1.0 / (va + vb + vc)
            w0, w1, w2 = va * total, vb * total, vc * total
    weights[0], weights[1], weights[2] = w0, w1, w2
    return (
        (x - (w0 * ax + w1 * bx + w2 * cx)) ** 2
        + (y - (w0 * ay + w1 * by + w2 * cy)) ** 2
        + (z - (w0 * az + w1 * bz + w2 * cz)) ** 2
    )


@kernel
def _square(corners, f, x, y, z, i, wi, j, wj, k, wk):
    """m^2, the square of the distance from the place with weights wi, wj, wk of corners i, j, k."""
    c = corners
    return (
        (x - (wi * c[f, i, 0] + wj * c[f, j, 0] + wk * c[f, k, 0])) ** 2
        + (y - (wi * c[f, i, 1] + wj * c[f, j, 1] + wk * c[f, k, 1])) ** 2
        + (z - (wi * c[f, i, 2] + wj * c[f, j, 2] + wk * c[f, k, 2])) ** 2
    )


@kernel
def _on_thin_triangle(corners, f, x, y, z, weights):
    """`on_triangle` where the sine of an angle is small, or 0: sides and corners may coincide."""
    least, longest, first = np.inf, -1.0, 0
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        square, along = 0.0, 0.0
        for axis in range(3):
            side = corners[f, j, axis] - corners[f, i, axis]
            square += side * side
            given = x if axis == 0 else y if axis == 1 else z
            along += side * (given - corners[f, i, axis])
        if square > longest:
            longest, first = square, i
        t = min(max(along / square, 0.0), 1.0) if square > 0.0 else 0.0
        away = _square(corners, f, x, y, z, i, 1.0 - t, j, t, k, 0.0)
        if away < least:
            least = away
            weights[i], weights[j], weights[k] = 1.0 - t, t, 0.0
    # Inside: along the longest side, and across it to the third corner.
    i, j, k = first, (first + 1) % 3, (first + 2) % 3
    along, to, height, up = 0.0, 0.0, 0.0, 0.0
    for axis in range(3):
        side, third = (
            corners[f, j, axis] - corners[f, i, axis],
            corners[f, k, axis] - corners[f, i, axis],
        )
        given = x if axis == 0 else y if axis == 1 else z
        along += side * third
        to += side * (given - corners[f, i, axis])
    for axis in range(3):
        side, third = (
            corners[f, j, axis] - corners[f, i, axis],
            corners[f, k, axis] - corners[f, i, axis],
        )
        given = x if axis == 0 else y if axis == 1 else z
        across = third - along / longest * side
        height += across * across
        up += across * (given - corners[f, i, axis])
    wk = up / height
    wj = (to - wk * along) / longest
    wi = 1.0 - wj - wk
    if wi >= 0.0 and wj >= 0.0 and wk >= 0.0:
        away = _square(corners, f, x, y, z, i, wi, j, wj, k, wk)
        if away < least:
            least = away
            weights[i], weights[j], weights[k] = wi, wj, wk
    return least if least < np.inf else np.nan


@allocating_entry
def on_each(corners, points, squares, weights):
    """`on_triangle` for a point (F, 3) m of each triangle; fills squares (F,) and weights."""
    for f in range(corners.shape[0]):
        x, y, z = points[f, 0], points[f, 1], points[f, 2]
        squares[f] = on_triangle(corners, f, x, y, z, weights[f])
