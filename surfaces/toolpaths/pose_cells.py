"""PoseCells: every pose is a cell."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints
from surfaces.adjacency import Neighbours
from surfaces.cell_curves import CellCurves
from surfaces.cells import Cells, CellTriangles, Unrolled
from surfaces.surface import points_of
from surfaces.toolpaths.arcs import arc_at, arc_pieces, curves
from surfaces.toolpaths.pose_surface import PoseSurface

TILE = 0.5  # of the distance to the nearest other pose: side of the square that a pose is drawn as
SMALLEST = 1e-3  # m, where all poses are in one place
_CORNERS = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])
_HALVES = np.array([[0, 1, 2], [0, 2, 3]])


@dataclass(frozen=True, eq=False, repr=False)
class PoseCells(Cells):
    """N poses as cells, numbered as they are given.

    Poses have no area: all count alike, as squares as wide as the typical step from one to the
    next. They are drawn as small tiles.
    """

    surface: PoseSurface

    @staticmethod
    def of(surface: PoseSurface) -> PoseCells:
        """The poses of a surface as cells."""
        points, pairs = surface.placed_points, surface.pairs
        steps = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
        steps = steps[steps > SMALLEST]
        width = float(np.median(steps)) if len(steps) else SMALLEST
        return PoseCells(
            surface=surface,
            centres=points,
            normals=surface.turned(surface.outward),
            areas=np.full(len(points), width**2),
            shape=(len(points),),
        )

    @property
    def in_order(self) -> bool:
        """See `Cells.in_order`."""
        return self.surface.in_order

    @property
    def middle(self) -> int:
        """The pose in the middle of a toolpath; else see `Cells.middle`."""
        return len(self) // 2 if self.in_order else super().middle

    @cached_property
    def tangents(self) -> Array | None:
        """See `Cells.tangents`; None where the poses have none."""
        return self._turned(self.surface.along)

    @cached_property
    def approaches(self) -> Array | None:
        """See `Cells.approaches`."""
        return self._turned(self.surface.axes)

    def _turned(self, directions: Array | None) -> Array | None:
        if directions is None:
            return None
        found = self.surface.turned(directions)
        found.flags.writeable = False
        return found

    @cached_property
    def neighbours(self) -> Neighbours:
        """(indptr, indices): the poses that each may move to, by their numbers."""
        ends = np.concatenate([self.surface.pairs, self.surface.pairs[:, ::-1]])
        return Neighbours.listed(ends[:, 0], ends[:, 1], ends[:, 1], len(self))

    @cached_property
    def curves(self) -> CellCurves:
        """See `Cells.curves`: straight, with the normals along great arcs.

        In as many pieces as the approaches and the tangents need too.
        """
        turning = (self.normals, self.approaches, self.tangents)
        counts = [arc_pieces(some, self.pairs) for some in turning if some is not None]
        return curves(self.centres, self.normals, self.pairs, np.max(counts, axis=0))

    def trace(self, pairs: Ints, t: Array) -> tuple[Array, Array]:
        """See `Cells.trace`."""
        i, j = (np.repeat(end, len(t)) for end in pairs.T)
        share = np.tile(t, len(pairs))
        points = self.centres[i] + share[:, None] * (self.centres[j] - self.centres[i])
        normals, _ = arc_at(self.normals[i], self.normals[j], share)
        shape = (len(pairs), len(t), 3)
        return points.reshape(shape), normals.reshape(shape)

    def parallel_curvature(self, height: float) -> Array:
        """See `Cells.parallel_curvature`: there is no surface that bends."""
        return np.zeros(len(self))

    def locate(self, points: ArrayLike) -> Ints:
        """See `Cells.locate`: the pose that is nearest."""
        points = points_of(points)
        found = np.full(points.shape[:-1], -1, dtype=np.int64)
        known = np.isfinite(points).all(axis=-1)
        found[known] = self.surface.tree.query(points[known])[1]
        return found

    def borders(self, samples: int = 8) -> Array:
        """See `Cells.borders`: the straight lines between poses."""
        return self.centres[self.pairs]

    @cached_property
    def _tiles(self) -> Array:
        """(N, 4, 3) m, the squares that poses are drawn as; along the tangents, if there are."""
        apart = self.surface.tree.query(self.centres, k=2)[0][:, 1]
        width = TILE * np.where(apart > SMALLEST, apart, np.sqrt(self.areas))
        along = self.tangents
        if along is None:
            least = np.eye(3)[np.argmin(np.abs(self.normals), axis=1)]
            along = np.cross(self.normals, least)
            along = along / np.linalg.norm(along, axis=1, keepdims=True)
        axes = width[:, None, None] * np.stack([along, np.cross(self.normals, along)], axis=1)
        return np.asarray(self.centres[:, None] + _CORNERS @ axes)

    def triangles(self, which: Ints, samples: int = 8, inset: float = 0.0) -> CellTriangles:
        """See `Cells.triangles`: two for each pose."""
        centres = self.centres[which, None]
        corners = centres + (1.0 - inset) * (self._tiles[which] - centres)
        faces = 4 * np.arange(len(corners))[:, None, None] + _HALVES
        return CellTriangles(corners.reshape(-1, 3), faces.reshape(-1, 3))

    def unrolled(self) -> Unrolled:
        """See `Cells.unrolled`: seen along the mean normal, from the outside."""
        return self.seen_from_outside(np.vstack([tile, tile[:1]]) for tile in self._tiles)

    def unravel(self, k: int) -> tuple[int]:
        """See `Cells.unravel`."""
        if not 0 <= k < len(self):
            raise IndexError(f"no pose {k} among {len(self)}")
        return (int(k),)

    def __repr__(self) -> str:
        """One line."""
        return f"Cells({self.surface!r})"
