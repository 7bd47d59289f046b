"""Courses: the ways between neighbouring cell centres, as smooth curves with known bends.

Whatever the surface is, a motion from cell to cell follows one of these curves: the foot f(t) on
the surface and its unit normal n(t), t from 0 to 1, each a piecewise cubic that is twice
continuously differentiable. The target at standoff h is f + h n. What certificates need is then at
hand: |f''| and |n''| are largest at the ends of the pieces, because second derivatives of cubics
are straight lines.

The curves are fitted to samples of `Surface.trace`: exactly through few samples of a smooth patch,
by least squares through many of a mesh, whose facets they so smooth out. (`surfaces.creased` and
`surfaces.bent` make those that lead over sharp edges and tight bends.) How far they stray from
the samples is measured between them too, and counted against tolerance and cone by those who use
them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from surfaces.cells import Cells

Array = NDArray[np.float64]

PIECES = (1, 4, 8, 16, 32, 64)  # numbers of cubics that a course may be made of
CLOSE = 1e-6  # [1], share of its length that a course may stray, and [1] that its normal may
FACETED = 5e-4  # [1], the same for the normal of a mesh
FACETED_POINT = 0.01  # [1], share of a mesh's edges that a course may stray from it
STANDS = 1e-3  # [1] a parallel curve that is so much shorter stands still
PLACES = 3  # along a piece, where its slopes are looked at
LEGS = 4  # of a course over a crease; it is at rest between them
BETWEEN = 1.5  # [1], on what was measured at samples: for what lies between them
SHARPER = 1.5  # [1], on curvatures at the two centres: for what lies between them
ROUNDING = 1.0 + 1e-12  # covers the rounding of the few operations on bends
HALVES = (slice(0, 3), slice(3, 6))  # of a cubic's values: foot, normal
BLOCK = 5_000  # courses fitted at once: what the processor's caches hold


@dataclass(frozen=True, eq=False, slots=True)
class CellCurves:
    """One curve for each of M neighbouring pairs (i, j) of cells, from centre i to centre j."""

    first: NDArray[np.int64]
    """(M + 1,) where each course's pieces begin, equal shares of t, and the end of the last."""
    cubics: Array
    """(P, 4, 6) coefficients of 1, s, s^2, s^3 of foot (m) and normal; s in 0..1 on the piece."""
    derivative_bounds: Array
    """(P, 2) largest |f''| (m) and |n''| on each piece, for t in 0..1 on the whole course."""
    deviations: Array
    """(M, 2) how far foot (m) and normal (1) may be from the surface's own, at most."""
    rests: NDArray[np.bool_]
    """(P,) pieces at an end of which the foot is at rest, see `surfaces.creased`."""

    def __post_init__(self) -> None:
        """Write-protect the arrays."""
        for name in ("first", "cubics", "derivative_bounds", "deviations", "rests"):
            getattr(self, name).flags.writeable = False

    def __len__(self) -> int:
        """Number of courses."""
        return len(self.first) - 1

    def at(self, curves: NDArray[np.int64], t: Array) -> tuple[Array, Array]:
        """Foot (k, 3) m and normal (k, 3) at t (k,) of some courses (k,)."""
        powers, cubics = self._local(curves, t)
        values = np.einsum("kp,kpd->kd", powers, cubics)
        return values[:, :3], values[:, 3:]

    def slopes(self, curves: NDArray[np.int64], t: Array) -> tuple[Array, Array]:
        """Derivatives by t of foot (k, 3) m and normal (k, 3)."""
        powers, cubics = self._local(curves, t)
        count = np.diff(self.first)[curves]
        by_s = np.column_stack([powers[:, 0], 2.0 * powers[:, 1], 3.0 * powers[:, 2]])
        values = np.einsum("kp,kpd->kd", by_s, cubics[:, 1:]) * count[:, None]
        return values[:, :3], values[:, 3:]

    def folds(self, height: float) -> NDArray[np.bool_]:
        """(M,) where the parallel curve at a signed height (m) turns back or stands still.

        There the height reaches the radius of curvature on the hollow side, and the offset surface
        folds: no tool can follow it.
        """
        folded = np.zeros(len(self.cubics), dtype=bool)
        for point, normal in self._slopes_along():
            onward = ((point + height * normal) * point).sum(axis=1)
            folded |= ~(onward > STANDS * (point**2).sum(axis=1))
        return np.logical_or.reduceat(folded, self.first[:-1]) if len(self) else folded

    def curvature(self, height: float) -> Array:
        """(P,) 1/m, how fast the normal turns for each metre that the target travels, at most.

        Args:
            height: signed height of the target over the surface, m.
        """
        fastest = np.zeros(len(self.cubics))
        for point, normal in self._slopes_along():
            way = np.linalg.norm(point + height * normal, axis=1)
            turn = np.linalg.norm(normal, axis=1)
            none = np.where(turn > 0.0, np.inf, 0.0)  # it turns on the spot, or there is no way
            rate = np.divide(turn, way, out=none, where=way > 0.0)
            fastest = np.maximum(fastest, rate)
        return fastest

    def _slopes_along(self) -> Iterator[tuple[Array, Array]]:
        """Derivatives by s of foot and normal (P, 3), at places along every piece.

        Where a course is at rest at an end of a piece, both are the whole way over the piece.
        """
        resting = np.flatnonzero(self.rests)
        whole = self.cubics[resting, 1:].sum(axis=1)
        for s in np.linspace(0.0, 1.0, PLACES):
            slope = slopes_of(self.cubics, s)
            slope[resting] = whole
            yield slope[:, :3], slope[:, 3:]

    @property
    def creased(self) -> NDArray[np.bool_]:
        """(M,) courses that come to rest on their way, see `surfaces.creased`."""
        if not self.rests.any():
            return np.zeros(len(self), dtype=bool)
        return np.logical_or.reduceat(self.rests, self.first[:-1])

    def _local(self, curves: NDArray[np.int64], t: Array) -> tuple[Array, Array]:
        """Powers 1, s, s^2, s^3 (k, 4), and the cubics (k, 4, 6) that hold at t."""
        count = np.diff(self.first)[curves]
        piece = np.clip(np.floor(t * count), 0, count - 1).astype(np.int64)
        s = t * count - piece
        return np.vander(s, 4, increasing=True), self.cubics[self.first[curves] + piece]


def curves_of(cells: Cells) -> CellCurves:
    """Fit a course to every neighbouring pair of cells; see the module."""
    pairs, mean_edge_length = cells.pairs, cells.surface.mean_edge_length
    length = np.linalg.norm(cells.centres[pairs[:, 0]] - cells.centres[pairs[:, 1]], axis=1)
    close = np.full((len(pairs), 2), CLOSE if mean_edge_length == 0.0 else FACETED)
    close[:, 0] = np.maximum(CLOSE * length, FACETED_POINT * mean_edge_length)
    deviations = np.full((len(pairs), 2), np.inf)
    fitted: list[tuple[NDArray[np.int64], Array]] = []
    missing = np.arange(len(pairs))
    for count in PIECES:
        # A mesh has nothing to say between its facets: no more pieces than half the samples.
        samples = np.full(len(missing), count + 2)
        if mean_edge_length:
            samples = np.maximum(
                samples, 2 * np.ceil(length[missing] / mean_edge_length).astype(np.int64)
            )
        for some, fit_to in _blocks(missing, samples):
            cubics, deviation = _fit(cells, pairs[some], count, fit_to)
            final = (deviation <= close[some]).all(axis=1) | (count == PIECES[-1])
            if mean_edge_length:
                final |= 4 * count > fit_to
            deviations[some[final]] = deviation[final]
            fitted.append((some[final], cubics[final]))
        missing = np.flatnonzero(np.isinf(deviations).any(axis=1))
        if len(missing) == 0:
            break
    creased = np.zeros(len(pairs), dtype=bool)
    if mean_edge_length:
        from surfaces.meshes.cells import MeshCells, over_bends, over_creases

        if isinstance(cells, MeshCells):
            rough = np.flatnonzero((deviations > close).any(axis=1))
            for some, cubics in over_creases(cells, rough, close, deviations):
                fitted.append((some, cubics))
                creased[some] = True
            fitted += over_bends(cells, fitted, rough[~creased[rough]], close, deviations)
    return _joined(fitted, deviations, creased)


def _blocks(
    curves: NDArray[np.int64], samples: NDArray[np.int64]
) -> Iterator[tuple[NDArray[np.int64], int]]:
    """Courses that are sampled alike, some at a time: the courses, and into how many parts."""
    # Few different numbers of samples: powers of two of a mesh's, all alike of a patch's.
    rounded = np.where(samples > 8, 2 ** np.ceil(np.log2(np.maximum(samples, 1))), samples)
    for parts in np.unique(rounded).astype(np.int64):
        alike = curves[rounded == parts]
        for start in range(0, len(alike), BLOCK):
            yield alike[start : start + BLOCK], int(parts)


def _fit(cells: Cells, pairs: NDArray[np.int64], count: int, parts: int) -> tuple[Array, Array]:
    """Cubics (m, count, 4, 6) through samples of m courses, and how far they stray (m, 2)."""
    t = np.linspace(0.0, 1.0, 2 * parts + 1)
    points, normals = cells.surface.trace(cells, pairs, t)
    return through(cells, pairs, points, normals, count)


def slopes_of(cubics: Array, s: float) -> Array:
    """(..., 6) derivatives by s of foot and normal of cubics (..., 4, 6)."""
    b, c, d = (cubics[..., power, :] for power in (1, 2, 3))
    return np.asarray(b + 2.0 * s * c + 3.0 * s * s * d)


def through(
    cells: Cells, pairs: NDArray[np.int64], points: Array, normals: Array, count: int
) -> tuple[Array, Array]:
    """See `fitted_to`: whole courses from samples (m, 2 parts + 1, 3), ends at the two centres."""
    # Places first, so that both maps are products of two matrices: (2 parts + 1, m, 6).
    values = np.concatenate([points, normals], axis=2).swapaxes(0, 1).copy()
    values[0] = np.hstack([cells.centres[pairs[:, 0]], cells.normals[pairs[:, 0]]])
    values[-1] = np.hstack([cells.centres[pairs[:, 1]], cells.normals[pairs[:, 1]]])
    return fitted_to(cells, pairs, values, count)


def fitted_to(
    cells: Cells, pairs: NDArray[np.int64], values: Array, count: int, rests: str = ""
) -> tuple[Array, Array]:
    """Cubics (m, count, 4, 6) through every other sample of m courses, and their strays (m, 2).

    Args:
        cells: the cells.
        pairs: (m, 2) which the courses, or parts of them, belong to.
        values: (2 parts + 1, m, 6) foot and normal at equal steps; brought up to date where the
            courses are smoother than the surface.
        count: number of cubics.
        rests: "last" where the courses are at rest at their last end, "both" at both.
    """
    parts = len(values) // 2
    fit, evaluate = _maps(count, parts, rests)
    cubics = fit @ values[::2].reshape(parts + 1, -1)
    off = (evaluate @ cubics).reshape(values.shape)
    smoothed = np.flatnonzero(cells.surface.smoothed(cells, pairs))
    if len(smoothed):
        # Least squares also cut corners along the facets, which takes nothing off the surface.
        closest_points = off[:, smoothed, :3].swapaxes(0, 1)
        places, normals = cells.surface.beneath(cells, pairs[smoothed], closest_points)
        values[:, smoothed] = np.concatenate([places, normals], axis=2).swapaxes(0, 1)
    off = off - values
    deviation = [np.sqrt((off[..., half] ** 2).sum(axis=2)).max(axis=0) for half in HALVES]
    # The surface's own normal is the one at the nearest point, which is not the sample, and may lie
    # to the side, where the surface bends more than along the course.
    moves = [np.sqrt((np.diff(values[..., half], axis=0) ** 2).sum(axis=2)) for half in HALVES]
    curvature = np.divide(moves[1], moves[0], out=np.zeros_like(moves[0]), where=moves[0] > 0.0)
    sharpest = SHARPER * cells.max_curvature[pairs].max(axis=1)
    sharpest[smoothed] = 0.0  # measured, to the side too
    deviation[1] = deviation[1] + np.maximum(curvature.max(axis=0), sharpest) * deviation[0]
    by_curve = cubics.reshape(count, 4, len(pairs), 6).transpose(2, 0, 1, 3)
    return by_curve, BETWEEN * np.stack(deviation, axis=1)


@cache
def _maps(count: int, parts: int, rests: str) -> tuple[Array, Array]:
    """From samples to cubics, and from cubics to values; both linear. See `fitted_to`.

    Returns:
        (4 count, parts + 1): coefficients of the least-squares spline of `count` pieces that keeps
        the first and the last sample; and (2 parts + 1, 4 count): its values at twice as many
        places.
    """
    design = _basis(count, np.linspace(0.0, 1.0, parts + 1))  # (parts + 1, count + 3)
    # End coefficients are the end samples, and so are their neighbours where the curve is at rest
    # there; the others fit what these leave.
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


def _joined(
    fitted: list[tuple[NDArray[np.int64], Array]], deviations: Array, creased: NDArray[np.bool_]
) -> CellCurves:
    """All courses in the order of the pairs, with their bends; the last fit of each counts."""
    counts, final = np.zeros((2, len(deviations)), dtype=np.int64)
    for turn, (some, cubics) in enumerate(fitted):
        counts[some], final[some] = cubics.shape[1], turn
    first = np.concatenate([[0], np.cumsum(counts)])
    joined = np.empty((first[-1], 4, 6))
    for turn, (some, cubics) in enumerate(fitted):
        kept = final[some] == turn
        joined[first[some[kept]][:, None] + np.arange(cubics.shape[1])] = cubics[kept]
    rests = np.zeros(len(joined), dtype=bool)
    for curve in np.flatnonzero(creased):
        legs = np.arange(first[curve], first[curve + 1]).reshape(LEGS, -1)
        rests[legs[1:, 0]] = rests[legs[:-1, -1]] = True
    square = np.repeat(counts, counts)[:, None] ** 2  # from s to t
    ends = [2.0 * joined[:, 2], 2.0 * joined[:, 2] + 6.0 * joined[:, 3]]
    derivative_bounds = np.stack(
        [np.max([np.linalg.norm(end[:, part], axis=1) for end in ends], axis=0) for part in HALVES],
        axis=1,
    )
    return CellCurves(first, joined, ROUNDING * square * derivative_bounds, deviations, rests)
