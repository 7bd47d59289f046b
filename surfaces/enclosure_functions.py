"""NumPy's functions over boxes: what is made of polynomials with a radius.

**Quotients and roots** are interpolated at Chebyshev's nodes, by some Q, and tested: a / b - Q is
(a - Q b) / b, and sqrt(f) - Q is (f - Q^2) / (sqrt(f) + Q), both quotients of polynomials. With
coefficients r of the one and s > 0 of the other, of the same degree, such a quotient is no larger
than the largest |r| / s, as both are means with the same weights.

**Other functions** g of a value in an interval are interpolated there, too, by a cubic p of it. If
the fourth and the fifth derivative have one sign each, (g - p) / prod(t - t_i) is a divided
difference, monotone in t, and the product is largest at the ends, so that |g - p| is largest at an
end. For sines, and polynomials of n coefficients, it is at most 2 (w / 2)^n / n! times the n-th
derivative, w half the interval.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from coverable.arrays import Array, Mask
from surfaces import bernstein
from surfaces.enclosures import (
    FUNCTIONS,
    KEPT,
    MOST,
    ROUNDING,
    UFUNCS,
    Enclosure,
    enclosed,
)

WIDE = 1.2  # rad, half an interval over which sines are taken for cubics
WIDER = 6  # coefficients that they have over wider ones
UNEVEN = 4.0  # [1] the largest coefficient of a divisor beside the least, where quarters say more
SMALLEST = 1e-150


def _add(a: Any, b: Any) -> Enclosure:
    a, b = enclosed(a), enclosed(b)
    one, other = bernstein.alike(a.net, b.net)
    size = a.size + b.size
    return Enclosure(one + other, a.radius + b.radius + ROUNDING * size)


def _negative(a: Enclosure) -> Enclosure:
    return Enclosure(-a.net, a.radius)


def _times(a: Any, b: Any) -> Enclosure:
    a, b = enclosed(a), enclosed(b)
    if any(m + n - 1 > MOST for m, n in zip(a.net.shape[:2], b.net.shape[:2], strict=True)):
        a, b = a.lower(), b.lower()
    size = a.size * b.size
    radius = a.size * b.radius + b.size * a.radius + a.radius * b.radius + 8 * ROUNDING * size
    unknown = ~(np.isfinite(a.radius) & np.isfinite(b.radius))
    return Enclosure(bernstein.product(a.net, b.net), np.where(unknown, np.inf, radius))


def _square(a: Any) -> Enclosure:
    return _times(a, a)


def _divided(a: Any, b: Any) -> Enclosure:
    if not isinstance(b, Enclosure):
        return _times(a, 1.0 / np.asarray(b, dtype=float))
    a = enclosed(a)
    sign = np.where(b.ends[1] < 0.0, -1.0, 1.0)
    a, b = _times(a, sign), _times(b, sign)

    def ratio(one: Array, other: Array) -> Array:
        return one / np.where(other == 0.0, 1.0, other)

    quotient = _interpolated(ratio, a, b)
    left = _add(Enclosure(a.net), _negative(_plain_product(quotient, b.net)))
    known = a.radius + _size(quotient) * b.radius + left.radius
    r, s = bernstein.alike(left.net, b.net)
    if (s.max(axis=(0, 1)) > UNEVEN * s.min(axis=(0, 1))).any():
        r, s = bernstein.halved(r), bernstein.halved(s)
    return Enclosure(quotient, _largest_ratio(r, known, s, -b.radius))


def _size(net: Array) -> Array:
    return np.asarray(np.abs(net).max(axis=(0, 1)))


def _plain_product(one: Array, other: Array) -> Enclosure:
    size = _size(one) * _size(other)
    return Enclosure(bernstein.product(one, other), 8 * ROUNDING * size)


def _largest_ratio(r: Array, more: Array, s: Array, less: Array) -> Array:
    """(k, ...) bounds of (|r| + more) / (s + less) of nets r and s; inf unless s + less > 0."""
    r, s = bernstein.alike(r, s)
    below = s + less
    found = ((np.abs(r) + more) / below).max(axis=(0, 1))
    known = (below > 0.0).all(axis=(0, 1)) & np.isfinite(found)
    return np.where(known, found, np.inf)


def _interpolated(function: Callable[..., Array], *given: Enclosure) -> Array:
    """The net of the polynomial through the values of a function, at `bernstein.nodes`."""
    counts = [KEPT if max(x.net.shape[axis] for x in given) > 1 else 1 for axis in (0, 1)]
    values = []
    for x in given:
        net = x.net
        for axis in (0, 1):
            if net.shape[axis] > 1:
                net = bernstein.along(bernstein.to_nodes(net.shape[axis], KEPT), net, axis)
        values.append(net)
    net = function(*values)
    for axis in (0, 1):
        if counts[axis] > 1:
            net = bernstein.along(bernstein.from_nodes(KEPT), net, axis)
    return net


def _sqrt(f: Enclosure) -> Enclosure:
    low, high = (np.sqrt(np.maximum(end, 0.0)) for end in f.ends)
    net = _interpolated(lambda values: np.sqrt(np.maximum(values, 0.0)), f)
    left = _add(f, _negative(_plain_product(net, net)))
    radius = _largest_ratio(left.net, left.radius, net, low)
    whole = Enclosure.between(low, high)
    return _closer(Enclosure(net, radius), whole)


def _composed(
    g: Callable[[Array], Array],
    f: Enclosure,
    error: Callable[[Array, Array, Callable[[Array], Array]], Array],
    whole: Enclosure,
    count: int = KEPT,
) -> Enclosure:
    """g of f by a polynomial, or where that is closer, by anything in `whole`.

    Args:
        g: of arrays.
        f: what it is taken of.
        error: (middle, half, polynomial) of intervals (k, ...) -> bounds on how far the polynomial
            is off, NaN where nothing is known.
        whole: what g can be.
        count: of the polynomial's coefficients.
    """
    low, high = f.ends
    middle, half = 0.5 * (low + high), np.maximum(0.5 * (high - low), SMALLEST)
    at = bernstein.nodes(count).reshape(-1, *(1,) * middle.ndim)
    terms = np.tensordot(bernstein.nodes_to_powers(count), g(middle + half * at), (1, 0))

    def polynomial(t: Array) -> Array:
        return functools.reduce(lambda found, term: found * t + term, terms[::-1])

    scaled = _times(_add(f, -middle), 1.0 / half)
    found = enclosed(terms[-1])
    for term in terms[-2::-1]:
        found = _add(_times(found, scaled), term)
    return _closer(Enclosure(found.net, found.radius + error(middle, half, polynomial)), whole)


def _closer(one: Enclosure, other: Enclosure) -> Enclosure:
    """The one of smaller radius, box by box."""
    return _chosen(one.radius < other.radius, one, other)


def _chosen(which: Mask, one: Enclosure, other: Enclosure) -> Enclosure:
    """The one where `which`, and the other elsewhere."""
    a, b = bernstein.alike(one.net, other.net)
    return Enclosure(np.where(which, a, b), np.where(which, one.radius, other.radius))


def of_length_one(vectors: Enclosure) -> Enclosure:
    """Unit vectors (k, 3), closer where one coordinate leads: it is what the others leave of 1."""
    low, high = vectors.ends
    square = np.maximum(low**2, high**2)
    most = square.sum(axis=-1, keepdims=True) - square
    least = np.sqrt(np.maximum(1.0 - most, 0.0)) - ROUNDING
    one = 1.0 + ROUNDING
    low = np.where(low > -least, np.maximum(low, least), np.maximum(low, -one))
    high = np.where(high < least, np.minimum(high, -least), np.minimum(high, one))
    return _closer(vectors, Enclosure.between(low, high))


def _wave(shift: float) -> Callable[[Enclosure], Enclosure]:
    """sin(x + shift)."""

    def function(x: Enclosure) -> Enclosure:
        low, high = x.ends
        count = KEPT if (high - low <= 2.0 * WIDE).all() else WIDER
        share = 2.0 ** (1 - count) / math.factorial(count)

        def error(middle: Array, half: Array, _: Any) -> Array:
            derivative = np.minimum(np.abs(np.sin(middle + shift)) + half, 1.0)
            return half**count * share * derivative

        whole = Enclosure(np.zeros((1, 1, *x.shape)), np.ones(x.shape))
        return _composed(lambda t: np.sin(t + shift), x, error, whole, count)

    return function


def _monotone(g: Callable[[Array], Array], above: float) -> Callable[[Enclosure], Enclosure]:
    """A monotone function of numbers above `above`, of whose derivatives each has one sign."""

    def function(x: Enclosure) -> Enclosure:
        low, high = x.ends

        def error(middle: Array, half: Array, cubic: Callable[[Array], Array]) -> Array:
            one = np.ones_like(middle)
            ends = [np.abs(g(middle + s * half) - cubic(s * one)) for s in (-1.0, 1.0)]
            return np.where(low > above, np.maximum(*ends), np.inf)

        a, b = g(low), g(high)
        known = (low > above) & np.isfinite(a) & np.isfinite(b)
        a, b = np.where(known, a, -np.inf), np.where(known, b, np.inf)
        return _composed(g, x, error, Enclosure.between(np.minimum(a, b), np.maximum(a, b)))

    return function


_exp, _log = _monotone(np.exp, -np.inf), _monotone(np.log, 0.0)


def _arctan(x: Enclosure) -> Enclosure:
    """The fourth derivative of arctan is 24 (t - t^3) / (1 + t^2)^4, at most 4.67."""
    low, high = x.ends
    whole = Enclosure.between(np.arctan(low), np.arctan(high))
    return _composed(np.arctan, x, lambda m, half, _: half**4 / 192.0 * 4.67, whole)


def _arctan2(y: Any, x: Any) -> Enclosure:
    """On one side of either axis; there the quotient is known."""
    y, x = _both(y, x)
    quarter = np.pi / 2.0
    right, up, down = x.ends[0] > 0.0, y.ends[0] > 0.0, y.ends[1] < 0.0
    beside = _add(_negative(_arctan(_divided(x, y))), np.where(up, quarter, -quarter))
    beside = Enclosure(beside.net, np.where(up | down, beside.radius, np.inf))
    return _chosen(right, _arctan(_divided(y, x)), beside)


def _both(a: Any, b: Any) -> tuple[Enclosure, Enclosure]:
    """Of one shape."""
    a, b = enclosed(a), enclosed(b)
    return _add(a, np.zeros(b.shape)), _add(b, np.zeros(a.shape))


def _power(base: Any, exponent: Any) -> Enclosure:
    if isinstance(exponent, Enclosure):
        return _exp(_times(_log(enclosed(base)), exponent))
    p = np.asarray(exponent, dtype=float)
    if p.ndim:
        raise TypeError("powers of several numbers at once are not known over boxes")
    whole = int(p) if p == np.round(p) and abs(p) <= 16 else None
    if whole is None:
        return _sqrt(base) if p == 0.5 else _monotone(lambda t: np.power(t, p), 0.0)(base)
    if whole < 0:
        return _divided(1.0, _power(base, -whole))
    found = enclosed(np.ones(base.shape))
    for _ in range(whole):
        found = _times(found, base)
    return found


def _absolute(x: Enclosure) -> Enclosure:
    low, high = x.ends
    sign = np.where(low >= 0.0, 1.0, np.where(high <= 0.0, -1.0, 0.0))
    most = np.maximum(np.abs(low), np.abs(high))
    return _chosen(sign == 0.0, Enclosure.between(0.0 * most, most), _times(x, sign))


def _arcsin(x: Enclosure) -> Enclosure:
    return _arctan(_divided(x, _sqrt(1.0 - x * x)))


def _hyperbolic(sign: float) -> Callable[[Enclosure], Enclosure]:
    def function(x: Enclosure) -> Enclosure:
        return 0.5 * (_exp(x) + sign * _exp(-x))

    return function


_sin, _cos = _wave(0.0), _wave(np.pi / 2.0)
_sinh, _cosh = _hyperbolic(-1.0), _hyperbolic(1.0)

UFUNCS |= {
    np.add: _add,
    np.subtract: lambda a, b: _add(a, -b),
    np.negative: _negative,
    np.positive: lambda a: a,
    np.multiply: _times,
    np.divide: _divided,
    np.reciprocal: lambda a: _divided(1.0, a),
    np.square: _square,
    np.power: _power,
    np.float_power: _power,
    np.sqrt: _sqrt,
    np.absolute: _absolute,
    np.hypot: lambda a, b: _sqrt(_add(_times(a, a), _times(b, b))),
    np.sin: _sin,
    np.cos: _cos,
    np.tan: lambda a: _divided(_sin(a), _cos(a)),
    np.exp: _exp,
    np.log: _log,
    np.sinh: _sinh,
    np.cosh: _cosh,
    np.tanh: lambda a: _divided(_sinh(a), _cosh(a)),
    np.arctan: _arctan,
    np.arctan2: _arctan2,
    np.arcsin: _arcsin,
    np.arccos: lambda a: np.pi / 2.0 - _arcsin(a),
    np.radians: lambda a: _times(a, np.pi / 180.0),
    np.deg2rad: lambda a: _times(a, np.pi / 180.0),
}


def _stack(parts: Any, axis: int = 0) -> Enclosure:
    """Coordinates beside each other."""
    if axis != -1:
        raise TypeError("np.stack is known over boxes with axis=-1 alone")
    return _joined([_with_axis(part) for part in parts])


def _with_axis(part: Any) -> Enclosure:
    part = enclosed(part)
    return part[..., None] if part.ndim else enclosed(part.net[0, 0][None])


def _joined(parts: list[Enclosure]) -> Enclosure:
    """Along the last axis."""
    m, n = (max(part.net.shape[axis] for part in parts) for axis in (0, 1))
    shape = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
    nets = []
    for part in parts:
        net, _ = bernstein.alike(part.net, np.empty((m, n, *(1,) * part.ndim)))
        net = net.reshape(net.shape[:2] + (1,) * (len(shape) + 1 - part.ndim) + part.shape)
        nets.append(np.broadcast_to(net, (m, n, *shape, part.shape[-1])))
    radii = [np.broadcast_to(part.radius, (*shape, part.shape[-1])) for part in parts]
    return Enclosure(np.concatenate(nets, axis=-1), np.concatenate(radii, axis=-1))


def _concatenate(parts: Any, axis: int = 0) -> Enclosure:
    if axis != -1:
        raise TypeError("np.concatenate is known over boxes with axis=-1 alone")
    return _joined([enclosed(part) for part in parts])


def _norm(x: Enclosure, ord: Any = None, axis: Any = None, keepdims: bool = False) -> Enclosure:
    if ord not in (None, 2) or axis is None:
        raise TypeError("np.linalg.norm is known over boxes along an axis, of order 2, alone")
    return _sqrt((x * x).sum(axis=axis, keepdims=keepdims))


def _cross(a: Any, b: Any) -> Enclosure:
    a, b = enclosed(a), enclosed(b)
    second, third = [1, 2, 0], [2, 0, 1]
    return a[..., second] * b[..., third] - a[..., third] * b[..., second]


FUNCTIONS |= {
    np.stack: _stack,
    np.concatenate: _concatenate,
    np.linalg.norm: _norm,
    np.cross: _cross,
    np.sum: lambda a, axis=None, keepdims=False: a.sum(axis=axis, keepdims=keepdims),
    np.zeros_like: lambda a: enclosed(np.zeros(a.shape)),
    np.ones_like: lambda a: enclosed(np.ones(a.shape)),
    np.full_like: lambda a, value: enclosed(np.full(a.shape, value)),
    np.broadcast_arrays: lambda *parts: [_both(part, sum(parts))[0] for part in parts],
}
