"""How far planes part two convex bodies along stretches, one plane for each: see `parting`.

Compiled, because a motion has hundreds of stretches and each takes three supports; the search has
nothing of it.
"""

from __future__ import annotations

import numpy as np

from coverable_kernels import entry, kernel


@kernel
def support(corners, circle, x, y, z):  # type: ignore[no-untyped-def]
    """How far a body reaches along (x, y, z), see `Piece.outline`; without its radius.

    Every other corner is compared with a most of its own, which the processor does side by side.
    """
    most, more, count = -np.inf, -np.inf, corners.shape[0]
    for k in range(0, count - 1, 2):
        one = corners[k, 0] * x + corners[k, 1] * y + corners[k, 2] * z
        other = corners[k + 1, 0] * x + corners[k + 1, 1] * y + corners[k + 1, 2] * z
        most = one if one > most else most
        more = other if other > more else more
    if count % 2 == 1:
        k = count - 1
        one = corners[k, 0] * x + corners[k, 1] * y + corners[k, 2] * z
        most = one if one > most else most
    most = more if more > most else most
    if circle[3] > 0.0:
        along = circle[0] * x + circle[1] * y + circle[2] * z
        most += circle[3] * np.sqrt(max(x * x + y * y + z * z - along * along, 0.0))
    return most


@kernel
def least_along(corners, circle, turn, at, x, y, z):  # type: ignore[no-untyped-def]
    """The least that a placed body reaches along (x, y, z), without its radius."""
    u = turn[0, 0] * x + turn[1, 0] * y + turn[2, 0] * z
    v = turn[0, 1] * x + turn[1, 1] * y + turn[2, 1] * z
    w = turn[0, 2] * x + turn[1, 2] * y + turn[2, 2] * z
    return at[0] * x + at[1] * y + at[2] * z - support(corners, circle, -u, -v, -w)


@entry
def part(  # type: ignore[no-untyped-def]
    a_corners, a_circle, b_corners, b_circle, first_turns, first_points, last_turns, last_points,
    directions, less, low,
):  # fmt: skip
    """Set how far planes part body a and body b, as it moves along stretches.

    Args:
        a_corners: (i, 3) m, see `Piece.outline`.
        a_circle: (4,) see there.
        b_corners: (j, 3) m.
        b_circle: (4,)
        first_turns: (k, 3, 3) rotations of b, seen from a, where stretches begin.
        first_points: (k, 3) m.
        last_turns: (k, 3, 3) the same where they end.
        last_points: (k, 3) m.
        directions: (k, 3) unit vectors across the planes, or (1, 3): one for all.
        less: (k,) m, taken off.
        low: (k,) m, set.
    """
    same, own = directions.shape[0] == 1, 0.0
    for k in range(low.shape[0]):
        n = directions[0 if same else k]
        x, y, z = n[0], n[1], n[2]
        if k == 0 or not same:
            own = support(a_corners, a_circle, x, y, z)
        start = least_along(b_corners, b_circle, first_turns[k], first_points[k], x, y, z)
        end = least_along(b_corners, b_circle, last_turns[k], last_points[k], x, y, z)
        low[k] = min(start, end) - own - less[k]
