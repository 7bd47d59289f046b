"""Normals at the corners of triangles: smooth over the surface, sharp at its creases.

Where neighbouring faces meet at less than `CREASE`, a mesh is taken as a smooth surface cut into
facets, and the normal is interpolated between its vertices. Sharper edges are edges of the part.
There the corners of the faces on either side keep normals of their own. Once a mesh is fine enough
for its cells, they are joined again over a narrow strip along the crease (`WIDTH` of a small face),
so that the normal is continuous and a tool can roll over the edge: at a standoff far wider than the
strip it goes round the edge in an arc, as it should.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array, Ints, Mask
from surfaces.adjacency import components
from surfaces.meshes.triangle_mesh import TriangleMesh, sum_by

CREASE = np.radians(30.0)  # rad between the normals of two faces; usual for smooth shading
WIDTH = 0.1  # [1] of a face, from a crease inwards, over which its normal turns


def corner_normals(mesh: TriangleMesh) -> Array:
    """(F, 3, 3) unit normal at each corner of each face.

    The mean of the normals of the faces at the vertex, weighted by their angles there; at a vertex
    of a crease, of those only that turn less than `CREASE` from the face's own. Angles and not
    areas, so that the normal belongs to the surface and not to how it is cut into triangles:
    splitting a face through its corner changes nothing.
    """
    alike = np.repeat(mesh.face_normals[:, None], 3, axis=1)
    normals = blended(mesh.vertices, mesh.faces, alike, mesh.faces)
    sharp = sharp_edges(mesh)
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
    sums = sum_by(one, weights[other][:, None] * b, len(corners))
    flat = normals.reshape(-1, 3)
    flat[corners] = sums / np.linalg.norm(sums, axis=1, keepdims=True)
    return flat.reshape(-1, 3, 3)


def parts_of_faces(mesh: TriangleMesh, fine: Array, faces: Ints, parent: Ints) -> Array:
    """(G, 3, 3) where the corners of a finer mesh lie on its faces: weights of their corners.

    Args:
        mesh: the coarser mesh.
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
    return np.stack([1.0 - second - third, second, third], axis=-1)


def blended(vertices: Array, faces: Ints, normals: Array, groups: Ints) -> Array:
    """(F, 3, 3) corner normals, one for each group of corners: the mean, weighted by angle.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3).
        normals: (F, 3, 3) unit normals of the corners.
        groups: (F, 3) the group of each corner, from 0 on: `faces` itself for one normal a vertex,
            `sectors` for one on each side of a crease.
    """
    weighted = normals * corner_angles(vertices, faces)[..., None]
    count = int(groups.max()) + 1
    sums = sum_by(groups.ravel(), weighted.reshape(-1, 3), count)
    lengths = np.linalg.norm(sums, axis=1)
    # Normals of faces folded back onto each other cancel; then one of them is taken.
    some = np.zeros((count, 3))
    some[groups.ravel()] = normals.reshape(-1, 3)
    folded = lengths < 1e-9
    sums[folded] = some[folded]
    return np.asarray(unit(sums)[groups])


def sharp_edges(mesh: TriangleMesh) -> Mask:
    """(E,) which of `mesh.edges` are creases."""
    pairs = mesh.face_normals[mesh.edges.faces]
    return np.asarray(np.einsum("ei,ei->e", pairs[:, 0], pairs[:, 1]) < np.cos(CREASE))


def sectors(mesh: TriangleMesh) -> Ints:
    """(F, 3) which corners lie together at their vertex, without a crease between them.

    A crease that ends at a vertex parts nothing there.
    """
    smooth = ~sharp_edges(mesh)
    if smooth.all():
        return mesh.faces  # one fan of faces at each vertex
    faces, ends = mesh.edges.faces[smooth], mesh.edges.vertices[smooth]
    joined = [
        3 * faces[:, side] + (mesh.faces[faces[:, side]] == ends[:, [end]]).argmax(axis=1)
        for end in range(2)
        for side in range(2)
    ]
    pairs = np.column_stack([np.concatenate(joined[::2]), np.concatenate(joined[1::2])])
    return components(pairs, mesh.faces.size).reshape(-1, 3)


def corner_angles(vertices: Array, faces: Ints) -> Array:
    """(F, 3) rad, of each face at its corners."""
    corners = vertices[faces]
    ahead = np.roll(corners, -1, axis=1) - corners
    behind = np.roll(corners, 1, axis=1) - corners
    cross = np.linalg.norm(np.cross(ahead, behind), axis=2)
    return np.arctan2(cross, np.einsum("fki,fki->fk", ahead, behind))


def crease_share(on_crease: Mask, weights: Array) -> Array:
    """(...,) how far the normal has turned to that on the crease: 0 off its strip, 1 on it.

    Args:
        on_crease: (..., 3) which corners of the face lie on a crease.
        weights: (..., 3) of the place on the face.
    """
    along = (weights * on_crease).sum(axis=-1)  # 1 on the crease
    return np.asarray(np.clip(1.0 - (1.0 - along) / WIDTH, 0.0, 1.0))


def unit(vectors: NDArray[Any]) -> Array:
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
