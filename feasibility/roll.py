"""The roll about the approach direction: eqs. (2) and (6) of the paper, by swing and twist.

With a the tool axis, x the reference axis of the TCP square to it and y = a x x, with b the
approach direction, t the reference direction on the surface square to it and u = b x t: carry x by
the least rotation that takes a to b. The roll psi is the angle from t to what x becomes, about b.
In closed form, with c = a . b,

    C = t . x + u . y = (1 + c) cos(psi)        N = u . x - t . y = (1 + c) sin(psi)

which has no value only where the axis points straight back, c = -1.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array

ALONG = math.sin(math.radians(1.0))  # [1] a reference this near to the approach shows no direction


class Roll(NamedTuple):
    """The rolls that a task allows: those within `half` of `middle`, up to full turns."""

    middle: float
    """rad."""
    half: float
    """rad, 0 .. pi."""

    def off(self, roll: Array) -> Array:
        """How far rolls (rad) are from the middle, -pi .. pi.

        Example:
            >>> Roll(math.pi, 0.1).off(np.array([-3.0])).round(4).tolist()
            [0.1416]
        """
        return np.arctan2(np.sin(roll - self.middle), np.cos(roll - self.middle))


def roll_of_range(low_deg: float, high_deg: float) -> Roll | None:
    """The range as a middle and a half width, rad; None where it is a full turn: any roll will do.

    Example:
        >>> roll_of_range(-90, 90).half == math.pi / 2, roll_of_range(-180, 180) is None
        (True, True)
    """
    if high_deg - low_deg >= 360.0:
        return None
    middle, half = math.radians(0.5 * (low_deg + high_deg)), math.radians(high_deg - low_deg) / 2.0
    return Roll(middle, half)


def projected(directions: Array, approaches: Array) -> tuple[Array, Array]:
    """Reference directions t (..., 3) square to b, and how much h (...) of the given ones that is.

    Args:
        directions: (..., 3) unit; h is the sine of their angle to b.
        approaches: (..., 3) b, of any length.

    Returns:
        t, unit, NaN where h is 0; and h.
    """
    length = (approaches * approaches).sum(axis=-1, keepdims=True)
    along = (directions * approaches).sum(axis=-1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        across = directions - along / length * approaches
        sine = np.linalg.norm(across, axis=-1, keepdims=True)
        return across / sine, sine[..., 0]


def cosine_and_sine(
    x: Array, axes: Array, references: Array, approaches: Array
) -> tuple[Array, Array]:
    """C and N (...) of the module's text, from x, a, t and b (..., 3).

    Example:
        >>> ex, ey, ez = np.eye(3)
        >>> c, n = cosine_and_sine(ey, ez, ex, ez)
        >>> round(math.degrees(math.atan2(n, c)), 9)
        90.0
    """
    y, u = np.cross(axes, x), np.cross(approaches, references)
    cosine = (references * x).sum(axis=-1) + (u * y).sum(axis=-1)
    sine = (u * x).sum(axis=-1) - (references * y).sum(axis=-1)
    return cosine, sine


def roll_of(x: Array, axes: Array, references: Array, approaches: Array) -> Array:
    """The roll psi (...), rad, -pi .. pi, from x, a, t and b (..., 3)."""
    cosine, sine = cosine_and_sine(x, axes, references, approaches)
    return np.asarray(np.arctan2(sine, cosine))
