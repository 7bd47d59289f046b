"""Lines that a tool runs along on a surface, and how often it comes by places beside them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array, Ints

CLOSE = 0.2  # [1] of the radius: points of the path are about this far apart
CHUNK = 2_000  # places that are looked at together


class ToolLines(NamedTuple):
    """Lines that the tool runs along, on the surface."""

    points: Array
    """(k, 3) m."""
    normals: Array
    """(k, 3) outward unit normals of the surface there."""
    stretch: Ints
    """(k,) which stretch each point belongs to; two points of one stretch in a row are joined."""

    @property
    def segments(self) -> tuple[Array, Array]:
        """Both ends (m, 3) of the pieces; points alone are pieces without length."""
        joined = np.append(self.stretch[1:] == self.stretch[:-1], False)
        following = np.where(joined, np.arange(len(self.points)) + 1, np.arange(len(self.points)))
        return self.points, self.points[following]

    @property
    def step(self) -> float:
        """m, the longest piece."""
        start, end = self.segments
        return float(np.linalg.norm(end - start, axis=1).max(initial=0.0))

    def about(self, step: float) -> ToolLines:
        """The same with points about `step` (m) apart along each stretch, ends kept."""
        start, end = self.segments
        along = np.append(0.0, np.cumsum(np.linalg.norm(end - start, axis=1)))[: len(start)]
        kept = np.diff(np.floor(along / step), prepend=-1.0) > 0.0
        turns = np.diff(self.stretch) != 0
        kept[1:] |= turns
        kept[:-1] |= turns
        kept[-1:] = True
        thin = ToolLines(self.points[kept], self.normals[kept], self.stretch[kept])
        return thin.no_longer_than(step)

    def no_longer_than(self, step: float) -> ToolLines:
        """The same with points so close that no piece is longer than `step` (m)."""
        start, end = self.segments
        count = np.maximum(np.ceil(np.linalg.norm(end - start, axis=1) / step), 1).astype(np.int64)
        of = np.repeat(np.arange(len(count)), count)
        share = (np.arange(len(of)) - np.repeat(np.cumsum(count) - count, count)) / count[of]
        points = start[of] + share[:, None] * (end - start)[of]
        return ToolLines(points, self.normals[of], self.stretch[of])


def visits(places: Array, normals: Array, path: ToolLines, radius: float) -> Ints:
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


def _coming(near: NDArray[np.object_], normals: Array, path: ToolLines) -> Ints:
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
