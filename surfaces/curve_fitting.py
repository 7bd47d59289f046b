"""Fitting `CellCurves` to the curves that cells trace on their surface.

Exactly through few samples of a smooth patch, by least squares through many of a mesh, whose facets
they so smooth out. (`surfaces.meshes.cells` then replaces those over sharp edges and tight bends.)
How far they deviate from the samples is measured between them too, and counted against tolerance
and cone by those who use them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.cell_curves import CellCurves
from surfaces.cells import Cells

PIECES = (1, 4, 8, 16, 32, 64)  # numbers of cubics that a curve may consist of
CLOSE = 1e-6  # [1], share of its length that a curve may deviate, and [1] that its normal may
FACETED = 5e-4  # [1], the same for the normal of a mesh
FACETED_POINT = 0.01  # [1], share of a mesh's mean edge length that a curve may deviate from it
LEGS = 4  # of a curve over a crease; it is at rest between them
BETWEEN = 1.5  # [1], on deviations measured at samples: for those between them
SHARPER = 1.5  # [1], on curvatures at the two centres: for those between them
ROUNDING = 1.0 + 1e-12  # covers the rounding of the few operations on derivative bounds
HALVES = (slice(0, 3), slice(3, 6))  # of a cubic's values: point, normal
BLOCK = 5_000  # curves fitted at once: what the processor's caches hold


@dataclass(eq=False)
class CurveFit:
    """Cubics for the curves between the M `pairs` of some cells, to be improved and then joined."""

    cells: Cells
    close: Array
    """(M, 2) deviations of point (m) and normal that are small enough."""
    deviations: Array
    """(M, 2) deviations reached so far; inf before the first fit."""
    creased: Mask
    """(M,) curves that consist of `LEGS` legs and are at rest between them."""
    leans: Array
    """(M,) see `CellCurves.leans`."""
    cubics: list[tuple[Ints, Array]] = field(default_factory=list)
    """Curves (k,) and their cubics (k, count, 4, 6); the last fit of each curve counts."""

    @staticmethod
    def of(cells: Cells) -> CurveFit:
        """Fit a curve to every neighbouring pair of cells, with as few cubics as are enough."""
        pairs, edge = cells.pairs, cells.surface.mean_edge_length
        length = np.linalg.norm(cells.centres[pairs[:, 0]] - cells.centres[pairs[:, 1]], axis=1)
        close = np.full((len(pairs), 2), CLOSE if edge == 0.0 else FACETED)
        close[:, 0] = np.maximum(CLOSE * length, FACETED_POINT * edge)
        unknown = np.full((len(pairs), 2), np.inf)
        fit = CurveFit(
            cells, close, unknown, np.zeros(len(pairs), dtype=bool), np.zeros(len(pairs))
        )
        missing = np.arange(len(pairs))
        for count in PIECES:
            # Between its facets a mesh has no detail: no more pieces than half the samples.
            samples = np.full(len(missing), count + 2)
            if edge:
                fine = 2 * np.ceil(length[missing] / edge).astype(np.int64)
                samples = np.maximum(samples, fine)
            cubics, deviations = np.empty((len(missing), count, 4, 6)), np.empty((len(missing), 2))
            final = np.full(len(missing), count == PIECES[-1])
            for rows, parts in _blocks(samples):
                some = missing[rows]
                traced = cells.trace(pairs[some], np.linspace(0.0, 1.0, 2 * parts + 1))
                fitted = fit_between_centres(cells, pairs[some], *traced, count)
                cubics[rows], deviations[rows] = fitted
                final[rows] |= (deviations[rows] <= close[some]).all(axis=1)
                if edge:
                    final[rows] |= 4 * count > parts
            if final.all():  # most grids, at once: no copies of what may be large
                fit.put(missing, cubics, deviations)
                break
            fit.put(missing[final], cubics[final], deviations[final])
            missing = missing[~final]
        return fit

    @property
    def rough(self) -> Ints:
        """Curves that deviate by more than is small enough."""
        return np.flatnonzero((self.deviations > self.close).any(axis=1))

    def put(self, curves: Ints, cubics: Array, deviations: Array) -> None:
        """Take cubics (k, count, 4, 6), with deviations (k, 2), for some curves (k,)."""
        self.cubics.append((curves, cubics))
        self.deviations[curves] = deviations

    def joined(self) -> CellCurves:
        """All curves in the order of the pairs, with bounds on their second derivatives."""
        counts, last = np.zeros((2, len(self.deviations)), dtype=np.int64)
        for turn, (some, cubics) in enumerate(self.cubics):
            counts[some], last[some] = cubics.shape[1], turn
        first = np.concatenate([[0], np.cumsum(counts)])
        if len(self.cubics) == 1:
            joined = self.cubics[0][1].reshape(-1, 4, 6)
        else:
            joined = np.empty((first[-1], 4, 6))
            for turn, (some, cubics) in enumerate(self.cubics):
                kept = last[some] == turn
                joined[first[some[kept]][:, None] + np.arange(cubics.shape[1])] = cubics[kept]
        rests = np.zeros(len(joined), dtype=bool)
        for curve in np.flatnonzero(self.creased):
            legs = np.arange(first[curve], first[curve + 1]).reshape(LEGS, -1)
            rests[legs[1:, 0]] = rests[legs[:-1, -1]] = True
        square = np.repeat(counts, counts)[:, None] ** 2  # from s to t
        begin = 2.0 * joined[:, 2]
        ends = begin, begin + 6.0 * joined[:, 3]
        sizes = [[np.sqrt(_squares(end[:, half])) for half in HALVES] for end in ends]
        bounds: Array = np.max(sizes, axis=0).T
        bounds *= ROUNDING * square
        return CellCurves(first, joined, bounds, self.deviations, rests, self.leans)


def _blocks(samples: Ints) -> Iterator[tuple[Ints, int]]:
    """Rows of curves that are sampled alike, some at a time: the rows, and into how many parts."""
    # Few different numbers of samples: powers of two of a mesh's, all alike of a patch's.
    rounded = np.where(samples > 8, 2 ** np.ceil(np.log2(np.maximum(samples, 1))), samples)
    for parts in np.unique(rounded).astype(np.int64):
        alike = np.flatnonzero(rounded == parts)
        for start in range(0, len(alike), BLOCK):
            yield alike[start : start + BLOCK], int(parts)


def _squares(vectors: Array) -> Array:
    """(...,) squares of the lengths of (..., 3); numpy's own sums are slow over three numbers."""
    x, y, z = (vectors[..., k] for k in range(3))
    return x * x + y * y + z * z


def fit_between_centres(
    cells: Cells, pairs: Ints, points: Array, normals: Array, count: int
) -> tuple[Array, Array]:
    """See `fit_cubics`: from samples (m, 2 parts + 1, 3) whose ends are at the two centres."""
    # Places first, so that both maps are products of two matrices: (2 parts + 1, m, 6).
    values = np.empty((points.shape[1], len(points), 6))
    values[..., :3], values[..., 3:] = points.swapaxes(0, 1), normals.swapaxes(0, 1)
    values[0] = np.hstack([cells.centres[pairs[:, 0]], cells.normals[pairs[:, 0]]])
    values[-1] = np.hstack([cells.centres[pairs[:, 1]], cells.normals[pairs[:, 1]]])
    return fit_cubics(cells, pairs, values, count)


def fit_cubics(
    cells: Cells, pairs: Ints, values: Array, count: int, rests: str = "", exact: bool = False
) -> tuple[Array, Array]:
    """Cubics (m, count, 4, 6) through every other sample of m curves, and their deviations (m, 2).

    Args:
        cells: the cells.
        pairs: (m, 2) which the curves, or parts of them, belong to.
        values: (2 parts + 1, m, 6) point and normal at equal steps; overwritten where the curves
            are smoother than the surface.
        count: number of cubics.
        rests: "last" where the curves are at rest at their last end, "both" at both.
        exact: whether the samples are the surface's own, also where the curves are smoother.
    """
    parts = len(values) // 2
    fit, evaluate = _maps(count, parts, rests)
    cubics = fit @ values[::2].reshape(parts + 1, -1)
    off = (evaluate @ cubics).reshape(values.shape)
    smoothed = np.flatnonzero(cells.smoothed(pairs) & (not exact))
    if len(smoothed):
        # Least squares also cut corners along the facets, which takes nothing off the surface.
        points, normals = cells.closest_along(pairs[smoothed], off[:, smoothed, :3].swapaxes(0, 1))
        values[:, smoothed] = np.concatenate([points, normals], axis=2).swapaxes(0, 1)
    off -= values
    deviations = [np.sqrt(_squares(off[..., half]).max(axis=0)) for half in HALVES]
    # The surface's own normal is the one at the closest point, which is not the sample, and may lie
    # to the side, where the surface bends more than along the curve.
    moves = [np.sqrt(_squares(np.diff(values[..., half], axis=0))) for half in HALVES]
    curvature = np.divide(moves[1], moves[0], out=np.zeros_like(moves[0]), where=moves[0] > 0.0)
    sharpest = SHARPER * cells.max_curvature[pairs].max(axis=1)
    sharpest[smoothed] = 0.0  # measured, to the side too
    deviations[1] = deviations[1] + np.maximum(curvature.max(axis=0), sharpest) * deviations[0]
    by_curve = cubics.reshape(count, 4, len(pairs), 6).transpose(2, 0, 1, 3)
    return by_curve, BETWEEN * np.stack(deviations, axis=1)


def fit_directions(values: Array, count: int) -> tuple[Array, Array]:
    """Cubics (m, count, 4, 3) through every other sample of m curves, and their deviations (m,).

    Args:
        values: (2 parts + 1, m, 3) unit directions at equal steps.
        count: number of cubics.
    """
    parts = len(values) // 2
    fit, evaluate = _maps(count, parts, "")
    cubics = fit @ values[::2].reshape(parts + 1, -1)
    off = (evaluate @ cubics).reshape(values.shape) - values
    deviations = BETWEEN * np.linalg.norm(off, axis=2).max(axis=0)
    return cubics.reshape(count, 4, -1, 3).transpose(2, 0, 1, 3), deviations


@cache
def _maps(count: int, parts: int, rests: str) -> tuple[Array, Array]:
    """From samples to cubics, and from cubics to values; both linear. See `fit_cubics`.

    Returns:
        (4 count, parts + 1): coefficients of the least-squares spline of `count` pieces that keeps
        the first and the last sample; and (2 parts + 1, 4 count): its values at twice as many
        places.
    """
    design = _basis(count, np.linspace(0.0, 1.0, parts + 1))  # (parts + 1, count + 3)
    # End coefficients are the end samples, and so are their neighbours where the curve is at rest
    # there; the others fit the remainder.
    coefficients = np.zeros((count + 3, parts + 1))
    free = slice(2 if rests == "both" else 1, -2 if rests else -1)
    coefficients[: free.start, 0] = coefficients[free.stop :, -1] = 1.0
    rest = np.eye(parts + 1) - design @ coefficients
    coefficients[free] = np.linalg.pinv(design[:, free]) @ rest
    # A cubic is known by its values at four places.
    places = np.array([0.125, 0.375, 0.625, 0.875])
    values = _basis(count, ((np.arange(count)[:, None] + places) / count).reshape(-1))
    inverse = np.linalg.inv(np.vander(places, 4, increasing=True))
    to_local = inverse @ values.reshape(count, 4, count + 3)
    fit = (to_local @ coefficients).reshape(4 * count, parts + 1)
    t = np.linspace(0.0, 1.0, 2 * parts + 1)
    piece = np.minimum((t * count).astype(np.int64), count - 1)
    evaluate = np.zeros((len(t), count, 4))
    evaluate[np.arange(len(t)), piece] = np.vander(t * count - piece, 4, increasing=True)
    return fit, evaluate.reshape(len(t), 4 * count)


def _basis(count: int, t: Array) -> Array:
    """(k, count + 3) values at t of the clamped cubic B-splines of `count` equal pieces.

    By the recursion of Cox and de Boor. (Loading scipy's splines would take longer than a search.)
    """
    knots = np.concatenate([np.zeros(3), np.linspace(0.0, 1.0, count + 1), np.ones(3)])
    piece = 3 + np.minimum((t * count).astype(np.int64), count - 1)
    values = np.zeros((len(t), len(knots) - 1))
    values[np.arange(len(t)), piece] = 1.0
    for degree in (1, 2, 3):
        span = knots[degree:] - knots[:-degree]
        share = (t[:, None] - knots[:-degree]) / np.where(span > 0.0, span, np.inf)
        rising = share[:, :-1] * values[:, :-1]
        falling = np.where(span > 0.0, 1.0 - share, 0.0)[:, 1:] * values[:, 1:]
        values = rising + falling
    return values
