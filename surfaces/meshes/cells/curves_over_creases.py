"""Curves over creases: straight to a corner on the crease, and straight on from it.

A smooth curve cannot turn a corner without leaving the surface. So a curve over a crease consists
of four straight legs: up to the strip along the crease where the normal turns (see
`surfaces.meshes.normals`), over it to the corner, and the same on the other side. Between two legs
point and normal come to rest for a moment, so that the curve stays continuously differentiable.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces.cells import Cells
from surfaces.curve_fitting import BLOCK, PIECES, CurveFit, fit_cubics
from surfaces.meshes.mesh_surface import MeshSurface
from surfaces.meshes.normals import sharp_edges

Array = NDArray[np.float64]
Ints = NDArray[np.int64]
Shares = Callable[[Ints, Array], Array]
"""From pairs (m, 2) and points (m, k, 3) m to (m, k), see `MeshSurface.crease_share`."""

SAMPLES = 4  # for each cubic
TRACED = 257  # places on the line to a corner, to find its strip
ENOUGH = 0.7  # [1] share of the deviation: what more cubics must reach to be worth it


class Creases(NamedTuple):
    """The K edges of a mesh that are creases, in the root frame."""

    ends: Array
    """(K, 2, 3) m."""
    inwards: Array
    """(K, 2, 3) m, from the middle of each edge into either face."""
    cells: Ints
    """(K, 2) the cells of the two faces, the lower first."""


def creases_of(surface: MeshSurface, labels: Ints) -> Creases:
    """The creases of a mesh whose faces belong to cells `labels` (F,)."""
    mesh, rotation = surface.mesh, surface.rotation
    sharp = sharp_edges(mesh)
    faces, vertices = mesh.edges.faces[sharp], mesh.edges.vertices[sharp]
    ends = mesh.vertices[vertices] @ rotation.T + surface.position
    middles = mesh.vertices[mesh.faces[faces]].mean(axis=2) @ rotation.T + surface.position
    return Creases(ends, middles - ends.mean(axis=1)[:, None], np.sort(labels[faces], axis=1))


def fit_over_creases(fit: CurveFit, creases: Creases, shares: Shares) -> None:
    """Replace rough curves by such over a corner on a crease, where these deviate less."""
    cells, curves = fit.cells, fit.rough
    corners = _corners(cells, cells.pairs[curves], creases)
    found = np.isfinite(corners[:, 0])
    curves, corners = curves[found], corners[found]
    for count in PIECES[1:-2]:
        left = np.flatnonzero((fit.deviations[curves] > fit.close[curves]).any(axis=1))
        for start in range(0, len(left), BLOCK):
            rows = left[start : start + BLOCK]
            some = curves[rows]
            cubics, deviations = _by_corners(cells, cells.pairs[some], corners[rows], shares, count)
            before = fit.deviations[some]
            better = (deviations <= np.maximum(before, fit.close[some])).all(axis=1)
            better &= (deviations < ENOUGH * before).any(axis=1)
            fit.put(some[better], cubics[better], deviations[better])
            fit.creased[some[better]] = True


def _by_corners(
    cells: Cells, pairs: Ints, corners: Array, shares: Shares, count: int
) -> tuple[Array, Array]:
    """Cubics (m, 4 count, 4, 6) over corners (m, 3) m, and their deviations (m, 2)."""
    cubics, deviations = [], []
    tau = np.linspace(0.0, 1.0, 2 * SAMPLES * count + 1)
    for end in range(2):
        centre = cells.centres[pairs[:, end]]
        border = _strip_borders(pairs, centre, corners, shares)
        first = _along(cells, pairs, centre, border, tau * (2.0 - tau))
        first[0] = np.hstack([centre, cells.normals[pairs[:, end]]])
        second = _along(cells, pairs, border, corners, tau * tau * (3.0 - 2.0 * tau))
        for values, rests in ((first, "last"), (second, "both")):
            part, deviation = fit_cubics(cells, pairs, values, count, rests)
            cubics.append(part if end == 0 else _backwards(part))
            deviations.append(deviation)
    order = (0, 1, 3, 2)
    return np.concatenate([cubics[k] for k in order], axis=1), np.max(deviations, axis=0)


def _along(cells: Cells, pairs: Ints, start: Array, stop: Array, share: Array) -> Array:
    """(k, m, 6) point and normal at shares (k,) of straight legs."""
    lines = start[:, None] + share[None, :, None] * (stop - start)[:, None]
    return np.concatenate(cells.closest_along(pairs, lines), axis=2).swapaxes(0, 1).copy()


def _strip_borders(pairs: Ints, centres: Array, corners: Array, shares: Shares) -> Array:
    """(m, 3) m, where the lines from centres to corners reach the strip along the crease."""
    t = np.linspace(0.0, 1.0, TRACED)
    lines = centres[:, None] + t[None, :, None] * (corners - centres)[:, None]
    share = shares(pairs, lines)
    off = TRACED - 1 - (share[:, ::-1] <= 0.0).argmax(axis=1)  # the last place off the strip
    off[(share > 0.0).all(axis=1)] = TRACED // 2  # there is none: anywhere will do
    off = np.minimum(off, TRACED - 2)
    rows = np.arange(len(pairs))
    # The share rises evenly from there.
    one, two = share[rows, off + 1], share[rows, np.minimum(off + 2, TRACED - 1)]
    ahead = np.divide(one, two - one, out=np.zeros(len(one)), where=two > one)
    place = t[off + 1] - np.clip(ahead, 0.0, 1.0) / (TRACED - 1)
    return np.asarray(lines[:, 0] + place[:, None] * (corners - centres))


def _backwards(cubics: Array) -> Array:
    """The same curves (m, count, 4, 6) run through from their ends."""
    a, b, c, d = np.moveaxis(cubics[:, ::-1], 2, 0)
    return np.stack([a + b + c + d, -(b + 2.0 * c + 3.0 * d), c + 3.0 * d, -d], axis=2)


def _corners(cells: Cells, pairs: Ints, creases: Creases) -> Array:
    """(m, 3) m, where the shortest paths between centres cross a crease; NaN without one.

    The crease is one within or between the two cells.
    """
    by_cells: dict[tuple[int, int], list[int]] = {}
    for row, (i, j) in enumerate(creases.cells.tolist()):
        by_cells.setdefault((i, j), []).append(row)
    corners = np.full((len(pairs), 3), np.nan)
    for k, (i, j) in enumerate(pairs.tolist()):
        some = [row for key in ((i, i), (i, j), (j, j)) for row in by_cells.get(key, ())]
        if some:
            corners[k] = _shortest(cells.centres[[i, j]], creases.ends[some], creases.inwards[some])
    return corners


def _shortest(centres: Array, edges: Array, inwards: Array) -> Array:
    """(3,) the point of a crease on the shortest path between two centres; NaN without one.

    Unfold both sides into one plane: the path is straight there, and divides the edge in the
    ratio of the distances of the two points from it.

    Args:
        centres: (2, 3) m.
        edges: (k, 2, 3) m, ends of the crease's edges.
        inwards: (k, 2, 3) directions from each edge into its two faces.
    """
    origin, along = edges[:, 0], edges[:, 1] - edges[:, 0]
    square = (along**2).sum(axis=1)
    off = centres - origin[:, None]  # (k, 2, 3)
    near = (off * along[:, None]).sum(axis=2) / square[:, None]  # of the line through the edge
    out = off - near[..., None] * along[:, None]
    far = np.linalg.norm(out, axis=2)
    lies = (out[:, :, None] * inwards[:, None]).sum(axis=3).argmax(axis=2)  # (k, 2) on which face
    share = far[:, 0] / np.maximum(far.sum(axis=1), 1e-300)
    place = np.clip(near[:, 0] + share * (near[:, 1] - near[:, 0]), 0.0, 1.0)
    points = origin + place[:, None] * along
    length = np.linalg.norm(points[:, None] - centres, axis=2).sum(axis=1)
    length[lies[:, 0] == lies[:, 1]] = np.inf  # it would touch the crease and come back
    return np.where(np.isfinite(length.min()), points[length.argmin()], np.nan)
