"""The offset surface over a mesh, as flat triangles between its corners: where to look for places.

Faces on a crease are cut into slices along it, over which the normal turns a part of the way, so
that the arc round an edge becomes a few flat triangles. Nothing rests on how well they fit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from coverable_arrays import Array, Ints
from surfaces.meshes import WIDTH, MeshSurface

if TYPE_CHECKING:
    from surfaces.meshes import FaceTree

SLICES = 4  # of the strip along a crease


@dataclass(frozen=True, eq=False)
class OffsetTriangles:
    """G flat triangles."""

    corners: Array
    """(G, 3, 3) m, in the root frame."""
    face: Ints
    """(G,) the face of the mesh that each is over a part of."""
    weights: Array
    """(G, 3, 3) for each of its corners the weights of the face's corners."""

    @staticmethod
    def of(surface: MeshSurface, height: float) -> OffsetTriangles:
        """Those at a signed height (m)."""
        flagged = surface.on_crease.sum(axis=1)
        plain = np.flatnonzero((flagged == 0) | (flagged == 3))
        faces = [plain]
        weights = [np.broadcast_to(np.eye(3), (len(plain), 3, 3))]
        for count in (1, 2):
            some = np.flatnonzero(flagged == count)
            odd = np.argmax(surface.on_crease[some] == (count == 1), axis=1)
            cut = _slices(count)  # of a face whose odd corner is the first
            order = (np.arange(3) - odd[:, None]) % 3  # which of cut's columns each corner has
            turned = cut[:, :, order]  # (triangles, 3, faces, 3)
            faces.append(np.repeat(some, len(cut)))
            weights.append(np.moveaxis(turned, 2, 0).reshape(-1, 3, 3))
        face, weight = np.concatenate(faces), np.concatenate(weights)
        repeated = np.repeat(face[:, None], 3, axis=1)
        normals = surface.normals_at(repeated, weight)
        corners = surface.points_at(repeated, weight) + height * normals
        return OffsetTriangles(np.ascontiguousarray(corners), face, weight)

    @cached_property
    def _tree(self) -> FaceTree:
        from surfaces.meshes import FaceTree  # compiled: loaded when it is needed

        return FaceTree.of(self.corners)

    def nearest(self, points: Array) -> tuple[Ints, Array]:
        """Faces (k,) and weights (k, 3) under the points nearest to `points` (k, 3) m.

        -1 and NaN for points that are not finite.
        """
        found, at = self._tree.nearest(points)
        face = np.where(found >= 0, self.face[found], -1)
        return face, np.einsum("kc,kcj->kj", at, self.weights[found])


def _slices(flagged: int) -> Array:
    """(t, 3, 3) weights of the triangles that a face is cut into.

    Args:
        flagged: 1 where the first corner alone lies on a crease, 2 where the two others do.
    """
    level = WIDTH * np.arange(SLICES + 1) / SLICES
    lines = [np.array([[1.0 - t, t, 0.0], [1.0 - t, 0.0, t]]) for t in (*level, 1.0)]
    if flagged == 2:
        lines = [np.array([[t, 1.0 - t, 0.0], [t, 0.0, 1.0 - t]]) for t in (*level, 1.0)]
    made = []
    for (a, b), (c, d) in pairwise(lines):
        made += [[a, b, c], [b, d, c]]
    kept = [corners for corners in made if abs(np.linalg.det(np.array(corners))) > 0.0]
    return np.array(kept)
