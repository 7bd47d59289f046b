"""Normals at the corners of triangles: smooth over the surface, sharp at its creases.

Where neighbouring faces meet at less than `CREASE`, a mesh is taken as a smooth surface cut into
facets, and the normal is interpolated between its vertices. Sharper edges are edges of the part.
There the corners of the faces on either side keep normals of their own; once a mesh is fine enough
for its cells, `blended` joins them again over the width of one small face, so that the normal is
continuous and a tool can roll over the edge.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfaces.triangles import TriangleMesh

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

CREASE = np.radians(30.0)  # rad between the normals of two faces; usual for smooth shading


def corner_normals(mesh: TriangleMesh) -> Floats:
    """(F, 3, 3) unit normal at each corner of each face.

    The mean of the normals of the faces at the vertex, weighted by their angles there; at a vertex
    of a crease, of those only that turn less than `CREASE` from the face's own.
    """
    normals = mesh.vertex_normals[mesh.faces]
    pairs = mesh.face_normals[mesh.edges.faces]
    sharp = np.einsum("ei,ei->e", pairs[:, 0], pairs[:, 1]) < np.cos(CREASE)
    if not sharp.any():
        return normals
    creased = np.zeros(len(mesh.vertices), dtype=bool)
    creased[mesh.edges.vertices[sharp]] = True
    vertex = mesh.faces.ravel()
    corners = np.flatnonzero(creased[vertex])
    corners = corners[np.argsort(vertex[corners], kind="stable")]
    weights = corner_angles(mesh.vertices, mesh.faces).ravel()[corners]
    one, other = _pairs_within(vertex[corners])
    face = corners // 3
    a, b = mesh.face_normals[face[one]], mesh.face_normals[face[other]]
    near = (one == other) | (np.einsum("ki,ki->k", a, b) > np.cos(CREASE))
    one, other, b = one[near], other[near], b[near]
    sums = np.column_stack(
        [np.bincount(one, weights[other] * b[:, axis], len(corners)) for axis in range(3)]
    )
    flat = normals.reshape(-1, 3)
    flat[corners] = sums / np.linalg.norm(sums, axis=1, keepdims=True)
    return flat.reshape(-1, 3, 3)


def carried(mesh: TriangleMesh, normals: Floats, fine: Floats, faces: Ints, parent: Ints) -> Floats:
    """Corner normals (G, 3, 3) of a finer mesh of the same surface, linear over each old face.

    Args:
        mesh: the coarser mesh.
        normals: (F, 3, 3) its corner normals.
        fine: (W, 3) m, vertices of the finer one.
        faces: (G, 3) its faces.
        parent: (G,) the face of `mesh` that each is part of.
    """
    old = mesh.vertices[mesh.faces[parent]]
    side, other = old[:, 1] - old[:, 0], old[:, 2] - old[:, 0]
    across = np.cross(side, other)
    square = np.einsum("gi,gi->g", across, across)[:, None]
    off = fine[faces] - old[:, None, 0]
    second = np.einsum("gki,gi->gk", np.cross(off, other[:, None]), across) / square
    third = np.einsum("gki,gi->gk", np.cross(side[:, None], off), across) / square
    weights = np.stack([1.0 - second - third, second, third], axis=-1)
    return unit(np.einsum("gkc,gci->gki", weights, normals[parent]))


def blended(vertices: Floats, faces: Ints, normals: Floats) -> Floats:
    """(W, 3) one unit normal a vertex: the mean of those of its corners, weighted by angle."""
    weighted = normals * corner_angles(vertices, faces)[..., None]
    sums = np.column_stack(
        [np.bincount(faces.ravel(), weighted[..., k].ravel(), len(vertices)) for k in range(3)]
    )
    lengths = np.linalg.norm(sums, axis=1)
    # Where faces are folded back onto each other one of them speaks for the vertex.
    some = np.zeros((len(vertices), 3))
    some[faces.ravel()] = normals.reshape(-1, 3)
    folded = lengths < 1e-9
    sums[folded] = some[folded]
    return unit(sums)


def corner_angles(vertices: Floats, faces: Ints) -> Floats:
    """(F, 3) rad."""
    corners = vertices[faces]
    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(corners, 1, axis=1) - corners
    cross = np.linalg.norm(np.cross(ahead, behind), axis=2)
    return np.arctan2(cross, np.einsum("fki,fki->fk", ahead, behind))


def unit(vectors: NDArray[Any]) -> Floats:
    """The vectors (..., 3) at length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _pairs_within(groups: Ints) -> tuple[Ints, Ints]:
    """All ordered pairs of rows with equal entries in the sorted array `groups`, itself too."""
    starts = np.flatnonzero(np.concatenate([[True], groups[1:] != groups[:-1]]))
    sizes = np.diff(np.append(starts, len(groups)))
    size, start = np.repeat(sizes, sizes), np.repeat(starts, sizes)
    one = np.repeat(np.arange(len(groups)), size)
    within = np.arange(len(one)) - np.repeat(np.cumsum(size) - size, size)
    return one, np.repeat(start, size) + within
