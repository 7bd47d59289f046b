"""Vertices within a tolerance of each other become one."""

from __future__ import annotations

from itertools import product

import numpy as np

from surfaces.meshes.triangle_mesh import Floats, Ints

WELD = 1e-6  # of the mesh's diagonal: no vertex moves further; thinner faces have no area


def weld_distance(vertices: Floats) -> float:
    """m: how far welding may move a vertex; 1 micrometre for a part of 1 m.

    The single-precision numbers of most files are 16 times finer, so that the same corner written
    twice with different last digits is joined, and no detail that a file can hold is lost.
    """
    return WELD * float(np.linalg.norm(np.ptp(vertices, axis=0)))


def welded(vertices: Floats, distance: float) -> Ints:
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
