"""Enclosures: what a formula of u and v is over boxes of parameters, as a polynomial and a radius.

Over each of k boxes, seen as -1..1 along u and v, a value is within `radius` of a polynomial in
Bernstein's basis. NumPy's functions take enclosures like arrays (`enclosure_functions`), so that a
formula written once serves for numbers and for bounds:

    def local_point(self, u, v):
        return np.stack([self.radius * np.cos(u), self.radius * np.sin(u), v], axis=-1)

What is not known has an infinite radius, and stays so whatever is made of it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from coverable.arrays import Array
from surfaces import bernstein

KEPT = 4  # coefficients along each parameter that results are brought down to
MOST = 27  # coefficients along each parameter, at most, of a product: normals of degree 9
ROUNDING = 4e-16  # [1] of the terms that are added up

UFUNCS: dict[Any, Callable[..., Enclosure]] = {}
"""NumPy's functions of single values; filled by `enclosure_functions`."""
FUNCTIONS: dict[Any, Callable[..., Any]] = {}
"""Those of whole arrays."""


class Enclosure(NDArrayOperatorsMixin):
    """Functions over k boxes, (k, ...) in shape like the arrays that numbers would give."""

    __slots__ = ("net", "radius")

    def __init__(self, net: Array, radius: Array | float = 0.0) -> None:
        """Keep both, made so that nothing is known where one of them is not finite.

        Args:
            net: (m, n, k, ...) see `bernstein`.
            radius: (k, ...) how far a value may be from it.
        """
        size = np.abs(net).max(axis=(0, 1))
        radius = np.asarray(radius + ROUNDING * size)
        unknown = ~np.isfinite(radius)
        if unknown.any():
            net = np.where(unknown, 0.0, net)
            radius = np.where(unknown, np.inf, radius)
        self.net, self.radius = net, radius

    @staticmethod
    def variable(low: Array, high: Array, axis: int) -> Enclosure:
        """u (axis 0) or v (axis 1) itself, over intervals (k,)."""
        net = np.stack([low, high])
        return Enclosure(net[:, None] if axis == 0 else net[None])

    @staticmethod
    def between(low: Array, high: Array) -> Enclosure:
        """Anything from low to high (k, ...)."""
        return Enclosure((0.5 * (low + high))[None, None], 0.5 * (high - low))

    @property
    def shape(self) -> tuple[int, ...]:
        """As of an array."""
        return self.radius.shape

    @property
    def ndim(self) -> int:
        """As of an array."""
        return self.radius.ndim

    @property
    def ends(self) -> tuple[Array, Array]:
        """Lowest and highest values (k, ...), or beyond."""
        return self.net.min(axis=(0, 1)) - self.radius, self.net.max(axis=(0, 1)) + self.radius

    @property
    def size(self) -> Array:
        """(k, ...) the largest absolute value of the polynomial, or more."""
        return np.abs(self.net).max(axis=(0, 1))

    def __array__(self, *_: Any, **__: Any) -> Any:
        """Refuse to be an array of numbers."""
        raise TypeError("its values are not single numbers here")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """NumPy's functions of single values."""
        if method != "__call__" or ufunc not in UFUNCS or options:
            raise TypeError(f"np.{ufunc.__name__} is not known over boxes")
        return UFUNCS[ufunc](*inputs)

    def __array_function__(self, function: Any, types: Any, given: Any, options: Any) -> Any:
        """NumPy's functions of whole arrays."""
        if function not in FUNCTIONS:
            raise TypeError(f"np.{function.__name__} is not known over boxes")
        return FUNCTIONS[function](*given, **options)

    def __getitem__(self, key: Any) -> Enclosure:
        """As of an array; the boxes, which come first, are kept."""
        keys = key if isinstance(key, tuple) else (key,)
        every = (slice(None), slice(None))
        if keys[0] is Ellipsis:
            return Enclosure(self.net[(..., *keys[1:])], self.radius[key])
        return Enclosure(self.net[every + keys], self.radius[key])

    def sum(self, axis: int = -1, keepdims: bool = False) -> Enclosure:
        """Along coordinates."""
        axis = _of_coordinates(axis, self.ndim)
        added = [each.sum(axis=axis, keepdims=True) for each in (self.net, self.radius)]
        return Enclosure(*(added if keepdims else [each.squeeze(axis) for each in added]))

    def lower(self, most: int = KEPT) -> Enclosure:
        """The same; of more coefficients than `most` few are kept, the others count as radius."""
        net, radius = self.net, self.radius
        for axis in (0, 1):
            size = net.shape[axis]
            if size > most:
                terms = bernstein.along(bernstein.to_chebyshev(size), net, axis)
                kept, rest = np.split(terms, [KEPT], axis=axis)
                radius = radius + np.abs(rest).max(axis=1 - axis).sum(axis=0)
                net = bernstein.along(bernstein.from_chebyshev(KEPT), kept, axis)
        return self if net is self.net else Enclosure(net, radius)


def _of_coordinates(axis: int, ndim: int) -> int:
    """The axis, counted from the end."""
    axis = axis - ndim if axis >= 0 else axis
    if axis <= -ndim:
        raise TypeError("boxes are not added up")
    return axis


def enclosed(value: Any) -> Enclosure:
    """A number or an array (k, ...), or (...) of coordinates, as an enclosure of one value."""
    if isinstance(value, Enclosure):
        return value
    return Enclosure(np.asarray(value, dtype=float)[None, None])
