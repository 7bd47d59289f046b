"""Caps: triangles whose three corners lie on one line, up to a tolerance.

A cap has no area, but it joins the face on its long side to the faces on its two short sides.
Taking it away would leave a slit there, so instead its long edge is flipped: the cap and the face
beyond become two faces that meet in the cap's middle corner. The surface stays where it is.
"""

from __future__ import annotations

import numpy as np

from surfaces.triangles import Floats, Ints, doubled_areas, half_edge_ends, half_edges

ROUNDS = 100


def thin(vertices: Floats, faces: Ints, height: float) -> np.ndarray:
    """(F,) bool: faces whose least height is below `height` (m)."""
    corners = vertices[faces]
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    return np.linalg.norm(doubled_areas(vertices, faces), axis=1) <= height * longest


def flipped(vertices: Floats, faces: Ints, height: float) -> tuple[Ints, int, int]:
    """Flip the long edges of caps until none is left, and drop those that cannot be flipped.

    A cap on the border, or whose flip would run along an edge that is there already, cannot.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3), at most two on an edge, all facing one way.
        height: m, what is thinner is a cap.

    Returns:
        The faces, how many caps were flipped, and how many were dropped.
    """
    before = len(faces)
    count = 0
    for _ in range(ROUNDS):
        caps = np.flatnonzero(thin(vertices, faces, height))
        if not len(caps):
            break
        faces, done = _flip_some(vertices, faces, caps)
        count += done
        if not done:
            break
    faces = faces[~thin(vertices, faces, height)]
    return faces, count, before - len(faces)


def _flip_some(vertices: Floats, faces: Ints, caps: Ints) -> tuple[Ints, int]:
    """Flip as many caps at once as do not touch each other's faces."""
    corners = vertices[faces[caps]]
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).argmax(axis=1)
    halves = 3 * caps + longest
    inner = half_edges(faces).of_count(2)
    partner = np.full(faces.size, -1, np.int64)
    partner[inner[:, 0]] = inner[:, 1]
    partner[inner[:, 1]] = inner[:, 0]
    halves = halves[partner[halves] >= 0]
    across = partner[halves]
    # A cap goes first where no other cap of lower number wants one of its two faces.
    claim = np.full(len(faces), len(faces), np.int64)
    for half in (halves, across):
        np.minimum.at(claim, half // 3, halves // 3)
    first = (claim[halves // 3] == halves // 3) & (claim[across // 3] == halves // 3)
    halves, across = halves[first], across[first]
    apex = faces[halves // 3, (halves % 3 + 2) % 3]
    beyond = faces[across // 3, (across % 3 + 2) % 3]
    a, b = half_edge_ends(faces, halves).T
    free = (apex != beyond) & _absent(faces, apex, beyond)
    # Two flips of one round may not make the same edge either.
    size = int(faces.max()) + 1
    made = np.minimum(apex, beyond) * size + np.maximum(apex, beyond)
    kept = np.zeros(len(made), bool)
    allowed = np.flatnonzero(free)
    kept[allowed[np.unique(made[allowed], return_index=True)[1]]] = True
    faces = faces.copy()
    # The cap (a, b, apex) and the face (b, a, beyond) become (apex, a, beyond), (beyond, b, apex).
    faces[halves[kept] // 3] = np.column_stack([apex, a, beyond])[kept]
    faces[across[kept] // 3] = np.column_stack([beyond, b, apex])[kept]
    return faces, int(kept.sum())


def _absent(faces: Ints, a: Ints, b: Ints) -> np.ndarray:
    """(n,) bool: no face has the edge a-b."""
    size = int(faces.max()) + 1
    tails, heads = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    present = np.minimum(tails, heads) * size + np.maximum(tails, heads)
    return ~np.isin(np.minimum(a, b) * size + np.maximum(a, b), present)
