"""Ways over creases: straight to a corner on the crease, and straight on from it.

A smooth curve cannot turn a corner without leaving the surface. So a course over a crease is made
of four straight legs: up to the strip along the crease where the normal turns (see
`surfaces.mesh_normals`), over it to the corner, and the same on the other side. Between two legs
foot and normal come to rest for a moment, by which the whole stays continuously differentiable.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from surfaces.cell_curves import BLOCK, PIECES, Array, fitted_to
from surfaces.meshes.normals import sharp_edges

if TYPE_CHECKING:
    from surfaces.meshes.cells.mesh_cells import MeshCells

Ints = NDArray[np.int64]

SAMPLES = 4  # for each cubic
LOOKS = 257  # places on the way to a corner, to find its strip
ENOUGH = 0.7  # [1] of how far a course strays: what more cubics must reach to be worth it


def over_creases(
    cells: MeshCells, curves: Ints, close: Array, deviations: Array
) -> list[tuple[Ints, Array]]:
    """Courses by way of a corner on a crease, where these stray less.

    Args:
        cells: the cells.
        courses: (k,) which to try.
        close: (M, 2) how near to the surface is near enough.
        strays: (M, 2) how far the courses stray, see `CellCurves`; brought up to date.

    Returns:
        Some of the courses, with their cubics (m, pieces, 4, 6), for each number of pieces.
    """
    corners, found = _corners(cells, cells.pairs[curves])
    curves, corners = curves[found], corners[found]
    fitted: list[tuple[Ints, Array]] = []
    for count in PIECES[1:-2]:
        left = np.flatnonzero((deviations[curves] > close[curves]).any(axis=1))
        for start in range(0, len(left), BLOCK):
            some = left[start : start + BLOCK]
            cubics, deviation = _by_corners(cells, cells.pairs[curves[some]], corners[some], count)
            before = deviations[curves[some]]
            better = (deviation <= np.maximum(before, close[curves[some]])).all(axis=1)
            better &= (deviation < ENOUGH * before).any(axis=1)
            deviations[curves[some[better]]] = deviation[better]
            fitted.append((curves[some[better]], cubics[better]))
    return fitted


def _by_corners(cells: MeshCells, pairs: Ints, corners: Array, count: int) -> tuple[Array, Array]:
    """Cubics (m, 4 count, 4, 6) by way of corners (m, 3) m, and how far they stray (m, 2)."""
    cubics, deviations = [], []
    for end in range(2):
        centre = cells.centres[pairs[:, end]]
        rim = _rims(cells, pairs, centre, corners)
        tau = np.linspace(0.0, 1.0, 2 * SAMPLES * count + 1)
        first = _along(cells, pairs, centre, rim, tau * (2.0 - tau))
        first[0] = np.hstack([centre, cells.normals[pairs[:, end]]])
        second = _along(cells, pairs, rim, corners, tau * tau * (3.0 - 2.0 * tau))
        for values, rests in ((first, "last"), (second, "both")):
            part, deviation = fitted_to(cells, pairs, values, count, rests)
            cubics.append(part if end == 0 else _backwards(part))
            deviations.append(deviation)
    order = (0, 1, 3, 2)
    return np.concatenate([cubics[k] for k in order], axis=1), np.max(deviations, axis=0)


def _along(cells: MeshCells, pairs: Ints, start: Array, stop: Array, share: Array) -> Array:
    """(k, m, 6) foot and normal at shares (k,) of straight legs."""
    lines = start[:, None] + share[None, :, None] * (stop - start)[:, None]
    points, normals = cells.surface.beneath(cells, pairs, lines)
    return np.concatenate([points, normals], axis=2).swapaxes(0, 1).copy()


def _rims(cells: MeshCells, pairs: Ints, centres: Array, corners: Array) -> Array:
    """(m, 3) m, where the ways from centres to corners come to the strip along the crease."""
    t = np.linspace(0.0, 1.0, LOOKS)
    lines = centres[:, None] + t[None, :, None] * (corners - centres)[:, None]
    share = cells.surface.rim_share(*cells.surface.faces_beneath(cells, pairs, lines))  # (m, k)
    off = LOOKS - 1 - (share[:, ::-1] <= 0.0).argmax(axis=1)  # the last place off the strip
    off[(share > 0.0).all(axis=1)] = LOOKS // 2  # there is none: anywhere will do
    off = np.minimum(off, LOOKS - 2)
    rows = np.arange(len(pairs))
    # It rises evenly from there.
    one, two = share[rows, off + 1], share[rows, np.minimum(off + 2, LOOKS - 1)]
    ahead = np.divide(one, two - one, out=np.zeros(len(one)), where=two > one)
    place = t[off + 1] - np.clip(ahead, 0.0, 1.0) / (LOOKS - 1)
    return np.asarray(lines[:, 0] + place[:, None] * (corners - centres))


def _backwards(cubics: Array) -> Array:
    """The same curves (m, count, 4, 6) run through from their ends."""
    a, b, c, d = np.moveaxis(cubics[:, ::-1], 2, 0)
    return np.stack([a + b + c + d, -(b + 2.0 * c + 3.0 * d), c + 3.0 * d, -d], axis=2)


def _corners(cells: MeshCells, pairs: Ints) -> tuple[Array, NDArray[np.bool_]]:
    """Where the shortest ways over a crease cross it (k, 3) m, and whether there is one at all.

    The crease is one within or between the two cells.
    """
    mesh, rotation = cells.surface.mesh, cells.surface.rotation
    sharp = sharp_edges(mesh)
    faces, vertices = mesh.edges.faces[sharp], mesh.edges.vertices[sharp]
    beside = np.sort(cells.labels[faces], axis=1)
    ends = mesh.vertices[vertices] @ rotation.T + cells.surface.position
    # From the edge into either face.
    middles = mesh.vertices[mesh.faces[faces]].mean(axis=2) @ rotation.T + cells.surface.position
    inwards = middles - ends.mean(axis=1)[:, None]
    by_cells: dict[tuple[int, int], list[int]] = {}
    for row, (i, j) in enumerate(beside.tolist()):
        by_cells.setdefault((i, j), []).append(row)
    corners = np.full((len(pairs), 3), np.nan)
    for k, (i, j) in enumerate(pairs.tolist()):
        some = [row for key in ((i, i), (i, j), (j, j)) for row in by_cells.get(key, ())]
        if some:
            corners[k] = _shortest(cells.centres[[i, j]], ends[some], inwards[some])
    return corners, np.isfinite(corners[:, 0])


def _shortest(centres: Array, edges: Array, inwards: Array) -> Array:
    """(3,) the point of a crease on the shortest way from one centre to another; NaN without one.

    Unfold both sides into one plane: the way is straight there, and divides the edge as the
    distances of the two points from it.

    Args:
        centres: (2, 3) m.
        edges: (k, 2, 3) m, ends of the crease's edges.
        inwards: (k, 2, 3) directions from each edge into its two faces.
    """
    origin, along = edges[:, 0], edges[:, 1] - edges[:, 0]
    square = (along**2).sum(axis=1)
    off = centres - origin[:, None]  # (k, 2, 3)
    closest_points = (off * along[:, None]).sum(axis=2) / square[:, None]
    out = off - closest_points[..., None] * along[:, None]
    far = np.linalg.norm(out, axis=2)
    lies = (out[:, :, None] * inwards[:, None]).sum(axis=3).argmax(axis=2)  # (k, 2) on which face
    share = far[:, 0] / np.maximum(far.sum(axis=1), 1e-300)
    place = np.clip(
        closest_points[:, 0] + share * (closest_points[:, 1] - closest_points[:, 0]), 0.0, 1.0
    )
    points = origin + place[:, None] * along
    way = np.linalg.norm(points[:, None] - centres, axis=2).sum(axis=1)
    way[lies[:, 0] == lies[:, 1]] = np.inf  # it would touch the crease and come back
    return np.where(np.isfinite(way.min()), points[way.argmin()], np.nan)
