"""Signed distances of points from bodies at rest, exact or larger.

They are negative inside. Of primitives they are exact; of a convex mesh exact inside, where the
depth is the least over the planes of its faces. Of triangles the distance from some of those near
by is taken, which is no less than that from all. All of them change no faster than the point moves
where they are exact, and only the exact distance is bounded further on.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np

from coverable_arrays import Array
from feasibility.collisions import HalfSpace
from feasibility.roadmap.tool_alone.balls_inside import FLUSH, balls_in, face_planes
from robots.shapes import Triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere

Distance = Callable[[Array], Array]
"""From points (..., 3) m in the root frame to m (...)."""

NEAR = 16  # triangles, by their middles, that the distance is taken from


def distance_from(geometry: object, placement: Array) -> Distance:
    """How far points are from a shape at rest, see the module.

    Args:
        geometry: a primitive, `Triangles` or a `HalfSpace`.
        placement: (4, 4) its frame in the root frame, m.

    Raises:
        TypeError: it is none of these.
    """
    if not isinstance(geometry, (HalfSpace, Sphere, Capsule, Cylinder, Box, Triangles)):
        raise TypeError(f"no distance is known from {geometry!r:.80}")
    own = _of_mesh(geometry) if isinstance(geometry, Triangles) else None

    def distance(points: Array) -> Array:
        x = (points - placement[:3, 3]) @ placement[:3, :3]
        return _of_primitive(geometry, x) if own is None else own(x)

    return distance


def ball_around(geometry: object, placement: Array) -> tuple[Array, float]:
    """Centre (3,), in the root frame, and radius, m, of a ball around a shape at rest.

    Args:
        geometry: see `distance_from`; the ball around a `HalfSpace` has no end.
        placement: (4, 4) its frame in the root frame, m.
    """
    match geometry:
        case Sphere(radius):
            half = np.array([radius, 0.0, 0.0])
        case Capsule(radius, length):
            half = np.array([0.5 * length + radius, 0.0, 0.0])
        case Cylinder(radius, length):
            half = np.array([radius, 0.5 * length, 0.0])
        case Box(size):
            half = 0.5 * np.asarray(size)
        case Triangles(vertices):
            low, high = vertices.min(axis=0), vertices.max(axis=0)
            centre = placement[:3, :3] @ (0.5 * (low + high)) + placement[:3, 3]
            return centre, 0.5 * float(np.linalg.norm(high - low))
        case _:
            half = np.array([np.inf])
    return placement[:3, 3], float(np.linalg.norm(half))


def _of_primitive(shape: object, x: Array) -> Array:
    """Signed distances of points x (..., 3) in the shape's own frame."""
    match shape:
        case Sphere(radius):
            return np.asarray(np.linalg.norm(x, axis=-1) - radius)
        case Capsule(radius, length):
            off = np.maximum(np.abs(x[..., 2]) - 0.5 * length, 0.0)
            return np.sqrt(x[..., 0] ** 2 + x[..., 1] ** 2 + off**2) - radius
        case Cylinder(radius, length):
            lateral = np.hypot(x[..., 0], x[..., 1]) - radius
            past = np.stack([lateral, np.abs(x[..., 2]) - 0.5 * length], axis=-1)
        case Box(size):
            past = np.abs(x) - 0.5 * np.asarray(size)
        case _:  # a half space
            return x[..., 2].copy()
    outside = np.linalg.norm(np.maximum(past, 0.0), axis=-1)
    return np.asarray(outside + np.minimum(past.max(axis=-1), 0.0))


@lru_cache(maxsize=64)
def _of_mesh(mesh: Triangles) -> Distance:
    """Of a solid its inside too, as far as it is known."""
    near, planes = distance_from_triangles(mesh.vertices[mesh.faces]), face_planes(mesh)
    balls = balls_in(mesh) if planes is None else np.empty((0, 4))
    slack = FLUSH * float(np.ptp(mesh.vertices, axis=0).max())

    def distance(x: Array) -> Array:
        found = near(x)
        if planes is not None:
            highest = (x @ planes[:, :3].T - planes[:, 3]).max(axis=-1) + slack
            return np.where(highest < 0.0, highest, found)
        for ball in balls:
            np.minimum(found, np.linalg.norm(x - ball[:3], axis=-1) - ball[3], out=found)
        return found

    return distance


def distance_from_triangles(triangles: Array, deviation: float = 0.0) -> Distance:
    """How far points are from a sheet, at most.

    Args:
        triangles: (m, 3, 3) m.
        deviation: m, how far what is meant may be from the triangles.
    """
    from scipy.spatial import KDTree
    from trimesh.triangles import closest_point

    tree, count = KDTree(triangles.mean(axis=1)), min(NEAR, len(triangles))

    def distance(points: Array) -> Array:
        flat = points.reshape(-1, 3)
        _, which = tree.query(flat, k=count)
        queries = np.repeat(flat, count, axis=0)
        nearest = closest_point(triangles[np.ravel(which)], queries)
        away = np.linalg.norm(nearest - queries, axis=1).reshape(-1, count).min(axis=1)
        return np.asarray(away.reshape(points.shape[:-1]) + deviation)

    return distance
