"""Untreated places of a surface, joined to regions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces import components
from surfaces.passes import Treated

Floats = NDArray[np.float64]

OPEN = 0.5  # [1] a face of which at least this share is untreated for certain belongs to a region
LEAST = 1e-6  # [1] of the whole area: smaller regions are not listed


class UntreatedRegion(NamedTuple):
    """A connected part of the surface that the tool does not treat."""

    centre: Floats
    """(3,) m, in the root frame: a place of the surface in its middle."""
    area: float
    """m^2."""


def untreated_regions(found: Treated) -> tuple[UntreatedRegion, ...]:
    """The regions that are untreated for certain, the largest first."""
    mesh = found.mesh
    faces = np.flatnonzero(found.most <= 1.0 - OPEN)
    if not len(faces):
        return ()
    corners = mesh.faces[faces]
    used, of = np.unique(corners, return_inverse=True)
    of = of.reshape(-1, 3)
    joined = np.concatenate([of[:, [0, 1]], of[:, [1, 2]]]).astype(np.int64)
    part = components(joined, len(used))[of[:, 0]]
    middles = mesh.corners[faces].mean(axis=1)
    areas = mesh.areas[faces] * (1.0 - found.most[faces])
    regions = []
    for number in np.unique(part):
        own = part == number
        mean = np.average(middles[own], axis=0, weights=areas[own])
        nearest = np.linalg.norm(middles[own] - mean, axis=1).argmin()
        regions.append(UntreatedRegion(middles[own][nearest], float(areas[own].sum())))
    listed = (each for each in regions if each.area >= LEAST * found.area)
    return tuple(sorted(listed, key=lambda each: -each.area))
