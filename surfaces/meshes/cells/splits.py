"""Two kinds of splits of a triangle: halved at its longest edge, or cut across like a ladder."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from surfaces.meshes.triangle_mesh import half_edge_ends, half_edges

kernel = njit(cache=True, error_model="numpy")

SAME = 1e-9  # relative: lengths this close are equal, so that rounding does not choose


class Edges(NamedTuple):
    """The edges of a mesh, each once."""

    ends: NDArray[np.int64]
    """(E, 2) vertices, the lower index first."""
    of_face: NDArray[np.int64]
    """(F, 3) the edge from vertex k to vertex k + 1 of each face."""
    length: NDArray[np.float64]
    """(E,) m."""
    longest: NDArray[np.int64]
    """(F,) which of a face's edges is the longest: 0, 1 or 2."""


class Split(NamedTuple):
    """The faces after a round of splits."""

    faces: NDArray[np.int64]
    """(G, 3) vertex indices; new vertices follow the old ones."""
    parent: NDArray[np.int64]
    """(G,) the face each is a part of, in rising order."""
    ends: NDArray[np.int64]
    """(K, 2) the ends of the edge that each new vertex lies on."""
    part: NDArray[np.float64]
    """(K,) how far along it, 0 to 1 from the first end to the second."""


def edges_of(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> Edges:
    """The edges, and each face's longest; of equal ones that of the lowest index.

    Both faces of an edge then agree on the order of edges, and splits spread no further than
    they must.
    """
    halves = half_edges(faces)
    ends = np.sort(half_edge_ends(faces, halves.order[halves.starts]), axis=1)
    of_face = halves.edges.reshape(-1, 3)
    length = np.linalg.norm(vertices[ends[:, 0]] - vertices[ends[:, 1]], axis=1)
    of_length = length[of_face]
    near = of_length >= of_length.max(axis=1, keepdims=True) * (1.0 - SAME)
    longest = np.argmin(np.where(near, of_face, len(ends)), axis=1)
    return Edges(ends, of_face, length, longest)


def halve(
    faces: NDArray[np.int64], edges: Edges, wanted: NDArray[np.bool_], n_vertices: int
) -> Split:
    """Halve the wanted faces at their longest edges, and others as far as edges have to agree.

    With m the middle of a face's longest edge a-b, the halves are c-a-m and c-m-b. Either is
    halved once more if its own old edge, c-a with middle p or b-c with middle n, is split too.
    """
    longest = edges.of_face[np.arange(len(faces)), edges.longest]
    split = np.zeros(len(edges.ends), dtype=bool)
    while wanted.any():
        split[longest[wanted]] = True
        wanted = split[edges.of_face].any(axis=1) & ~split[longest]
    middle = np.full(len(split), -1, dtype=np.int64)
    middle[split] = n_vertices + np.arange(np.count_nonzero(split))
    turn = (edges.longest[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(faces, turn, axis=1).T
    m, n, p = middle[np.take_along_axis(edges.of_face, turn, axis=1)].T
    table = np.full((len(faces), 4, 3), -1, dtype=np.int64)

    def put(slot: int, rows: NDArray[np.bool_], *corners: NDArray[np.int64]) -> None:
        table[rows, slot] = np.stack(corners, axis=1)[rows]

    halved = m >= 0
    put(0, ~halved, *faces.T)
    put(0, halved & (p < 0), c, a, m)
    put(0, halved & (p >= 0), a, m, p)
    put(1, halved & (p >= 0), m, c, p)
    put(2, halved & (n < 0), c, m, b)
    put(2, halved & (n >= 0), m, b, n)
    put(3, halved & (n >= 0), c, m, n)
    parts = table.reshape(-1, 3)
    kept = parts[:, 0] >= 0
    parent = np.repeat(np.arange(len(faces)), 4)[kept]
    return Split(parts[kept], parent, edges.ends[split], np.full(split.sum(), 0.5))


def cut_across(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    edges: Edges,
    count: NDArray[np.int64],
) -> Split:
    """Cut edges into `count` (E,) equal parts each, and join the points like a ladder's rungs.

    Every face needs an edge that stays whole: the ladder's base. The rungs lead from there to the
    corner on the other side.
    """
    first = len(vertices) + np.concatenate([[0], np.cumsum(count - 1)])
    edge = np.repeat(np.arange(len(count)), count - 1)
    rung = np.arange(len(edge)) - (first[edge] - len(vertices)) + 1
    part = rung / count[edge]
    ends = edges.ends[edge]
    added = vertices[ends[:, 0]] + part[:, None] * (vertices[ends[:, 1]] - vertices[ends[:, 0]])
    parts = count[edges.of_face].sum(axis=1) - 2
    new_faces = np.empty((parts.sum(), 3), dtype=np.int64)
    points = np.concatenate([vertices, added])
    _ladders(points, faces, edges.of_face, edges.longest, first, count, new_faces)
    return Split(new_faces, np.repeat(np.arange(len(faces)), parts), ends, part)


@kernel
def _place(from_vertex, to_vertex, first, count, k):  # type: ignore[no-untyped-def]
    """Vertex k of 0..count on the edge between two vertices; inner ones run from the lower end."""
    if k == 0:
        return from_vertex
    if k == count:
        return to_vertex
    return first + (k if from_vertex < to_vertex else count - k) - 1


@kernel
def _apart(points, i, j):  # type: ignore[no-untyped-def]
    """The squared distance of two points."""
    total = 0.0
    for k in range(3):
        total += (points[i, k] - points[j, k]) ** 2
    return total


@kernel
def _ladders(points, faces, of_face, longest, first, count, out):  # type: ignore[no-untyped-def]
    """Write the parts of all faces; each next rung is the shorter of the two there could be."""
    written = 0
    for face in range(faces.shape[0]):
        base = 0  # the edge that stays whole; one that is not the longest if there is a choice
        for k in range(3):
            if count[of_face[face, k]] == 1 and (k != longest[face]):
                base = k
        following, last = (base + 1) % 3, (base + 2) % 3
        b, c, a = faces[face, base], faces[face, following], faces[face, last]
        right, left = of_face[face, last], of_face[face, following]
        i, j = 0, 0
        p, q = b, c
        while i + 1 < count[right] or j + 1 < count[left]:
            p_next = _place(b, a, first[right], count[right], i + 1)
            q_next = _place(c, a, first[left], count[left], j + 1)
            if j + 1 == count[left]:
                go = True
            elif i + 1 == count[right]:
                go = False
            else:
                go = _apart(points, p_next, q) <= _apart(points, p, q_next) * (1.0 + SAME)
            out[written, 1], out[written, 2] = p, q
            if go:
                out[written, 0] = p_next
                i, p = i + 1, p_next
            else:
                out[written, 0] = q_next
                j, q = j + 1, q_next
            written += 1
        out[written, 0], out[written, 1], out[written, 2] = a, p, q
        written += 1
