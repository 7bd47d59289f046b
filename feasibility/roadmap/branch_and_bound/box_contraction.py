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

from __future__ import annotations

import numpy as np

from coverable.kernels import kernel
from feasibility.roadmap.branch_and_bound.box_bounds import (
    contract_to_ball,
    reach_of_direction,
    reach_of_point,
)
from feasibility.roadmap.branch_and_bound.roll_bounds import (
    contract_roll,
    length_of,
    reference_rows,
    roll_chord,
    rolls_over,
    unturned,
)
from feasibility.roadmap.motions.working_memory import NEXT, place
from robots.chain import jacobians

THINNEST = 1e-6  # [rad], [m]: boxes are not halved further
ROUNDING = 1e-10  # [m], [1], [rad]: more than the error of double arithmetic in a cut
SKEWED = 1.5  # [1] roll differs by no more than so many times what its frame does, up to 90 deg
PASSES = 3  # contractions of a box
GAIN = 0.3  # [1] of the volume left: contracting again would gain little


@kernel
def _place_centre(arrays, work, places, part, low, high, space):
    """Evaluate the arm and the target at a box's centre."""
    n, m = space.q.shape[0], low.shape[0]
    for j in range(m):
        space.middle[j] = 0.5 * (low[j] + high[j])
        space.half[j] = 0.5 * (high[j] - low[j])
        if j < n:
            space.q[j] = space.middle[j]
    for k in range(3):
        for which in range(2):
            value = places.centre[part, 3 * which + k]
            for i in range(m - n):
                value += space.middle[n + i] * places.slopes[part, i, 3 * which + k]
            work.target[which, k] = value
    if rolls_over(arrays, places, part):
        for k in range(3):
            value = places.centre[part, 6 + k]
            for i in range(m - n):
                value += space.middle[n + i] * places.slopes[part, i, 6 + k]
            space.toward[k] = value
        unturned(work.target, space.toward, arrays.roll[0])
    place(arrays, work, NEXT, space.q)


@kernel
def _first_and_second(arrays, work, places, part, space):
    """Bounds of first and second order, for the point and for the axis, over the present box."""
    n, m = space.q.shape[0], space.half.shape[0]
    first, second = reach_of_point(arrays, work, space.half[:n], space.longest, space.lever)
    first_axis, second_axis = reach_of_direction(
        arrays, work, work.axis[1], space.half[:n], space.sine
    )
    for i in range(m - n):
        first += length_of(places.slopes[part, i, :3]) * space.half[n + i]
        first_axis += length_of(places.slopes[part, i, 3:6]) * space.half[n + i]
    return first, second, first_axis, second_axis


@kernel
def _contract_second(arrays, work, places, part, directions, space, low, high):
    """Cut the present box by the lemma of this module; False when nothing is left.

    Args:
        arrays, work, places, part, directions, space, low, high: as in `shrink`.
            `space.most` holds the right hand sides.
    """
    n, m = space.q.shape[0], low.shape[0]
    near, narrow, rolled = space.most[0], space.most[1], space.most[2]
    jacobians(
        arrays.chain, work.origins[1], work.axes[1], work.point[1], work.axis[1],
        space.point_rows, space.axis_rows,
    )  # fmt: skip
    for k in range(3):
        space.gap[0, k] = work.target[0, k] - work.point[1, k]
        space.gap[1, k] = work.target[1, k] - work.axis[1, k]
        for i in range(m - n):
            space.point_rows[k, n + i] = -places.slopes[part, i, k]
            space.axis_rows[k, n + i] = -places.slopes[part, i, 3 + k]
            space.reference_rows[k, n + i] = -places.slopes[part, i, 6 + k]
    for j in range(m):
        low[j] -= space.middle[j]
        high[j] -= space.middle[j]
    if near < np.inf and not contract_to_ball(
        space.point_rows, space.gap[0], work.error[1, 0], near, directions, space.row, low, high
    ):
        return False
    if narrow < np.inf and not contract_to_ball(
        space.axis_rows, space.gap[1], work.error[1, 1], narrow, directions, space.row, low, high
    ):
        return False
    if rolled < np.inf:
        reference_rows(arrays, work, space.reference_rows)
        if not contract_to_ball(
            space.reference_rows, space.gap[2], length_of(space.gap[2]), rolled, directions,
            space.row, low, high,
        ):  # fmt: skip
            return False
    # The target at rest, so that roll itself is a function of the joints alone.
    at_rest = m == n and rolls_over(arrays, places, part)
    if at_rest and not contract_roll(arrays, work, space.half, space.sine, space.row, low, high):
        return False
    for j in range(m):
        low[j] += space.middle[j]
        high[j] += space.middle[j]
    return True


@kernel
def _first_and_second_of_roll(arrays, work, places, part, space):
    """Bounds of first and second order for the reference axis over a box; sets its gap."""
    n, m = space.q.shape[0], space.half.shape[0]
    for k in range(3):
        space.gap[2, k] = space.toward[k] - work.reference[1, k]
    first, second = reach_of_direction(
        arrays, work, work.reference[1], space.half[:n], space.reference_sine
    )
    for i in range(m - n):
        first += length_of(places.slopes[part, i, 6:]) * space.half[n + i]
    return first, second


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
    driver = 0
    rolls, rolled, off_roll = rolls_over(arrays, places, part), np.inf, 0.0
    for _ in range(PASSES):
        _place_centre(arrays, work, places, part, low, high, space)
        distance, chord = work.error[1, 0], work.error[1, 1]
        if not (distance < np.inf and chord < np.inf):
            return 3, driver
        if _is_solution(arrays, work, places, part):
            return 2, driver
        first, second, first_axis, second_axis = _first_and_second(
            arrays, work, places, part, space
        )
        near = arrays.tolerance + places.radius[part, 0] + ROUNDING
        narrow = arrays.cone_chord + places.radius[part, 1] + ROUNDING
        by_point = distance / (near + min(first, second))
        by_axis = chord / (narrow + min(first_axis, second_axis))
        driver = 0 if by_point > by_axis else 1
        if distance > near + first or chord > narrow + first_axis:
            return 1, driver
        if rolls:
            first_roll, second_roll = _first_and_second_of_roll(arrays, work, places, part, space)
            rolled = roll_chord(arrays) + places.radius[part, 2] + ROUNDING
            off_roll = length_of(space.gap[2])
            if off_roll / (rolled + min(first_roll, second_roll)) > max(by_point, by_axis):
                driver = 2
            if off_roll > rolled + first_roll:
                return 1, driver
            rolled = rolled + second_roll if second_roll < first_roll else np.inf
        # The second order is of use only where it beats the first.
        space.most[0] = near + second if second < first else np.inf
        space.most[1] = narrow + second_axis if second_axis < first_axis else np.inf
        space.most[2] = rolled
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
