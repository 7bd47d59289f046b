"""A simplified copy of a large surface to measure distances on.

Exact distances on 200,000 triangles take the better part of a minute, on 20,000 a part of a
second. The passes are projected from the copy back onto the surface itself, so that what the copy
leaves out changes no more than the distance between them, by about the share by which lengths on
the two differ.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from surfaces.passes.net import WorkingMesh
from surfaces.surface import Surface

MOST_EXACT = 50_000  # faces up to which distances are measured on the surface itself
COPIED = 20_000  # faces of the copy


class WorkingCopy(NamedTuple):
    """What distances are measured on."""

    mesh: WorkingMesh
    deviation: float
    """m, how far it is from the surface at most, at its vertices and the middles of its faces; 0
    where it is the surface itself."""


def working_copy(surface: Surface, mesh: WorkingMesh) -> WorkingCopy:
    """The mesh itself, or a copy with fewer faces where it has more than `MOST_EXACT`.

    Edges are collapsed in the order of the error that this makes (Garland and Heckbert's quadrics).

    Args:
        surface: what the mesh is of.
        mesh: its triangles.
    """
    if len(mesh.faces) <= MOST_EXACT:
        return WorkingCopy(mesh, 0.0)
    from fast_simplification import simplify

    share = 1.0 - COPIED / len(mesh.faces)
    vertices, faces = simplify(mesh.vertices, mesh.faces.astype(np.int32), share)[:2]
    made = WorkingMesh(np.asarray(vertices, dtype=float), np.asarray(faces, dtype=np.int64))
    made = _manifold(made)
    places = np.concatenate([made.vertices, made.corners.mean(axis=1)])
    away = float(np.abs(surface.closest(places).height).max())
    return WorkingCopy(made, away)


def _manifold(mesh: WorkingMesh) -> WorkingMesh:
    """Without faces of no area, and without vertices of no face."""
    faces = mesh.faces[mesh.areas > 0.0]
    used, numbered = np.unique(faces, return_inverse=True)
    return WorkingMesh(mesh.vertices[used], numbered.reshape(-1, 3).astype(np.int64))
