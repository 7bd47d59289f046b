"""Slopes: what a formula of u and v changes by along u, from the formula itself.

A `Slope` is a value, numbers or an enclosure, beside its derivative. NumPy's functions take it like
an array and follow the rules of differentiation, in NumPy's functions again.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin


class Slope(NDArrayOperatorsMixin):
    """Values with their derivatives, both of one shape.

    Example:
        >>> u = Slope(np.array([0.0, 1.0]), np.ones(2))
        >>> (u * np.exp(2.0 * u)).by.round(3).tolist()
        [1.0, 22.167]
    """

    __slots__ = ("by", "value")

    def __init__(self, value: Any, by: Any) -> None:
        """Keep both."""
        self.value, self.by = value, by

    @property
    def shape(self) -> tuple[int, ...]:
        """As of an array."""
        return tuple(self.value.shape)

    def __array__(self, *_: Any, **__: Any) -> Any:
        """Refuse to be an array of numbers."""
        raise TypeError("its values are not single numbers here")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **options: Any) -> Any:
        """NumPy's functions of single values: the chain rule."""
        if method != "__call__" or ufunc not in _DERIVATIVES or options:
            raise TypeError(f"the derivative of np.{ufunc.__name__} is not known")
        values = [_value(x) for x in inputs]
        found = ufunc(*values)
        rates = _DERIVATIVES[ufunc](found, *values)
        terms = [rate * x.by for rate, x in zip(rates, inputs, strict=True) if isinstance(x, Slope)]
        return Slope(found, terms[0] if len(terms) == 1 else terms[0] + terms[1])

    def __array_function__(self, function: Any, types: Any, given: Any, options: Any) -> Any:
        """NumPy's functions of whole arrays."""
        if function in (np.stack, np.concatenate):
            parts = given[0]
            values = function([_value(x) for x in parts], *given[1:], **options)
            return Slope(values, function([_slope(x) for x in parts], *given[1:], **options))
        if function is np.linalg.norm:
            (x, *rest) = given
            return np.sqrt((x * x).sum(*rest, **options))
        if function is np.cross:
            a, b = given
            by = np.cross(_slope(a), _value(b)) + np.cross(_value(a), _slope(b))
            return Slope(np.cross(_value(a), _value(b)), by)
        if function in (np.zeros_like, np.ones_like, np.full_like):
            return function(given[0].value, *given[1:], **options)
        raise TypeError(f"the derivative of np.{function.__name__} is not known")

    def __getitem__(self, key: Any) -> Slope:
        """As of an array."""
        return Slope(self.value[key], self.by[key])

    def sum(self, axis: int = -1, keepdims: bool = False) -> Slope:
        """Along an axis."""
        return Slope(self.value.sum(axis, keepdims=keepdims), self.by.sum(axis, keepdims=keepdims))


def _value(x: Any) -> Any:
    return x.value if isinstance(x, Slope) else x


def _slope(x: Any) -> Any:
    """Zero of a constant, in the shape that it has."""
    return x.by if isinstance(x, Slope) else 0.0 * x


def _power(found: Any, base: Any, exponent: Any) -> tuple[Any, Any]:
    if isinstance(exponent, (int, float)):
        by_base = exponent * base ** (exponent - 1) if exponent else 0.0 * base
        return by_base, None
    return exponent * base ** (exponent - 1), found * np.log(base)


_DERIVATIVES: dict[Any, Callable[..., tuple[Any, ...]]] = {
    np.add: lambda f, a, b: (1.0, 1.0),
    np.subtract: lambda f, a, b: (1.0, -1.0),
    np.negative: lambda f, a: (-1.0,),
    np.positive: lambda f, a: (1.0,),
    np.multiply: lambda f, a, b: (b, a),
    np.divide: lambda f, a, b: (1.0 / b, -f / b),
    np.reciprocal: lambda f, a: (-f * f,),
    np.square: lambda f, a: (2.0 * a,),
    np.power: _power,
    np.float_power: _power,
    np.sqrt: lambda f, a: (0.5 / f,),
    np.hypot: lambda f, a, b: (a / f, b / f),
    np.sin: lambda f, a: (np.cos(a),),
    np.cos: lambda f, a: (-np.sin(a),),
    np.tan: lambda f, a: (1.0 + f * f,),
    np.exp: lambda f, a: (f,),
    np.log: lambda f, a: (1.0 / a,),
    np.sinh: lambda f, a: (np.cosh(a),),
    np.cosh: lambda f, a: (np.sinh(a),),
    np.tanh: lambda f, a: (1.0 - f * f,),
    np.arctan: lambda f, a: (1.0 / (1.0 + a * a),),
    np.arctan2: lambda f, y, x: (x / (x * x + y * y), -y / (x * x + y * y)),
    np.arcsin: lambda f, a: (1.0 / np.sqrt(1.0 - a * a),),
    np.arccos: lambda f, a: (-1.0 / np.sqrt(1.0 - a * a),),
    np.radians: lambda f, a: (np.pi / 180.0,),
    np.deg2rad: lambda f, a: (np.pi / 180.0,),
}
