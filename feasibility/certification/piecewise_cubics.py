"""Curves of cubic pieces: their values, and the places on them that are nearest to given points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints

GUESSES = 4  # parameters tried first on each piece of a curve
NEWTON_STEPS = 16  # from the best of them, at most
CONVERGED = 1e-7  # [1] of a curve: a step this small is the last
BLOCK = 4096  # points at once, to bound the memory
SAMPLES = np.array([0.07, 0.29, 0.51, 0.73, 0.94])  # on each part; no fit has used them


class Pieces(NamedTuple):
    """Where k parameters are."""

    piece: Ints
    """(k,) row of the cubics."""
    s: Array
    """(k,) 0..1 on the piece."""
    number: Ints
    """(k,) of pieces of the curve."""


class PiecewiseCubics(NamedTuple):
    """M curves in d dimensions, each with a parameter t from 0 to 1 and pieces of equal length."""

    first: Ints
    """(M + 1,) where each curve's pieces begin, and the end of the last."""
    cubics: Array
    """(P, 4, d) coefficients of 1, s, s^2, s^3, s in 0..1 on the piece."""

    def pieces(self, curve: Ints, t: Array) -> Pieces:
        """The pieces of some curves (k,) that t (k,) falls into."""
        first = self.first[curve]
        count = self.first[curve + 1] - first
        along = t * count
        piece = np.minimum(np.maximum(along.astype(np.int64), 0), count - 1)
        return Pieces(first + piece, along - piece, count)

    def at(self, curve: Ints, t: Array) -> Array:
        """(k, d) values of some curves (k,) at t (k,)."""
        piece, s, _ = self.pieces(curve, t)
        square = s * s
        powers = np.stack([np.ones(len(s)), s, square, square * s], axis=1)
        return np.asarray(np.einsum("kp,kpd->kd", powers, self.cubics[piece]))

    def _with_slopes(self, curve: Ints, t: Array) -> tuple[Array, Array]:
        """`at`, by coordinate (d, k), and the derivatives by t."""
        piece, s, count = self.pieces(curve, t)
        a, b, c, d = self.cubics.take(piece, axis=0).transpose(1, 2, 0)
        cubic, square = s * d, s * c
        slope = b + square + square + 3.0 * s * cubic
        return a + s * (b + square + s * cubic), slope * count

    def nearest(self, curve: Ints, points: Array) -> Array:
        """(k,) t of the place on each of some curves (k,) that is closest to a point (k, d)."""
        t, counts = self._guesses(curve, points), self.first[curve + 1] - self.first[curve]
        # Newton's steps, shortened where one leads away: they overshoot where a curve stops.
        left, width = np.arange(len(t)), 1.0 / (GUESSES * counts)
        wanted, here_t, here_curve = points.T, t.copy(), curve
        off, slope = self._with_slopes(curve, t)
        off -= wanted
        for _ in range(NEWTON_STEPS):
            square = _square(slope)
            step = (off * slope).sum(axis=0)
            step = np.divide(step, square, out=np.zeros(len(left)), where=square > 0.0)
            step = np.minimum(np.maximum(step, -width), width)
            tried_t = np.minimum(np.maximum(here_t - step, 0.0), 1.0)
            there, there_slope = self._with_slopes(here_curve, tried_t)
            there -= wanted
            nearer = _square(there) < _square(off)
            here_t = np.where(nearer, tried_t, here_t)
            off, slope = np.where(nearer, there, off), np.where(nearer, there_slope, slope)
            t[left] = here_t
            width = np.where(nearer, width, 0.25 * np.abs(step))
            open_ = np.flatnonzero(np.abs(step) > CONVERGED)
            if len(open_) == 0:
                break
            left, here_curve = left[open_], here_curve[open_]
            here_t, width = here_t[open_], width[open_]
            off, slope, wanted = (a[:, open_] for a in (off, slope, wanted))
        return t

    def _guesses(self, curve: Ints, points: Array) -> Array:
        """(k,) t on each curve of the closest of a few places."""
        t, counts = np.empty(len(curve)), self.first[curve + 1] - self.first[curve]
        for count in np.unique(counts):
            alike = np.flatnonzero(counts == count)
            # Not where two pieces join: a curve may stop there, where Newton's method fails.
            inner = (np.arange(GUESSES * count) + 0.5) / (GUESSES * count)
            grid = np.concatenate([[0.0], inner, [1.0]])
            used, which = np.unique(curve[alike], return_inverse=True)
            along = self.at(np.repeat(used, len(grid)), np.tile(grid, len(used)))
            tried = along.reshape(len(used), len(grid), -1)
            for first in range(0, len(alike), BLOCK):
                some = slice(first, first + BLOCK)
                away = tried[which[some]].transpose(2, 0, 1) - points[alike[some]].T[:, :, None]
                t[alike[some]] = grid[np.argmin(_square(away), axis=1)]
        return t


def samples(count: Ints) -> tuple[Ints, Array]:
    """Samples of curves with so many parts (k,) each: which of the curves, and t on it."""
    owner = np.repeat(np.arange(len(count)), count)
    part = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    t = ((part[:, None] + SAMPLES) / count[owner][:, None]).reshape(-1)
    return np.repeat(owner, len(SAMPLES)), t


def _square(a: Array) -> Array:
    """(...,) sums of squares of (d, ...); numpy's own sums are slow over three numbers."""
    total = a[0] * a[0]
    for one in a[1:]:
        total += one * one
    return total
