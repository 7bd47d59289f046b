"""Triangles that share their vertices."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class WorkingMesh(NamedTuple):
    """A surface as triangles to measure on."""

    vertices: Floats
    """(V, 3) m, in the root frame."""
    faces: Ints
    """(F, 3) counterclockwise seen from outside."""

    @property
    def corners(self) -> Floats:
        """(F, 3, 3) m."""
        return np.asarray(self.vertices[self.faces])

    @property
    def longest_edge(self) -> float:
        """m."""
        corners = self.corners
        return float(np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2).max())

    @property
    def doubled_areas(self) -> Floats:
        """(F, 3) m^2: outward normals, as long as twice the areas."""
        a, b, c = np.moveaxis(self.corners, 1, 0)
        return np.cross(b - a, c - a)

    @property
    def areas(self) -> Floats:
        """(F,) m^2."""
        return np.asarray(0.5 * np.linalg.norm(self.doubled_areas, axis=1))
