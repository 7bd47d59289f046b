"""How much points and normals of a B-spline or NURBS patch bend: bounds from its control points.

A B-spline lies in the convex hull of its control points, and so do its derivatives in that of
theirs. For a rational one, S = A / w with splines A and w, differentiating w S = A gives bounds of
the derivatives of S one after the other. The normal is g / |g| with g = S_u x S_v:

    g_u = S_uu x S_v + S_u x S_uv            g_uu = S_uuu x S_v + 2 S_uu x S_uv + S_u x S_uuv
    g_v = S_uv x S_v + S_u x S_vv            g_vv = S_uvv x S_v + 2 S_uv x S_vv + S_u x S_vvv
                                             g_uv = S_uuv x S_v + S_uu x S_vv + S_u x S_uvv
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from coverable_arrays import Array, Ints
from surfaces.places.places import second_derivatives_of_unit

ORDERS = ((0, 1), (1, 0), (0, 2), (1, 1), (2, 0), (0, 3), (1, 2), (2, 1), (3, 0))
MOST_SPANS = 4  # of a box along one parameter; a wider one is not bounded
SMOOTH = 2  # the surface needs so many continuous derivatives for its normal to have one


def kinks(patch: Any, axis: int) -> Array:
    """Values of u (axis 0) or v (axis 1) where first derivatives of point or normal may jump."""
    net = patch.net
    knots, times = np.unique(net.knots[axis], return_counts=True)
    low, high = net.low[axis], net.high[axis]
    jumps = (times > net.degree[axis] - SMOOTH) & (knots > low) & (knots < high)
    ends = [low, high] if net.closed[axis] else []
    return np.unique(np.concatenate([knots[jumps], ends]))


def spline_bounds(patch: Any, low: Array, high: Array) -> Array:
    """See `patch_bounds`."""
    spans, table = _tables(patch.net)
    first, last = np.empty((2, len(low), 2), dtype=np.int64)
    for axis in (0, 1):
        most = len(spans[axis]) - 2
        found = np.searchsorted(spans[axis], low[:, axis], side="left") - 1
        first[:, axis] = np.clip(found, 0, most)
        found = np.searchsorted(spans[axis], high[:, axis], side="right") - 1
        last[:, axis] = np.clip(found, 0, most)
    wide = (last - first).max(axis=1) >= MOST_SPANS
    last = np.minimum(last, first + MOST_SPANS - 1)
    bound = table[first[:, 0], first[:, 1]]
    for step in np.ndindex(MOST_SPANS, MOST_SPANS):
        row, column = np.minimum(first + step, last).T
        bound = np.maximum(bound, table[row, column])
    made = _point_and_normal(patch, dict(zip(ORDERS, bound.T, strict=True)), low, high)
    made[wide] = np.inf
    return made


def _point_and_normal(
    patch: Any, s: dict[tuple[int, int], Array], low: Array, high: Array
) -> Array:
    """(k, 3, 2) from bounds (k,) of the derivatives of S in boxes."""
    half, middle = 0.5 * (high - low), 0.5 * (low + high)
    jet = patch.net.jet(middle)
    length = np.linalg.norm(np.cross(jet.first[:, 0], jet.first[:, 1]), axis=-1)
    # Derivatives by their values in the middle, where that is sharper.
    second, first = jet.second, jet.first
    values = {
        (2, 0): second[:, 0, 0],
        (1, 1): second[:, 0, 1],
        (0, 2): second[:, 1, 1],
        (1, 0): first[:, 0],
        (0, 1): first[:, 1],
    }
    s = dict(s)
    for (a, b), value in values.items():
        change = s[a + 1, b] * half[:, 0] + s[a, b + 1] * half[:, 1]
        s[a, b] = np.minimum(s[a, b], np.linalg.norm(value, axis=1) + change)
    u, v = s[1, 0], s[0, 1]
    by_u = s[2, 0] * v + u * s[1, 1]
    by_v = s[1, 1] * v + u * s[0, 2]
    by_uu = s[3, 0] * v + 2.0 * s[2, 0] * s[1, 1] + u * s[2, 1]
    by_uv = s[2, 1] * v + s[2, 0] * s[0, 2] + u * s[1, 2]
    by_vv = s[1, 2] * v + 2.0 * s[1, 1] * s[0, 2] + u * s[0, 3]
    least = length - by_u * half[:, 0] - by_v * half[:, 1]
    second = np.stack([by_uu, by_uv, by_vv], axis=1)
    normal = second_derivatives_of_unit(least, by_u, by_v, second)
    point = np.stack([s[2, 0], s[1, 1], s[0, 2]], axis=1)
    return np.stack([point, normal], axis=2)


@lru_cache(maxsize=64)  # splines are values, compared by identity
def _tables(net: Any) -> tuple[tuple[Array, Array], Array]:
    """Ends of the spans of u and of v; and (su, sv, 9) bounds of `ORDERS` of S on each span."""
    points = net.points
    weights = np.ones(points.shape[:2]) if net.weights is None else net.weights
    nets = {(0, 0): np.concatenate([weights[..., None] * points, weights[..., None]], axis=2)}
    for a, b in ORDERS:
        before, axis = ((a, b - 1), 1) if b else ((a - 1, b), 0)
        nets[a, b] = _derived(nets[before], net.knots[axis], net.degree[axis], (a, b)[axis], axis)
    kept = [_kept_spans(net.knots[axis], net.degree[axis]) for axis in (0, 1)]
    spans = tuple(np.append(net.knots[axis][some], net.knots[axis][some[-1] + 1])
                  for axis, some in enumerate(kept))  # fmt: skip
    # Seen from a point of the span itself, A is as small as it can be.
    near = _by_span(nets[0, 0], kept, net.degree, (0, 0))
    centres = near[..., :3].sum(axis=(1, 3)) / near[..., 3:].sum(axis=(1, 3))
    sizes = {}
    for order, of in nets.items():
        some = _by_span(of, kept, net.degree, order)
        moved = some[..., :3] - some[..., 3:] * centres[:, None, :, None]
        both = np.stack([np.linalg.norm(moved, axis=-1), np.abs(some[..., 3])], axis=-1)
        sizes[order] = both.max(axis=(1, 3))
    least = near[..., 3].min(axis=(1, 3))
    return (spans[0], spans[1]), np.stack(_quotients(sizes, least), axis=2)


def _derived(net: Array, knots: Array, degree: int, order: int, axis: int) -> Array:
    """Control points of the derivative of order `order` from those of the one before.

    Where a control point has no span of its own, its derivative counts as zero.
    """
    left = degree - order + 1  # the degree that is differentiated
    if left <= 0:
        return np.zeros_like(net)
    inner = knots[order - 1 : len(knots) - order + 1]
    count = net.shape[axis]
    gaps = inner[left + 1 : left + count] - inner[1:count]
    steps = np.diff(net, axis=axis)
    shape = [1, 1, 1]
    shape[axis] = len(gaps)
    rate = np.divide(left, gaps, out=np.zeros_like(gaps), where=gaps > 0.0)
    return np.asarray(steps * rate.reshape(shape))


def _kept_spans(knots: Array, degree: int) -> Ints:
    """Indices k of the knot spans [t_k, t_k+1] with a width, in the spline's domain."""
    within = np.arange(degree, len(knots) - degree - 1)
    return within[knots[within + 1] > knots[within]]


def _by_span(values: Array, kept: list[Ints], degree: Any, order: tuple[int, int]) -> Array:
    """(su, a, sv, b, 4) the control points that count on each span, by rows and columns."""
    for axis in (0, 1):
        some = kept[axis][:, None] - np.arange(min(order[axis], degree[axis]), degree[axis] + 1)
        some = np.clip(some, 0, values.shape[2 * axis] - 1)
        values = np.take(values, some, axis=2 * axis)
    return values


def _quotients(sizes: dict[tuple[int, int], Array], w: Array) -> list[Array]:
    """Bounds (su, sv) of the derivatives `ORDERS` of S = A / w, from those of A and w.

    w S_ab = A_ab - the sum over all lower (i, j) of C(a, i) C(b, j) w_(a-i, b-j) S_ij.
    """
    from math import comb

    s = {(0, 0): sizes[0, 0][..., 0] / w}
    for a, b in ORDERS:
        total = sizes[a, b][..., 0]
        for i, j in np.ndindex(a + 1, b + 1):
            if (i, j) != (a, b):
                rest = sizes[a - i, b - j][..., 1]
                total = total + comb(a, i) * comb(b, j) * rest * s[i, j]
        s[a, b] = total / w
    return [s[order] for order in ORDERS]
