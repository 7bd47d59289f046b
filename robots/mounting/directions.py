"""The two axes of a tool: where it points, and what its roll is measured by."""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array, unit_along

PARALLEL = 1e-6  # [1], sine of the angle below which two directions count as parallel


def unit_axis(axis: Array) -> Array:
    """(3,) the axis brought to length one; NaN where it is zero or not finite."""
    largest = float(np.abs(axis).max())
    if not 1e-9 < largest < np.inf:
        return np.full(3, np.nan)
    return unit_along(axis)


def made_orthogonal(reference: Array, approach: Array) -> Array:
    """(3,) unit vector: the part of `reference` that is orthogonal to `approach`.

    Args:
        reference: (3,) of any length; NaN for the default, +x, or +z where x is parallel to
            `approach`.
        approach: (3,) unit vector.

    Returns:
        NaN where `reference` is zero, not finite, or parallel to `approach`.
    """
    if np.isnan(reference).all():
        across = np.hypot(approach[1], approach[2])
        reference = np.eye(3)[2 if across < PARALLEL else 0]
    unit = unit_axis(reference)
    part = unit - (unit @ approach) * approach
    length = np.linalg.norm(part)
    if not length >= PARALLEL:
        return np.full(3, np.nan)
    part = part / length
    return unit_axis(part - (part @ approach) * approach)  # once more, for the last digits
