"""Polynomials over rectangles in Bernstein's basis: nets whose convex hull holds the values."""

from __future__ import annotations

from collections.abc import Iterator
from math import comb

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def span_matrix(knots: Array, degree: int, low: float, high: float) -> tuple[int, Array]:
    """From the coefficients of a spline to those of its polynomial over low..high in one span.

    A coefficient is the polar form at low, taken degree - j times, and high, taken j times; de
    Boor's recursion gives it.

    Returns:
        The first of the degree + 1 coefficients that count there, and the matrix
        (degree + 1, degree + 1).
    """
    span = int(np.searchsorted(knots, (low + high) / 2.0, side="right")) - 1
    first = span - degree
    matrix = np.empty((degree + 1, degree + 1))
    for j in range(degree + 1):
        rows = np.eye(degree + 1)
        for step in range(1, degree + 1):
            at = high if step <= j else low
            for i in range(span, span - degree + step - 1, -1):
                begin, end = knots[i], knots[i + degree + 1 - step]
                share = (at - begin) / (end - begin)
                k = i - first
                rows[k] = (1.0 - share) * rows[k - 1] + share * rows[k]
        matrix[j] = rows[degree]
    return first, matrix


def part_of(nets: Array, low: Array, high: Array, axis: int) -> Array:
    """The nets (k, ...) of the same polynomials over low..high (k,) of 0..1 along an axis >= 1.

    By de Casteljau: convex combinations, which lose no accuracy.
    """
    net = np.moveaxis(nets, axis, 1).copy()
    degree = net.shape[1] - 1
    shape = (-1,) + (1,) * (net.ndim - 2)
    upper = high.reshape(shape)[:, None]
    for step in range(1, degree + 1):  # 0..high
        net[:, step:] = (1.0 - upper) * net[:, step - 1 : -1] + upper * net[:, step:]
    share = np.divide(low, high, out=np.zeros_like(low), where=high > 0.0)
    lower = share.reshape(shape)[:, None]
    for step in range(1, degree + 1):  # and of that low..high
        net[:, : degree + 1 - step] = (1.0 - lower) * net[:, : degree + 1 - step] + lower * net[
            :, 1 : degree + 2 - step
        ]
    return np.moveaxis(net, 1, axis)


def derivative(nets: Array, axis: int) -> Array:
    """The nets of the derivatives along axis 1 or 2."""
    return np.asarray((nets.shape[axis] - 1) * np.diff(nets, axis=axis))


def product(one: Array, other: Array) -> Array:
    """The nets of products of polynomials (k, m, n, d) and (k, p, q, d); d may be 1 in either."""
    scaled = [net * _binomials(net)[..., None] for net in (one, other)]
    (k, m, n, _), (_, p, q, _) = one.shape, other.shape
    total = np.zeros((k, m + p - 1, n + q - 1, max(one.shape[3], other.shape[3])))
    for i, j in np.ndindex(m, n):
        total[:, i : i + p, j : j + q] += scaled[0][:, i : i + 1, j : j + 1] * scaled[1]
    return np.asarray(total / _binomials(total)[..., None])


def cross(one: Array, other: Array) -> Array:
    """The nets of vector products of (k, m, n, 3) and (k, p, q, 3)."""

    def minor(i: int, j: int) -> Array:
        return product(one[..., [i]], other[..., [j]]) - product(one[..., [j]], other[..., [i]])

    return np.concatenate([minor(1, 2), minor(2, 0), minor(0, 1)], axis=-1)


def abscissae(count: int) -> Array:
    """(count,) where in -1..1 the coefficients of x itself are."""
    return np.linspace(-1.0, 1.0, count) if count > 1 else np.zeros(1)


def _binomials(nets: Array) -> Array:
    """(m, n) products of binomial coefficients of a net's degrees."""

    def row(degree: int) -> Iterator[int]:
        return (comb(degree, k) for k in range(degree + 1))

    u, v = (np.array([*row(size - 1)], dtype=float) for size in nets.shape[1:3])
    return np.asarray(u[:, None] * v)
