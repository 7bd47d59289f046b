"""Shapes of links, tool and scene, and sheets, as pieces for the judge of collisions."""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array
from coverable_errors import ArgumentError
from feasibility.certification.collisions.mesh_pieces import MeshPart, mesh_piece
from feasibility.certification.collisions.pieces import Below, Piece, Round, moved
from feasibility.collisions import HalfSpace
from robots.shapes import Triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere


def piece_of(geometry: object, placement: Array, at_rest: bool = False) -> Piece:
    """A body of the arm or of the scene as the judge sees it.

    Args:
        geometry: a primitive, `Triangles` or a `HalfSpace`.
        placement: (4, 4) its frame in the joint's frame (or the root frame), m.
        at_rest: does it belong to the scene?

    Raises:
        ArgumentError: it is none of these, empty, or not finite.
    """
    import coal

    sizes = np.concatenate([np.ravel(placement), _sizes(geometry)])
    if not np.isfinite(sizes).all():
        raise ArgumentError(f"a shape for the replay is not finite: {geometry!r:.80}")
    origin = placement[None, :3, 3]
    match geometry:
        case Box(size):
            signs = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, 8).T
            corners = moved(placement, signs * np.array(size))
            return Piece(coal.Box(*size), placement, corners, 0.0)
        case Sphere(radius):
            return Piece(coal.Sphere(radius), placement, origin, radius)
        case Capsule(radius, length):
            ends = moved(placement, np.array([[0.0, 0.0, -0.5 * length], [0, 0, 0.5 * length]]))
            return Piece(coal.Capsule(radius, length), placement, ends, radius)
        case Cylinder(radius, length):
            return Round(coal.Cylinder(radius, length), placement, geometry)
        case HalfSpace():
            return Below(placement)
        case Triangles(vertices, faces, closed) if len(faces):
            return mesh_piece(moved(placement, vertices), faces, closed, at_rest)
    raise ArgumentError(f"the replay knows no shape like {geometry!r:.80}")


def sheet_piece(triangles: Array, closed: bool) -> Piece:
    """Triangles (k, 3, 3) m at rest in the root frame, k >= 1, as one piece.

    Raises:
        ArgumentError: there are none, or they are not finite.
    """
    if not len(triangles) or not np.isfinite(triangles).all():
        raise ArgumentError("a sheet for the replay has no triangles, or they are not finite")
    vertices, faces = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return MeshPart(vertices, faces.reshape(-1, 3), closed)


def _sizes(geometry: object) -> Array:
    """The numbers of a shape, flat."""
    match geometry:
        case Triangles(vertices):
            return np.ravel(vertices)
        case Box(size):
            return np.array(size, dtype=float)
        case Sphere(radius):
            return np.array([radius])
        case Capsule(radius, length) | Cylinder(radius, length):
            return np.array([radius, length])
    return np.empty(0)
