"""Bodies that a joint carries: exact ones as the URDF gives them, and convex ones around them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Protected
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere


@dataclass(frozen=True, eq=False, slots=True)
class Triangles:
    """A body, or a sheet, bounded by triangles; checked: finite, and every index is a vertex."""

    vertices: Array
    """(k, 3) m."""
    faces: Ints
    """(m, 3) indices of vertices."""
    closed: bool
    """True where they bound a solid, see `solid_faces`; they look outwards then. Else a sheet."""


@dataclass(frozen=True, slots=True)
class HalfSpace:
    """All points with z <= 0 in the object's frame: a floor, or turned, a wall or a ceiling."""


Fineness = Literal["hulls", "pieces", "meshes"]
"""How closely convex bodies follow a link; see `link_shapes`."""
Geometry = Box | Cylinder | Capsule | Sphere | Triangles | HalfSpace
"""Primitives are about their frame's origin, round ones along z, as in URDF."""


class Outline(NamedTuple):
    """All points within `radius` of the hull of circles across z about some vertices."""

    vertices: Array
    """(k, 3) m, in the shape's own frame."""
    radius: float
    """m."""
    circle: float = 0.0
    """m, radius of the circles."""


def outline(shape: Geometry) -> Outline:
    """What a shape is; of a half space a point of its plane, of triangles their corners."""
    match shape:
        case Box(size):
            corners = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, 8).T * size
            return Outline(corners, 0.0)
        case Capsule(radius, length):
            return Outline(np.outer([-0.5, 0.5], [0.0, 0.0, length]), radius)
        case Cylinder(radius, length):
            return Outline(np.outer([-0.5, 0.5], [0.0, 0.0, length]), 0.0, radius)
        case Triangles(vertices):
            return Outline(vertices, 0.0)
        case Sphere(radius):
            return Outline(np.zeros((1, 3)), radius)
        case HalfSpace():
            return Outline(np.zeros((1, 3)), 0.0)


@dataclass(frozen=True, eq=False, slots=True)
class Solid(Protected):
    """One exact shape: what the judge sees, and what pictures show."""

    owner: str
    """The link's name, or that of the object in the scene, or 'tool'."""
    joint: int
    """Which joint of the robot's model carries it, 1 .. n; 0 where none does."""
    placement: Array
    """(4, 4) the shape's frame in that joint's frame (Pinocchio's), m; in the root frame for 0."""
    geometry: Geometry


@dataclass(frozen=True, eq=False, slots=True)
class Polytope(Protected):
    """A convex body that holds a shape: all points within `radius` of the hull of `vertices`.

    A ball is one vertex and its radius, a capsule two.
    """

    owner: str
    """The link's name, or that of the object in the scene."""
    joint: int
    """See `Solid.joint`."""
    vertices: Array
    """(k, 3) m, k >= 1, in the frame of the joint (Pinocchio's), or in the root frame."""
    radius: float
    """m, >= 0."""
