"""Cells made of faces: their centres, outlines, and who shares how much border with whom."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.adjacency import Neighbours
from surfaces.meshes.closest_on_triangle import on_each
from surfaces.meshes.triangle_mesh import edge_partners, least_by, sum_by

_INSIDE = 0.25  # of sqrt(area): as far from the border as this is well inside (a disc has 0.56)
_SAME = 1e-12  # of the area: squares of distances that differ by less are equal, the first counts
_DEEP = 0.8  # of the greatest distance to the border: as good as the greatest


class LabelledFaces(NamedTuple):
    """The faces of a clean mesh, grouped into N cells."""

    vertices: Array
    """(V, 3) m."""
    faces: Ints
    """(F, 3) vertex indices."""
    labels: Ints
    """(F,) cell of each face."""
    partner: Ints
    """(F, 3) see `triangle_mesh.edge_partners`."""
    across: Ints
    """(F, 3) the cell on the other side of each edge; -1 at the border of the mesh."""

    @staticmethod
    def of(vertices: Array, faces: Ints, labels: Ints) -> LabelledFaces:
        """With what follows from the faces."""
        partner = edge_partners(faces)
        across = np.where(partner >= 0, labels[partner // 3], -1)
        return LabelledFaces(vertices, faces, labels, partner, across)

    @property
    def border(self) -> Mask:
        """(F, 3) whether an edge lies on its cell's border."""
        return np.asarray(self.across != self.labels[:, None])


class FacePoints(NamedTuple):
    """A point of a face of each of N cells."""

    points: Array
    """(N, 3) m."""
    faces: Ints
    """(N,) the face it lies on."""
    weights: Array
    """(N, 3) barycentric coordinates on that face, >= 0, of sum 1."""


def centre_points(mesh: LabelledFaces, areas: Array) -> FacePoints:
    """The point of each cell nearest to its centroid; elsewhere where that is at its border.

    The centroid of a ring or a horseshoe lies outside, and the point nearest to it on the border.
    Such a cell gets the middle of a face that is about as far from the border as can be, and of
    those the one nearest to the centroid.

    Args:
        mesh: the cells.
        areas: (F,) m^2, of the faces.
    """
    labels, count = mesh.labels, int(mesh.labels.max()) + 1
    corners = mesh.vertices[mesh.faces]
    middles = corners.mean(axis=1)
    total = sum_by(labels, areas, count)
    centroids = sum_by(labels, areas[:, None] * middles, count) / total[:, None]
    squares, at = np.empty(len(labels)), np.empty((len(labels), 3))
    on_each(corners, centroids[labels], squares, at)
    chosen = least_by(labels, squares, _SAME * total)
    weights = at[chosen]
    points = np.einsum("nk,nkc->nc", weights, corners[chosen])
    face, k = np.nonzero(mesh.border)
    ends = np.stack([corners[face, k], corners[face, (k + 1) % 3]], axis=1)
    inside = np.full(count, math.inf)
    np.minimum.at(inside, labels[face], _to_segments(points[labels[face]], *ends.swapaxes(0, 1)))
    for n in np.flatnonzero(inside < _INSIDE**2 * total).tolist():
        own = np.flatnonzero(labels == n)
        depths = np.full(len(own), math.inf)
        for start, end in ends[labels[face] == n]:
            depths = np.minimum(depths, _to_segments(middles[own], start, end))
        if inside[n] < depths.max() / 4.0:
            own = own[depths >= _DEEP**2 * depths.max() - _SAME * total[n]]
            off = ((middles[own] - centroids[n]) ** 2).sum(axis=1)
            chosen[n] = own[np.argmax(off <= off.min() + _SAME * total[n])]
            weights[n], points[n] = 1.0 / 3.0, middles[chosen[n]]
    return FacePoints(points, chosen, weights)


def _to_segments(points: Array, start: Array, end: Array) -> Array:
    """(k,) m^2, squared distances of points from segments, both (k, 3) m or one of either."""
    along = end - start
    share = ((points - start) * along).sum(axis=-1) / (along * along).sum(axis=-1)
    off = start + np.clip(share, 0.0, 1.0)[:, None] * along - points
    return np.asarray((off * off).sum(axis=1))


class SharedBorders(NamedTuple):
    """Pairs of cells that share a border. Cells that touch in single points share none."""

    pairs: Ints
    """(M, 2) i < j, sorted."""
    lengths: Array
    """(M,) m."""
    midpoints: Array
    """(M, 3) m, the place on each border that is nearest to its mean."""


def outlines(mesh: LabelledFaces) -> list[list[Ints]]:
    """Of each cell its closed border lines, as vertices (n + 1,): the last is the first.

    Counter-clockwise seen from outside, holes clockwise; a closed surface has none.
    """
    border, partner = mesh.border.ravel(), mesh.partner.ravel()
    halves = np.flatnonzero(border)
    following = _ahead(halves)
    while len(inner := np.flatnonzero(~border[following])):  # turning about their vertex
        following[inner] = _ahead(partner[following[inner]])
    after = dict(zip(halves.tolist(), following.tolist(), strict=True))
    found: list[list[Ints]] = [[] for _ in range(int(mesh.labels.max()) + 1)]
    for first in halves.tolist():
        if first in after:
            line, half = [first], after.pop(first)
            while half != first:
                line.append(half)
                half = after.pop(half)
            found[mesh.labels[first // 3]].append(mesh.faces.ravel()[[*line, first]])
    return found


def _ahead(halves: Ints) -> Ints:
    """The next half-edges of the same faces."""
    return halves - halves % 3 + (halves + 1) % 3


def shared_borders(mesh: LabelledFaces) -> SharedBorders:
    """Which cells share a border, how long it is, and its middle."""
    vertices, faces, labels = mesh.vertices, mesh.faces, mesh.labels
    count = int(labels.max()) + 1
    face, k = np.nonzero(mesh.across > labels[:, None])
    keys, pair = np.unique(labels[face] * count + mesh.across[face, k], return_inverse=True)
    start, end = vertices[faces[face, k]], vertices[faces[face, (k + 1) % 3]]
    length = np.linalg.norm(end - start, axis=1)
    total = sum_by(pair, length, len(keys))
    mean = sum_by(pair, length[:, None] * (start + end) / 2.0, len(keys)) / total[:, None]
    along = np.einsum("ij,ij->i", mean[pair] - start, end - start) / length**2
    nearest = start + np.clip(along, 0.0, 1.0)[:, None] * (end - start)
    # Rounded, so that of two places equally near the first is taken, however the mesh is turned.
    off = np.linalg.norm(nearest - mean[pair], axis=1) / total[pair]
    order = np.lexsort((np.arange(len(pair)), off.round(6), pair))
    first = order[np.unique(pair[order], return_index=True)[1]]
    return SharedBorders(np.column_stack(np.divmod(keys, count)), total, nearest[first])


def clockwise_neighbours(borders: SharedBorders, centres: Array, normals: Array) -> Neighbours:
    """Each cell's neighbours, clockwise seen from its normal's tip, the lowest index first.

    Args:
        borders: of N cells.
        centres: (N, 3) m.
        normals: (N, 3) unit normals at the centres.
    """
    owner, other = np.concatenate([borders.pairs, borders.pairs[:, ::-1]]).T
    middle = np.concatenate([borders.midpoints, borders.midpoints])
    # Angles from the direction of the lowest neighbour, which so comes first.
    order = np.lexsort((other, owner))
    owner, other, middle = owner[order], other[order], middle[order]
    lowest = np.searchsorted(owner, owner)
    away = middle - centres[owner]
    first, normal = away[lowest], normals[owner]
    ahead = np.einsum("ij,ij->i", first, away) - (
        np.einsum("ij,ij->i", first, normal) * np.einsum("ij,ij->i", away, normal)
    )
    right = np.einsum("ij,ij->i", normal, np.cross(away, first))
    angle = np.arctan2(right, ahead) % (2.0 * np.pi)
    angle[lowest == np.arange(len(owner))] = -1.0
    return Neighbours.listed(owner, other, angle, len(centres))
