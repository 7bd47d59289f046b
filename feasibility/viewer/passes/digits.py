"""Numbers as lines in space, digits of seven strokes."""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array

WIDTH = 0.5  # [1] of the height
GAP = 0.25  # [1] of the height, between digits
_CORNERS = {"a": (0, 2), "b": (1, 2), "c": (0, 1), "d": (1, 1), "e": (0, 0), "f": (1, 0)}
_DIGITS = (
    "abfeca", "bf", "abdcef", "abdcdfe", "acdbf", "bacdfe", "bacefdc", "abf", "cabfecd", "dcabfe",
)  # fmt: skip
"""Strokes from corner to corner: top a b, middle c d, bottom e f."""


def digit_lines(number: int, origin: Array, along: Array, up: Array) -> list[Array]:
    """Polylines (k, 3) m of a number.

    Args:
        number: at least 0.
        origin: (3,) m, where its lower left corner is.
        along: (3,) unit, the direction in which it is read.
        up: (3,) m, the height of a digit.
    """
    height = float(np.linalg.norm(up))
    lines = []
    for place, digit in enumerate(str(number)):
        corners = np.array([_CORNERS[name] for name in _DIGITS[int(digit)]], dtype=float)
        x = (WIDTH * corners[:, 0] + place * (WIDTH + GAP)) * height
        lines.append(origin + x[:, None] * along + 0.5 * corners[:, 1:] * up)
    return lines
