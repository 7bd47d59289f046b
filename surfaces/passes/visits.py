"""How often a tool comes by places of a surface: the passes over each of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfaces.passes.treated import ToolLines

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

CLOSE = 0.2  # [1] of the radius: points of the path are about this far apart
CHUNK = 2_000  # places that are looked at together


def visits(places: Floats, normals: Floats, path: ToolLines, radius: float) -> Ints:
    """How often a path comes within `radius` (m) of each place, and leaves it again.

    Args:
        places: (k, 3) m.
        normals: (k, 3) outward normals there, of any length.
        path: of the tool, on the surface; what is on the other side of a thin part does not count.
        radius: m > 0.

    Returns:
        (k,) counts.
    """
    from scipy.spatial import KDTree

    found = np.zeros(len(places), dtype=np.int64)
    if not len(places) or not len(path.points):
        return found
    path = path.about(CLOSE * radius)
    tree = KDTree(path.points)
    for first in range(0, len(places), CHUNK):
        some = slice(first, first + CHUNK)
        near = tree.query_ball_point(places[some], radius, return_sorted=True)
        found[some] = _coming(near, normals[some], path)
    return found


def _coming(near: NDArray[np.object_], normals: Floats, path: ToolLines) -> Ints:
    """(k,) how many runs of points of a path in a row are near each of some places."""
    counts = np.array([len(row) for row in near])
    owner = np.repeat(np.arange(len(near)), counts)
    points = np.concatenate([np.asarray(row, dtype=np.int64) for row in near])
    facing = (path.normals[points] * normals[owner]).sum(axis=1) > 0.0
    owner, points = owner[facing], points[facing]
    same = (np.diff(owner) == 0) & (np.diff(points) == 1)
    same &= np.diff(path.stretch[points]) == 0
    begins = np.concatenate([[True], ~same])[: len(owner)]
    return np.bincount(owner[begins], minlength=len(near))
