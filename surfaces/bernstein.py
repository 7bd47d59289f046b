"""Polynomials in Bernstein's basis: nets whose convex hull holds the values.

A net has its coefficients along the first two axes, (m, n, ...) of degree m - 1 in x_1 and n - 1 in
x_2, both in -1..1; one coefficient along an axis is a constant there. Whatever follows belongs to
each coefficient: boxes, coordinates.
"""

from __future__ import annotations

from functools import cache
from math import comb

import numpy as np
from numpy.polynomial.chebyshev import chebvander

from coverable.arrays import Array


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


def along(matrix: Array, net: Array, axis: int) -> Array:
    """The net with a matrix (p, m) applied to its coefficients along axis 0 or 1.

    Line by line: one product of all would be shared out among threads, and wait for busy ones.
    """
    m, n = net.shape[:2]
    found = np.empty(((len(matrix), n) if axis == 0 else (m, len(matrix))) + net.shape[2:])
    lines, made = (each.reshape(*each.shape[:2], -1) for each in (net, found))
    if axis == 0:
        lines, made = lines.swapaxes(0, 1), made.swapaxes(0, 1)
    np.matmul(matrix, lines, out=made)
    return found


def product(one: Array, other: Array) -> Array:
    """The net of a product."""
    a, b = (net * _binomials(net) for net in (one, other))
    if a.shape[0] * a.shape[1] > b.shape[0] * b.shape[1]:
        a, b = b, a
    (m, n), (p, q) = a.shape[:2], b.shape[:2]
    size = np.broadcast_shapes(a.shape[2:], b.shape[2:])
    total = np.zeros((m + p - 1, n + q - 1, *size))
    for i, j in np.ndindex(m, n):
        total[i : i + p, j : j + q] += a[i, j] * b
    return np.asarray(total / _binomials(total))


def _binomials(net: Array) -> Array:
    """(m, n, 1, ...) products of the binomial coefficients of a net's degrees."""
    return _table(*net.shape[:2]).reshape(net.shape[:2] + (1,) * (net.ndim - 2))


@cache
def _table(m: int, n: int) -> Array:
    u, v = (np.array([comb(size - 1, k) for k in range(size)], dtype=float) for size in (m, n))
    return np.asarray(u[:, None] * v)


def alike(one: Array, other: Array) -> tuple[Array, Array]:
    """Both nets of the same degrees; constants stay what they are, and are broadcast."""
    nets = [one, other]
    for axis in (0, 1):
        size = max(net.shape[axis] for net in nets)
        nets = [
            net
            if net.shape[axis] in (1, size)
            else along(elevation(net.shape[axis], size), net, axis)
            for net in nets
        ]
    return nets[0], nets[1]


@cache
def elevation(size: int, to: int) -> Array:
    """(to, size) from coefficients to those of the same polynomial as of a higher degree."""
    matrix, more = np.zeros((to, size)), to - size
    for i in range(to):
        for j in range(max(0, i - more), min(size - 1, i) + 1):
            matrix[i, j] = comb(size - 1, j) * comb(more, i - j) / comb(to - 1, i)
    return matrix


@cache
def nodes(size: int) -> Array:
    """(size,) the zeros of Chebyshev's polynomial of that degree, rising."""
    return -np.cos(np.pi * (np.arange(size) + 0.5) / size)


def values_at(x: Array, size: int) -> Array:
    """(len(x), size) from coefficients to the values at places x in -1..1."""
    share = (1.0 + x[:, None]) / 2.0
    k = np.arange(size)
    each = np.array([comb(size - 1, i) for i in range(size)], dtype=float)
    return np.asarray(each * share**k * (1.0 - share) ** (size - 1 - k))


@cache
def to_chebyshev(size: int) -> Array:
    """(size, size) from coefficients to those of the sum of Chebyshev's polynomials."""
    at = nodes(size)
    return np.asarray(np.linalg.solve(chebvander(at, size - 1), values_at(at, size)), dtype=float)


@cache
def from_chebyshev(size: int) -> Array:
    """(size, size) the way back."""
    return np.asarray(np.linalg.inv(to_chebyshev(size)), dtype=float)


@cache
def nodes_to_powers(count: int) -> Array:
    """(count, count) from values at `nodes` to the coefficients of 1, x, x^2, ..."""
    return np.asarray(np.linalg.inv(np.vander(nodes(count), increasing=True)), dtype=float)


@cache
def to_nodes(size: int, count: int) -> Array:
    """(count, size) from coefficients to values at `nodes`."""
    return values_at(nodes(count), size)


@cache
def from_nodes(count: int) -> Array:
    """(count, count) from values at `nodes` to the coefficients of the polynomial through them."""
    return np.asarray(np.linalg.inv(values_at(nodes(count), count)), dtype=float)


@cache
def halves(size: int) -> Array:
    """(2 size, size) from coefficients to those of both halves."""
    parts = part_matrices(size - 1, np.array([0.0, 0.5]), np.array([0.5, 1.0]))
    return np.asarray(parts.reshape(2 * size, size))


def halved(net: Array) -> Array:
    """The coefficients of all quarters of a net, which are nearer to its values."""
    for axis in (0, 1):
        if net.shape[axis] > 1:
            net = along(halves(net.shape[axis]), net, axis)
    return net
