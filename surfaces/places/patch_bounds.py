"""How much points and normals of a patch bend along its parameters: proved bounds for each kind.

Each function takes boxes of parameters, low and high (k, 2), and returns (k, 3, 2): numbers A, B, C
for the point (m) and for the outward unit normal such that along every straight line in the box, at
the rate (u', v'), their second derivatives are at most A u'^2 + 2 B |u' v'| + C v'^2. Second
derivatives may jump within a box, first ones may not: `spline_bounds.kinks` says where they do.

Surfaces of revolution turn a profile (r(t), z(t)), with the unit normal (a(t), c(t)), about z:
f = (r cos p, r sin p, z), and so

    |f_tt| = |(r'', z'')|    |f_tp| = |r'|    |f_pp| = r

and likewise for the normal, with (a, c) in place of (r, z). |cos| and |sin| change by no more than
their argument, which bounds them over an interval by their values at its middle.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from coverable_arrays import Array
from surfaces.places.places import second_derivatives_of_unit
from surfaces.places.spline_bounds import spline_bounds

LEAST = 1e-4  # [1] of a range, a step of differences

BoxBounds = Callable[[Any, Array, Array], Array]


def box_bounds(patch: Any) -> BoxBounds:
    """The function for a kind of patch."""
    return _KINDS.get(patch.kind, _measured)


def _measured(patch: Any, low: Array, high: Array) -> Array:
    """Of a kind that is not known here: twice the second differences over the box, no proof."""
    half = np.maximum(0.5 * (high - low), LEAST * np.ptp([patch.u_range, patch.v_range], axis=1))
    middle = 0.5 * (low + high)
    at = {
        (i, k): np.stack(patch.point_and_normal(*(middle + half * [i, k]).T), axis=1)
        for i in (-1, 0, 1)
        for k in (-1, 0, 1)
    }
    hu, hv = half.T[:, :, None, None]
    along = [
        [(at[1, k] - 2.0 * at[0, k] + at[-1, k]) / hu**2 for k in (-1, 0, 1)],
        [(at[1, 1] - at[1, -1] - at[-1, 1] + at[-1, -1]) / (4.0 * hu * hv)],
        [(at[i, 1] - 2.0 * at[i, 0] + at[i, -1]) / hv**2 for i in (-1, 0, 1)],
    ]
    return 2.0 * np.stack([np.linalg.norm(d, axis=-1).max(axis=0) for d in along], axis=1)


def _table(point: tuple[Any, Any, Any], normal: tuple[Any, Any, Any], count: int) -> Array:
    """(k, 3, 2) from numbers or arrays (k,)."""
    made = np.empty((count, 3, 2))
    for row in range(3):
        made[:, row, 0], made[:, row, 1] = point[row], normal[row]
    return made


def _wave(function: Callable[[Array], Array], low: Array, high: Array) -> Array:
    """(k,) at least |cos| or |sin| over intervals of angles."""
    return np.minimum(np.abs(function(0.5 * (low + high))) + 0.5 * (high - low), 1.0)


def _plane(patch: Any, low: Array, high: Array) -> Array:
    """A plane is straight."""
    return np.zeros((len(low), 3, 2))


def _sphere(patch: Any, low: Array, high: Array) -> Array:
    """u the polar angle, v the azimuth; the normal is the point over the radius."""
    size = patch.radius
    turn = _wave(np.cos, low[:, 0], high[:, 0]), _wave(np.sin, low[:, 0], high[:, 0])
    return _table((size, size * turn[0], size * turn[1]), (1.0, *turn), len(low))


def _cylinder(patch: Any, low: Array, high: Array) -> Array:
    """u the angle about z, v = z."""
    return _table((patch.radius, 0.0, 0.0), (1.0, 0.0, 0.0), len(low))


def _cone(patch: Any, low: Array, high: Array) -> Array:
    """u the angle about z, v = z, r = radius + slope v."""
    widest = np.maximum(*(patch.radius + patch.slope * end[:, 1] for end in (low, high)))
    out = 1.0 / np.hypot(1.0, patch.slope)
    return _table((widest, abs(patch.slope), 0.0), (out, 0.0, 0.0), len(low))


def _torus(patch: Any, low: Array, high: Array) -> Array:
    """u the angle about z, v that about the tube."""
    cos, sin = _wave(np.cos, low[:, 1], high[:, 1]), _wave(np.sin, low[:, 1], high[:, 1])
    point = (patch.ring + patch.tube * cos, patch.tube * sin, patch.tube)
    return _table(point, (cos, sin, 1.0), len(low))


def _hyperboloid(patch: Any, low: Array, high: Array) -> Array:
    """u the angle about z, v = z, r = waist sqrt(1 + (z / flare)^2).

    With w = z / flare: r' = waist w / (flare sqrt(1 + w^2)) grows with w,
    r'' = waist / flare^2 (1 + w^2)^-1.5 falls with |w|, and |r'''| is
    3 waist |w| / flare^3 (1 + w^2)^-2.5. The normal has the angle p = atan(r') to the horizontal:
    p' = r'' / (1 + r'^2), and p'' = r''' / (1 + r'^2) - 2 r' r''^2 / (1 + r'^2)^2, so that
    |n_vv| <= p'^2 + |p''| and |n_uv| = sin p p'.
    """
    most = np.maximum(np.abs(low[:, 1]), np.abs(high[:, 1])) / patch.flare
    least = (
        np.where(
            low[:, 1] * high[:, 1] > 0.0, np.minimum(np.abs(low[:, 1]), np.abs(high[:, 1])), 0.0
        )
        / patch.flare
    )
    rising = patch.waist / patch.flare
    slope = rising * most / np.sqrt(1.0 + most**2)
    flat = 1.0 + (rising * least) ** 2 / (1.0 + least**2)  # 1 + r'^2 at least
    second = rising / patch.flare * (1.0 + least**2) ** -1.5
    third = 3.0 * rising / patch.flare**2 * most * (1.0 + least**2) ** -2.5
    turn = second / flat
    turning = third / flat + 2.0 * slope * turn**2
    widest = patch.waist * np.sqrt(1.0 + most**2)
    lean = slope / np.sqrt(1.0 + slope**2)
    return _table(
        (widest, slope, second), (1.0 / np.sqrt(flat), lean * turn, turn**2 + turning), len(low)
    )


def _ellipsoid(patch: Any, low: Array, high: Array) -> Array:
    """The unit sphere s stretched by E: f = E s, and n = g / |g| with g = E^-1 s."""
    axes = np.array(patch.semi_axes)
    cos, sin = _wave(np.cos, low[:, 0], high[:, 0]), _wave(np.sin, low[:, 0], high[:, 0])
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    su, cu = np.sin(middle[:, 0]), np.cos(middle[:, 0])
    sv, cv = np.sin(middle[:, 1]), np.cos(middle[:, 1])
    ones, zeros = np.ones_like(su), np.zeros_like(su)
    second = np.stack([ones, cos, sin], axis=1) / axes.min()
    length = np.linalg.norm(np.stack([su * cv, su * sv, cu], axis=1) / axes, axis=1)
    by_u = np.linalg.norm(np.stack([cu * cv, cu * sv, -su], axis=1) / axes, axis=1)
    by_v = np.linalg.norm(np.stack([-su * sv, su * cv, zeros], axis=1) / axes, axis=1)
    by_u = by_u + second[:, 0] * half[:, 0] + second[:, 1] * half[:, 1]
    by_v = by_v + second[:, 1] * half[:, 0] + second[:, 2] * half[:, 1]
    least = np.maximum(length - by_u * half[:, 0] - by_v * half[:, 1], 1.0 / axes.max())
    point = axes.max() * np.stack([ones, cos, sin], axis=1)
    return np.stack([point, second_derivatives_of_unit(least, by_u, by_v, second)], axis=2)


def _revolution(patch: Any, low: Array, high: Array) -> Array:
    """u along a profile of cubic splines, v the angle about z.

    Second derivatives of the profile are straight between knots, so their largest values lie at the
    ends of the interval and at the knots within; a third derivative is constant between knots. The
    direction of the tangent has the angle p: p' = y' x y'' / |y'|^2 for the profile y, and
    p'' = y' x y''' / |y'|^2 - 2 p' (y' . y'') / |y'|^2.
    """
    profile = patch.profile
    start, stop = low[:, 0], high[:, 0]
    ends = np.stack([start, stop], axis=1)
    second = np.linalg.norm(profile.at(ends, 2), axis=2).max(axis=1)
    third = np.zeros(len(low))
    at_knots = np.linalg.norm(profile.at(profile.knots, 2), axis=1)
    middles = 0.5 * (profile.knots[1:] + profile.knots[:-1])
    jerks = np.linalg.norm(profile.at(middles, 3), axis=1)
    for k, jerk in enumerate(jerks):
        touched = (start <= profile.knots[k + 1]) & (stop >= profile.knots[k])
        third = np.where(touched, np.maximum(third, jerk), third)
    for k, value in enumerate(at_knots):
        within = (start <= profile.knots[k]) & (stop >= profile.knots[k])
        second = np.where(within, np.maximum(second, value), second)
    half = 0.5 * (stop - start)
    middle = profile.at(0.5 * (start + stop), 1)
    speed = np.linalg.norm(middle, axis=1)
    slowest = speed - half * second
    known = slowest > 0.0
    slow = np.where(known, slowest, 1.0)
    turn = second / slow
    turning = third / slow + 2.0 * turn**2
    falling = np.abs(middle[:, 0]) + half * second  # |r'| at most
    rising = np.minimum((np.abs(middle[:, 1]) + half * second) / slow, 1.0)  # |z'| / |y'|
    widest = np.abs(profile.at(0.5 * (start + stop))[:, 0]) + half * falling
    normal = (turn**2 + turning, np.minimum(falling / slow, 1.0) * turn, rising)
    bounds = _table((second, falling, widest), normal, len(low))
    bounds[~known] = np.inf
    return bounds


_KINDS: dict[str, BoxBounds] = {
    "plane": _plane,
    "sphere": _sphere,
    "cylinder": _cylinder,
    "cone": _cone,
    "torus": _torus,
    "hyperboloid": _hyperboloid,
    "ellipsoid": _ellipsoid,
    "revolution": _revolution,
    "bspline": spline_bounds,
    "parametric": spline_bounds,
    "grid": spline_bounds,
}
