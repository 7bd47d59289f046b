"""Calling a user's own g(u, v): what it may return, and what is wrong with what it does return."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from coverable.arrays import Array
from coverable.errors import Fault, shown
from surfaces.arguments import LARGEST_COORDINATE
from surfaces.surface import SurfaceError

HOW = (
    "g is called with two arrays of one shape, u and v, and returns x, y and z (m) of that shape: "
    "def g(u, v): return np.cos(u), np.sin(u), v"
)


class Formula:
    """A user's function, called with many places at a time."""

    def __init__(self, g: Callable[..., Any]) -> None:
        """Keep the function."""
        self._g = g

    def __call__(self, u: Array, v: Array) -> Array:
        """Points (..., 3) m at parameters of one shape.

        Raises:
            SurfaceError: the function fails, or returns something else.
        """
        shape = u.shape
        u, v = u.reshape(-1).copy(), v.reshape(-1).copy()
        try:
            with np.errstate(all="ignore"):
                value = self._g(u, v)
        except Exception as error:  # whatever a function of somebody else's may raise
            what = f"raised {type(error).__name__}: {str(error)[:120]}"
            raise SurfaceError(Fault("g", what, expected=HOW), "parametric") from error
        points = _points(value, len(u))
        bad = np.flatnonzero(~np.isfinite(points).all(axis=1))
        if len(bad):
            k = int(bad[0])
            raise SurfaceError(
                Fault(
                    "g",
                    f"got {points[k].tolist()} at (u, v) = ({u[k]:.6g}, {v[k]:.6g}), and the like "
                    f"at {len(bad)} of {len(u)} places; narrow the ranges",
                    expected="must be finite for all u and v",
                ),
                "parametric",
            )
        if np.abs(points).max(initial=0.0) > LARGEST_COORDINATE:
            got = f"got {np.abs(points).max():g}"
            expected = f"must lie within {LARGEST_COORDINATE:g} metres of the origin"
            raise SurfaceError(Fault("g", got, expected=expected), "parametric")
        return points.reshape(*shape, 3)


def _points(value: Any, count: int) -> Array:
    """(count, 3) from what a function returned for `count` places."""
    found: Array | None = None
    try:
        if isinstance(value, (tuple, list)) and len(value) == 3:
            parts = [np.asarray(part, dtype=float) for part in value]
            found = np.stack([np.broadcast_to(part, (count,)) for part in parts], axis=1)
        else:
            array = np.asarray(value, dtype=float)
            if array.shape == (3, count):
                array = array.T
            found = array if array.shape == (count, 3) else None
    except (TypeError, ValueError):
        found = None
    if found is None:
        shape = getattr(value, "shape", None)
        got = f"an array of shape {shape}" if shape is not None else shown(value)
        fault = Fault("g", f"returned {got} for {count} places", expected=HOW)
        raise SurfaceError(fault, "parametric")
    return found
