"""CellCurves: the smooth curves between neighbouring cell centres, with known derivatives.

Whatever the surface is, a motion from cell to cell follows one of these curves: the point f(t) on
the surface and its unit normal n(t), t from 0 to 1, each a piecewise cubic that is twice
continuously differentiable. The target at standoff h is f + h n. What certificates need is then at
hand: |f''| and |n''| are largest at the ends of the pieces, because second derivatives of cubics
are straight lines. `surfaces.curve_fitting` fits them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from coverable.arrays import Array, Ints, Mask, Protected

STOPPED = 1e-3  # [1] a parallel curve this much slower than the curve counts as stopped
PLACES = 3  # along a piece, where its slopes are computed


@dataclass(frozen=True, eq=False, slots=True)
class CellCurves(Protected):
    """One curve for each of M neighbouring pairs (i, j) of cells, from centre i to centre j."""

    first: Ints
    """(M + 1,) where each curve's pieces begin, equal shares of t, and the end of the last."""
    cubics: Array
    """(P, 4, 6) coefficients of 1, s, s^2, s^3 of point (m) and normal; s in 0..1 on the piece."""
    derivative_bounds: Array
    """(P, 2) largest |f''| (m) and |n''| on each piece, differentiated by t."""
    deviations: Array
    """(M, 2) how far point (m) and normal (1) deviate from the surface's own, at most."""
    rests: Mask
    """(P,) pieces at an end of which the point is at rest, next to a crease."""
    leans: Array
    """(M,) at an inner crease, how far its two normals are from the one between them; 0 elsewhere.
    There the target stays where it is while the normal turns: the middle two of four legs."""

    def __len__(self) -> int:
        """Number of curves."""
        return len(self.first) - 1

    def moved(self, rotation: Array, translation: Array) -> CellCurves:
        """The same curves after the rigid motion x -> rotation x + translation, up to rounding."""
        halves = self.cubics.reshape(-1, 4, 2, 3) @ rotation.T
        halves[:, 0, 0] += translation
        return replace(self, cubics=halves.reshape(-1, 4, 6))

    def at(self, curves: Ints, t: Array) -> tuple[Array, Array]:
        """Point (k, 3) m and normal (k, 3) at t (k,) of some curves (k,)."""
        first = self.first[curves]
        count = self.first[curves + 1] - first
        along = t * count
        piece = np.minimum(np.maximum(np.floor(along), 0), count - 1).astype(np.int64)
        s = along - piece
        square = s * s
        powers = np.stack([np.ones(len(s)), s, square, square * s], axis=1)
        values = np.einsum("kp,kpd->kd", powers, self.cubics.take(first + piece, axis=0))
        return values[:, :3], values[:, 3:]

    def folds(self, height: float) -> Mask:
        """(M,) where the parallel curve at a signed height (m) runs backwards or stops.

        There the height reaches the radius of curvature on the concave side, and the offset surface
        folds: no tool can follow it.
        """
        folded = np.zeros(len(self.cubics), dtype=bool)
        for point, normal in self._slopes_along():
            onward = ((point + height * normal) * point).sum(axis=1)
            square = (point**2).sum(axis=1)
            # On an edge the normal turns on the spot: nothing runs backwards there.
            folded |= ~((onward > STOPPED * square) | (square == 0.0))
        folded &= ~self._turning
        return np.logical_or.reduceat(folded, self.first[:-1]) if len(self) else folded

    def curvature(self, height: float) -> Array:
        """(P,) 1/m, how fast the normal turns for each metre that the target travels, at most.

        Args:
            height: signed height of the target over the surface, m.
        """
        fastest = np.zeros(len(self.cubics))
        for point, normal in self._slopes_along():
            speed = np.linalg.norm(point + height * normal, axis=1)
            turn = np.linalg.norm(normal, axis=1)
            none = np.where(turn > 0.0, np.inf, 0.0)  # it turns on the spot, or not at all
            rate = np.divide(turn, speed, out=none, where=speed > 0.0)
            fastest = np.maximum(fastest, rate)
        return np.where(self._turning, 0.0, fastest)

    @property
    def _turning(self) -> Mask:
        """(P,) pieces along which the target stays where it is."""
        count = np.diff(self.first)
        at = 4 * (np.arange(len(self.cubics)) - np.repeat(self.first[:-1], count))
        middle = (at >= np.repeat(count, count)) & (at < np.repeat(3 * count, count))
        return np.asarray(middle & np.repeat(self.leans > 0.0, count))

    def _slopes_along(self) -> Iterator[tuple[Array, Array]]:
        """Derivatives by s of point and normal (P, 3), at places along every piece.

        Where a curve is at rest at an end of a piece, both are the differences over the piece.
        """
        resting = np.flatnonzero(self.rests)
        differences = self.cubics[resting, 1:].sum(axis=1)
        for s in np.linspace(0.0, 1.0, PLACES):
            slope = slopes_of(self.cubics, s)
            slope[resting] = differences
            yield slope[:, :3], slope[:, 3:]

    @property
    def creased(self) -> Mask:
        """(M,) curves over a crease of a mesh, which come to rest at its strip."""
        if not self.rests.any():
            return np.zeros(len(self), dtype=bool)
        return np.logical_or.reduceat(self.rests, self.first[:-1])


def slopes_of(cubics: Array, s: float) -> Array:
    """(..., 6) derivatives by s of point and normal of cubics (..., 4, 6)."""
    b, c, d = (cubics[..., power, :] for power in (1, 2, 3))
    return np.asarray(b + 2.0 * s * c + 3.0 * s * s * d)
