"""Points inside bodies, and how deep they are: how far it is to the nearest point outside.

A point that is r deep in one body and s deep in another keeps them together: the two are moved
apart by no motion of less than r + s. A mesh that is not a convex solid has corners and no depth.
"""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array
from feasibility.certification.tool_alone import planes_around
from feasibility.collisions import HalfSpace
from robots.shapes import Triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere

ALONG, ACROSS = 9, 5  # points along the longest side of a body, and along the others
FINEST = 10  # parts of the widest side of a mesh that no edge is longer than
MOST_CORNERS = 64  # of a mesh


def depths(shape: object, points: Array) -> Array | None:
    """(...) m, how deep points (..., 3) are, at most 0 outside; None of what has no known inside.

    How far outside a point is, is not told. So a point of one body counts only where it is inside
    the other one too: what overlaps by less than the points are apart may be missed.

    Args:
        shape: a primitive, `Triangles` or a `HalfSpace`.
        points: m, in its own frame.
    """
    x = np.abs(points)
    match shape:
        case Sphere(radius):
            return np.asarray(radius - np.linalg.norm(points, axis=-1))
        case Capsule(radius, length):
            past = np.maximum(x[..., 2] - 0.5 * length, 0.0)
            return np.asarray(radius - np.sqrt(x[..., 0] ** 2 + x[..., 1] ** 2 + past**2))
        case Cylinder(radius, length):
            around = radius - np.hypot(x[..., 0], x[..., 1])
            return np.minimum(around, 0.5 * length - x[..., 2])
        case Box(size):
            return np.asarray((0.5 * np.array(size) - x).min(axis=-1))
        case HalfSpace():
            return -points[..., 2]
        case Triangles():
            planes = planes_around(shape)
            if planes is None:
                return None
            return np.asarray(-(points @ planes[:, :3].T + planes[:, 3]).max(axis=-1))
    return None


def points_inside(shape: object) -> tuple[Array, Array]:
    """(k, 3) m, points of a body in its own frame, and (k,) m, how deep they are."""
    if isinstance(shape, Triangles):
        corners = _apart(shape.vertices[np.unique(shape.faces)])
        grid = _grid(shape.vertices.min(axis=0), shape.vertices.max(axis=0))
        found = depths(shape, grid)
        if found is None:
            corners = _apart(_all_over(shape))
            return corners, np.zeros(len(corners))
        inside = found > 0.0
        points = np.concatenate([corners, grid[inside]])
        return points, np.append(np.zeros(len(corners)), found[inside])
    half = _half_sizes(shape)
    # A little less than the body, for rounding.
    grid = (1.0 - 1e-9) * _grid(-half, half)
    found = depths(shape, grid)
    if found is None:
        return np.empty((0, 3)), np.empty(0)
    inside = found >= 0.0
    return grid[inside], found[inside]


def _all_over(mesh: Triangles) -> Array:
    """(k, 3) m, corners of a mesh whose wide triangles are cut."""
    from trimesh.remesh import subdivide_to_size

    widest = float(np.ptp(mesh.vertices, axis=0).max())
    vertices, _ = subdivide_to_size(mesh.vertices, mesh.faces, widest / FINEST, max_iter=20)
    return np.asarray(vertices, dtype=np.float64)


def _half_sizes(shape: object) -> Array:
    """(3,) m, half the sides of the box around a primitive."""
    match shape:
        case Sphere(radius):
            return np.full(3, radius)
        case Capsule(radius, length):
            return np.array([radius, radius, radius + 0.5 * length])
        case Cylinder(radius, length):
            return np.array([radius, radius, 0.5 * length])
        case Box(size):
            return 0.5 * np.array(size)
    return np.zeros(3)


def _grid(low: Array, high: Array) -> Array:
    """(k, 3) points all over a box, its corners too."""
    counts = np.full(3, ACROSS)
    counts[int(np.argmax(high - low))] = ALONG
    sides = [np.linspace(a, b, int(k)) for a, b, k in zip(low, high, counts, strict=True)]
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3)


def _apart(corners: Array) -> Array:
    """Some of the corners, far from each other."""
    chosen, away = [0], np.full(len(corners), np.inf)
    while len(chosen) < min(MOST_CORNERS, len(corners)):
        away = np.minimum(away, ((corners - corners[chosen[-1]]) ** 2).sum(axis=1))
        chosen.append(int(away.argmax()))
    return corners[chosen]
