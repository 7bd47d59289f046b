"""What stands around the arm, and what is mounted on its flange."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robots.shapes import Triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere


@dataclass(frozen=True, slots=True)
class HalfSpace:
    """All points with z <= 0 in the object's frame: a floor, or turned, a wall or a ceiling."""


Shape = Box | Cylinder | Capsule | Sphere | Triangles
"""Primitives are about their frame's origin, round ones along z, as in URDF."""


@dataclass(frozen=True, eq=False, slots=True)
class Obstacle:
    """One object of the scene, at rest in the root frame."""

    name: str
    geometry: Shape | HalfSpace
    placement: NDArray[np.float64]
    """(4, 4) the object's frame in the root frame, m."""
    clearance: float | None = None
    """m, in place of `Collision.clearance` for every pair with it."""


@dataclass(frozen=True, eq=False, slots=True)
class ToolShape:
    """A shape mounted on the tool frame, for a URDF that ends at the flange."""

    geometry: Shape
    placement: NDArray[np.float64]
    """(4, 4) the shape's frame in the tool frame, m."""
