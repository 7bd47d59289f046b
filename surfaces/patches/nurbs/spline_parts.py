"""Bounds on parts of splines and NURBS: control points hold everything between them.

Over one span a spline is a polynomial; in Bernstein's basis its values are means of its
coefficients, with weights >= 0. The coefficients of an affine function lie on it. So what is left
of an affine model is no longer than it is at the longest coefficient. For a rational spline P / w
the left over (P - A w) / w is no longer than the largest ratio of coefficients of P - A w and w,
both of the degree of A w, as all of those of w are > 0.

The normal is along S_u x S_v, which is a polynomial too: N = P_u x P_v, or for a rational spline
N = w P_u x P_v + w_v P x P_u + w_u P_v x P, w^3 times it. A model of N gives one of N / |N|, see
`unit_model`.

A box of parameters is cut at the knots and, where that is not too dear, at its middle, which brings
the coefficients nearer to the values.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array
from surfaces.patches.affine_models import SpaceModel, unit_model
from surfaces.patches.nurbs.bernstein import (
    abscissae,
    changed,
    cross,
    derivative,
    elevated,
    part_matrices,
    product,
    span_matrix,
)
from surfaces.patches.nurbs.span_pieces import SpanPieces, pieces_of

_QUARTERED = 128  # coefficients of N, with more a box is not cut at its middle
_BLOCK = 300_000  # numbers held at a time, about
_ROUNDING = 1e-13  # [1] of the products that N is the sum of


class SpanNets(NamedTuple):
    """A spline as polynomials over its spans, U along u and V along v."""

    breaks: tuple[Array, Array]
    """(U + 1,) and (V + 1,) where spans end."""
    origin: Array
    """(3,) m, from which the points are counted, so that nothing cancels in N."""
    points: Array
    """(U V, p + 1, q + 1, 3) m, coefficients; those of w P where there are weights."""
    weights: Array | None
    """(U V, p + 1, q + 1, 1) of w; None where all are one."""
    normals: Array
    """(U V, ..., 3) of N."""
    rounding: Array
    """(U V,) how wrong the coefficients of N may be."""


def span_nets(
    points: Array,
    weights: Array | None,
    knots: tuple[Array, Array],
    degree: tuple[int, int],
    breaks: tuple[Array, Array],
) -> SpanNets:
    """See `SplineMap` for the arguments, all but `breaks`: where its smooth spans begin and end."""
    origin = points.mean(axis=(0, 1))
    net = points - origin
    if weights is not None:
        net = np.concatenate([weights[..., None] * net, weights[..., None]], axis=-1)
    by_u, by_v = (
        [span_matrix(knots[axis], degree[axis], *ends) for ends in pairwise(breaks[axis])]
        for axis in (0, 1)
    )
    p, q = degree
    nets = np.array(
        [
            np.einsum("ab,cd,bdx->acx", a, c, net[i : i + p + 1, j : j + q + 1])
            for i, a in by_u
            for j, c in by_v
        ]
    )
    own, w = nets[..., :3], (None if weights is None else nets[..., 3:])
    normals, rounding = _normal_nets(own, w)
    # Derivatives by 0..1 of each span, to those by parameters, which do not jump between spans.
    sides = [np.diff(line) / (line[-1] - line[0]) for line in breaks]
    area = np.outer(*sides).ravel()
    return SpanNets(breaks, origin, own, w, normals / area[:, None, None, None], rounding / area)


def _normal_nets(points: Array, weights: Array | None) -> tuple[Array, Array]:
    """The nets of N over 0..1 of each span, and how wrong they may be."""
    by_u, by_v = derivative(points, 1), derivative(points, 2)
    if weights is None:
        return cross(by_u, by_v), _ROUNDING * _largest(by_u) * _largest(by_v)
    w_u, w_v = derivative(weights, 1), derivative(weights, 2)
    net = (
        product(weights, cross(by_u, by_v))
        + product(w_v, cross(points, by_u))
        + product(w_u, cross(by_v, points))
    )
    size = (
        _largest(weights) * _largest(by_u) * _largest(by_v)
        + _largest(w_v) * _largest(points) * _largest(by_u)
        + _largest(w_u) * _largest(points) * _largest(by_v)
    )
    return net, _ROUNDING * size


def _largest(nets: Array) -> Array:
    """(k,) the longest coefficient of each net."""
    return np.asarray(np.linalg.norm(nets, axis=-1).max(axis=(1, 2)))


def spline_models(nets: SpanNets, low: Array, high: Array) -> tuple[SpaceModel, SpaceModel]:
    """Bounds on points and normals over boxes of parameters (k, 2)."""
    entries = nets.normals[0].size + 2 * nets.points[0].size
    step = max(1, _BLOCK // (4 * entries))
    blocks = [
        _models(nets, low[first : first + step], high[first : first + step])
        for first in range(0, len(low), step)
    ]
    points, normals = (_joined(models) for models in zip(*blocks, strict=True))
    return points._replace(centre=points.centre + nets.origin), normals


def _joined(models: Sequence[SpaceModel]) -> SpaceModel:
    """Models one after the other."""
    columns = zip(*(model[:4] for model in models), strict=True)
    centre, slopes, error, along = map(np.concatenate, columns)
    return SpaceModel(centre, slopes, error, along)


def _models(nets: SpanNets, low: Array, high: Array) -> tuple[SpaceModel, SpaceModel]:
    """Of boxes that are few enough to be held at a time."""
    quartered = nets.normals[0].size <= 3 * _QUARTERED
    pieces = pieces_of(nets.breaks, low, high, quartered)

    def cut(net: Array) -> Array:
        by_u, by_v = (
            part_matrices(net.shape[1 + axis] - 1, pieces.low[:, axis], pieces.high[:, axis])
            for axis in (0, 1)
        )
        return changed(net[pieces.span], by_u, by_v)

    points = cut(nets.points)
    weights = None if nets.weights is None else cut(nets.weights)
    place = _Fit.of(pieces, points, weights)
    points_model = SpaceModel(place.centre, place.slopes, place.longest(), place.along())
    return points_model, _unit_normals(pieces, cut(nets.normals), nets.rounding)


def _unit_normals(pieces: SpanPieces, net: Array, rounding: Array) -> SpaceModel:
    """From the nets (j, m, n, 3) of N of each piece, and what is wrong with those of spans.

    N is divided by an affine function first, that is nearly its length: the direction is the same,
    and where only the length of N changes nothing is left.
    """
    long = _least_squares(pieces, net)
    size = np.maximum(np.linalg.norm(long[:, 0], axis=1), 1e-300)
    length = np.einsum("kad,kd->ka", long, long[:, 0]) / size[:, None]
    least = length[:, 0] - np.abs(length[:, 1:]).sum(axis=1)
    known = least > 1e-6 * size
    length[~known] = [1.0, 0.0, 0.0]
    fit = _Fit.of(pieces, net, pieces.affine(length[..., None]))
    own = np.maximum(np.linalg.norm(fit.centre, axis=1), 1e-300)[:, None]
    wrong = np.maximum.reduceat(rounding[pieces.span], pieces.starts)
    wrong = np.where(known, wrong / np.where(known, least, 1.0), np.inf)
    ahead, across = fit.split(fit.centre / own)
    unit = unit_model(fit.centre, fit.slopes, ahead + wrong, across + wrong)
    return SpaceModel(*unit, fit.along() + (unit[1] ** 2).sum(axis=2) / 4.0)


class _Fit(NamedTuple):
    """An affine model of each box, and the coefficients of what it leaves of the pieces."""

    pieces: SpanPieces
    centre: Array
    """(k, 3)"""
    slopes: Array
    """(k, 2, 3)"""
    left: Array
    """(j, m, n, 3)"""

    @staticmethod
    def of(pieces: SpanPieces, net: Array, weights: Array | None) -> _Fit:
        """Least squares over the coefficients, the middle moved between the extremes.

        Args:
            pieces: j of them.
            net: (j, m, n, 3) of what is to be modelled, or of w times it.
            weights: (j, p, q, 1) of w > 0; None where it is one.
        """
        w = np.ones(1)
        if weights is not None:
            (_, m, n, _), (_, p, q, _) = net.shape, weights.shape
            degree = max(m - 1, p), max(n - 1, q)
            net, w = elevated(net, degree), elevated(weights, degree)
        values = net / w
        best = _least_squares(pieces, values)
        off = values - pieces.affine(best, *net.shape[1:3])
        flat = off.reshape(len(off), -1, 3).transpose(0, 2, 1).copy()  # quick to run along
        low = np.minimum.reduceat(flat.min(axis=2), pieces.starts)
        high = np.maximum.reduceat(flat.max(axis=2), pieces.starts)
        shift = (low + high) / 2.0
        best[:, 0] += shift
        if weights is None:
            left = off - shift[pieces.box][:, None, None]
        else:
            left = (net - elevated(product(pieces.affine(best), weights), degree)) / w
        return _Fit(pieces, best[:, 0], best[:, 1:], left)

    def longest(self) -> Array:
        """(k,) of what is left."""
        return self._most(_lengths(self.left))

    def along(self) -> Array:
        """(k, 2) what of it comes from each axis."""
        means = [
            np.linalg.norm(self.left.mean(axis=2 - axis), axis=-1).max(axis=1) for axis in (0, 1)
        ]
        return np.stack([np.maximum.reduceat(m, self.pieces.starts) for m in means], axis=1)

    def split(self, axis: Array) -> tuple[Array, Array]:
        """(k,) its largest share along unit vectors (k, 3), and square to them."""
        own = axis[self.pieces.box]
        share = np.einsum("jmnd,jd->jmn", self.left, own)
        beside = self.left - share[..., None] * own[:, None, None]
        return self._most(np.abs(share)), self._most(_lengths(beside))

    def _most(self, values: Array) -> Array:
        most = values.reshape(len(values), -1).max(axis=1)
        return np.asarray(np.maximum.reduceat(most, self.pieces.starts))


def _lengths(vectors: Array) -> Array:
    """(...,) of vectors (..., 3)."""
    return np.asarray(np.sqrt(np.einsum("...d,...d->...", vectors, vectors)))


def _least_squares(pieces: SpanPieces, values: Array) -> Array:
    """(k, 3, 3) for each box the affine function, 1, x_1, x_2, nearest to values (j, m, n, 3)."""
    (_, m, n, _), starts = values.shape, pieces.starts
    x, y = abscissae(m), abscissae(n)
    basis = np.stack([np.ones(m * n), np.repeat(x, n), np.tile(y, m)])
    sums = basis @ values.reshape(len(values), m * n, 3)
    at = np.concatenate([np.ones((len(values), 1)), pieces.middle], axis=1)
    right = sums * np.insert(pieces.half, 0, 1.0, 1)[..., None]
    right[:, 1:] += pieces.middle[..., None] * sums[:, :1]
    square = m * n * at[:, :, None] * at[:, None, :]
    square[:, [1, 2], [1, 2]] += pieces.half**2 * [n * (x @ x), m * (y @ y)]
    square = np.add.reduceat(square, starts)
    square += 1e-12 * square[:, :1, :1] * np.eye(3)
    return np.asarray(np.linalg.solve(square, np.add.reduceat(right, starts)))
