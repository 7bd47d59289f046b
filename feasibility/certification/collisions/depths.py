"""Points inside bodies, and how deep they are: how far it is to the nearest point outside.

A point that is r deep in one body and s deep in another keeps them together: the two are moved
apart by no motion of less than r + s. Outside a body a depth is less than 0: a point s away from
it is -s deep. A mesh that is not a convex solid is only known to be deep in balls inside it.
"""

from __future__ import annotations

from functools import lru_cache, reduce
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.judged_shapes import winding
from robots.shapes.bodies import Geometry, HalfSpace, Triangles, outline
from robots.shapes.hulls import is_convex, rims
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere

ALONG, ACROSS = 9, 5  # points along the longest side of a body, and along the others
AROUND = 24  # points on each rim of a cylinder
FINEST = 10  # parts of the widest side of a mesh that no edge is longer than
MOST_CORNERS = 64  # of a mesh
MOST_BALLS = 40  # inside one
FLUSH = 1e-9  # [1] of the widest side, that a convex mesh may be off its hull
FULL = 1e-6  # [1] of the hull's volume, that it may be off
MOST_FACES = 4_000  # of a mesh that has an inside
ROUNDING = 1e-9  # [m] that a point of a mesh is less deep than its triangles are away


class Balls(NamedTuple):
    """Balls inside a mesh, some of them points of it: what is known to be deep in one."""

    centres: Array
    """(k, 3) m"""
    radii: Array
    """(k,) m"""

    @staticmethod
    def among(points: Array, deep: Array, most: int = MOST_BALLS) -> Balls:
        """The deepest of some points, then those that reach furthest from what is taken."""
        out, chosen = np.full(len(points), np.inf), [int(deep.argmax())]
        while len(chosen) < min(most, len(points)):
            last = chosen[-1]
            away = np.linalg.norm(points - points[last], axis=1) + deep - deep[last]
            out = np.minimum(out, away)
            out[chosen] = -np.inf
            chosen.append(int(out.argmax()))
        return Balls(points[chosen], deep[chosen])


def depths(shape: Geometry | Balls, points: Array) -> Array:
    """(...) m, how deep points (..., 3) in its own frame are in a shape, or less.

    Of meshes -inf outside convex ones, and for all others.
    """
    x = np.abs(points)
    match shape:
        case Sphere(radius):
            return np.asarray(radius - np.linalg.norm(points, axis=-1))
        case Capsule(radius, length):
            past = np.maximum(x[..., 2] - 0.5 * length, 0.0)
            return np.asarray(radius - np.sqrt(x[..., 0] ** 2 + x[..., 1] ** 2 + past**2))
        case Cylinder(radius, length):
            around = np.hypot(x[..., 0], x[..., 1]) - radius
            return _within_sides(around, x[..., 2] - 0.5 * length)
        case Box(size):
            return _within_sides(*(x[..., k] - 0.5 * side for k, side in enumerate(size)))
        case HalfSpace():
            return -points[..., 2]
        case Balls(centres, radii):
            found = np.full(points.shape[:-1], -np.inf)
            along = [np.ascontiguousarray(points[..., k]) for k in range(3)]  # numpy's norm is slow
            for centre, radius in zip(centres, radii, strict=True):
                square = sum((one - place) ** 2 for one, place in zip(along, centre, strict=True))
                np.maximum(found, radius - np.sqrt(square), out=found)
            return found
        case Triangles():
            planes = planes_around(shape)
            if planes is None:
                return np.full(points.shape[:-1], -np.inf)
            deep = -(points @ planes[:, :3].T + planes[:, 3]).max(axis=-1)
            return np.where(deep >= 0.0, deep, -np.inf)


def _within_sides(*past: Array) -> Array:
    """(...) m, how deep points are that are past sides at right angles by so many (...) m."""
    outside = np.sqrt(sum(np.maximum(one, 0.0) ** 2 for one in past))  # numpy's sum is slow here
    return np.asarray(-outside - np.minimum(reduce(np.maximum, past), 0.0))


@lru_cache(maxsize=64)
def points_inside(shape: Geometry) -> tuple[Array, Array]:
    """(k, 3) m, points of a body in its own frame, and (k,) m, how deep they are at least.

    Of a mesh corners that are far from each other, on wide triangles too, and places inside.
    """
    corners, radius, circle = outline(shape)
    beside = radius + np.array([circle, circle, 0.0])
    points = _grid(corners.min(axis=0) - beside, corners.max(axis=0) + beside)
    if isinstance(shape, Triangles):
        solid, some = planes_around(shape) is not None, _all_over(shape)
        found = depths(shape, points) if solid else _depths_by_triangles(shape, points)
        some, none = Balls.among(some, np.zeros(len(some)), MOST_CORNERS)
        return np.concatenate([some, points[found > 0.0]]), np.append(none, found[found > 0.0])
    if isinstance(shape, Cylinder):
        points = np.concatenate([points, rims(shape.radius, shape.length, AROUND)])
    if isinstance(shape, Capsule):
        axis = np.outer(np.linspace(-0.5, 0.5, ALONG) * shape.length, [0.0, 0.0, 1.0])
        points = np.concatenate([points, axis])
    points *= 1.0 - 1e-9  # a little less than the body, for rounding
    found = depths(shape, points)
    return points[found >= 0.0], found[found >= 0.0]


def _depths_by_triangles(mesh: Triangles, points: Array) -> Array:
    """(k,) m, how far points (k, 3) are from the triangles that wind around them; else -inf."""
    from trimesh.triangles import closest_point

    deep = np.full(len(points), -np.inf)
    if not mesh.closed or len(mesh.faces) > MOST_FACES:
        return deep
    triangles = mesh.vertices[mesh.faces]
    for k, point in enumerate(points):
        if abs(winding(triangles, point)) > 0.5:
            near = closest_point(triangles, np.broadcast_to(point, (len(triangles), 3)))
            deep[k] = np.linalg.norm(near - point, axis=1).min() - ROUNDING
    return deep


def _all_over(mesh: Triangles) -> Array:
    """(k, 3) m, corners of a mesh whose wide triangles are cut."""
    from trimesh.remesh import subdivide_to_size

    widest = float(np.ptp(mesh.vertices, axis=0).max())
    vertices, _ = subdivide_to_size(mesh.vertices, mesh.faces, widest / FINEST, max_iter=20)
    return np.asarray(vertices, dtype=np.float64)


def _grid(low: Array, high: Array) -> Array:
    """(k, 3) points all over a box, its corners too."""
    counts = np.full(3, ACROSS)
    counts[int(np.argmax(high - low))] = ALONG
    sides = [np.linspace(a, b, int(k)) for a, b, k in zip(low, high, counts, strict=True)]
    return np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3)


@lru_cache(maxsize=64)
def planes_around(mesh: Triangles) -> Array | None:
    """(k, 4) unit normals n and d with n . x + d <= 0 in a convex solid; None where it is none.

    All corners and middles of faces have to lie on the convex hull. The depth beneath the hull is
    concave over a face, so no point of it is then deeper than three times that of its middle; and
    a closed surface that stays at the hull and encloses its volume is the hull.
    """
    from scipy.spatial import ConvexHull

    if len(mesh.faces) > MOST_FACES or not is_convex(mesh, FULL):
        return None
    planes = np.array(ConvexHull(mesh.vertices).equations)
    wide = np.ptp(mesh.vertices, axis=0).max()
    points = np.concatenate([mesh.vertices, mesh.vertices[mesh.faces].mean(axis=1)])
    if (points @ planes[:, :3].T + planes[:, 3]).max(axis=1).min() < -FLUSH * wide:
        return None
    planes[:, 3] += 3.0 * FLUSH * wide
    return planes
