"""Curves between cells that lead over a corner: in four legs, at rest between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.cells import Cells
from surfaces.curve_fitting import BLOCK, PIECES, CurveFit, fit_cubics

SAMPLES = 4  # of a leg, for each cubic
ENOUGH = 0.7  # [1] share of the deviation: what more cubics must reach to be worth it

Legs = Callable[[Ints, Array, Array], Sequence[Array]]
"""From rows and two lists of shares to the samples of four legs; see `over_corners`."""


def over_corners(fit: CurveFit, curves: Ints, legs: Legs, off: Array | float = 0.0) -> Mask:
    """Replace some curves (k,) by such in four legs over a corner, where these deviate less.

    Args:
        curves: those that have a corner.
        legs: samples of rows (j,) of `curves`, see `fit_in_legs`; by shares of the way to where
            a leg ends, at rest at its last end, and at both.
        off: (k,) m, how far those may be off the surface.

    Returns:
        (k,) which were replaced.
    """
    cells, off = fit.cells, np.broadcast_to(off, len(curves))
    taken = np.zeros(len(curves), dtype=bool)
    for count in PIECES[1:-2]:
        left = np.flatnonzero((fit.deviations[curves] > fit.close[curves]).any(axis=1))
        for start in range(0, len(left), BLOCK):
            rows = left[start : start + BLOCK]
            some = curves[rows]
            tau = np.linspace(0.0, 1.0, 2 * SAMPLES * count + 1)
            shares = tau * (2.0 - tau), tau * tau * (3.0 - 2.0 * tau)
            cubics, deviations = fit_in_legs(cells, cells.pairs[some], legs(rows, *shares), count)
            deviations[:, 0] += off[rows]
            before = fit.deviations[some]
            better = (deviations <= np.maximum(before, fit.close[some])).all(axis=1)
            better &= (deviations < ENOUGH * before).any(axis=1)
            fit.put(some[better], cubics[better], deviations[better])
            fit.creased[some[better]] = taken[rows[better]] = True
    return taken


def fit_in_legs(
    cells: Cells, pairs: Ints, legs: Sequence[Array], count: int
) -> tuple[Array, Array]:
    """Cubics (m, 4 count, 4, 6) of curves in four legs, at rest between them; deviations (m, 2).

    Args:
        cells: the cells.
        pairs: (m, 2) their pairs.
        legs: samples as for `fit_cubics`: from the first centre on to the corner, in two legs, and
            the same from the second centre.
        count: cubics of each leg.
    """
    exact = cells.surface.mean_edge_length == 0.0  # no facets
    parts, deviations = [], []
    for values, rests in zip(legs, ("last", "both") * 2, strict=True):
        still = (values[..., :3] == values[:1, :, :3]).all(axis=(0, 2))
        part, deviation = fit_cubics(cells, pairs, values, count, rests, exact)
        part[still, :, 1:, :3] = 0.0  # without rounding: it turns on the spot
        parts.append(part)
        deviations.append(deviation)
    first, second, last, third = parts
    return (
        np.concatenate([first, second, _backwards(third), _backwards(last)], axis=1),
        np.max(deviations, axis=0),
    )


def _backwards(cubics: Array) -> Array:
    """The same curves (m, count, 4, 6) run through from their ends."""
    a, b, c, d = np.moveaxis(cubics[:, ::-1], 2, 0)
    return np.stack([a + b + c + d, -(b + 2.0 * c + 3.0 * d), c + 3.0 * d, -d], axis=2)
