"""What a box of joint values can reach, and what of it linear bounds leave: kernels.

With r_j the largest distance of the tool point from axis j over a box with centre c and half widths
h (the distance at c plus what the joints behind j can add), a tool point in the box is at most

    sum_j r_j h_j                          from p(c)                (first order)
    D / 2 = 1/2 sum_j r_j h_j (h_j + 2 sum_{i<j} h_i)   from p(c) + J d    (second order)

and likewise for the axis, with sines s_j in place of r_j (D is that of
`feasibility.roadmap.motions.segment_bound`).

Contraction: what must lie in a <= g . d <= b leaves each d_j the interval that the others' leave
open. No comparison with NaN cuts anything off.
"""

from __future__ import annotations

import numpy as np

from coverable.kernels import allocating, kernel


@kernel
def contract(g, least_sum, most_sum, low, high):
    """Cut the box to d with least_sum <= g . d <= most_sum; False when nothing is left.

    Args:
        g: (m,) weights of the first m intervals.
        least_sum, most_sum: may be infinite.
        low, high: (m or more,) the box, cut in place.
    """
    least, most = 0.0, 0.0
    for j in range(g.shape[0]):
        a, b = g[j] * low[j], g[j] * high[j]
        least += min(a, b)
        most += max(a, b)
    if least > most_sum or most < least_sum:
        return False
    if least >= least_sum and most <= most_sum:
        return True
    for j in range(g.shape[0]):
        if abs(g[j]) < 1e-9:
            continue
        a, b = g[j] * low[j], g[j] * high[j]
        # What the other intervals leave open for this one.
        left = (least_sum - (most - max(a, b))) / g[j]
        right = (most_sum - (least - min(a, b))) / g[j]
        if g[j] < 0.0:
            left, right = right, left
        if left > low[j]:
            low[j] = left
        if right < high[j]:
            high[j] = right
        if low[j] > high[j]:
            return False
        least += min(g[j] * low[j], g[j] * high[j]) - min(a, b)
        most += max(g[j] * low[j], g[j] * high[j]) - max(a, b)
    return True


@kernel
def contract_along(rows, gap, radius, direction, g, low, high):
    """Cut the box to d with |direction . (rows d - gap)| <= radius; False when nothing is left.

    Args:
        rows: (3, m).
        gap, direction: (3,).
        radius: m, or a chord.
        g: (m,) scratch.
        low, high: (m,) the box, cut in place.
    """
    goal = direction[0] * gap[0] + direction[1] * gap[1] + direction[2] * gap[2]
    for j in range(g.shape[0]):
        g[j] = direction[0] * rows[0, j] + direction[1] * rows[1, j] + direction[2] * rows[2, j]
    return contract(g, goal - radius, goal + radius, low, high)


@allocating
def contract_to_ball(rows, gap, distance, radius, directions, g, low, high):
    """Cut the box to d with |rows d - gap| <= radius, along the gap and along every direction.

    Returns False when nothing is left.
    """
    along = np.empty(3)
    for k in range(3):
        along[k] = gap[k] / max(distance, 1e-12)
    if not contract_along(rows, gap, radius, along, g, low, high):
        return False
    for k in range(directions.shape[0]):
        if not contract_along(rows, gap, radius, directions[k], g, low, high):
            return False
    return True


@kernel
def reach_of_point(arrays, work, half, longest, lever):
    """Largest levers of the tool point over a box about slot 1; returns (first, D/2).

    Args:
        arrays, work: the `SearchArrays` and the `Work`; slot 1 holds the box's centre.
        half: (n,) half widths.
        longest: (n,) of `static_levers`.
        lever: (n,) out.
    """
    before, first, second = turns_of(arrays, half), 0.0, 0.0
    for j in range(half.shape[0] - 1, -1, -1):
        h = half[j]
        lever[j] = 1.0
        if arrays.chain.prismatic[j]:
            second += h * before
        else:
            before -= h
            x = work.point[1, 0] - work.origins[1, j, 0]
            y = work.point[1, 1] - work.origins[1, j, 1]
            z = work.point[1, 2] - work.origins[1, j, 2]
            lever[j] = min(_across(work.axes[1, j], x, y, z) + first, longest[j])
            second += 0.5 * lever[j] * h * (h + 2.0 * before)
        first += lever[j] * h
    return first, second


@kernel
def reach_of_direction(arrays, work, direction, half, sine):
    """As `reach_of_point` for a direction (3,) of the tool: (first, Da/2), and its sines (n,)."""
    before, first, second = turns_of(arrays, half), 0.0, 0.0
    for j in range(sine.shape[0] - 1, -1, -1):
        h = half[j]
        sine[j] = 0.0
        if not arrays.chain.prismatic[j]:
            before -= h
            s = _across(work.axes[1, j], direction[0], direction[1], direction[2])
            sine[j] = min(1.0, s + first)
            second += 0.5 * sine[j] * h * (h + 2.0 * before)
            first += sine[j] * h
    return first, second


@kernel
def turns_of(arrays, half):
    """The sum of what the revolute joints turn by, of half widths (n,)."""
    total = 0.0
    for j in range(half.shape[0]):
        if not arrays.chain.prismatic[j]:
            total += half[j]
    return total


@kernel
def _across(axis, x, y, z):
    """How far a vector reaches from an axis (3,)."""
    a, b, c = axis[0], axis[1], axis[2]
    return np.sqrt((b * z - c * y) ** 2 + (c * x - a * z) ** 2 + (a * y - b * x) ** 2)


@kernel
def static_levers(arrays, longest):
    """The longest lever (n,) that each joint can have: the links behind it, stretched out."""
    total = 0.0
    for j in range(longest.shape[0] - 1, -1, -1):
        link = arrays.chain.translations[j + 1]
        total += np.sqrt(link[0] ** 2 + link[1] ** 2 + link[2] ** 2)
        longest[j] = total
        if arrays.chain.prismatic[j]:
            total += max(abs(arrays.lower[j]), abs(arrays.upper[j]))
