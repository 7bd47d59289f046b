"""Parts of a mesh: clusters of facets, cut in two through the middle of their longest side.

The points of a cluster lie between two planes, seen from above in a rectangle that holds all
corners; x are the coordinates in it. On every facet the normal is m / |m|, see
`surfaces.meshes.facets`, with m in the hull of its coefficients. For an affine function of x, which
is one of the place, the difference to m is in the hull of the differences at the coefficients'
places. So it is no longer than the longest of these; and |n - m| = |1 - |m||.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from coverable.arrays import Array, Chosen, Ints, Mask
from surfaces.meshes.facets import Facets
from surfaces.part_growth import Pieces
from surfaces.parts import PartModels

_BINS = 8  # of a coordinate of the normals
_EMPTY = 0.03  # [1] of the area: where less of it is in one of these, they are of several sorts
_TURNS = 8  # of a right angle, by which rectangles are tried
_LARGE = 500  # facets, of more a rectangle along the largest spread will do


@dataclass(frozen=True, eq=False, slots=True)
class Clusters(Pieces):
    """k clusters of facets."""

    in_halves: ClassVar[bool] = False

    facets: Facets
    alike: float
    """Normals that differ by less are of one sort."""
    order: Ints
    """(G,) facets; each cluster is a run of them. Cutting clusters sorts their runs."""
    begin: Ints
    """(k,)"""
    end: Ints
    """(k,)"""

    @staticmethod
    def whole(facets: Facets, straight: float) -> Clusters:
        """All facets in one."""
        count = len(facets.corners)
        return Clusters(
            facets, straight, np.arange(count), np.zeros(1, np.int64), np.full(1, count)
        )

    def of(self, rows: Chosen) -> Self:
        """See `Rows`."""
        return replace(self, begin=self.begin[rows], end=self.end[rows])

    @classmethod
    def join(cls, *parts: Self) -> Self:
        """See `Rows`, of clusters of the same facets."""
        begin, end = (np.concatenate([getattr(one, k) for one in parts]) for k in ("begin", "end"))
        return replace(parts[0], begin=begin, end=end)

    @property
    def sides(self) -> Array:
        """Alike."""
        return np.ones((len(self.begin), 2))

    @property
    def divisible(self) -> Mask:
        """Those of more than one facet."""
        return self.end - self.begin > 1

    def cut(self, axis: Ints) -> Clusters:
        """At the median along the axis of the frame along which the facets' middles spread most.

        Where normals are of several sorts, as beside creases, these are parted instead.
        """
        run, cluster, starts = self._runs()
        facet = self.order[run]
        corners = self.facets.corners[facet]
        keys, _ = _widest(corners.mean(axis=1), cluster, starts)
        normals, ends = _widest(self.facets.normals[facet].mean(axis=1), cluster, starts)
        between, share = _emptiest(normals, _areas(corners), ends, cluster, starts)
        apart = (share < _EMPTY) & (ends[1] - ends[0] > self.alike)
        below = np.add.reduceat((normals <= between[cluster]).astype(np.int64), starts)
        self.order[run] = facet[np.lexsort((np.where(apart[cluster], normals, keys), cluster))]
        size = self.end - self.begin
        apart &= (below > 0) & (below < size)
        middle = self.begin + np.where(apart, below, size // 2)
        begin, end = np.stack([self.begin, middle], axis=1), np.stack([middle, self.end], axis=1)
        return Clusters(self.facets, self.alike, self.order, begin.ravel(), end.ravel())

    def _runs(self) -> tuple[Ints, Ints, Ints]:
        """Where in `order` the facets are, cluster by cluster; which cluster; where each begins."""
        size = self.end - self.begin
        starts = np.cumsum(size) - size
        cluster = np.repeat(np.arange(len(size)), size)
        return np.arange(len(cluster)) - starts[cluster] + self.begin[cluster], cluster, starts

    def models(self) -> PartModels:
        """See the module's text."""
        run, cluster, starts = self._runs()
        facet = self.order[run]
        corners, count = self.facets.corners[facet], len(starts)
        centre, slopes, radius = np.empty((count, 6)), np.empty((count, 2, 6)), np.empty((count, 2))
        middle, frame = _frames(corners, cluster, starts)
        local = (corners - middle[cluster, None]) @ frame[cluster].transpose(0, 2, 1)
        low, high = _extremes(local, starts)
        half, mid = (high - low) / 2.0, (high + low) / 2.0
        centre[:, :3] = middle + np.einsum("ke,ked->kd", mid, frame)
        slopes[..., :3] = half[:, :2, None] * frame[:, :2]
        radius[:, 0] = half[:, 2]
        across = (local[..., :2] - mid[cluster, None, :2]) / np.maximum(half[:, :2], 1e-300)[
            cluster, None
        ]
        # Where the coefficients are: at the corners, and in the middles of the sides.
        x = np.concatenate([across, (across + across[:, [1, 2, 0]]) / 2.0], axis=1)
        fit = _fitted(x, self.facets.normals[facet], cluster, starts)
        centre[:, 3:], slopes[..., 3:], left = fit[:, 0], fit[:, 1:3], fit[:, 3, 0]
        radius[:, 1] = left + np.maximum.reduceat(self.facets.off[facet], starts)
        return PartModels(centre, slopes, radius, np.zeros((count, 2, 2)))


def _widest(values: Array, cluster: Ints, starts: Ints) -> tuple[Array, Array]:
    """(g,) the coordinate along which values (g, 3) of each cluster spread most; ends (2, k)."""
    low, high = np.minimum.reduceat(values, starts), np.maximum.reduceat(values, starts)
    axis = (high - low).argmax(axis=1)[:, None]
    ends = np.stack([np.take_along_axis(end, axis, axis=1)[:, 0] for end in (low, high)])
    return np.take_along_axis(values, axis[cluster], axis=1)[:, 0], ends


def _areas(corners: Array) -> Array:
    """(g,) of triangles (g, 3, 3)."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return np.asarray(0.5 * np.linalg.norm(across, axis=1))


def _emptiest(
    values: Array, areas: Array, ends: Array, cluster: Ints, starts: Ints
) -> tuple[Array, Array]:
    """(k,) the middle of the emptiest of `_BINS` bins between each cluster's ends, and its share.

    The outermost bins do not count.

    Args:
        values: (g,)
        areas: (g,) which count.
        ends: (2, k) lowest and highest value.
        cluster: (g,) of each value.
        starts: (k,) where clusters begin.
    """
    low, width = ends[0], np.maximum((ends[1] - ends[0]) / _BINS, 1e-300)
    at = np.clip((values - low[cluster]) / width[cluster], 0.0, _BINS - 1.0).astype(np.int64)
    held = np.bincount(cluster * _BINS + at, areas, len(starts) * _BINS).reshape(-1, _BINS)
    best = 1 + held[:, 1:-1].argmin(axis=1)
    share = held[np.arange(len(starts)), best] / np.maximum(held.sum(axis=1), 1e-300)
    return low + (best + 0.5) * width, share


def _extremes(values: Array, starts: Ints) -> tuple[Array, Array]:
    """(k, d) lowest and highest of the values (g, m, d) of each cluster."""
    _, m, d = values.shape
    flat = values.reshape(-1, d).T.copy()  # quick to run along
    low, high = (f.reduceat(flat, m * starts, axis=1) for f in (np.minimum, np.maximum))
    return low.T, high.T


def _frames(corners: Array, cluster: Ints, starts: Ints) -> tuple[Array, Array]:
    """A point of each cluster (k, 3), and unit vectors (k, 3, 3): two in its plane, one across.

    The plane is the one nearest to the corners in the mean; the two vectors are those with the
    rectangle of least area.
    """
    size = np.diff(np.append(starts, len(corners)))[:, None]
    middle = np.add.reduceat(corners.mean(axis=1), starts) / size
    off = corners - middle[cluster, None]
    spread = np.add.reduceat(off.transpose(0, 2, 1) @ off, starts)
    frame = np.linalg.eigh(spread)[1][:, :, ::-1].transpose(0, 2, 1)  # the least spread is last
    flat = off @ frame[cluster, :2].transpose(0, 2, 1)
    turns = _TURNS if size.max() <= _LARGE else 1
    angles = np.arange(turns) * (np.pi / 2.0 / turns)
    cosine, sine = np.cos(angles), np.sin(angles)
    u, v = (
        flat[..., :1] * cosine + flat[..., 1:] * sine,
        flat[..., 1:] * cosine - flat[..., :1] * sine,
    )
    areas = [high - low for low, high in (_extremes(each, starts) for each in (u, v))]
    best = np.argmin(areas[0] * areas[1], axis=1)
    c, s = cosine[best][:, None], sine[best][:, None]
    first, second = c * frame[:, 0] + s * frame[:, 1], c * frame[:, 1] - s * frame[:, 0]
    return middle, np.stack([first, second, frame[:, 2]], axis=1)


def _fitted(x: Array, values: Array, cluster: Ints, starts: Ints) -> Array:
    """(k, 4, 3): an affine function of x for each cluster, and the longest difference to values.

    Least squares, then moved between the extremes.

    Args:
        x: (g, m, 2) of each value.
        values: (g, m, 3)
        cluster: (g,) of each facet.
        starts: (k,) where clusters begin.
    """
    at = np.concatenate([np.ones((*x.shape[:2], 1)), x], axis=2)
    square = np.add.reduceat(at.transpose(0, 2, 1) @ at, starts)
    right = np.add.reduceat(at.transpose(0, 2, 1) @ values, starts)
    square += 1e-12 * square[:, :1, :1] * np.eye(3)
    fit = np.zeros((len(starts), 4, 3))
    fit[:, :3] = np.linalg.solve(square, right)
    off = values - at @ fit[cluster, :3]
    low, high = _extremes(off, starts)
    shift = (low + high) / 2.0
    fit[:, 0] += shift
    off -= shift[cluster, None]
    square = np.einsum("gkd,gkd->gk", off, off).max(axis=1)
    fit[:, 3] = np.sqrt(np.maximum.reduceat(square, starts))[:, None]
    return fit
