"""Shapes without all that is near to their surface.

What is left of a shape after an erosion by m are its points with the whole ball of radius m around
them inside. So a point that meets the eroded shape is in the shape still after any motion by no
more than m.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from coverable_arrays import Array
from robots.shapes import Triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere

FLUSH = 1e-9  # [1] of the widest side, that a convex mesh may be off its hull
FULL = 1e-6  # [1] of the hull's volume, that it may be off
MOST_FACES = 4_000  # of a mesh that is tested for convexity
LEFT = 1e-6  # [m] that has to be left of a mesh


def eroded(shape: object, by: float) -> Any:
    """The shape without what is within `by` >= 0 (m) of its surface; None where nothing is left.

    Nor is anything known to be left of meshes that are not convex solids.
    """
    match shape:
        case Sphere(radius) if radius > by:
            return Sphere(radius - by)
        case Capsule(radius, length) if radius > by:
            return Capsule(radius - by, length)
        case Cylinder(radius, length) if min(radius, 0.5 * length) > by:
            return Cylinder(radius - by, length - 2.0 * by)
        case Box(size) if 0.5 * min(size) > by:
            x, y, z = (side - 2.0 * by for side in size)
            return Box((x, y, z))
        case Triangles():
            planes = planes_around(shape)
            return None if planes is None else _within(planes, by)
    return None


@lru_cache(maxsize=64)
def planes_around(mesh: Triangles) -> Array | None:
    """(k, 4) unit normals n and d with n . x + d <= 0 in a convex solid; None where it is none.

    All corners and middles of faces have to lie on the convex hull. The depth beneath the hull is
    concave over a face, so no point of it is then deeper than three times that of its middle; and
    a closed surface that stays at the hull and encloses its volume is the hull.
    """
    from scipy.spatial import ConvexHull, QhullError

    if not mesh.closed or len(mesh.faces) > MOST_FACES:
        return None
    corners = mesh.vertices[mesh.faces]
    try:
        hull = ConvexHull(corners.reshape(-1, 3))
    except QhullError:
        return None
    wide = float(np.ptp(hull.points, axis=0).max())
    points = np.concatenate([corners.reshape(-1, 3), corners.mean(axis=1)])
    depths = -(points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1)
    a, b, c = (corners[:, k] - corners[0, 0] for k in range(3))
    volume = abs(float(np.einsum("ki,ki->", np.cross(a, b), c))) / 6.0
    if depths.max() > FLUSH * wide or abs(volume - hull.volume) > FULL * hull.volume:
        return None
    planes = np.array(hull.equations)
    planes[:, 3] += 3.0 * FLUSH * wide
    return planes


def _within(planes: Array, by: float) -> Triangles | None:
    """The convex solid beneath all planes by so much; None where it is next to nothing."""
    from scipy.optimize import linprog
    from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

    moved = planes.copy()
    moved[:, 3] += by
    # The largest ball beneath them: maximise r with n . x + r <= -d.
    rows = np.column_stack([moved[:, :3], np.ones(len(moved))])
    found = linprog([0, 0, 0, -1], rows, -moved[:, 3], bounds=[(None, None)] * 3 + [(0.0, None)])
    if not found.success or not found.x[3] > LEFT:
        return None
    try:
        corners = HalfspaceIntersection(moved, found.x[:3]).intersections
        # Rounding may put corners outside; towards the middle they are inside.
        corners = found.x[:3] + (1.0 - 1e-9) * (corners - found.x[:3])
        hull = ConvexHull(corners)
    except QhullError:
        return None
    return Triangles(hull.points, hull.simplices.astype(np.int64), True)
