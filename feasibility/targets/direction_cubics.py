"""Cubics of unit directions along cell curves; approach directions that are no normals."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.task import Task
from surfaces.cells import Cells
from surfaces.curve_fitting import fit_directions

BESIDE_CREASES = 4  # times as many samples for each cubic of a mesh, whose curves may come to rest
ROUNDING = 1.0 + 1e-12  # covers the rounding of the few operations on derivative bounds


class DirectionCurves(NamedTuple):
    """A direction along the M curves of some cells, as P cubics."""

    cubics: Array
    """(P, 4, 3) coefficients of 1, s, s^2, s^3; s in 0..1 on the piece."""
    derivative_bounds: Array
    """(P, 2) the largest first and second derivative by t in 0..1 of all the curve."""
    deviations: Array
    """(M,) how far they are from the direction meant, at most."""


def fitted(cells: Cells, direction: Callable[[Ints, Array], Array], ends: Array) -> DirectionCurves:
    """Cubics on the same pieces as the curves of `cells`, through samples of a direction.

    Args:
        cells: the cells.
        direction: unit directions (k, 3) at t (k,) of curves (k,); NaN where there is none.
        ends: (M, 2, 3) those at both ends, which are kept exactly.

    Returns:
        The cubics; bounds and deviations are inf where a direction is missing.
    """
    first = cells.curves.first
    counts = np.diff(first)
    cubics, deviations = np.empty((first[-1], 4, 3)), np.empty(len(counts))
    for count in np.unique(counts):
        some = np.flatnonzero(counts == count)
        parts = int(count) + 2
        if cells.surface.mean_edge_length > 0.0:
            parts = BESIDE_CREASES * parts
        t = np.linspace(0.0, 1.0, 2 * parts + 1)
        values = direction(np.tile(some, len(t)), np.repeat(t, len(some)))
        values = values.reshape(len(t), len(some), 3)
        values[0], values[-1] = ends[some, 0], ends[some, 1]
        found, off = fit_directions(values, int(count))
        cubics[first[some][:, None] + np.arange(count)] = found
        deviations[some] = off
    bounds = _derivative_bounds(cubics, np.repeat(counts, counts))
    lost = ~np.isfinite(deviations)
    deviations[lost] = bounds[np.repeat(lost, counts)] = np.inf
    cubics[np.repeat(lost, counts)] = 0.0
    return DirectionCurves(cubics, bounds, deviations)


def _derivative_bounds(cubics: Array, counts: Ints) -> Array:
    """(P, 2) see `DirectionCurves`: the derivative of a cubic lies in the hull of three vectors."""
    b, c, d = (cubics[:, power] for power in (1, 2, 3))
    slopes = [np.linalg.norm(v, axis=1) for v in (b, b + c, b + 2.0 * c + 3.0 * d)]
    seconds = [np.linalg.norm(v, axis=1) for v in (2.0 * c, 2.0 * c + 6.0 * d)]
    both = np.column_stack([np.max(slopes, axis=0) * counts, np.max(seconds, axis=0) * counts**2])
    return ROUNDING * both


def approach_curves(cells: Cells, task: Task) -> DirectionCurves:
    """The approach direction along the curves where it is not the normal."""
    fixed = task.fixed_approach(cells)
    if fixed is None:
        from surfaces.toolpaths.arcs import arc_at

        ends = task.approaches(cells)[cells.pairs]
        return fitted(cells, lambda curve, t: arc_at(ends[curve, 0], ends[curve, 1], t)[0], ends)
    pieces, curves = len(cells.curves.cubics), len(cells.curves)
    cubics = np.zeros((pieces, 4, 3))
    cubics[:, 0] = fixed
    return DirectionCurves(cubics, np.zeros((pieces, 2)), np.zeros(curves))
