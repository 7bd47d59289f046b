"""Convex bodies around a shape, with few vertices.

A distance query costs as much as the bodies have vertices, so a hull of many is thinned: some of
its vertices are kept, and the radius around them reaches all others. Nothing of the shape is ever
left outside.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robots.shapes.bodies import Geometry, Triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere

Array = NDArray[np.float64]

MOST_VERTICES = 64
CLOSE_ENOUGH = 1e-4  # [m]: no vertex is added for less
HAIR = 1e-5  # [m] a body without thickness is given this much to each side
ROUNDING = 1e-12  # of a body's width: what hull and distances may be wrong by
PRISM_EXCESS = 3e-4  # [m] the corners of a prism around a cylinder stand out by at most this ...
MOST_SIDES = 32  # ... where so many sides are enough


class Hull(NamedTuple):
    """All points within `radius` of the convex hull of `vertices`."""

    vertices: Array
    """(k, 3) m."""
    radius: float
    """m."""


def hull_of(shape: Geometry) -> Hull:
    """A convex body that holds a shape, in the shape's frame; exact for balls, capsules and boxes.

    A cylinder becomes a prism around it.
    """
    match shape:
        case Sphere(radius):
            return Hull(np.zeros((1, 3)), radius)
        case Capsule(radius, length):
            return Hull(np.array([[0.0, 0.0, -length / 2], [0.0, 0.0, length / 2]]), radius)
        case Box(size):
            corners = np.stack(np.meshgrid([-0.5, 0.5], [-0.5, 0.5], [-0.5, 0.5]), axis=-1)
            return Hull(corners.reshape(-1, 3) * size, 0.0)
        case Cylinder(radius, length):
            return Hull(_prism(radius, length), 0.0)
        case Triangles():
            return _hull_of_mesh(shape)


def _prism(radius: float, length: float) -> Array:
    """(2 k, 3) corners of a regular prism around a cylinder."""
    # A corner is at radius / cos(pi / k).
    sides = math.ceil(math.pi / math.acos(radius / (radius + PRISM_EXCESS)))
    sides = min(max(sides, 8), MOST_SIDES)
    angle = 2.0 * np.pi * np.arange(sides) / sides
    corner = radius / math.cos(math.pi / sides)
    ring = corner * np.column_stack([np.cos(angle), np.sin(angle)])
    ends = [np.column_stack([ring, np.full(sides, z)]) for z in (-length / 2, length / 2)]
    return np.concatenate(ends)


@lru_cache(maxsize=256)
def _hull_of_mesh(mesh: Triangles) -> Hull:
    """The hull of all vertices; the same mesh is looked at once."""
    return outer_hull(mesh.vertices)


def outer_hull(points: Array, most: int = MOST_VERTICES) -> Hull:
    """A convex body of at most `most` vertices that holds some points.

    Where the hull has more vertices, the one furthest outside is added to those kept until there
    are enough, or none is further outside than `CLOSE_ENOUGH`; the radius is then an upper bound on
    the distance of any point from the hull of those kept. Flat points are first given a thickness
    of `HAIR` to each side, which Qhull needs.

    Args:
        points: (k, 3) m, finite, at least one.
        most: at least 14.
    """
    from scipy.spatial import ConvexHull, QhullError

    solid = thickened(np.unique(points, axis=0))
    try:
        corners = solid[ConvexHull(solid).vertices]
        kept = corners if len(corners) <= most else _furthest(corners, most)
        radius = float(_distances(ConvexHull(kept), corners).max())
    except QhullError:  # no file is known that comes here
        low, high = solid.min(axis=0), solid.max(axis=0)
        kept, radius = _box_corners(low, high), 0.0
    return Hull(kept, radius + ROUNDING * float(np.ptp(solid, axis=0).max()))


def hull_volume(points: Array) -> float:
    """m^3; 0 for points that span no volume."""
    from scipy.spatial import ConvexHull, QhullError

    if len(points) < 4:
        return 0.0
    try:
        return float(ConvexHull(points).volume)
    except QhullError:
        return 0.0


def _box_corners(low: Array, high: Array) -> Array:
    """(8, 3)"""
    return np.stack(np.meshgrid(*zip(low, high, strict=True)), axis=-1).reshape(-1, 3)


def thickened(points: Array) -> Array:
    """The points, moved to both sides along each direction in which they have no extent."""
    centred = points - points.mean(axis=0)
    axes = np.linalg.svd(centred.T @ centred)[0].T  # rows
    for axis in axes:
        if np.ptp(points @ axis) < HAIR:
            points = np.concatenate([points + HAIR * axis, points - HAIR * axis])
    return points


def _furthest(corners: Array, most: int) -> Array:
    """At most `most` of the corners, chosen one by one: the one furthest outside those before."""
    from scipy.spatial import ConvexHull

    signs = np.array([[x, y, z] for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1)])
    axes = np.linalg.svd(corners - corners.mean(axis=0), full_matrices=False)[2]
    directions = signs[np.abs(signs).sum(axis=1) % 2 == 1] @ axes  # 6 faces and 8 corners of a box
    chosen = np.unique((corners @ directions.T).argmax(axis=0))
    hull = ConvexHull(corners[chosen])
    while len(chosen) < most:
        outside = (corners @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
        worst = int(outside.argmax())
        if outside[worst] < CLOSE_ENOUGH:
            break
        chosen = np.append(chosen, worst)
        hull = ConvexHull(corners[chosen])
    return np.asarray(corners[chosen])


def _distances(hull: object, points: Array) -> Array:
    """(k,) m, upper bounds on the distances of points from a hull of `scipy.spatial`.

    Each point is projected onto the plane of every facet and moved into the facet by clipping its
    barycentric coordinates; the nearest of these places lies in the hull.
    """
    corners = hull.points[hull.simplices]  # type: ignore[attr-defined]  # (f, 3, 3)
    inverse = np.linalg.pinv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))  # (f, 2, 3)
    equations = hull.equations  # type: ignore[attr-defined]
    outside = (points @ equations[:, :3].T + equations[:, 3]).max(axis=1)
    distances = np.zeros(len(points))
    for k in np.flatnonzero(outside > 0.0):
        shares = np.einsum("fij,fj->fi", inverse, points[k] - corners[:, 0])
        weights = np.column_stack([1.0 - shares.sum(axis=1), shares]).clip(0.0)
        weights /= weights.sum(axis=1, keepdims=True)
        places = np.einsum("fi,fij->fj", weights, corners)
        distances[k] = np.linalg.norm(places - points[k], axis=1).min()
    return distances
