"""A mesh whose hull is crude, cut into slabs by parallel planes, each in a hull of its own.

The part of a solid between two parallel planes lies in the hull of its surface between them: what
is extreme in it and not on its surface would be inside the solid and extreme in a slab, which has
no corners. So the hulls of the clipped surface hold the solid, and no cap has to be made.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from robots.shapes.bodies import Geometry, Triangles
from robots.shapes.hulls import Hull, hull_of, hull_volume, is_convex, outer_hull

MOST_PIECES = 8
BINS = 16  # planes may lie between any two of them
WORTH = 0.04  # of the volume of the whole hull: what one more piece has to save
SAMPLES = 600  # points on the surface, by which planes are chosen


class _Cut(NamedTuple):
    """Slabs across one axis."""

    axis: int
    places: Array
    """Of the planes along the axis, rising, m."""
    volume: float
    """m^3, of the hulls together."""


def pieces_of(shape: Geometry) -> list[Hull]:
    """Convex bodies that together hold a shape; one where more would not be much smaller."""
    if isinstance(shape, Triangles):
        return list(_pieces_of_mesh(shape))
    return [hull_of(shape)]


@lru_cache(maxsize=256)
def _pieces_of_mesh(mesh: Triangles) -> tuple[Hull, ...]:
    if is_convex(mesh, WORTH):
        return (hull_of(mesh),)
    points = _on_surface(mesh)
    cut = min((_best_cut(points, axis) for axis in range(3)), key=lambda cut: cut.volume)
    if len(cut.places) == 0:
        return (hull_of(mesh),)
    ends = np.concatenate([[-np.inf], cut.places, [np.inf]])
    slabs = (_clipped(mesh, cut.axis, *ends[k : k + 2]) for k in range(len(ends) - 1))
    return tuple(outer_hull(slab) for slab in slabs if len(slab))


def _on_surface(mesh: Triangles) -> Array:
    """Points spread evenly over the surface, the same ones each time, and the hull's vertices."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    rng = np.random.default_rng(0)
    face = np.searchsorted(np.cumsum(areas), rng.random(SAMPLES) * areas.sum())
    face = np.minimum(face, len(areas) - 1)
    s, t = rng.random((2, SAMPLES, 1))
    s, t = np.where(s + t > 1.0, (1.0 - s, 1.0 - t), (s, t))
    inside = a[face] + s * (b - a)[face] + t * (c - a)[face]
    return np.concatenate([inside, hull_of(mesh).vertices])


def _best_cut(points: Array, axis: int) -> _Cut:
    """The slabs across one axis of least volume, as many as are worth it.

    Planes lie between bins of even width; with v(i, j) the volume of the hull of bins i .. j - 1,
    the least volume of k slabs over the first j bins is min over i of best(k - 1, i) + v(i, j).
    """
    along = points[:, axis]
    low, high = float(along.min()), float(along.max())
    whole = hull_volume(points)
    if high - low <= 0.0 or whole <= 0.0:
        return _Cut(axis, np.empty(0), whole)
    borders = np.linspace(low, high, BINS + 1)
    volume = np.full((BINS + 1, BINS + 1), np.inf)
    for i in range(BINS):
        for j in range(i + 1, BINS + 1):
            some = points[(along >= borders[i]) & (along <= borders[j])]
            volume[i, j] = hull_volume(some)
    best, chosen = [volume[0]], [np.zeros(BINS + 1, dtype=int)]
    for _ in range(1, MOST_PIECES):
        totals = best[-1][:, None] + volume
        chosen.append(totals.argmin(axis=0))
        best.append(totals.min(axis=0))
    count = 1
    while count < MOST_PIECES and best[count - 1][BINS] - best[count][BINS] > WORTH * whole:
        count += 1
    planes, end = list[float](), BINS
    for k in range(count - 1, 0, -1):
        end = int(chosen[k][end])
        planes.insert(0, float(borders[end]))
    return _Cut(axis, np.array(planes), float(best[count - 1][BINS]))


def _clipped(mesh: Triangles, axis: int, low: float, high: float) -> Array:
    """(k, 3) m, the corners of all triangles, each clipped to low .. high along the axis."""
    along = mesh.vertices[:, axis]
    inside = np.zeros(len(along), dtype=bool)
    inside[mesh.faces] = True
    found = [mesh.vertices[inside & (along >= low) & (along <= high)]]
    edges = mesh.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    first, second = along[edges].T
    for plane in (low, high):
        crossing = (first < plane) != (second < plane)
        if np.isfinite(plane) and crossing.any():
            a, b = (mesh.vertices[edges[crossing, k]] for k in range(2))
            share = (plane - a[:, axis]) / (b[:, axis] - a[:, axis])
            places = a + share[:, None] * (b - a)
            places[:, axis] = plane
            found.append(places)
    return np.concatenate(found)
