"""What of a box may still hold a solution: contraction to second order.

A box is an interval for each joint and, where the place on the surface is free, one for each of the
two parameters x of a part of it (`surfaces.parts`): there the target point is T(x) = c + e_1 x_1 +
e_2 x_2 up to a radius r, and the approach direction likewise. A target at rest is a part without
parameters, of radius 0.

**Lemma.** Let c be the middle of a box, J the derivatives of the tool point there, and D/2 its
second-order bound over the box (`feasibility.roadmap.box_bounds`). Let y = c + (dq, dx) be in the
box, with a place of the part at its x whose target point is within the tolerance of p. Then for
every unit w

    |w . (p(c) + J dq - T(c) - e dx)| <= tolerance + D/2 + r

and likewise for the tool axis, with the chord of the cone in place of the tolerance. *Proof.* p is
within D/2 of p(c) + J dq, the target within r of T(c) + e dx, and a projection only shrinks. QED

So a box holds nothing when its target is further off than tolerance, r and first-order bounds
allow, or when no (dq, dx) in it satisfies these inequalities for a few w; and every interval can be
contracted to what the others leave open.

Boxes may have slabs, low <= w . q <= high for some weights w: those of cuts.
"""

from __future__ import annotations

import numpy as np

from feasibility.compiled import inlined, kernel
from feasibility.roadmap.arrays import NEXT, place
from feasibility.roadmap.branch_and_bound.box_bounds import contract, contract_to_ball, reach_of_box
from robots import jacobians

THINNEST = 1e-6  # [rad], [m]: boxes are not halved further
ROUNDING = 1e-10  # [m], [1], [rad]: more than the error of double arithmetic in a cut
PASSES = 3  # contractions of a box
GAIN = 0.3  # [1] of the volume left: contracting again would gain little


@inlined
def _place_centre(arrays, work, places, part, low, high, space):  # type: ignore[no-untyped-def]
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
    place(arrays, work, NEXT, space.q)


@inlined
def _first_and_second(arrays, work, places, part, space):  # type: ignore[no-untyped-def]
    """Bounds of first and second order, for the point and for the axis, over the present box."""
    n, m = space.q.shape[0], space.half.shape[0]
    first, second, first_axis, second_axis = reach_of_box(
        arrays, work, space.half, space.longest, space.lever, space.sine
    )
    for i in range(m - n):
        slope, turn = 0.0, 0.0
        for k in range(3):
            slope += places.slopes[part, i, k] ** 2
            turn += places.slopes[part, i, 3 + k] ** 2
        first += np.sqrt(slope) * space.half[n + i]
        first_axis += np.sqrt(turn) * space.half[n + i]
    return first, second, first_axis, second_axis


@inlined
def _contract_second(arrays, work, places, part, near, narrow, directions, space, low, high):  # type: ignore[no-untyped-def]
    """Cut the present box by the lemma of this module; False when nothing is left.

    Args:
        arrays, work, places, part, directions, space, low, high: as in `shrink`.
        near, narrow: the right hand sides, for tool point and axis; inf where they say nothing.
    """
    n, m = space.q.shape[0], low.shape[0]
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
    for j in range(m):
        low[j] += space.middle[j]
        high[j] += space.middle[j]
    return True


@inlined
def _inside_slabs(slabs, q):  # type: ignore[no-untyped-def]
    """Do the slabs hold a configuration, but for what no box is cut to?"""
    inside = True
    for i in range(slabs.weights.shape[0]):
        at = 0.0
        for j in range(q.shape[0]):
            at += slabs.weights[i, j] * q[j]
        inside &= slabs.low[i] - THINNEST <= at and at <= slabs.high[i] + THINNEST
    return inside


@kernel
def shrink(arrays, work, places, part, slabs, directions, space, low, high):  # type: ignore[no-untyped-def]
    """Cut one box (in place) to what may still hold a solution.

    Returns:
        1 when nothing is left, 2 when its centre is a solution, 3 when it is not finite, 0
        otherwise; and whether the tool point, rather than the axis, is closer to ruling it out.
    """
    by_point = True
    off, turned = places.radius[part, 0], places.radius[part, 1]
    for _ in range(PASSES):
        for i in range(slabs.weights.shape[0]):
            least, most = slabs.low[i] - ROUNDING, slabs.high[i] + ROUNDING
            if not contract(slabs.weights[i], least, most, low, high):
                return 1, by_point
        _place_centre(arrays, work, places, part, low, high, space)
        distance, chord = work.error[1, 0], work.error[1, 1]
        if not (distance < np.inf and chord < np.inf):
            return 3, by_point
        if (
            distance + off <= arrays.tolerance
            and chord + turned <= arrays.cone_chord
            and _inside_slabs(slabs, space.q)
        ):
            return 2, by_point
        first, second, first_axis, second_axis = _first_and_second(
            arrays, work, places, part, space
        )
        near = arrays.tolerance + off + ROUNDING
        narrow = arrays.cone_chord + turned + ROUNDING
        by_point = distance / (near + min(first, second)) > chord / (
            narrow + min(first_axis, second_axis)
        )
        if distance > near + first or chord > narrow + first_axis:
            return 1, by_point
        # The second order is of use only where it beats the first.
        near = near + second if second < first else np.inf
        narrow = narrow + second_axis if second_axis < first_axis else np.inf
        if not (near < np.inf or narrow < np.inf):
            break
        if not _contract_second(
            arrays, work, places, part, near, narrow, directions, space, low, high
        ):
            return 1, by_point
        left = 1.0
        for j in range(low.shape[0]):
            if space.half[j] > 0.0:
                left *= max((high[j] - low[j]) / (2.0 * space.half[j]), 1e-3)
        if left > GAIN:
            break
    return 0, by_point
