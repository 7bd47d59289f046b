"""MeshCells: connected groups of the triangles of a mesh, of even area."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints, Mask
from surfaces.adjacency import Neighbours
from surfaces.cell_curves import CellCurves
from surfaces.cells import Cells, CellTriangles, Unrolled
from surfaces.curve_fitting import CurveFit
from surfaces.meshes.triangle_surface import TriangleSurface
from surfaces.surface import SurfaceError, max_principal_curvature, points_of

if TYPE_CHECKING:
    from surfaces.meshes.cells.properties import Figures


JUMP = 3.0  # times the step along the straight line: there closest points jump


@dataclass(frozen=True, eq=False, repr=False)
class MeshCells(Cells):
    """N cells of a mesh; a cell is the faces with its label."""

    surface: TriangleSurface
    labels: Ints
    """(F,) cell of each face of `surface.mesh`."""

    @staticmethod
    def cut(surface: TriangleSurface, count: int | None, size: float | None) -> MeshCells:
        """See `MeshSurface.cells`."""
        from surfaces.meshes.cells.clustering import cells_for

        cut = cells_for(surface.mesh.vertices, surface.mesh.faces, count, size)
        fine = surface.finer(cut.mesh.vertices, cut.mesh.faces, cut.mesh.original)
        return MeshCells.of(fine, cut.labels)

    @staticmethod
    def of(surface: TriangleSurface, labels: ArrayLike) -> MeshCells:
        """Cells from given groups of faces.

        Args:
            surface: the mesh.
            labels: (F,) cell of each face, every one of 0..N-1 at least once, each connected.

        Raises:
            SurfaceError: the labels are no such groups.
        """
        numbers = np.asarray(labels)
        if numbers.shape != (len(surface.mesh.faces),) or numbers.dtype.kind not in "iu":
            raise SurfaceError(
                f"labels must be {len(surface.mesh.faces)} whole numbers, one for each face, got "
                f"shape {numbers.shape} of {numbers.dtype}"
            )
        if numbers.min() < 0:
            raise SurfaceError(f"labels must number cells from 0 on, got {numbers.min()}")
        numbers = numbers.astype(np.int64)
        figures = _figures(surface, numbers)
        made = MeshCells(
            surface=surface,
            centres=figures.centres @ surface.rotation.T + surface.position,
            normals=figures.normals @ surface.rotation.T,
            areas=figures.areas,
            shape=(len(figures.areas),),
            labels=numbers,
        )
        made.__dict__["figures"] = figures
        return made

    @cached_property
    def figures(self) -> Figures:
        """What is known of each cell: flatness and borders; in the surface's own frame."""
        return _figures(self.surface, self.labels)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know about the mesh and its cells; one sentence each."""
        from surfaces.meshes.cells.properties import coarse

        words = coarse(self.figures)
        return (*self.surface.notes, *([words] if words else []))

    @property
    def neighbours(self) -> Neighbours:
        """(indptr, indices): the cells that share a border with each, clockwise from outside."""
        return self.figures.neighbours

    @cached_property
    def curves(self) -> CellCurves:
        """See `Cells.curves`; those over creases and tight bends, or past notches, are reshaped."""
        from surfaces.meshes.cells.curves_inside import fit_inside
        from surfaces.meshes.cells.reshaped_curves import (
            creases_of,
            fit_over_bends,
            fit_over_creases,
        )

        fit = CurveFit.of(self)
        rough = fit.rough
        if len(rough):
            fit_over_creases(fit, creases_of(self.surface, self.labels), self._crease_shares)
            fit_over_bends(fit)
            fit_inside(fit, self.surface, self.labels, self.figures.faces)
        return fit.joined()

    def trace(self, pairs: Ints, t: Array) -> tuple[Array, Array]:
        """See `Cells.trace`: the closest points to straight lines on the faces of both cells.

        Where these jump, because the surface is strongly bent or creased between the centres, the
        line is led over the middle of the border that the cells share.
        """
        start, end = self.centres[pairs[:, 0]], self.centres[pairs[:, 1]]
        points, normals = self.closest_along(pairs, _bent_lines(start, 0.5 * (start + end), end, t))
        steps = np.linalg.norm(np.diff(points, axis=1), axis=2)
        even = np.linalg.norm(end - start, axis=1)[:, None] * np.diff(t)
        jumps = (steps > JUMP * even).any(axis=1)
        over = pairs[jumps]
        bent = _bent_lines(start[jumps], self.crossings(over), end[jumps], t)
        points[jumps], normals[jumps] = self.closest_along(over, bent)
        return points, normals

    def closest_along(self, pairs: Ints, points: Array) -> tuple[Array, Array]:
        """See `Cells.closest_along`: on the two cells and those that touch both."""
        faces, weights = self._closest_faces(pairs, points)
        return self.surface.points_at(faces, weights), self.surface.normals_at(faces, weights)

    def parallel_curvature(self, height: float) -> Array:
        """See `Cells.parallel_curvature`: of the most curved face of each cell."""
        steps, turns = self.surface.turns
        sharpest = np.zeros(len(self))
        by_face = max_principal_curvature(steps + height * turns, turns)
        np.maximum.at(sharpest, self.labels, by_face)
        return sharpest

    @property
    def creased(self) -> Mask:
        """See `Cells.creased`."""
        creased = np.zeros(len(self), dtype=bool)
        creased[self.labels[self.surface.on_crease.any(axis=1)]] = True
        return creased

    def distances(self, pairs: Ints, points: Array) -> tuple[Array, Array]:
        """See `Cells.distances`."""
        return self.surface.beside(points, *self._closest_places(pairs, points))

    def crease_distances(self, pairs: Ints, points: Array) -> Array:
        """See `Cells.crease_distances`."""
        if not self.surface.on_crease.any():
            return super().crease_distances(pairs, points)
        return self.surface.from_crease(*self._closest_places(pairs, points))

    def _crease_shares(self, pairs: Ints, points: Array) -> Array:
        """(m, k) see `MeshSurface.crease_share`, closest to points (m, k, 3) m."""
        return self.surface.crease_share(*self._closest_faces(pairs, points))

    def _closest_places(self, pairs: Ints, points: Array) -> tuple[Ints, Array]:
        """Faces (k,) and weights (k, 3) on them closest to points (k, 3) m; see `distances`."""
        faces, weights = self._closest_faces(pairs, points[:, None])
        return faces[:, 0], weights[:, 0]

    def _closest_faces(self, pairs: Ints, points: Array) -> tuple[Ints, Array]:
        """Faces (m, k) and weights (m, k, 3) on them closest to points (m, k, 3) m.

        Of the two cells of each pair and of those that touch both.
        """
        from surfaces.meshes.face_tree import FaceTree

        members, indptr = self.members
        local = (points - self.surface.position) @ self.surface.rotation
        found, at = self.surface.face_tree.nearest(local.reshape(-1, 3))
        faces, weights = found.reshape(local.shape[:2]), at.reshape(local.shape)
        # The face of all that is nearest is mostly one of theirs. Where it is not, as where another
        # part of the mesh is close, a tree of theirs is asked.
        label, one, other = self.labels[faces], pairs[:, :1], pairs[:, 1:]
        theirs = (label == one) | (label == other) | (faces < 0)
        theirs |= self._touching(label, one) & self._touching(label, other)
        corners = self.surface.face_balls[0]
        for row in np.flatnonzero(~theirs.all(axis=1)):
            near, beside = (set(self.neighbours.of(k).tolist()) for k in pairs[row])
            cells = {*pairs[row].tolist(), *(near & beside)}
            own = np.sort(np.concatenate([members[indptr[k] : indptr[k + 1]] for k in cells]))
            away = np.flatnonzero(~theirs[row])
            found, weights[row, away] = FaceTree.of(corners[own]).nearest(local[row, away])
            faces[row, away] = own[found]
        return faces, weights

    def _touching(self, one: Ints, other: Ints) -> Mask:
        """Which cells share a border with others, both broadcast."""
        keys = self.pairs[:, 0] * len(self) + self.pairs[:, 1]
        wanted = np.minimum(one, other) * len(self) + np.maximum(one, other)
        at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        return np.asarray(keys[at] == wanted) if len(keys) else np.zeros(wanted.shape, dtype=bool)

    @cached_property
    def members(self) -> tuple[Ints, Ints]:
        """Faces cell by cell (F,), and where each cell's begin (N + 1,)."""
        order = np.argsort(self.labels, kind="stable")
        return order, np.searchsorted(self.labels[order], np.arange(len(self) + 1))

    def crossings(self, pairs: Ints) -> Array:
        """(m, 3) m, a place in the middle of the border that two cells share."""
        keys = self.pairs[:, 0] * len(self) + self.pairs[:, 1]
        row = np.searchsorted(keys, pairs.min(axis=1) * len(self) + pairs.max(axis=1))
        local = self.figures.borders.midpoints[row]
        return local @ self.surface.rotation.T + self.surface.position

    def locate(self, points: ArrayLike) -> Ints:
        """See `Cells.locate`; beyond the border of the mesh there is no cell."""
        face, weights = self.surface.nearest(points_of(points))
        off = (face < 0) | self.surface.beyond_border(face, weights)
        return np.where(off, -1, self.labels[face])

    def borders(self, samples: int = 8) -> Array:
        """See `Cells.borders`: the edges between faces of different cells, and the mesh's own."""
        edges = self.surface.mesh.edges
        apart = self.labels[edges.faces[:, 0]] != self.labels[edges.faces[:, 1]]
        ends = np.concatenate([edges.vertices[apart], edges.border_vertices])
        local = self.surface.mesh.vertices[ends]
        return local @ self.surface.rotation.T + self.surface.position

    def triangles(self, which: Ints, samples: int = 8, inset: float = 0.0) -> CellTriangles:
        """See `Cells.triangles`."""
        members, indptr = self.members
        parts = [members[indptr[k] : indptr[k + 1]] for k in which]
        faces = np.concatenate([np.empty(0, dtype=np.int64), *parts])
        surface = self.surface
        corners = surface.mesh.vertices[surface.mesh.faces[faces]] @ surface.rotation.T
        corners = corners + surface.position
        centre = self.centres[self.labels[faces]][:, None]
        corners = corners + inset * (centre - corners)
        return CellTriangles(corners.reshape(-1, 3), np.arange(3 * len(faces)).reshape(-1, 3))

    def unrolled(self) -> Unrolled:
        """See `Cells.unrolled`: seen along the mean normal, from the outside."""
        from surfaces.meshes.cells.borders import LabelledFaces, outlines

        surface, none = self.surface, np.empty((0, 3))  # of a cell that is a closed surface
        points = surface.mesh.vertices @ surface.rotation.T + surface.position
        labelled = LabelledFaces.of(surface.mesh.vertices, surface.mesh.faces, self.labels)
        lines = ([points[line] for line in some] for some in outlines(labelled))
        return self.seen_from_outside(max(some, key=_length, default=none) for some in lines)

    def unravel(self, k: int) -> tuple[int]:
        """See `Cells.unravel`: the cell's number."""
        if not 0 <= k < len(self):
            raise IndexError(f"no cell {k} among {len(self)}")
        return (int(k),)

    def __repr__(self) -> str:
        """One line."""
        return f"Cells({len(self)} of {self.surface!r})"


def _bent_lines(start: Array, middle: Array, end: Array, t: Array) -> Array:
    """(m, k, 3) points at t (k,) of m lines that bend in the middle, at even speed."""
    first = np.linalg.norm(middle - start, axis=1)
    second = np.linalg.norm(end - middle, axis=1)
    share = (first / np.maximum(first + second, 1e-300))[:, None]
    before = np.clip(t / np.maximum(share, 1e-300), 0.0, 1.0)[..., None]
    after = np.clip((t - share) / np.maximum(1.0 - share, 1e-300), 0.0, 1.0)[..., None]
    start, middle, end = start[:, None], middle[:, None], end[:, None]
    return np.asarray(start + before * (middle - start) + after * (end - middle))


def _length(line: Array) -> float:
    """m, of a polyline (k, 3)."""
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def _figures(surface: TriangleSurface, labels: Ints) -> Figures:
    """The figures of labelled faces."""
    from surfaces.meshes.cells.properties import figures

    mesh = surface.mesh
    normals = np.empty_like(mesh.vertices)
    normals[mesh.faces.ravel()] = surface.crease_normals.reshape(-1, 3)
    made = figures(mesh.vertices, mesh.faces, normals, labels)
    return replace(made, normals=surface.normals_at(made.faces, made.weights) @ surface.rotation)
