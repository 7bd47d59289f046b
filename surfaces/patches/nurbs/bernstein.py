"""Polynomials over rectangles in Bernstein's basis: nets whose convex hull holds the values."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from math import comb

import numpy as np

from coverable_arrays import Array


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


def part_matrices(degree: int, low: Array, high: Array) -> Array:
    """(k, degree + 1, degree + 1) from coefficients over 0..1 to those over low..high (k,) of it.

    By de Casteljau: the rows are convex combinations, which lose no accuracy.
    """
    rows = np.broadcast_to(np.eye(degree + 1), (len(low), degree + 1, degree + 1)).copy()
    upper = high[:, None, None]
    for step in range(1, degree + 1):  # 0..high
        rows[:, step:] = (1.0 - upper) * rows[:, step - 1 : -1] + upper * rows[:, step:]
    lower = np.divide(low, high, out=np.zeros_like(low), where=high > 0.0)[:, None, None]
    for last in range(degree, 0, -1):  # and of that low..high
        rows[:, :last] = (1.0 - lower) * rows[:, :last] + lower * rows[:, 1 : last + 1]
    return rows


def changed(nets: Array, by_u: Array, by_v: Array) -> Array:
    """The nets (k, m, n, d) with matrices (k, p, m) or (p, m), and (k, q, n) or (q, n), applied."""
    k, m, n, d = nets.shape
    rows = (by_u @ nets.reshape(k, m, n * d)).reshape(k, -1, n, d)
    return np.asarray((by_v[:, None] if by_v.ndim == 3 else by_v) @ rows)


@cache
def elevation(degree: int, to: int) -> Array:
    """(to + 1, degree + 1) from coefficients to those of the same polynomial as of degree `to`."""
    matrix = np.zeros((to + 1, degree + 1))
    for i in range(to + 1):
        for j in range(max(0, i - to + degree), min(degree, i) + 1):
            matrix[i, j] = comb(degree, j) * comb(to - degree, i - j) / comb(to, i)
    return matrix


def elevated(nets: Array, degree: tuple[int, int]) -> Array:
    """The same polynomials as of a higher degree, or the same."""
    own = nets.shape[1] - 1, nets.shape[2] - 1
    if own == degree:
        return nets
    return changed(nets, elevation(own[0], degree[0]), elevation(own[1], degree[1]))


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
