"""Places of a triangle mesh: a face, and the weights of its second and third corner.

The offset surface over a face is f + h n with the normal n interpolated between the corners, see
`surfaces.meshes.normals`. On the strip along a crease n = v / |v| with

    v = sum of w_c (own_c + t (crease_c - own_c)),    t from 0 at the strip's inner border to 1,

so along a straight line in the weights v is straight beside the strip and of second order on it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.meshes.facets import cut_faces
from surfaces.meshes.mesh_surface import MeshSurface
from surfaces.meshes.normals import WIDTH
from surfaces.places.places import (
    ROUNDING,
    JoinedCharts,
    PlacePaths,
    Places,
    second_derivative_of_unit,
)

if TYPE_CHECKING:
    from surfaces.meshes.face_tree import FaceTree

GRID = np.linspace(0.0, 1.0, 9)  # places on an edge that are tried, in so many rounds
ROUNDS = 8
SLICES = 8  # of the strip along a crease, in flat triangles


@dataclass(frozen=True, eq=False)
class MeshPlaces(JoinedCharts):
    """The places of a mesh. Paths lead over one edge or vertex at most."""

    surface: MeshSurface

    bends_evenly: ClassVar[bool] = True

    def at(self, places: Places) -> tuple[Array, Array, Array]:
        """See `OffsetSurface.at`."""
        face, weights = np.maximum(places.chart, 0), _weights(places.x)
        normals = self.surface.normals_at(face, weights)
        points = self.surface.points_at(face, weights) + self.height * normals
        for values in (points, normals):
            values[places.chart < 0] = np.nan
        return points, normals, np.full_like(normals, np.nan)

    @cached_property
    def _triangles(self) -> tuple[FaceTree, Places]:
        """G flat triangles between points of the offset surface, and the places of their corners.

        A face on a crease has several, so that the arc round an edge becomes a few of them. Nothing
        rests on how well they fit.
        """
        from surfaces.meshes.face_tree import FaceTree  # compiled: loaded when it is needed

        surface = self.surface
        face, weights = cut_faces(surface.on_crease, SLICES)
        corners = Places(np.repeat(face, 3), weights.reshape(-1, 3)[:, 1:])
        whole = surface.face_balls[0] + self.height * surface.crease_normals
        offset = (whole @ surface.rotation.T + surface.position)[face]
        cut = (weights != np.eye(3)).any(axis=(1, 2))
        offset[cut] = self.at(corners.of(np.repeat(cut, 3)))[0].reshape(-1, 3, 3)
        # Cut as the faces themselves are, which are about as near to each other.
        rank = np.argsort(surface.face_tree.order)
        return FaceTree.of(offset, np.argsort(rank[face], kind="stable")), corners

    def nearest(
        self, points: Array, ahead: Array, within: float, only: Ints | None = None
    ) -> Places:
        """See `OffsetSurface.nearest`: on the flat triangles between offset points."""
        tree, corners = self._triangles
        found, weights = tree.nearest(points)
        chart = np.where(found >= 0, corners.chart[3 * found], -1)
        return Places(chart, np.einsum("kc,kcj->kj", weights, corners.x.reshape(-1, 3, 2)[found]))

    def facets(self, points: Array) -> Array:
        """See `OffsetSurface.facets`."""
        return self.surface.beside(points, *self.surface.nearest(points))[0]

    def corners(self, chart: Ints) -> Ints:
        """See `JoinedCharts.corners`."""
        return self.surface.mesh.faces[chart]

    def across(self, start: Places, end: Places, equal: Mask) -> PlacePaths:
        """See `JoinedCharts.across`.

        The edge is crossed where it comes closest to the straight line. There the place belongs to
        both faces; normals on either side differ only if a crease ends there.
        """
        one = np.asarray(equal.any(axis=2))
        count = one.sum(axis=1)
        row = np.arange(len(count))
        corner = np.argmax(one, axis=1)
        last = np.where(count >= 2, 2 - np.argmax(one[:, ::-1], axis=1), corner)
        mates = np.argmax(equal[row, corner], axis=1), np.argmax(equal[row, last], axis=1)
        ends = self._on(start), self._on(end)
        eye = np.eye(3)
        along = [self._on(Places(start.chart, eye[c][:, 1:])) for c in (corner, last)]
        t = np.where(count >= 2, _crossing(*ends, *along), 0.0)
        creased = np.asarray(self.surface.on_crease.any(axis=1))
        some = np.flatnonzero((count >= 2) & (creased[start.chart] | creased[end.chart]))
        if len(some):
            few = start.of(some), end.of(some)
            t[some] = self._shortest(*few, corner[some], last[some], t[some])
        t = t[:, None]
        before = Places(start.chart, ((1.0 - t) * eye[corner] + t * eye[last])[:, 1:])
        after = Places(end.chart, ((1.0 - t) * eye[mates[0]] + t * eye[mates[1]])[:, 1:])
        first, last = self.straight(start, before), self.straight(after, end)
        return PlacePaths.joined(first, last, (first.length, last.length))

    def _shortest(self, start: Places, end: Places, corner: Ints, last: Ints, t: Array) -> Array:
        """(k,) 0..1, where on the edge from `corner` to `last` the path from T to T is shortest.

        On a crease's strip the straight line on the mesh may be a long way round. Looked for on
        ever finer grids, the first of them over the whole edge with `t` in it.
        """
        eye = np.eye(3)
        low, high = np.zeros_like(t), np.ones_like(t)
        a, b = self.at(start)[0], self.at(end)[0]
        best = t
        for _ in range(ROUNDS):
            tried = np.concatenate([low + GRID[:, None] * (high - low), best[None]])
            x = (1.0 - tried)[..., None] * eye[corner] + tried[..., None] * eye[last]
            chart = np.tile(start.chart, len(tried))
            over = self.at(Places(chart, x.reshape(-1, 3)[:, 1:]))[0].reshape(*tried.shape, 3)
            length = np.linalg.norm(over - a, axis=2) + np.linalg.norm(over - b, axis=2)
            best = tried[np.argmin(length, axis=0), np.arange(len(t))]
            width = 1.5 * GRID[1] * (high - low)
            low, high = np.maximum(best - width, 0.0), np.minimum(best + width, 1.0)
        return np.asarray(best)

    def _on(self, places: Places) -> Array:
        """(k, 3) m, points of the mesh itself, which are linear in the weights; on a crease's strip
        those of the offset surface are not."""
        return self.surface.points_at(places.chart, _weights(places.x))

    def bends(self, chart: Ints, start: Array, stop: Array) -> Array:
        """See `JoinedCharts.bends`.

        An eighth of bounds of second derivatives. On one side of the strip's border v is smooth:
        v'' = 2 t' g' for the sum g of w_c (crease_c - own_c). A line over that border has a kink
        there; its slope is at most
        |o'| + |t'| |g| + |g'|, with o the sum of w_c own_c, and a curve of slope M differs from a
        straight line by at most 2 M s (1 - s), as one with the second derivative 4 M.
        """
        surface = self.surface
        a, b = _weights(start), _weights(stop)
        own = surface.corner_normals[chart]
        turn = surface.crease_normals[chart] - own
        level = [(w * surface.on_crease[chart]).sum(axis=1) for w in (a, b)]
        o = [np.einsum("kc,kci->ki", w, own) for w in (a, b)]
        g = [np.einsum("kc,kci->ki", w, turn) for w in (a, b)]
        rate = (level[1] - level[0]) / WIDTH
        inner = 1.0 - WIDTH
        beside = np.maximum(*level) <= inner
        within = np.minimum(*level) >= inner
        rate = np.where(beside, 0.0, rate)
        do, dg = o[1] - o[0], g[1] - g[0]
        most = np.maximum(*(np.linalg.norm(part, axis=1) for part in g))
        size_dg = np.where(beside, 0.0, np.linalg.norm(dg, axis=1))
        slope = np.linalg.norm(do, axis=1) + np.abs(rate) * most + size_dg
        middle = 0.5 * (a + b)
        shared = surface.crease_share(chart, middle)[:, None]
        v = np.einsum("kc,kci->ki", middle, own + shared[..., None] * turn)
        least = np.linalg.norm(v, axis=1) - 0.5 * slope
        smooth = second_derivative_of_unit(least, slope, 2.0 * np.abs(rate) * size_dg)
        positive = least > 0.0
        kinked = np.where(positive, 4.0 * slope / np.where(positive, least, 1.0), np.inf)
        normal = np.where(beside | within, smooth, kinked)
        normal = np.where((start == stop).all(axis=1), 0.0, normal / 8.0) * ROUNDING
        point = abs(self.height) * normal if self.height else np.zeros_like(normal)
        return np.column_stack([np.where(positive, point, np.inf), normal, np.inf + 0.0 * rate])


def _weights(x: Array) -> Array:
    """(k, 3) weights of all corners."""
    return np.concatenate([1.0 - x.sum(axis=1, keepdims=True), x], axis=1)


def _crossing(start: Array, end: Array, first: Array, last: Array) -> Array:
    """(k,) 0..1, where lines from `first` to `last` are closest to lines from start to end."""
    d, e, off = end - start, last - first, start - first
    a, b, c = ((x * y).sum(axis=1) for x, y in ((d, d), (d, e), (e, e)))
    p, q = (d * off).sum(axis=1), (e * off).sum(axis=1)
    square = a * c - b * b
    along = np.divide(b * q - c * p, square, out=np.zeros_like(a), where=square > 1e-30)
    along = np.clip(along, 0.0, 1.0)
    t = np.divide(along * b + q, c, out=np.zeros_like(a), where=c > 0.0)
    return np.asarray(np.clip(t, 0.0, 1.0))
