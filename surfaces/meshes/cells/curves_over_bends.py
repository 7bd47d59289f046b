"""Ways over tight bends, such as the rounded edge of a sheet: slowly where the normal turns.

At an even pace over the surface the normal of such a course stands still, turns fast, and stands
still again. A smooth fit then overshoots at both ends of the bend, and at a standoff of many times
the bend's radius its target runs backwards there. So these courses go at an even pace of foot and
normal together: through the bend at the pace at which the normal turns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from surfaces.cell_curves import BLOCK, PIECES, PLACES, Array, slopes_of, through

if TYPE_CHECKING:
    from surfaces.meshes.cells.mesh_cells import MeshCells

Ints = NDArray[np.int64]

SAMPLES = 4  # for each cubic
LOOKS = 513  # places on the way, to find how fast the normal turns
ROUGH = 4e-3  # [1] a normal that strays less moves a target 100 mm away by 0.4 mm at most
TURNED = 0.1  # [1] |n1 - n0| of the normals at both ends: less is roughness, and no bend
ENOUGH = 0.7  # [1] of how far a course strays: what more cubics must reach to be worth it
FAR = 10.0  # times a mesh's edges: the height in which foot and normal are weighed together


def over_bends(
    cells: MeshCells,
    fitted: list[tuple[Ints, Array]],
    curves: Ints,
    close: Array,
    deviations: Array,
) -> list[tuple[Ints, Array]]:
    """Courses at an even pace of foot and normal together, where these stray less.

    More cubics could also follow every facet. So none is taken that turns more hollow.

    Args:
        cells: the cells.
        fitted: the courses as they are; the last fit of each counts.
        courses: (k,) which to try.
        close: (M, 2) how near to the surface is near enough.
        strays: (M, 2) how far the courses stray, see `CellCurves`; brought up to date.

    Returns:
        Some of the courses, with their cubics (m, pieces, 4, 6), for each number of pieces.
    """
    ends = cells.normals[cells.pairs[curves]]
    turned = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) > TURNED
    curves = curves[turned & (deviations[curves, 1] > ROUGH)]
    if len(curves) == 0:
        return []
    weights = np.array([1.0, FAR * cells.surface.mean_edge_length])
    side = cells.surface.side_sign
    hollow = np.empty(len(deviations))
    for some, cubics in fitted:
        hollow[some] = _hollow(cubics, side)
    found: list[tuple[Ints, Array]] = []
    for start in range(0, len(curves), BLOCK):
        block = curves[start : start + BLOCK]
        lines, pace = _paced(cells, cells.pairs[block])
        for count in PIECES[1:]:
            left = np.flatnonzero((deviations[block] > close[block]).any(axis=1))
            some = block[left]
            cubics, deviation = _by_pace(cells, cells.pairs[some], lines[left], pace[left], count)
            better = deviation @ weights < ENOUGH * (deviations[some] @ weights)
            better &= _hollow(cubics, side) <= hollow[some]
            deviations[some[better]] = deviation[better]
            found.append((some[better], cubics[better]))
    return found


def _hollow(cubics: Array, side: float) -> Array:
    """(m,) 1/m, the largest curvature of m courses (m, count, 4, 6) that is hollow to a side."""
    most = np.zeros(len(cubics))
    for s in np.linspace(0.0, 1.0, PLACES):
        point, normal = np.split(slopes_of(cubics, s), 2, axis=2)
        square = (point**2).sum(axis=2)
        turn = -side * (point * normal).sum(axis=2)
        curvature = np.divide(turn, square, out=np.full_like(turn, np.inf), where=square > 0.0)
        most = np.maximum(most, curvature.max(axis=1))
    return most


def _paced(cells: MeshCells, pairs: Ints) -> tuple[Array, Array]:
    """Places (m, LOOKS, 3) m on the ways between centres, and when each is passed, from 0 to 1.

    A turn of the normal by 1 rad takes as long as the way from centre to centre.
    """
    points, normals = cells.surface.trace(cells, pairs, np.linspace(0.0, 1.0, LOOKS))
    length = np.linalg.norm(cells.centres[pairs[:, 1]] - cells.centres[pairs[:, 0]], axis=1)
    moves = np.linalg.norm(np.diff(points, axis=1), axis=2)
    turns = np.linalg.norm(np.diff(normals, axis=1), axis=2)
    travel = np.cumsum(np.hypot(moves, length[:, None] * turns), axis=1)
    return points, np.hstack([np.zeros((len(pairs), 1)), travel / travel[:, -1:]])


def _by_pace(
    cells: MeshCells, pairs: Ints, lines: Array, pace: Array, count: int
) -> tuple[Array, Array]:
    """Cubics (m, count, 4, 6) at even steps of the pace, and how far they stray (m, 2)."""
    tau = np.linspace(0.0, 1.0, 2 * SAMPLES * count + 1)
    places = np.empty((len(pairs), len(tau), 3))
    for row, (line, time) in enumerate(zip(lines, pace, strict=True)):
        for axis in range(3):
            places[row, :, axis] = np.interp(tau, time, line[:, axis])
    points, normals = cells.surface.beneath(cells, pairs, places)
    return through(cells, pairs, points, normals, count)
