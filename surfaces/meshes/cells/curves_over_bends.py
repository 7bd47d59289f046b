"""Curves over tight bends, such as the rounded edge of a sheet: slow where the normal turns.

At an even pace over the surface the normal of such a curve is constant, turns fast, and is constant
again. A smooth fit then overshoots at both ends of the bend, and at a standoff of many times the
bend's radius its target runs backwards there. So these curves have an even pace of point and normal
together: through the bend at the pace at which the normal turns.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfaces.cell_curves import PLACES, slopes_of
from surfaces.cells import Cells
from surfaces.curve_fitting import BLOCK, PIECES, CurveFit, fit_between_centres

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

SAMPLES = 4  # for each cubic
TRACED = 513  # places on the trace, to find how fast the normal turns
ROUGH = 4e-3  # [1] a normal that deviates less moves a target 100 mm away by 0.4 mm at most
TURNED = 0.1  # [1] |n1 - n0| of the normals at both ends: less is roughness, and no bend
ENOUGH = 0.7  # [1] share of the deviation: what more cubics must reach to be worth it
FAR = 10.0  # mean edge lengths: the height at which point and normal are weighed together


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
    """Points (m, TRACED, 3) m between centres, and when each is passed, from 0 to 1.

    A turn of the normal by 1 rad takes as long as the line from centre to centre.
    """
    points, normals = cells.trace(pairs, np.linspace(0.0, 1.0, TRACED))
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
