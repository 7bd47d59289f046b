"""The cone around the approach direction: eqs. (3), (4) and (7) of the paper.

With a the tool axis and b(u, v) the approach direction, both unit vectors, the paper asks for
a . b <= cos(alpha). Its prose means that the angle between them is at most alpha, and so do we:

    angle(a, b) <= alpha,   that is   a . b >= cos(alpha),   that is   |a - b| <= 2 sin(alpha / 2)

The last form, the chord of the cone, is the one that bounds between samples work with: it has no
square root to lose digits in where the cone is narrow, and |a - b| is a norm.
"""

from __future__ import annotations

import math


def chord_of(cone: float) -> float:
    """|a - b| at the boundary of a cone (rad, 0 .. pi); inf from pi on, where any axis will do.

    Example:
        >>> round(chord_of(math.radians(60)), 12)
        1.0
    """
    return math.inf if cone >= math.pi else 2.0 * math.sin(0.5 * cone)


def angle_of(chord: float) -> float:
    """The angle (rad) between unit vectors with |a - b| = `chord`; NaN for NaN.

    Example:
        >>> round(math.degrees(angle_of(1.0)), 9)
        60.0
    """
    return math.nan if math.isnan(chord) else 2.0 * math.asin(min(0.5 * chord, 1.0))
