"""Curves over creases, through a corner; and over tight bends, slow where the normal turns.

A smooth curve cannot turn a corner without leaving the surface. So a curve over a crease consists
of four straight legs: up to the strip along the crease where the normal turns (see
`surfaces.meshes.normals`), over it to the corner, and the same on the other side. Between two legs
point and normal come to rest for a moment, so that the curve stays continuously differentiable.

Over a tight bend, such as the rounded edge of a sheet, the normal of a curve at an even pace is
constant, turns fast, and is constant again. A smooth fit then overshoots at both ends of the bend,
and at a standoff of many times the bend's radius its target runs backwards there. So these curves
have an even pace of point and normal together: through the bend at the pace of the normal's turn.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from surfaces.cell_curves import PLACES, slopes_of
from surfaces.cells import Cells
from surfaces.curve_fitting import BLOCK, PIECES, CurveFit, fit_between_centres
from surfaces.curves_over_corners import ENOUGH, SAMPLES, over_corners
from surfaces.meshes.normals import sharp_edges
from surfaces.meshes.triangle_surface import TriangleSurface

Shares = Callable[[Ints, Array], Array]
"""From pairs (m, 2) and points (m, k, 3) m to (m, k), see `MeshSurface.crease_share`."""

TRACED = 257  # places on the line to a corner, to find its strip
PACED = 513  # places on the trace, to find how fast the normal turns
ROUGH = 4e-3  # [1] a normal that deviates less moves a target 100 mm away by 0.4 mm at most
TURNED = 0.1  # [1] |n1 - n0| of the normals at both ends: less is roughness, and no bend
FAR = 10.0  # mean edge lengths: the height at which point and normal are weighed together


class Creases(NamedTuple):
    """The K edges of a mesh that are creases, in the root frame."""

    ends: Array
    """(K, 2, 3) m."""
    inwards: Array
    """(K, 2, 3) m, from the middle of each edge into either face."""
    cells: Ints
    """(K, 2) the cells of the two faces, the lower first."""


def creases_of(surface: TriangleSurface, labels: Ints) -> Creases:
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

    def legs(rows: Ints, first: Array, second: Array) -> list[Array]:
        pairs, found = cells.pairs[curves[rows]], []
        for end in range(2):
            centre = cells.centres[pairs[:, end]]
            border = _strip_borders(pairs, centre, corners[rows], shares)
            found.append(_along(cells, pairs, centre, border, first))
            found[-1][0] = np.hstack([centre, cells.normals[pairs[:, end]]])
            found.append(_along(cells, pairs, border, corners[rows], second))
        return found

    over_corners(fit, curves, legs)


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


def fit_over_bends(fit: CurveFit) -> None:
    """Replace curves by such at an even pace of point and normal, where these deviate less.

    More cubics could also follow every facet. So none is taken that is more concave. Curves over
    creases stay.
    """
    cells, curves = fit.cells, fit.rough
    curves = curves[~fit.creased[curves]]
    ends = cells.normals[cells.pairs[curves]]
    turned = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) > TURNED
    curves = curves[turned & (fit.deviations[curves, 1] > ROUGH)]
    if len(curves) == 0:
        return
    weights = np.array([1.0, FAR * cells.surface.mean_edge_length])
    side = cells.surface.side_sign
    concave = np.empty(len(fit.deviations))
    for some, cubics in fit.cubics:
        concave[some] = _concave_curvature(cubics, side)
    for start in range(0, len(curves), BLOCK):
        block = curves[start : start + BLOCK]
        points, pace = _paced(cells, cells.pairs[block])
        for count in PIECES[1:]:
            left = np.flatnonzero((fit.deviations[block] > fit.close[block]).any(axis=1))
            some = block[left]
            cubics, deviations = _by_pace(cells, cells.pairs[some], points[left], pace[left], count)
            better = deviations @ weights < ENOUGH * (fit.deviations[some] @ weights)
            better &= _concave_curvature(cubics, side) <= concave[some]
            fit.put(some[better], cubics[better], deviations[better])


def _concave_curvature(cubics: Array, side: float) -> Array:
    """(m,) 1/m, the largest curvature of m curves (m, count, 4, 6) that is concave to a side."""
    most = np.zeros(len(cubics))
    for s in np.linspace(0.0, 1.0, PLACES):
        point, normal = np.split(slopes_of(cubics, s), 2, axis=2)
        square = (point**2).sum(axis=2)
        turn = -side * (point * normal).sum(axis=2)
        curvature = np.divide(turn, square, out=np.full_like(turn, np.inf), where=square > 0.0)
        most = np.maximum(most, curvature.max(axis=1))
    return most


def _paced(cells: Cells, pairs: Ints) -> tuple[Array, Array]:
    """Points (m, PACED, 3) m between centres, and when each is passed, from 0 to 1.

    A turn of the normal by 1 rad takes as long as the line from centre to centre.
    """
    points, normals = cells.trace(pairs, np.linspace(0.0, 1.0, PACED))
    length = np.linalg.norm(cells.centres[pairs[:, 1]] - cells.centres[pairs[:, 0]], axis=1)
    moves = np.linalg.norm(np.diff(points, axis=1), axis=2)
    turns = np.linalg.norm(np.diff(normals, axis=1), axis=2)
    travel = np.cumsum(np.hypot(moves, length[:, None] * turns), axis=1)
    return points, np.hstack([np.zeros((len(pairs), 1)), travel / travel[:, -1:]])


def _by_pace(
    cells: Cells, pairs: Ints, traced: Array, pace: Array, count: int
) -> tuple[Array, Array]:
    """Cubics (m, count, 4, 6) at even steps of the pace, and their deviations (m, 2)."""
    tau = np.linspace(0.0, 1.0, 2 * SAMPLES * count + 1)
    points = np.empty((len(pairs), len(tau), 3))
    for row, (line, time) in enumerate(zip(traced, pace, strict=True)):
        for axis in range(3):
            points[row, :, axis] = np.interp(tau, time, line[:, axis])
    return fit_between_centres(cells, pairs, *cells.closest_along(pairs, points), count)
