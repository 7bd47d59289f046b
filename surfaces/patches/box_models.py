"""Affine models of points and normals over boxes of parameters, from enclosures of both.

The model is made of Chebyshev's polynomials of first degree; what is left is no longer than its
longest coefficient over any quarter of the box, where Bernstein's coefficients are near to the
values, and what the enclosure itself may be off. A box across lines where a patch is not smooth is
cut there (`Pieces`), and its model holds those of all pieces.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from surfaces import bernstein
from surfaces.enclosure_functions import Enclosure
from surfaces.parts import PartModels

Formula = Callable[[Enclosure, Enclosure], tuple[Enclosure, Enclosure]]
"""u and v -> points and normals."""

COLUMNS = (slice(0, 3), slice(3, 6))  # of points, and of normals
CORNERS = ((1, 1), (1, -1), (-1, 1), (-1, -1))
SMALLEST = 1e-300
MOST_TWIST = 1.0 - 1e-6  # [1] of shares of slopes, so that no corner becomes straight
FEW = 7  # coefficients along each parameter that are looked at as they are


class VectorModel(NamedTuple):
    """Vectors over k boxes: |f - (centre + x_1 e_1 + x_2 e_2 + x_1 x_2 t)| <= radius."""

    centre: Array
    """(k, 3)"""
    slopes: Array
    """(k, 2, 3) e_1 and e_2."""
    radius: Array
    """(k,)"""
    along: Array
    """(k, 2) which share of the radius comes from each parameter; see `PartModels`."""
    twist: Array
    """(k, 3) t."""

    @staticmethod
    def of(vectors: Enclosure, twisted: bool = False) -> VectorModel:
        """From an enclosure (k, 3); t is 0 unless `twisted`.

        Twisted, t is a sum of shares of the slopes, whose absolute values are at most 1 together:
        then the model fills a flat convex quadrilateral.
        """
        vectors = vectors.lower(FEW)
        terms = vectors.net
        for axis in (0, 1):
            terms = bernstein.along(bernstein.to_chebyshev(terms.shape[axis]), terms, axis)
        count = vectors.shape[0]
        full = np.zeros((max(2, terms.shape[0]), max(2, terms.shape[1]), count, 3))
        full[: terms.shape[0], : terms.shape[1]] = terms
        centre, slopes = full[0, 0].copy(), np.stack([full[1, 0], full[0, 1]], axis=1)
        twist = _in_plane(slopes, full[1, 1]) if twisted else np.zeros((count, 3))
        ends = np.zeros((2, 2, count, 3))
        for i, j in np.ndindex(2, 2):
            a, b = 2 * i - 1, 2 * j - 1
            ends[i, j] = centre + a * slopes[:, 0] + b * slopes[:, 1] + a * b * twist
        left, affine = bernstein.alike(vectors.net, ends)
        left = bernstein.halved(left - affine)
        shift = 0.5 * (left.min(axis=(0, 1)) + left.max(axis=(0, 1)))
        radius = _lengths(left - shift).max(axis=(0, 1)) + _lengths(vectors.radius)
        full[0, 0] = full[1, 0] = full[0, 1] = 0.0
        full[1, 1] -= twist
        each = _lengths(full)
        mixed = 0.5 * each[1:, 1:].sum(axis=(0, 1))
        by_axis = [each[:, 0].sum(axis=0) + mixed, each[0].sum(axis=0) + mixed]
        return VectorModel(centre + shift, slopes, radius, np.stack(by_axis, axis=1), twist)


def _lengths(vectors: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("...d,...d->...", vectors, vectors)))


def _in_plane(slopes: Array, twist: Array) -> Array:
    """(k, 3) what of t (k, 3) the slopes (k, 2, 3) span."""
    square = slopes @ slopes.transpose(0, 2, 1) + SMALLEST * np.eye(2)
    with np.errstate(all="ignore"):
        right = slopes @ twist[..., None]
        det = square[:, 0, 0] * square[:, 1, 1] - square[:, 0, 1] * square[:, 1, 0]
        turned = np.stack([
            square[:, 1, 1] * right[:, 0, 0] - square[:, 0, 1] * right[:, 1, 0],
            square[:, 0, 0] * right[:, 1, 0] - square[:, 1, 0] * right[:, 0, 0],
        ], axis=1)  # fmt: skip
        shares = turned / det[:, None]
        shares /= np.maximum(np.abs(shares).sum(axis=1, keepdims=True) / MOST_TWIST, 1.0)
    shares = np.where(np.isfinite(shares).all(axis=1, keepdims=True), shares, 0.0)
    return np.asarray(np.einsum("ks,ksd->kd", shares, slopes))


def over_boxes(
    formula: Formula, low: Array, high: Array, twisted: bool = False
) -> tuple[PartModels, Array]:
    """Models over boxes of parameters (k, 2) within which a formula is smooth, and t (k, 3).

    Example:
        >>> ball = lambda u, v: (np.stack([u, v, u * v], axis=-1), np.stack([u, v, 1.0], axis=-1))
        >>> models, _ = over_boxes(ball, np.zeros((1, 2)), np.full((1, 2), 0.5))
        >>> models.radius.round(9).tolist()
        [[0.0625, 0.0]]
    """
    with np.errstate(all="ignore"):  # what is not known is infinite
        variables = (Enclosure.variable(low[:, axis], high[:, axis], axis) for axis in (0, 1))
        points, normals = formula(*variables)
        one = VectorModel.of(points, twisted)
        other = one if normals is points else VectorModel.of(normals)
    joined = [np.concatenate(two, axis=-1) for two in zip(one[:2], other[:2], strict=True)]
    beside = [np.stack(two, axis=-1) for two in zip(one[2:4], other[2:4], strict=True)]
    return PartModels(*joined, *beside), one.twist


class Pieces(NamedTuple):
    """What of k boxes lies between the lines at which a patch is not smooth, box by box."""

    box: Ints
    """(j,) the box of each piece."""
    low: Array
    """(j, 2)"""
    high: Array
    """(j, 2)"""
    starts: Ints
    """(k,) where each box's pieces begin."""

    @staticmethod
    def of(breaks: tuple[Array, Array], low: Array, high: Array) -> Pieces:
        """Cut boxes (k, 2) at some values of u and of v, rising."""
        first, count = np.empty((2, 2, len(low)), dtype=np.int64)
        lines = [np.concatenate([[-np.inf], line, [np.inf]]) for line in breaks]
        for axis, line in enumerate(lines):
            first[axis], last = (
                np.clip(found - 1, 0, len(line) - 2)  # NaN lies anywhere
                for found in (
                    np.searchsorted(line, low[:, axis], "right"),
                    np.searchsorted(line, high[:, axis], "left"),
                )
            )
            count[axis] = np.maximum(last - first[axis], 0) + 1
        total = count.prod(axis=0)
        starts = np.cumsum(total) - total
        box = np.repeat(np.arange(len(low)), total)
        number = np.arange(len(box)) - starts[box]
        begin, stop = low[box], high[box]
        for axis, line in enumerate(lines):
            span = np.divmod(number, count[1][box])[axis] + first[axis][box]
            begin[:, axis] = np.maximum(begin[:, axis], line[span])
            stop[:, axis] = np.minimum(stop[:, axis], line[span + 1])
        return Pieces(box, begin, np.maximum(begin, stop), starts)

    def merged(self, models: PartModels, low: Array, high: Array) -> PartModels:
        """Models of the boxes from those of all their pieces."""
        box, half = self.box, np.maximum(0.5 * (high - low), SMALLEST)
        middle = ((self.low + self.high - low[box] - high[box]) / 2.0 / half[box])[..., None]
        width = ((self.high - self.low) / 2.0 / half[box])[..., None]
        share = width.prod(axis=1) + SMALLEST
        share = share / np.add.reduceat(share, self.starts)[box]
        own = np.where(width > 0.0, models.slopes / np.maximum(width, SMALLEST), 0.0)
        slopes = np.add.reduceat(share[..., None] * own, self.starts)
        off = models.centre - (middle * slopes[box]).sum(axis=1)
        turn = models.slopes - width * slopes[box]
        lean = np.abs(turn).sum(axis=1)
        lowest = np.minimum.reduceat(off - lean, self.starts)
        centre = (lowest + np.maximum.reduceat(off + lean, self.starts)) / 2.0
        corners = [off - centre[box] + a * turn[:, 0] + b * turn[:, 1] for a, b in CORNERS]
        radius, along = np.empty((len(low), 2)), np.empty((len(low), 2, 2))
        for column, some in enumerate(COLUMNS):
            most = np.max([_lengths(corner[:, some]) for corner in corners], axis=0)
            radius[:, column] = np.maximum.reduceat(most + models.radius[:, column], self.starts)
            bent = _lengths(turn[..., some]) + models.along[..., column]
            bent += (width[..., 0] < 1.0) * _lengths((off - centre[box])[:, some])[:, None]
            along[..., column] = np.maximum.reduceat(bent, self.starts)
        return PartModels(centre, slopes, radius, along)
