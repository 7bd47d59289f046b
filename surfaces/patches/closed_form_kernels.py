"""Patches as compiled loops see them: the closest point to a point, and the cell it falls in.

One implementation serves `ClosedFormPatch.closest` and the search kernels alike. A new kind of
surface adds a code, a `_closest_on_...` function in its own frame, and a branch in
`closest_on_patch`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from coverable.kernels import allocating, allocating_entry

PLANE, SPHERE, CYLINDER, HYPERBOLOID = 0, 1, 2, 3
EDGE = 1e-9  # [rad], [m]: a point that misses the patch by no more than this lies on it
_TURN = 2.0 * math.pi


class PatchKernel(NamedTuple):
    """A patch of a surface, cut into cells, as a plain tuple for numba.

    It holds no arrays: numba counts references to an array whenever it is read out of a tuple,
    and that took longer than the geometry.

    Built by `ClosedFormPatch.patch_kernel` and `GridCells.patch_kernel`.
    """

    code: int
    """Which kind of surface: PLANE, SPHERE, ..."""
    shape: tuple[float, ...]
    """(2) m, lengths of the surface: radius; waist and flare; 0 where it has fewer."""
    rotation: tuple[float, ...]
    """(9) own frame in the root frame, row by row."""
    position: tuple[float, ...]
    """m, origin of the own frame in the root frame."""
    side_sign: float
    """-1.0 inside, +1.0 outside."""
    low: tuple[float, float]
    """rad or m, where the ranges of u and v begin."""
    high: tuple[float, float]
    """rad or m, where they end."""
    closed: tuple[bool, bool]
    """True where the range is a full turn."""
    cells: tuple[int, int]
    """Number of cells along u and v."""


@allocating
def wrap(angle, low, high):
    """The value angle + 2 pi k (rad) that lies in low..high, or failing that, nearest to it."""
    a = low + (angle - low) % _TURN
    if a > high and a - high > low - (a - _TURN):
        a -= _TURN
    return a


@allocating
def _closest_on_sphere(radius, x, y, z, low, high):
    """Closest point on the sphere about the origin: u, v, height, normal, in its own frame."""
    rho = math.hypot(x, y)
    distance = math.hypot(rho, z)
    if distance == 0.0:  # all points are equally close: take the patch's first corner
        u, v = low[0], low[1]
        s = math.sin(u)
        return u, v, -radius, s * math.cos(v), s * math.sin(v), math.cos(u)
    u = math.atan2(rho, z)
    v = wrap(math.atan2(y, x), low[1], high[1])
    if rho <= EDGE * distance:  # a pole is one point for every azimuth: take one of the patch
        v = min(max(v, low[1]), high[1])
    return u, v, distance - radius, x / distance, y / distance, z / distance


@allocating
def _closest_on_cylinder(radius, x, y, z, low, high):
    """Closest point on the cylinder about z: u, v, height, normal, in its own frame."""
    rho = math.hypot(x, y)
    if rho == 0.0:
        u = low[0]
        return u, z, -radius, math.cos(u), math.sin(u), 0.0
    return wrap(math.atan2(y, x), low[0], high[0]), z, rho - radius, x / rho, y / rho, 0.0


@allocating
def closest_on_hyperbola(waist, slope, rho, z):
    """Abscissa t of the point of r(t) = sqrt(waist^2 + slope^2 t^2) closest to (z, rho).

    It is a root of f(t) = (1 + s^2) t - s^2 rho t / r(t) - z. For z >= 0, f is convex on t >= 0
    with f(0) <= 0, so it has one root there where it rises, and the closest point is that one.
    Newton from a bound on its right falls onto it monotonically, and stops when rounding ends
    the fall.
    """
    target = abs(z)
    square = slope * slope
    t = (target + slope * rho) / (1.0 + square)
    for _ in range(200):
        r = math.sqrt(waist * waist + square * t * t)
        pull = square * rho / r
        value = (1.0 + square - pull) * t - target
        rise = 1.0 + square - pull * (waist / r) ** 2
        if not (value > 0.0 and rise > 0.0):
            break
        following = max(t - value / rise, 0.0)
        if following >= t:
            break
        t = following
    return math.copysign(t, z)


@allocating
def _closest_on_hyperboloid(waist, flare, x, y, z, low, high):
    """Closest point on the hyperboloid about z: u, v, height, normal, in its own frame."""
    rho = math.hypot(x, y)
    slope = waist / flare
    t = closest_on_hyperbola(waist, slope, rho, z)
    r = math.sqrt(waist * waist + slope * slope * t * t)
    rise = slope * slope * t / r
    length = math.sqrt(1.0 + rise * rise)
    height = ((rho - r) - rise * (z - t)) / length
    if rho == 0.0:
        u = low[0]
        cosine, sine = math.cos(u), math.sin(u)
    else:
        u = wrap(math.atan2(y, x), low[0], high[0])
        cosine, sine = x / rho, y / rho
    return u, t, height, cosine / length, sine / length, -rise / length


@allocating
def closest_on_patch(patch, x, y, z):
    """The point of the surface closest to (x, y, z), all in the root frame.

    Args:
        patch: a `PatchKernel`.
        x, y, z: m.

    Returns:
        (u, v, height, nx, ny, nz): parameters (rad or m; an angle is wrapped into the patch's
        range, or stays outside it if no turn brings it in), signed height along the outward
        normal (m), and that unit normal.
    """
    r, shape, low, high = patch.rotation, patch.shape, patch.low, patch.high
    dx = x - patch.position[0]
    dy = y - patch.position[1]
    dz = z - patch.position[2]
    a = r[0] * dx + r[3] * dy + r[6] * dz
    b = r[1] * dx + r[4] * dy + r[7] * dz
    c = r[2] * dx + r[5] * dy + r[8] * dz
    if patch.code == SPHERE:
        u, v, height, na, nb, nc = _closest_on_sphere(shape[0], a, b, c, low, high)
    elif patch.code == CYLINDER:
        u, v, height, na, nb, nc = _closest_on_cylinder(shape[0], a, b, c, low, high)
    elif patch.code == HYPERBOLOID:
        u, v, height, na, nb, nc = _closest_on_hyperboloid(shape[0], shape[1], a, b, c, low, high)
    elif patch.code == PLANE:
        u, v, height, na, nb, nc = a, b, c, 0.0, 0.0, 1.0
    else:
        u, v, height, na, nb, nc = math.nan, math.nan, math.nan, math.nan, math.nan, math.nan
    return (
        u,
        v,
        height,
        r[0] * na + r[1] * nb + r[2] * nc,
        r[3] * na + r[4] * nb + r[5] * nc,
        r[6] * na + r[7] * nb + r[8] * nc,
    )


@allocating
def u_direction(patch, u, v):
    """(x, y, z), the unit direction in the root frame in which u grows at u, v (rad or m)."""
    a, b, c = -math.sin(u), math.cos(u), 0.0
    if patch.code == SPHERE:
        a, b, c = math.cos(u) * math.cos(v), math.cos(u) * math.sin(v), -math.sin(u)
    elif patch.code == PLANE:
        a, b = 1.0, 0.0
    r = patch.rotation
    return (
        r[0] * a + r[1] * b + r[2] * c,
        r[3] * a + r[4] * b + r[5] * c,
        r[6] * a + r[7] * b + r[8] * c,
    )


@allocating
def on_patch(patch, u, v):
    """True where u and v (rad or m, as `closest_on_patch` wraps them) lie in the patch's ranges."""
    (u0, v0), (u1, v1) = patch.low, patch.high
    return u0 - EDGE <= u <= u1 + EDGE and v0 - EDGE <= v <= v1 + EDGE


@allocating
def cell_at(patch, u, v):
    """Flat row-major index of the cell at u, v (rad or m), or -1 outside the patch.

    A closed parameter may be off by any number of turns. A border belongs to the cell of higher
    index, the outermost border to the last cell.
    """
    (u0, v0), (u1, v1) = patch.low, patch.high
    u_closed, v_closed = patch.closed[0], patch.closed[1]
    rows, columns = patch.cells[0], patch.cells[1]
    if u_closed:
        u = wrap(u, u0, u1)
    if v_closed:
        v = wrap(v, v0, v1)
    if rows == 0 or columns == 0 or not on_patch(patch, u, v):
        return -1
    i = math.floor((u - u0) / (u1 - u0) * rows)
    j = math.floor((v - v0) / (v1 - v0) * columns)
    return min(max(i, 0), rows - 1) * columns + min(max(j, 0), columns - 1)


@allocating_entry
def closest_points(patch, points):
    """`closest_on_patch` (k, 6) and `on_patch` (k,) for many points (k, 3) m."""
    count = points.shape[0]
    values = np.empty((count, 6))
    inside = np.empty(count, dtype=np.bool_)
    for k in range(count):
        found = closest_on_patch(patch, points[k, 0], points[k, 1], points[k, 2])
        for j in range(6):
            values[k, j] = found[j]
        inside[k] = on_patch(patch, found[0], found[1])
    return values, inside
