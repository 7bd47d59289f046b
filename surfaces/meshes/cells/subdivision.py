"""Split coarse triangles until they are small and even enough.

Triangles are halved at their longest edges, which makes no new needles (Rivara 1984). It would not
mend old ones either, so needles are cut across, like a ladder by its rungs. New vertices lie on
edges, and the surface stays exactly what it was.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from coverable.kernels import allocating, allocating_entry
from surfaces.meshes.triangle_mesh import areas_of, half_edge_ends, half_edges
from surfaces.surface import SurfaceError

MOST_FACES = 4_000_000
LONGEST = 8.0  # edge^2 / most_area; 2.3 in an equilateral triangle, 4 in a halved square
SAME = 1e-9  # relative: lengths this close are equal, so that rounding does not choose


class EdgeLengths(NamedTuple):
    """The edges of a mesh, each once."""

    ends: Ints
    """(E, 2) vertices, the lower index first."""
    of_face: Ints
    """(F, 3) the edge from vertex k to vertex k + 1 of each face."""
    length: Array
    """(E,) m."""
    longest: Ints
    """(F,) which of a face's edges is the longest: 0, 1 or 2."""


class Subdivision(NamedTuple):
    """A finer mesh of the same surface, and where each part of it comes from."""

    vertices: Array
    """(W, 3) m; the first V are the old ones."""
    faces: Ints
    """(G, 3) vertex indices, turning as before."""
    original: Ints
    """(G,) the old face each one is a part of, in rising order."""


def edges_of(vertices: Array, faces: Ints) -> EdgeLengths:
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
    return EdgeLengths(ends, of_face, length, longest)


def halve(vertices: Array, faces: Ints, edges: EdgeLengths, wanted: Mask) -> Subdivision:
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
    middle[split] = len(vertices) + np.arange(np.count_nonzero(split))
    turn = (edges.longest[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(faces, turn, axis=1).T
    m, n, p = middle[np.take_along_axis(edges.of_face, turn, axis=1)].T
    table = np.full((len(faces), 4, 3), -1, dtype=np.int64)

    def put(slot: int, rows: Mask, *corners: Ints) -> None:
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
    start, end = vertices[edges.ends[split]].swapaxes(0, 1)
    points = np.concatenate([vertices, start + 0.5 * (end - start)])
    return Subdivision(points, parts[kept], parent)


def cut_across(vertices: Array, faces: Ints, edges: EdgeLengths, count: Ints) -> Subdivision:
    """Cut edges into `count` (E,) equal parts each, and join the points like a ladder's rungs.

    Every face needs an edge that is not cut: the ladder's base. The rungs lead from there to the
    corner on the other side.
    """
    first = len(vertices) + np.concatenate([[0], np.cumsum(count - 1)])
    edge = np.repeat(np.arange(len(count)), count - 1)
    rung = np.arange(len(edge)) - (first[edge] - len(vertices)) + 1
    part = rung / count[edge]
    start, end = vertices[edges.ends[edge]].swapaxes(0, 1)
    parts = count[edges.of_face].sum(axis=1) - 2
    new_faces = np.empty((parts.sum(), 3), dtype=np.int64)
    points = np.concatenate([vertices, start + part[:, None] * (end - start)])
    _ladders(points, faces, edges.of_face, edges.longest, first, count, new_faces)
    return Subdivision(points, new_faces, np.repeat(np.arange(len(faces)), parts))


@allocating
def _place(from_vertex, to_vertex, first, count, k):  # noqa: ANN001, ANN202
    """Vertex k of 0..count on the edge between two vertices; inner ones run from the lower end."""
    if k == 0:
        return from_vertex
    if k == count:
        return to_vertex
    return first + (k if from_vertex < to_vertex else count - k) - 1


@allocating
def _apart(points, i, j):  # noqa: ANN001, ANN202
    """The squared distance of two points."""
    total = 0.0
    for k in range(3):
        total += (points[i, k] - points[j, k]) ** 2
    return total


@allocating_entry
def _ladders(points, faces, of_face, longest, first, count, out):  # noqa: ANN001, ANN202
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


def subdivide(vertices: Array, faces: Ints, most_area: float) -> Subdivision:
    """Split faces until each is at most `most_area`, and no edge is longer than sqrt(8 most_area).

    The result is conforming: no vertex lies inside another face's edge. It depends on nothing but
    the arguments.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3) vertex indices of a clean mesh.
        most_area: m^2, > 0.

    Raises:
        SurfaceError: `most_area` is not a finite number > 0, or more than 4,000,000 faces would
            be needed.

    Example:
        >>> square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
        >>> fine = subdivide(square, np.array([[0, 1, 2], [0, 2, 3]]), most_area=0.25)
        >>> fine.faces.tolist(), fine.original.tolist()
        ([[1, 2, 4], [1, 4, 0], [3, 0, 4], [3, 4, 2]], [0, 0, 1, 1])
    """
    if not (np.isfinite(most_area) and most_area > 0.0):
        raise SurfaceError(f"most_area must be a finite number > 0 (m^2), got {most_area!r}")
    vertices = np.asarray(vertices, dtype=float)
    faces = np.asarray(faces, dtype=np.int64)
    found = Subdivision(vertices, faces, np.arange(len(faces), dtype=np.int64))
    if areas_of(vertices, faces).sum() / most_area > MOST_FACES:
        raise _too_many()
    while (split := _next_split(found.vertices, found.faces, most_area)) is not None:
        if len(split.faces) > MOST_FACES:
            raise _too_many()
        found = split._replace(original=found.original[split.original])
    return found


def _next_split(vertices: Array, faces: Ints, most_area: float) -> Subdivision | None:
    """One round of splits, or None where nothing is too large.

    First faces are halved until each has a short edge, then long ones are cut across from there,
    and at last those that are still too large are halved.
    """
    edges = edges_of(vertices, faces)
    most = most_area * (1.0 + SAME)
    count = np.ceil(edges.length / math.sqrt(LONGEST * most)).astype(np.int64).clip(1)
    wide: Mask = np.all(count[edges.of_face] > 1, axis=1)
    if wide.any():
        return halve(vertices, faces, edges, wide)
    if (count > 1).any():
        if count[edges.of_face].sum() - 2 * len(faces) > MOST_FACES:
            raise _too_many()
        return cut_across(vertices, faces, edges, count)
    large: Mask = areas_of(vertices, faces) > most
    return halve(vertices, faces, edges, large) if large.any() else None


def _too_many() -> SurfaceError:
    """Raised instead of filling the memory."""
    return SurfaceError(
        f"cells this small need more than {MOST_FACES:,} triangles; ask for larger cells, or "
        "mesh the part again with triangles of even size instead of long needles"
    )
