"""Vertices that are one point and faces without area, up to a tolerance.

Vertices within the tolerance become one. Caps are triangles whose three corners lie on one line. A
cap has no area, but it joins the face on its long side to the faces on its two short sides.
Taking it away would leave a slit there, so instead its long edge is flipped: the cap and the face
beyond become two faces that meet in the cap's middle corner. The surface stays where it is.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.meshes.triangle_mesh import areas_of, components, half_edge_ends, half_edges

WELD = 1e-6  # of the mesh's diagonal: no vertex moves further; thinner faces have no area
PATIENCE = 10  # rounds in which no cap goes


def weld_distance(vertices: Array) -> float:
    """m: how far welding may move a vertex; 1 micrometre for a part of 1 m.

    The single-precision numbers of most files are 16 times finer, so that the same corner written
    twice with different last digits is joined, and no detail that a file can hold is lost.
    """
    return WELD * float(np.linalg.norm(np.ptp(vertices, axis=0)))


def welded(vertices: Array, distance: float) -> Ints:
    """The representative of each vertex.

    Vertices that share a box of a grid are replaced by the first of them; then such a first one by
    the first in the boxes around, if that lies within a box's side and is a representative. So
    vertices that lie together, and are well apart from others, become one; in a chain of vertices
    each is close to the next, but none moves further than `distance`. Time and memory are bounded
    however many vertices lie in one place.

    Args:
        vertices: (V, 3) m, finite.
        distance: m, `weld_distance` of these vertices; twice the diagonal of a box.

    Returns:
        (V,) index of the representative of each vertex; representatives have their own.
    """
    if distance <= 0.0:
        return np.zeros(len(vertices), np.int64)
    side = distance / (2.0 * np.sqrt(3.0))
    boxes = ((vertices - vertices.min(axis=0)) / side).astype(np.int64)
    # The extent is 1 / WELD distances along its diagonal, so there are at most 8e18 boxes.
    _, rows, columns = (boxes.max(axis=0) + 1).tolist()
    keys, first, box = np.unique(
        (boxes[:, 0] * rows + boxes[:, 1]) * columns + boxes[:, 2],
        return_index=True,
        return_inverse=True,
    )
    points = vertices[first]
    lowest = first.copy()
    for x, y, z in product((-1, 0, 1), repeat=3):
        if (x, y, z) <= (0, 0, 0):
            continue  # each pair of boxes once
        # A step over the side of the grid lands in some other box, where the distance decides.
        wanted = keys + ((x * rows + y) * columns + z)
        place = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        here = np.flatnonzero(keys[place] == wanted)
        there = place[here]
        near = np.linalg.norm(points[here] - points[there], axis=1) <= side
        here, there = here[near], there[near]
        lowest[here] = np.minimum(lowest[here], first[there])
        lowest[there] = np.minimum(lowest[there], first[here])
    is_representative = np.zeros(len(vertices), bool)
    is_representative[first[lowest == first]] = True
    representative = np.where(is_representative[lowest], lowest, first)
    return representative[box.reshape(-1)].astype(np.int64)


def thin(vertices: Array, faces: Ints, height: float) -> Mask:
    """(F,) faces whose least height is below `height` (m)."""
    corners = vertices[faces]
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    return 2.0 * areas_of(vertices, faces) <= height * longest


def flipped(vertices: Array, faces: Ints, height: float) -> tuple[Ints, int, int]:
    """Flip the long edges of caps until none is left, and drop those that cannot be flipped.

    A cap on the border, or whose flip would run along an edge that is there already, cannot.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3), at most two on an edge, all facing one way.
        height: m, faces thinner than this are caps.

    Returns:
        The faces, how many caps were flipped, and how many were dropped.
    """
    before, count = len(faces), 0
    is_cap = thin(vertices, faces, height)
    if not is_cap.any():
        return faces, 0, 0
    # A piece of nothing but caps has no surface to join them to.
    pieces = components(half_edges(faces).of_count(2) // 3, len(faces))
    solid = (np.bincount(pieces, ~is_cap) > 0)[pieces]
    faces, is_cap = faces[solid].copy(), is_cap[solid]
    best, patience = len(is_cap), PATIENCE
    while is_cap.any() and patience:
        # A flip needs only the faces around the corners of caps.
        near = np.zeros(len(vertices), bool)
        near[faces[is_cap]] = True
        active = np.flatnonzero(near[faces].any(axis=1))
        faces[active], done = _flip_some(vertices, faces[active], is_cap[active])
        count += done
        is_cap[active] = thin(vertices, faces[active], height)
        left = int(is_cap.sum())
        patience = (PATIENCE if left < best else patience - 1) * (done > 0)
        best = min(best, left)
    faces = faces[~is_cap]
    return faces, count, before - len(faces)


def _flip_some(vertices: Array, faces: Ints, is_cap: Mask) -> tuple[Ints, int]:
    """Flip as many caps at once as do not touch each other's faces."""
    caps = np.flatnonzero(is_cap)
    corners = vertices[faces[caps]]
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).argmax(axis=1)
    long_edge = np.full(len(faces), -1, np.int64)
    long_edge[caps] = 3 * caps + longest
    inner = half_edges(faces).of_count(2)
    partner = np.full(faces.size, -1, np.int64)
    partner[inner] = inner[:, ::-1]
    halves = long_edge[caps]
    halves = halves[partner[halves] >= 0]
    across = partner[halves]
    # A cap that looks on another one waits for it, unless that looks back.
    ready = ~is_cap[across // 3] | (long_edge[across // 3] == across)
    halves, across = halves[ready], across[ready]
    # A cap goes first where no other cap of lower number wants one of its two faces.
    claim = np.full(len(faces), len(faces), np.int64)
    for half in (halves, across):
        np.minimum.at(claim, half // 3, halves // 3)
    first = (claim[halves // 3] == halves // 3) & (claim[across // 3] == halves // 3)
    halves, across = halves[first], across[first]
    apex = faces[halves // 3, (halves % 3 + 2) % 3]
    beyond = faces[across // 3, (across % 3 + 2) % 3]
    a, b = half_edge_ends(faces, halves).T
    size = int(faces.max()) + 1
    made = _edge_keys(apex, beyond, size)
    present = _edge_keys(faces.ravel(), np.roll(faces, -1, axis=1).ravel(), size)
    free = (apex != beyond) & ~np.isin(made, present)
    # Two flips of one round may not make the same edge either.
    kept = np.zeros(len(made), bool)
    allowed = np.flatnonzero(free)
    kept[allowed[np.unique(made[allowed], return_index=True)[1]]] = True
    faces = faces.copy()
    # The cap (a, b, apex) and the face (b, a, beyond) become (apex, a, beyond), (beyond, b, apex).
    faces[halves[kept] // 3] = np.column_stack([apex, a, beyond])[kept]
    faces[across[kept] // 3] = np.column_stack([beyond, b, apex])[kept]
    return faces, int(kept.sum())


def _edge_keys(a: Ints, b: Ints, size: int) -> Ints:
    """(n,) one number for each edge between two of `size` vertices, in either direction."""
    return np.minimum(a, b) * size + np.maximum(a, b)
