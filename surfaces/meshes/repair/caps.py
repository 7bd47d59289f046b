"""Caps: triangles whose three corners lie on one line, up to a tolerance.

A cap has no area, but it joins the face on its long side to the faces on its two short sides.
Taking it away would leave a slit there, so instead its long edge is flipped: the cap and the face
beyond become two faces that meet in the cap's middle corner. The surface stays where it is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfaces.meshes.triangle_mesh import (
    Floats,
    Ints,
    components,
    doubled_areas,
    half_edge_ends,
    half_edges,
)

PATIENCE = 10  # rounds in which no cap goes


def thin(vertices: Floats, faces: Ints, height: float) -> NDArray[np.bool_]:
    """(F,) faces whose least height is below `height` (m)."""
    corners = vertices[faces]
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    return np.linalg.norm(doubled_areas(vertices, faces), axis=1) <= height * longest


def flipped(vertices: Floats, faces: Ints, height: float) -> tuple[Ints, int, int]:
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


def _flip_some(vertices: Floats, faces: Ints, is_cap: NDArray[np.bool_]) -> tuple[Ints, int]:
    """Flip as many caps at once as do not touch each other's faces."""
    caps = np.flatnonzero(is_cap)
    corners = vertices[faces[caps]]
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).argmax(axis=1)
    long_edge = np.full(len(faces), -1, np.int64)
    long_edge[caps] = 3 * caps + longest
    inner = half_edges(faces).of_count(2)
    partner = np.full(faces.size, -1, np.int64)
    partner[inner[:, 0]] = inner[:, 1]
    partner[inner[:, 1]] = inner[:, 0]
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


def _absent(faces: Ints, a: Ints, b: Ints) -> NDArray[np.bool_]:
    """(n,) no face has the edge a-b."""
    size = int(faces.max()) + 1
    tails, heads = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    present = np.minimum(tails, heads) * size + np.maximum(tails, heads)
    return ~np.isin(np.minimum(a, b) * size + np.maximum(a, b), present)
