"""What of a box may still hold a solution: contraction to second order.

A box is an interval for each joint and, where the place on the surface is free, one for each of the
two parameters x of a part of it (`surfaces.parts`): there the target point is T(x) = c + e_1 x_1 +
e_2 x_2 up to a radius r, and the approach direction likewise. A target at rest is a part without
parameters, of radius 0.

**Lemma.** Let c be the middle of a box, J the derivatives of the tool point there, and D/2 its
second-order bound over the box (`box_bounds`). Let y = c + (dq, dx) be in the
box, with a place of the part at its x whose target point is within the tolerance of p. Then for
every unit w

    |w . (p(c) + J dq - T(c) - e dx)| <= tolerance + D/2 + r

and likewise for the tool axis, with the chord of the cone in place of the tolerance; and for its
reference axis, which is to point along that of the target, turned to the middle of the range of
roll: from there a tilt of at most alpha and a roll of at most rho to either side turn it by Theta
at most, cos(Theta / 2) = cos(alpha / 2) cos(rho / 2), over a chord of 2 sin(Theta / 2). *Proof.* p
is within D/2 of p(c) + J dq, the target within r of T(c) + e dx, and a projection only shrinks. QED

So a box holds nothing when its target is further off than tolerance, r and first-order bounds
allow, or when no (dq, dx) in it satisfies these inequalities for a few w; and every interval can be
contracted to what the others leave open.
"""

import numpy as np

from coverable.kernels import kernel
from feasibility.roadmap.motions.working_memory import NEXT, place
from feasibility.roadmap.proofs.box_bounds import (
    ROUNDING,
    contract_roll,
    contract_to_ball,
    length_of,
    reach,
    rolls_over,
    unturned,
)

THINNEST = 1e-6  # [rad], [m]: boxes are not halved further
SKEWED = 1.5  # [1] roll differs by no more than so many times what its frame does, up to 90 deg
PASSES = 3  # contractions of a box
GAIN = 0.3  # [1] of the volume left: contracting again would gain little


@kernel
def _place_centre(arrays, work, places, part, low, high, space):
    """Evaluate the arm and the target at a box's centre."""
    n, m = work.axes.shape[1], low.shape[0]
    for j in range(m):
        space.middle[j] = 0.5 * (low[j] + high[j])
        space.half[j] = 0.5 * (high[j] - low[j])
    for which in range(3):
        for k in range(3):
            value = places.centre[part, 3 * which + k]
            for i in range(n, m):
                value += space.middle[i] * places.slopes[part, i - n, 3 * which + k]
            space.gap[which, k] = value
            if which < 2:
                work.target[which, k] = value
    if rolls_over(arrays, places, part):
        unturned(work.target, space.gap[2], arrays.roll[0])
    place(arrays, work, NEXT, space.middle[:n])
    for k in range(3):
        space.gap[0, k] -= work.point[1, k]
        space.gap[1, k] -= work.axis[1, k]
        space.gap[2, k] -= work.reference[1, k]


@kernel
def _bounds_of(arrays, work, places, part, which, space):
    """Rows, levers, and bounds of first and second order of tool point, axis or reference axis."""
    n, m = work.axes.shape[1], space.half.shape[0]
    rows, lever = space.rows[which], space.lever[which]
    first, second = reach(arrays, work, which, space.half, rows, lever)
    for i in range(n, m):
        slope = places.slopes[part, i - n, 3 * which : 3 * which + 3]
        for k in range(3):
            rows[k, i] = -slope[k]
        lever[i] = length_of(slope)
        first += lever[i] * space.half[i]
    return first, second


@kernel
def _contract_second(arrays, work, places, part, directions, space, low, high):
    """Cut the present box by the lemma of this module; False when nothing is left.

    Args:
        arrays, work, places, part, directions, space, low, high: as in `shrink`.
            `space.most` holds the right hand sides.
    """
    m, sine = low.shape[0], space.lever[1]
    for j in range(m):
        low[j] -= space.middle[j]
        high[j] -= space.middle[j]
    for which in range(3):
        if space.most[which] < np.inf and not contract_to_ball(
            space.rows[which], space.gap[which], space.most[which], directions, space.row, low, high
        ):
            return False
    # The target at rest, so that roll itself is a function of the joints alone.
    at_rest = m == work.axes.shape[1] and rolls_over(arrays, places, part)
    if at_rest and not contract_roll(arrays, work, space.half, sine, space.row, low, high):
        return False
    for j in range(m):
        low[j] += space.middle[j]
        high[j] += space.middle[j]
    return True


@kernel
def _allowed(arrays, which):
    """How far tool point (m), axis or reference axis (chords) may be from where they are to be."""
    if which == 0:
        return arrays.tolerance
    if which == 1:
        return arrays.cone_chord
    tilt = 1.0 - 0.25 * min(arrays.cone_chord, 2.0) ** 2
    cosine = np.cos(0.5 * min(arrays.roll[1], np.pi))
    return 2.0 * np.sqrt(max(1.0 - tilt * cosine * cosine, 0.0))


@kernel
def _is_solution(arrays, work, places, part):
    """Does slot 1 hold the tool at a place of the part, wherever the model may be off by?"""
    off, turned = places.radius[part, 0], places.radius[part, 1]
    inside = work.error[1, 0] + off <= arrays.tolerance
    inside &= work.error[1, 1] + turned <= arrays.cone_chord
    if arrays.roll[1] < np.inf and places.children[part, 0] >= 0:
        inside &= places.radius[part, 2] < np.inf  # its children tell
    if rolls_over(arrays, places, part):
        deviation = SKEWED * (turned + places.radius[part, 2])
        inside &= abs(work.error[1, 2]) + deviation <= arrays.roll[1]
    return inside


@kernel
def shrink(arrays, work, places, part, directions, space, low, high):
    """Cut one box (in place) to what may still hold a solution.

    Returns:
        1 when nothing is left, 2 when its centre is a solution, 3 when it is not finite, 0
        otherwise; and what is closest to ruling it out: 0 the tool point, 1 the axis, 2 roll.
    """
    driver, rolls = 0, rolls_over(arrays, places, part)
    for _ in range(PASSES):
        _place_centre(arrays, work, places, part, low, high, space)
        if not (work.error[1, 0] < np.inf and work.error[1, 1] < np.inf):
            return 3, driver
        if _is_solution(arrays, work, places, part):
            return 2, driver
        nearest, space.most[2] = -1.0, np.inf
        for which in range(3 if rolls else 2):
            first, second = _bounds_of(arrays, work, places, part, which, space)
            off = length_of(space.gap[which])
            allowed = _allowed(arrays, which) + places.radius[part, which] + ROUNDING
            if off > allowed + first:
                return 1, driver
            used = off / (allowed + min(first, second))
            if used > nearest:
                driver, nearest = which, used
            # The second order is of use only where it beats the first.
            space.most[which] = allowed + second if second < first else np.inf
        if not (space.most[0] < np.inf or space.most[1] < np.inf or rolls):
            break
        if not _contract_second(arrays, work, places, part, directions, space, low, high):
            return 1, driver
        left = 1.0
        for j in range(low.shape[0]):
            if space.half[j] > 0.0:
                left *= max((high[j] - low[j]) / (2.0 * space.half[j]), 1e-3)
        if left > GAIN:
            break
    return 0, driver
