"""Shapes of scene and tool, their numbers checked before anything else sees them.

coal and qhull crash on shapes that are flat or not finite, so no other shapes exist.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coverable_errors import Checks, Fault, shown
from feasibility.collisions.triangles import object_triangles
from robots.shapes import Triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere

SMALLEST_SIDE, LARGEST_SIDE = 1e-6, 1e4  # [m]
FARTHEST = 1e4  # [m], from the root link
ORIGIN = (0.0, 0.0, 0.0)
_RIGID = 1e-6  # [1], how far a rotation may be from one

Matrix = NDArray[np.float64]


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
    try:
        matrix = np.array(placement, dtype=float)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    if matrix.shape == (4, 4) and np.isfinite(matrix).all():
        turn = matrix[:3, :3]
        rigid = np.abs(turn @ turn.T - np.eye(3)).max() <= _RIGID and np.linalg.det(turn) > 0.0
        near = np.abs(matrix[:3, 3]).max() <= FARTHEST
        if rigid and near and (matrix[3] == (0.0, 0.0, 0.0, 1.0)).all():
            return matrix
    expected = (
        "must be a 4 x 4 matrix of a rigid motion, its rotation without scale or mirror, "
        f"within {FARTHEST:g} m"
    )
    checks.wrong("placement", placement, expected)
    return np.eye(4)


def placement_of(checks: Checks, position: Any, rpy_deg: Any) -> Matrix:
    """The (4, 4) placement at a position (m), turned by roll, pitch and yaw about fixed axes."""
    from surfaces import rotation_from_rpy

    expected = "must be three finite numbers (metres)"
    place = checks.numbers("position", position, 3, expected, FARTHEST)
    angles = checks.numbers("rpy_deg", rpy_deg, 3, "must be three finite numbers (degrees)")
    matrix = np.eye(4)
    matrix[:3, :3] = rotation_from_rpy(*map(math.radians, angles or ORIGIN))
    matrix[:3, 3] = place or ORIGIN
    return matrix
