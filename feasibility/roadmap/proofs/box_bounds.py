"""What a box of joint values can reach, what of it linear bounds leave, and roll in it: kernels.

A box has the centre c and half widths h_j; J is of the tool point p, r_j = |J_j| its distance from
axis j at c (1 for a slide), and B_j the sum of h_i over the revolute joints i < j. In the box p is
at most

    sum_j r_j h_j                      from p(c)               (first order)
    sum_j r_j h_j (h_j / 2 + B_j)      from p(c) + J (q - c)   (second order)

a slide j adding h_j B_j to the second sum. *Proof.* Move the joints from c to q by d_j one by one,
the first first. Those behind j are still at c then, so p moves by R_j (p_j - p(c)), where j alone
would take p to p_j, and R_j is what the joints before j turn by. |p_j - p(c)| <= r_j h_j, and R_j
keeps that; p_j - p(c) is J_j d_j, up to r_j d_j^2 / 2 for a turn; and |R_j - 1| <= B_j. QED

The same holds of a direction of the tool, with sines in place of distances and 0 for a slide. So
levers need not be those of all the box. Where a bound is of what happens along a motion, as that of
roll is, they are at most r_j + sum_{k>j} r_k h_k: only the joints behind j change them.

Contraction: what must lie in a <= g . d <= b leaves each d_j the interval that the others' leave
open. No comparison with NaN cuts anything off.

The range of the roll leaves by two bounds: the reference axis is a direction of the tool, in a ball
about the direction in the middle of cone and range, wherever the target may be. And over a target
at rest, with g the gradient of roll at c,

    |psi(q) - psi(c) - g . (q - c)| <= M / 2

with M of `feasibility.roadmap.motions.segment_bound` for h in place of the step, and the largest
tilt of the box. That holds for the roll that is reached from c without a jump: the range is tested
only where that cannot be another turn.
"""

import numpy as np

from coverable.kernels import allocating, kernel
from feasibility.roadmap.motions.roll_kernels import TURN, level, roll_gradient

ROUNDING = 1e-10  # [m], [1], [rad]: more than the error of double arithmetic in a cut
FLATTEST = 0.1  # [1] 1 + cos of a tilt beyond which roll is not looked at


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
def contract_to_ball(rows, gap, radius, directions, g, low, high):
    """Cut the box to d with |rows d - gap| <= radius, along the gap and along every direction.

    Returns False when nothing is left.
    """
    along, distance = np.empty(3), max(length_of(gap), 1e-12)
    for k in range(3):
        along[k] = gap[k] / distance
    if not contract_along(rows, gap, radius, along, g, low, high):
        return False
    for k in range(directions.shape[0]):
        if not contract_along(rows, gap, radius, directions[k], g, low, high):
            return False
    return True


@kernel
def reach(arrays, work, which, half, rows, lever):
    """What the joints of a box about slot 1 do to the tool point (0), axis (1) or reference (2).

    Args:
        arrays, work: the `SearchArrays` and the `Work`; slot 1 holds the box's centre.
        which: of the three.
        half: (m,) half widths, of the n joints first.
        rows: (3, m) out, the derivatives J by the joints.
        lever: (m,) out, their lengths r.

    Returns:
        The bounds of first and second order, m or 1.
    """
    first, second, before = 0.0, 0.0, 0.0
    for j in range(work.axes.shape[1]):
        u, v, w = work.axes[1, j, 0], work.axes[1, j, 1], work.axes[1, j, 2]
        slides, h = arrays.chain.prismatic[j], half[j]
        x, y, z = work.axis[1, 0], work.axis[1, 1], work.axis[1, 2]
        if which == 2:
            x, y, z = work.reference[1, 0], work.reference[1, 1], work.reference[1, 2]
        elif which == 0:
            x = work.point[1, 0] - work.origins[1, j, 0]
            y = work.point[1, 1] - work.origins[1, j, 1]
            z = work.point[1, 2] - work.origins[1, j, 2]
        x, y, z = v * z - w * y, w * x - u * z, u * y - v * x
        if slides:
            x, y, z = (u, v, w) if which == 0 else (0.0, 0.0, 0.0)
        rows[0, j], rows[1, j], rows[2, j] = x, y, z
        lever[j] = np.sqrt(x * x + y * y + z * z)
        first += lever[j] * h
        second += lever[j] * h * before
        if not slides:
            second += 0.5 * lever[j] * h * h
            before += h
    return first, second


@kernel
def rolls_over(arrays, places, part):
    """Is roll limited, and known over a part?"""
    return arrays.roll[1] < np.inf and places.radius[part, 2] < np.inf


@kernel
def unturned(target, toward, middle):
    """Set row 2 of a target (3, 3) to `toward`, turned back about row 1 by `middle`."""
    cosine, sine = np.cos(middle), np.sin(middle)
    b = target[1]
    target[2, 0] = cosine * toward[0] - sine * (b[1] * toward[2] - b[2] * toward[1])
    target[2, 1] = cosine * toward[1] - sine * (b[2] * toward[0] - b[0] * toward[2])
    target[2, 2] = cosine * toward[2] - sine * (b[0] * toward[1] - b[1] * toward[0])
    level(target)


@kernel
def length_of(vector):
    """The length of a vector (3,)."""
    return np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)


@kernel
def contract_roll(arrays, work, half, sine, g, low, high):
    """Cut the box, about slot 1, to where roll is in its range; False when nothing is left.

    Args:
        arrays, work: as everywhere; slot 1 holds the box's centre.
        half, sine: (n,) half widths, and sines of `reach` for the axis.
        g: (n,) scratch.
        low, high: (n,) the box less its centre, cut in place.
    """
    behind, turn, axis, paired, mixed = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(sine.shape[0]):
        behind += sine[j] * half[j]
    chord = work.error[1, 1] + behind
    for j in range(sine.shape[0]):
        if not arrays.chain.prismatic[j]:
            behind -= sine[j] * half[j]
            largest = min(sine[j] + behind, 1.0)
            axis += largest * half[j]
            paired += largest * half[j] * turn
            mixed += half[j] * turn
            turn += half[j]
    along = 2.0 - 0.5 * chord * chord
    off, most = work.error[1, 2], arrays.roll[1]
    if not along > FLATTEST:
        return True
    cosine = np.sqrt(0.5 * along)
    if not turn / cosine < TURN - most - abs(off):
        return True
    second = (2.0 * paired + mixed * chord) / along + turn * axis * chord / along
    most += 0.5 * second + ROUNDING
    roll_gradient(work.target, work.axis[1], work.axes[1], arrays.chain.prismatic, g)
    return contract(g, -most - off, most - off, low, high)
