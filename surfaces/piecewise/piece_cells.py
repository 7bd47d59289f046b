"""PieceCells: the pieces of a piecewise surface, each cut into a grid, numbered piece by piece."""

from __future__ import annotations

import operator
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints, Mask
from surfaces.adjacency import Neighbours
from surfaces.cell_curves import CellCurves
from surfaces.cells import Cells, CellTriangles, Finer, Unrolled
from surfaces.curve_fitting import CurveFit
from surfaces.patches.grid_cells import GridCells
from surfaces.piecewise.across_seams import (
    SeamPairs,
    curves_across,
    fit_over_inner,
    fit_round_edges,
    seam_pairs_of,
)
from surfaces.piecewise.edges import SMOOTH
from surfaces.piecewise.joined_patches import JoinedPatches
from surfaces.surface import SurfaceError

LEFT = 0.2  # rad, so far clockwise from the left a list of neighbours begins, as in a grid


@dataclass(frozen=True, eq=False, repr=False)
class PieceCells(Cells):
    """N cells of several pieces; cell (piece, i, j) is cell (i, j) of that piece's grid."""

    surface: JoinedPatches
    counts: tuple[tuple[int, int], ...]
    """Cells along u and v of each piece."""

    @staticmethod
    def cut(surface: JoinedPatches, counts: Any) -> PieceCells:
        """See `Piecewise.cells`."""
        checked = _counts(counts, len(surface.pieces))
        grids = [piece.cells(*of) for piece, of in zip(surface.placed, checked, strict=True)]
        signs = surface.signs
        areas = np.concatenate([grid.areas for grid in grids])
        return PieceCells(
            surface=surface,
            centres=np.concatenate([grid.centres for grid in grids]),
            normals=np.concatenate([s * g.normals for s, g in zip(signs, grids, strict=True)]),
            areas=areas,
            shape=(len(areas),),
            counts=checked,
        )

    def finer(self, parts: int = 3) -> Finer:
        """See `Cells.finer`."""
        cells = PieceCells.cut(self.surface, [(parts * nu, parts * nv) for nu, nv in self.counts])
        starts = np.repeat(cells.first[:-1], np.diff(self.first))
        same = np.concatenate([grid.finer(parts).same for grid in self.grids])
        return Finer(cells, starts + same)

    @cached_property
    def grids(self) -> tuple[GridCells, ...]:
        """The cells of each piece alone, in the root frame."""
        return tuple(
            piece.cells(*of) for piece, of in zip(self.surface.placed, self.counts, strict=True)
        )

    @cached_property
    def first(self) -> Ints:
        """(pieces + 1,) where the cells of each piece begin, and the end of the last."""
        return np.concatenate([[0], np.cumsum([nu * nv for nu, nv in self.counts])])

    @cached_property
    def piece(self) -> Ints:
        """(N,) the piece of each cell."""
        return np.repeat(np.arange(len(self.counts)), np.diff(self.first))

    @cached_property
    def seam_pairs(self) -> SeamPairs:
        """The pairs of cells that touch across seams."""
        return seam_pairs_of(self.surface, self.counts)

    @cached_property
    def tangents(self) -> Array:
        """See `Cells.tangents`: the u directions of each piece."""
        found = np.concatenate([grid.tangents for grid in self.grids])
        found.flags.writeable = False
        return found

    @cached_property
    def neighbours(self) -> Neighbours:
        """(indptr, indices): each cell's neighbours, clockwise seen from outside."""
        own = [grid.pairs + start for grid, start in zip(self.grids, self.first, strict=False)]
        pairs = np.concatenate([*own, self.seam_pairs.pairs])
        owner, other = np.concatenate([pairs, pairs[:, ::-1]]).T
        right = np.concatenate([_rightward(grid) for grid in self.grids])
        up = np.cross(self.normals, right)
        ahead = self.centres[other] - self.centres[owner]
        x, y = ((ahead * axes[owner]).sum(axis=1) for axes in (right, up))
        clockwise = np.mod(np.arctan2(y, -x) - LEFT, 2.0 * np.pi)
        return Neighbours.listed(owner, other, clockwise, len(self))

    @cached_property
    def curves(self) -> CellCurves:
        """See `Cells.curves`."""
        return self._fitted().joined()

    def _fitted(self) -> CurveFit:
        fit = CurveFit.of(self)
        fit_round_edges(fit, self.surface, self.seam_pairs, self.piece[self.pairs])
        return fit

    def at_height(self, height: float) -> PieceCells:
        """See `Cells.at_height`."""
        if not self.surface.creases.inner:
            return self
        cells, fit = replace(self), self._fitted()
        fit_over_inner(fit, self.surface, self.seam_pairs, self.piece[self.pairs], height)
        vars(cells)["curves"] = fit.joined()
        return cells

    @property
    def creased(self) -> Mask:
        """See `Cells.creased`: along an edge round which the tool can go."""
        edges = {pieces for _, pieces in self.surface.creases.edges}
        of = self.piece[self.seam_pairs.pairs]
        creased = np.zeros(len(self), dtype=bool)
        creased[self.seam_pairs.pairs[[tuple(two) in edges for two in of.tolist()]]] = True
        return creased

    def trace(self, pairs: Ints, t: Array) -> tuple[Array, Array]:
        """See `Cells.trace`: within a piece as on its grid, across a seam see `curves_across`."""
        points, normals = np.empty((2, len(pairs), len(t), 3))
        for a, b, both in self._by_pieces(pairs):
            some = pairs[both]
            if a == b:
                found = self.grids[a].trace(some - self.first[a], t)
                points[both], normals[both] = found[0], self.surface.signs[a] * found[1]
            else:
                ends = self.centres[some[:, 0]], self.centres[some[:, 1]]
                points[both], normals[both] = curves_across(
                    self.surface, self.seam_pairs.between(some), *ends, t, (a, b), self.around(a, b)
                )
        return points, normals

    def closest_along(self, pairs: Ints, points: Array) -> tuple[Array, Array]:
        """See `Cells.closest_along`: on the pieces of both cells, and those that touch both."""
        found_points, normals = np.empty_like(points), np.empty_like(points)
        for a, b, both in self._by_pieces(pairs):
            found = self.surface.nearest(points[both], self.around(a, b))
            found_points[both] = found.places.reshape(-1, *points.shape[1:])
            normals[both] = found.normals.reshape(-1, *points.shape[1:])
        return found_points, normals

    def smoothed(self, pairs: Ints) -> Mask:
        """See `Cells.smoothed`: across creases."""
        creased = self.piece[pairs[:, 0]] != self.piece[pairs[:, 1]]
        creased[creased] = self.seam_pairs.between(pairs[creased]).creases > SMOOTH
        return creased

    def parallel_curvature(self, height: float) -> Array:
        """See `Cells.parallel_curvature`."""
        return np.concatenate([grid.parallel_curvature(height) for grid in self.grids])

    def _by_pieces(self, pairs: Ints) -> Iterator[tuple[int, int, Ints]]:
        """Both pieces of pairs (m, 2) of cells, and the rows that have them."""
        of = self.piece[pairs]
        for a, b in np.unique(of, axis=0).tolist():
            yield a, b, np.flatnonzero((of == (a, b)).all(axis=1))

    def around(self, a: int, b: int) -> tuple[int, ...]:
        """Two pieces, and all others that have a seam with both; of one piece, itself alone."""
        if a == b:
            return (a,)
        met = {seam.pieces for seam in self.surface.seams}
        return tuple(
            k
            for k in range(len(self.counts))
            if k in (a, b) or all((min(k, of), max(k, of)) in met for of in (a, b))
        )

    def index(self, piece: int, i: int, j: int) -> int:
        """Flat index of the cell in row i and column j of a piece.

        Raises:
            IndexError: there is no such cell.
        """
        if not 0 <= piece < len(self.grids):
            raise IndexError(f"no piece {piece} among {len(self.grids)}")
        return int(self.first[piece]) + self.grids[piece].index(i, j)

    def unravel(self, k: int) -> tuple[int, int, int]:
        """See `Cells.unravel`: piece, row (u) and column (v)."""
        if not 0 <= k < len(self):
            raise IndexError(f"no cell {k} among {len(self)}")
        piece = int(self.piece[k])
        return (piece, *self.grids[piece].unravel(int(k - self.first[piece])))

    def locate(self, points: ArrayLike) -> Ints:
        """See `Cells.locate`."""
        found = self.surface.nearest(points)
        cells = np.full(len(found.piece), -1, dtype=np.int64)
        for k, grid in enumerate(self.grids):
            some = found.inside & (found.piece == k)
            cells[some] = self.first[k] + grid.at(found.u[some], found.v[some])
        return cells

    def borders(self, samples: int = 8) -> Array:
        """See `Cells.borders`."""
        return np.concatenate([grid.borders(samples) for grid in self.grids])

    def triangles(self, which: Ints, samples: int = 8, inset: float = 0.0) -> CellTriangles:
        """See `Cells.triangles`; cell by cell in the given order."""
        which = np.asarray(which, dtype=np.int64)
        corners, faces = (samples + 1) ** 2, 2 * samples**2  # of one cell
        vertices = np.empty((len(which), corners, 3))
        triangles = np.empty((len(which), faces, 3), dtype=np.int64)
        for k, grid in enumerate(self.grids):
            some = np.flatnonzero(self.piece[which] == k)
            part = grid.triangles(which[some] - self.first[k], samples, inset)
            vertices[some] = part.vertices.reshape(-1, corners, 3)
            shift = corners * (some - np.arange(len(some)))
            outwards = part.faces[:, :: int(self.surface.signs[k])]
            triangles[some] = outwards.reshape(-1, faces, 3) + shift[:, None, None]
        return CellTriangles(vertices.reshape(-1, 3), triangles.reshape(-1, 3))

    def unrolled(self) -> Unrolled:
        """See `Cells.unrolled`: seen along the mean normal, from the outside."""
        return self.seen_from_outside(line for grid in self.grids for line in grid.outlines())

    def __repr__(self) -> str:
        """One line."""
        grids = " + ".join(f"{nu} x {nv}" for nu, nv in self.counts)
        return f"Cells({grids} of {self.surface!r})"


def _rightward(grid: GridCells) -> Array:
    """(N, 3) unit tangents at the centres along which v grows."""
    low, high = grid.surface.v_range
    step = 1e-5 * (high - low)
    along = grid.surface.point(grid.u, grid.v + step) - grid.surface.point(grid.u, grid.v - step)
    return np.asarray(along / np.linalg.norm(along, axis=1, keepdims=True))


def _counts(counts: Any, pieces: int) -> tuple[tuple[int, int], ...]:
    """One (nu, nv) for each piece."""
    expected = (
        f"counts must be a pair (nu, nv) of whole numbers >= 0 for all pieces, or a list of "
        f"{pieces} such pairs, one for each piece"
    )
    if isinstance(counts, np.ndarray):
        counts = counts.tolist()
    if not isinstance(counts, Sequence) or isinstance(counts, (str, bytes)):
        raise SurfaceError(f"{expected}; got {counts!r}")
    alike = len(counts) == 2 and not any(isinstance(part, Sequence) for part in counts)
    rows = [counts] * pieces if alike else counts
    if len(rows) != pieces:
        raise SurfaceError(f"{expected}; got {len(rows)} of them")
    checked = []
    for k, row in enumerate(rows):
        try:
            nu, nv = (operator.index(number) for number in row)
        except (TypeError, ValueError):
            nu = nv = -1
        if min(nu, nv) < 0 or any(isinstance(number, bool) for number in row):
            raise SurfaceError(f"{expected}; of pieces[{k}] got {row!r}")
        checked.append((nu, nv))
    return tuple(checked)
