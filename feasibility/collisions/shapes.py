"""Shapes of scene and tool, their numbers checked before anything else sees them.

coal and qhull crash on shapes that are flat or not finite, so no other shapes exist.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from coverable.arrays import Array
from coverable.errors import Checks, Fault, shown
from feasibility.collisions.scene_triangles import object_triangles
from robots.poses import matrix_of, rigid_matrix
from robots.shapes.bodies import Triangles
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere

SMALLEST_SIDE, LARGEST_SIDE = 1e-6, 1e4  # [m]
FARTHEST = 1e4  # [m], from the origin of the world
ORIGIN = (0.0, 0.0, 0.0)

Matrix = Array


@dataclass(frozen=True, slots=True)
class HalfSpace:
    """All points with z <= 0 in the object's frame: a floor, or turned, a wall or a ceiling."""


Shape = Box | Cylinder | Capsule | Sphere | Triangles
"""Primitives are about their frame's origin, round ones along z, as in URDF."""


def checked_shape(checks: Checks, geometry: Any) -> Shape | HalfSpace:
    """The shape with its numbers as plain floats; faults are kept under the numbers' names."""
    if isinstance(geometry, HalfSpace):
        return geometry
    if isinstance(geometry, Box):
        expected = "must be three edge lengths > 0 (metres)"
        size = checks.numbers("size", geometry.size, 3, expected) or [1.0, 1.0, 1.0]
        x, y, z = (_side(checks, f"size[{k}]", length) for k, length in enumerate(size))
        return Box((x, y, z))
    if isinstance(geometry, Sphere):
        return Sphere(_side(checks, "radius", geometry.radius))
    if isinstance(geometry, (Cylinder, Capsule)):
        radius = _side(checks, "radius", geometry.radius)
        return type(geometry)(radius, _side(checks, "length", geometry.length))
    if isinstance(geometry, Triangles):
        return object_triangles(checks, geometry.vertices, geometry.faces)
    checks.wrong("geometry", geometry, "must be a Box, Cylinder, Capsule, Sphere or Triangles")
    return Sphere(1.0)


def _side(checks: Checks, key: str, value: object) -> float:
    """m, a length of a shape that an arm can meet."""
    before = len(checks.faults)
    length = checks.positive(key, value)
    if len(checks.faults) > before or SMALLEST_SIDE <= length <= LARGEST_SIDE:
        return length
    expected = f"must lie in {SMALLEST_SIDE:g} .. {LARGEST_SIDE:g} (metres)"
    remedy = "; a floor, wall or ceiling is a halfspace" if length > LARGEST_SIDE else ""
    checks.keep(Fault(key, f"got {shown(value)}{remedy}", expected=expected))
    return 1.0


def checked_placement(checks: Checks, placement: Any) -> Matrix:
    """A (4, 4) rigid motion; the identity after a fault."""
    return rigid_matrix(checks, "placement", placement, FARTHEST)


def placement_of(checks: Checks, position: Any, rpy_deg: Any) -> Matrix:
    """The (4, 4) placement at a position (m), turned by roll, pitch and yaw about fixed axes."""
    return matrix_of(checks, position, rpy_deg, FARTHEST)
