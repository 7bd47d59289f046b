"""TriangleSurface: triangles as a surface with a pose, a side and a continuous normal."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints, Mask
from surfaces.meshes.facets import facets_of
from surfaces.meshes.mesh_parts import Clusters
from surfaces.meshes.normals import (
    WIDTH,
    blended,
    corner_normals,
    crease_share,
    parts_of_faces,
    sectors,
    unit,
)
from surfaces.meshes.triangle_mesh import TriangleMesh
from surfaces.part_growth import grown
from surfaces.parts import MOST_PARTS, SurfaceParts
from surfaces.surface import ClosestPoint, Smoothing, Surface, points_of

if TYPE_CHECKING:
    from surfaces.meshes.face_tree import FaceTree


ON = 1e-9  # [1] of the mean edge length: a point so close to a face lies on it


@dataclass(frozen=True, eq=False, repr=False)
class TriangleSurface(Surface):
    """Triangles with normals interpolated between their corners; outward is where faces look."""

    kind: ClassVar[str] = "mesh"

    mesh: TriangleMesh
    """In the surface's own frame."""
    corner_normals: Array
    """(F, 3, 3) unit normal at each corner of each face, in the own frame."""
    crease_normals: Array
    """(F, 3, 3) the same on creases, where both sides have one: the normal turns to it over a strip
    along the crease, `WIDTH` of a face wide."""
    smoothing: Smoothing | None = None
    """Of a smoothed copy, see `surfaces.meshes.smoothed`."""

    @property
    def deviations(self) -> tuple[float, float]:
        """See `Surface.deviations`; approach directions are those of a smoothed copy itself."""
        made = self.smoothing
        return (0.0 if made is None or not made.counted else made.off, 0.0)

    @cached_property
    def wall(self) -> Self:
        """See `Surface.wall`: of a smoothed copy the surface before, with the same faces."""
        if self.smoothing is None:
            return self
        before = TriangleMesh(self.smoothing.vertices, self.mesh.faces, self.mesh.history)
        normals = corner_normals(before)
        return replace(
            self, mesh=before, corner_normals=normals, crease_normals=normals, smoothing=None
        )

    @property
    def notes(self) -> tuple[str, ...]:
        """What was repaired in the mesh, and what to know about it."""
        from surfaces.meshes.mesh_notes import notes_of

        made = self.smoothing
        return (*notes_of(self.mesh), *([] if made is None else [made.words()]))

    @cached_property
    def mean_edge_length(self) -> float:
        """m, the mean length of the edges."""
        edges = self.mesh.edges
        lengths = np.concatenate([edges.lengths, edges.border_lengths])
        return float(lengths.mean())

    def closest(self, points: ArrayLike) -> ClosestPoint:
        """The points of the mesh closest to `points` (..., 3) m; see `ClosestPoint`.

        `height` is the distance, positive where the point lies on the outer side of the surface;
        the mesh ends at its border, so every closest point is inside. For a point that is not
        finite it is NaN and not inside.
        """
        points = points_of(points)
        flat = (points.reshape(-1, 3) - self.position) @ self.rotation
        face, weights = self.face_tree.nearest(flat)
        normals, _, heights = self._over(flat, face, weights)
        shape = points.shape[:-1]
        nowhere = np.full(shape, np.nan)
        return ClosestPoint(
            u=nowhere,
            v=nowhere,
            height=heights.reshape(shape),
            normal=(normals @ self.rotation.T).reshape(points.shape),
            inside=(face >= 0).reshape(shape),
        )

    def parts(self, flat: float, straight: float, most: int = MOST_PARTS) -> SurfaceParts:
        """See `Surface.parts`; clusters of triangles."""
        turned = self.rotation.T
        facets = facets_of(
            self.face_balls[0] @ turned + self.position,
            self.corner_normals @ turned,
            self.crease_normals @ turned,
            self.on_crease,
            straight,
        )
        return grown(Clusters.whole(facets, straight), flat, straight, most)

    def nearest(self, points: Array) -> tuple[Ints, Array]:
        """Faces (k,), and weights (k, 3) on them, of the places nearest to points (k, 3) m."""
        return self.face_tree.nearest((points - self.position) @ self.rotation)

    def beside(self, points: Array, face: Ints, weights: Array) -> tuple[Array, Array]:
        """Distances (k,) m of points (k, 3) m from places of faces, and outward directions (k, 3).

        These are unit vectors along the lines from the places to the points, without any
        interpolation: over an edge the direction to the edge; on a face the face's own normal.
        """
        local = (points - self.position) @ self.rotation
        # Outside or inside not by the face's own normal: beyond a sharp edge a point may lie under
        # its plane.
        _, off, heights = self._over(local, face, weights)
        distance = np.abs(heights)
        on = distance <= ON * self.mean_edge_length
        direction = off / np.where(on, 1.0, heights)[:, None]
        direction[on] = self.mesh.face_normals[face[on]]
        return distance, direction @ self.rotation.T

    def from_crease(self, face: Ints, weights: Array) -> Array:
        """(k,) m, how far off a crease places of faces are, at most.

        Only on the strips where the normal turns; inf elsewhere.
        """
        away = np.full(len(face), np.inf)
        some = np.flatnonzero(self.crease_share(face, weights) > 0.0)
        corners, on = self.face_balls[0][face[some]], self.on_crease[face[some]]
        parts = weights[some] * on
        near = np.einsum("kc,kci->ki", parts / parts.sum(axis=1, keepdims=True), corners)
        off = np.linalg.norm(np.einsum("kc,kci->ki", weights[some], corners) - near, axis=1)
        # A face with three corners on creases may have none of its edges on one.
        away[some] = np.where(on.all(axis=1), 2.0 * self.face_balls[2][face[some]], off)
        return away

    def points_at(self, face: Ints, weights: Array) -> Array:
        """(..., 3) m, places of faces by their weights, in the root frame."""
        local = np.einsum("...c,...ci->...i", weights, self.face_balls[0][face])
        return local @ self.rotation.T + self.position

    def normals_at(self, face: Ints, weights: Array) -> Array:
        """(..., 3) unit normals in the root frame at places of faces, by their weights."""
        return np.asarray(self._local_normals(face, weights) @ self.rotation.T)

    def _local_normals(self, face: Ints, weights: Array) -> Array:
        """(..., 3) unit normals in the own frame at places of faces, by their weights."""
        own, share = self.corner_normals[face], self.crease_share(face, weights)
        turned = own + share[..., None, None] * (self.crease_normals[face] - own)
        return unit(np.einsum("...c,...ci->...i", weights, turned))

    def _over(self, points: Array, face: Ints, weights: Array) -> tuple[Array, Array, Array]:
        """Normals (k, 3) at places of faces (k,); what leads from there to points (k, 3) m.

        All in the own frame: vectors (k, 3) m, and their lengths (k,), negative inwards.
        """
        normals = self._local_normals(face, weights)
        off = points - np.einsum("kc,kci->ki", weights, self.face_balls[0][face])
        outwards = np.einsum("ki,ki->k", off, normals)
        lengths = np.sqrt(np.einsum("ki,ki->k", off, off))
        return normals, off, np.where(outwards < 0.0, -lengths, lengths)

    def crease_share(self, face: Ints, weights: Array) -> Array:
        """(...,) how far the normal has turned to that on the crease: 0 off its strip, 1 on it."""
        return crease_share(self.on_crease[face], weights)

    def finer(self, vertices: Array, faces: Ints, parent: Ints) -> Self:
        """The same surface in smaller triangles, with a continuous normal.

        Args:
            vertices: (W, 3) m, in the own frame.
            faces: (G, 3).
            parent: (G,) the present face that each is part of.
        """
        weights, smoothing = parts_of_faces(self.mesh, vertices, faces, parent), self.smoothing
        normals = unit(np.einsum("gkc,gci->gki", weights, self.corner_normals[parent]))
        if smoothing is not None:
            before = np.empty_like(vertices)
            before[faces] = weights @ smoothing.vertices[self.mesh.faces[parent]]
            smoothing = smoothing._replace(vertices=before)
        mesh = TriangleMesh(vertices, faces, self.mesh.history)
        parts, crease = sectors(mesh), blended(vertices, faces, normals, faces)
        own = crease if parts is mesh.faces else blended(vertices, faces, normals, parts)
        return replace(
            self, mesh=mesh, corner_normals=own, crease_normals=crease, smoothing=smoothing
        )

    @cached_property
    def on_border(self) -> tuple[Mask, Mask]:
        """(F, 3) sides of faces, by the corner across, and corners: those on the mesh's border."""
        faces, edges = self.mesh.faces, self.mesh.edges
        sides = np.zeros(faces.shape, dtype=bool)
        ends = edges.border_vertices[:, None]
        across = (faces[edges.border_faces][..., None] != ends).all(axis=2)
        np.logical_or.at(sides, edges.border_faces, across)
        return sides, np.isin(faces, edges.border_vertices)

    def beyond_border(self, face: Ints, weights: Array) -> Mask:
        """(k,) which places nearest to points lie on the border, so that the points are beyond."""
        sides, corners = self.on_border
        off = (weights == 0.0) & sides[face] | (weights == 1.0) & corners[face]
        return np.asarray(off.any(axis=1))

    @cached_property
    def on_crease(self) -> Mask:
        """(F, 3) corners of faces that lie on a crease."""
        return np.asarray((self.corner_normals != self.crease_normals).any(axis=2))

    @cached_property
    def turns(self) -> tuple[Array, Array]:
        """Two sides of each face (F, 2, 3) m, and what the normal turns by along them, own frame.

        On the strip along a crease it turns as over a face that is so much smaller; half way from
        one unit normal to the other, their mean is shorter, and turns faster.
        """
        corners = self.face_balls[0]
        halves = 0.5 * np.linalg.norm(self.corner_normals + self.crease_normals, axis=2).min(axis=1)
        strip = WIDTH / (1.0 + WIDTH) * halves
        size = np.where(self.on_crease.any(axis=1), strip, 1.0)[:, None, None]
        turns = self.crease_normals[:, 1:] - self.crease_normals[:, :1]
        return size * (corners[:, 1:] - corners[:, :1]), turns

    def least_area(self, height: float) -> float:
        """[1] how much of its area a face keeps on the offset surface at a signed height (m).

        The least of all faces; negative where that folds.
        """
        steps, turns = self.turns
        before, after = (np.cross(x[:, 0], x[:, 1]) for x in (steps, steps + height * turns))
        return float(((before * after).sum(axis=1) / (before**2).sum(axis=1)).min())

    @cached_property
    def face_balls(self) -> tuple[Array, Array, Array]:
        """Corners (F, 3, 3), middles (F, 3) and radii (F,) of the faces, m, in the own frame."""
        corners = self.mesh.vertices[self.mesh.faces]
        middles = corners.mean(axis=1)
        radii = np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)
        return np.ascontiguousarray(corners), middles, radii

    @cached_property
    def face_tree(self) -> FaceTree:
        """The faces in the own frame, to find the nearest one."""
        from surfaces.meshes.face_tree import FaceTree

        return FaceTree.of(self.face_balls[0])

    def __repr__(self) -> str:
        """One line."""
        return f"mesh({self.mesh!r}, side={self.side!r}, position={self.position.tolist()})"
