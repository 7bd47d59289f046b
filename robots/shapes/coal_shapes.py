"""Shapes as coal wants them, and what has to be known of coal 3.0.

It crashes where a hull is flat or a number is not finite, and takes any index of a vertex: shapes
are checked before they get here. A mesh is its triangles, without an inside, and two that overlap
are 0 apart. Without contacts `collide` takes many deep penetrations of hulls for a distance of
1e-7 m, so for none: ask `with_contacts`.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import coal
import numpy as np
import pinocchio as pin

from coverable.arrays import Array, Ints
from robots.shapes.bodies import Geometry, HalfSpace, Polytope, Solid, Triangles
from robots.shapes.hulls import thickened
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere

LEAST = 1e-9  # [m] radius of a ball or capsule for coal
KEPT = 256  # meshes whose trees are kept
Z = np.array([0.0, 0.0, 1.0])


def with_contacts(request: Any) -> Any:
    """A request of coal's that also finds deep penetrations."""
    request.enable_contact = True
    return request


def coal_shape(shape: Geometry) -> Any:
    """A shape itself, about its frame's origin; of meshes the same for the same `Triangles`."""
    match shape:
        case Box(size):
            return coal.Box(*size)
        case Sphere(radius):
            return coal.Sphere(radius)
        case Capsule(radius, length):
            return coal.Capsule(radius, length)
        case Cylinder(radius, length):
            return coal.Cylinder(radius, length)
        case Triangles():
            return _tree(shape)
        case HalfSpace():
            return coal.Halfspace(Z, 0.0)


def coal_hull(points: Array) -> tuple[Any, Array]:
    """The convex hull of points (k, 3) m that are not flat, and its corners.

    Not coal's own hull, which crashes where points are flat.

    Raises:
        QhullError: they are flat.
        RuntimeError: a corner has more than 255 edges, which coal does not take.
    """
    from scipy.spatial import ConvexHull

    used, renumbered = np.unique(ConvexHull(points).simplices, return_inverse=True)
    return coal.Convex(*_lists(points[used], renumbered.reshape(-1, 3))), points[used]


def coal_body(body: Polytope | Solid) -> tuple[Any, Array]:
    """A body, and its placement (4, 4) in the frame of its joint."""
    if isinstance(body, Solid):
        return coal_shape(body.geometry), body.placement
    vertices, place, radius = body.vertices, np.eye(4), max(body.radius, LEAST)
    if len(vertices) > 2:
        shape, _ = coal_hull(thickened(np.array(vertices)))
        shape.setSweptSphereRadius(body.radius)
        return shape, place
    place[:3, 3] = vertices.mean(axis=0)
    if len(vertices) == 1:
        return coal.Sphere(radius), place
    along = vertices[1] - vertices[0]
    place[:3, :3] = pin.Quaternion.FromTwoVectors(Z, along).toRotationMatrix()
    return coal.Capsule(radius, float(np.linalg.norm(along))), place


def coal_distance(a: Polytope, b: Polytope) -> float:
    """m, between two bodies in the same frame; below 0 about as deep as they overlap.

    Example:
        >>> a, b = (Polytope("", 0, np.array([[x, 0.0, 0.0]]), 0.1) for x in (0.0, 0.15))
        >>> round(coal_distance(a, b), 9)
        -0.05
    """
    placed = []
    for body in (a, b):
        shape, place = coal_body(body)
        placed += [shape, coal.Transform3s(place[:3, :3], place[:3, 3])]
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    return float(coal.distance(*placed, request, coal.DistanceResult()))


@lru_cache(maxsize=KEPT)
def _tree(mesh: Triangles) -> Any:
    model = coal.BVHModelOBBRSS()
    model.beginModel(len(mesh.faces), len(mesh.vertices))
    model.addSubModel(*_lists(mesh.vertices, mesh.faces))
    model.endModel()
    return model


def _lists(vertices: Array, faces: Ints) -> tuple[Any, Any]:
    """Coal's lists of points and triangles."""
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(np.ascontiguousarray(vertices)))
    triangles.extend([coal.Triangle(*face) for face in faces.tolist()])
    return points, triangles
