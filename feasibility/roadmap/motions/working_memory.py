"""The working memory of the search, and the kernels that evaluate the arm into it.

Slot 0 is where the arm is, slot 1 where it tries to go.
"""

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from coverable.kernels import entry, kernel
from feasibility.roadmap.motions.roll_kernels import roll_off_middle
from robots.chain import frames

HERE, NEXT = np.int64(0), np.int64(1)  # slots of `Work`: where the arm is, where it tries to go
OF_CONE, OF_ROLL = np.int64(0), np.int64(1)  # rows of `Work.gradients`


class Work(NamedTuple):
    """Working memory of one thread; slot 0 is where the arm is, slot 1 where it tries to go."""

    origins: Array
    """(2, n, 3)"""
    axes: Array
    """(2, n, 3)"""
    point: Array
    """(2, 3)"""
    axis: Array
    """(2, 3)"""
    reference: Array
    """(2, 3) the tool's reference axis, across its axis."""
    error: Array
    """(2, 3) distance of the tool point from its target, |a - b|, and roll less the middle of its
    range (0 where it is free), in each slot."""
    point_rows: Array
    """(3, n)"""
    axis_rows: Array
    """(3, n)"""
    gradients: Array
    """(2, n) of |a - b|, and of roll."""
    rows: Array
    """(6, n) constraint rows of the step."""
    rhs: Array
    """(6,)"""
    secondary_step: Array
    """(n,) the step of the secondary objective, to be taken in the free directions."""
    step: Array
    """(n,)"""
    held: Mask
    """(n,) joints that the step holds at a limit."""
    trial: Array
    """(n,)"""
    kept: Array
    """(n,) the best configuration of a projection off the target."""
    target: Array
    """(3, 3) target point, approach direction, and the direction that roll is measured from."""
    derivative_bound: Array
    """(9,) largest second derivatives of target point and approach direction over the present
    step, by its own parameter in 0..1, zero while the target is at rest; the curvature of the
    target surface there (1/m); the target's speed by that parameter at both ends (m); and, where
    roll is limited, how fast the approach direction changes (1), the frame that roll is measured in
    turns (rad), and that rate changes (rad), at most; and rad of roll for each metre off the
    target."""
    allowance: Array
    """(3,) what the present step may use of the tolerance (m), of the cone chord, and of the roll's
    half range (rad); 0 where nothing is left."""
    roll_terms: Array
    """(4,) turn, A, G and W of the last segment, see `segment_bound`."""
    counts: Ints
    """(1,) forward kinematics evaluated."""
    stop_reason: Ints
    """(2,) why the last motion stopped: a code, and the joint for LIMIT."""


def work_for(n: int) -> Work:
    """Working memory for an arm of n joints."""
    return Work(
        origins=np.zeros((2, n, 3)),
        axes=np.zeros((2, n, 3)),
        point=np.zeros((2, 3)),
        axis=np.zeros((2, 3)),
        reference=np.zeros((2, 3)),
        error=np.zeros((2, 3)),
        point_rows=np.zeros((3, n)),
        axis_rows=np.zeros((3, n)),
        gradients=np.zeros((2, n)),
        rows=np.zeros((6, n)),
        rhs=np.zeros(6),
        secondary_step=np.zeros(n),
        step=np.zeros(n),
        held=np.zeros(n, dtype=np.bool_),
        trial=np.zeros(n),
        kept=np.zeros(n),
        target=np.zeros((3, 3)),
        derivative_bound=np.zeros(9),
        allowance=np.zeros(3),
        roll_terms=np.zeros(4),
        counts=np.zeros(1, dtype=np.int64),
        stop_reason=np.zeros(2, dtype=np.int64),
    )


@kernel
def measure(arrays, work, slot):
    """Set the errors of a slot against `work.target`."""
    distance = 0.0
    chord = 0.0
    for k in range(3):
        distance += (work.point[slot, k] - work.target[0, k]) ** 2
        chord += (work.axis[slot, k] - work.target[1, k]) ** 2
    work.error[slot, 0] = np.sqrt(distance)
    work.error[slot, 1] = np.sqrt(chord)
    work.error[slot, 2] = 0.0
    if arrays.roll[1] < np.inf:
        work.error[slot, 2] = roll_off_middle(
            work.target, work.axis[slot], work.reference[slot], arrays.roll[0]
        )


@entry
def place(arrays, work, slot, q):
    """Evaluate the arm at q into a slot, and its errors against `work.target`."""
    frames(
        arrays.chain, q, work.origins[slot], work.axes[slot], work.point[slot], work.axis[slot],
        work.reference[slot],
    )  # fmt: skip
    work.counts[0] += 1
    measure(arrays, work, slot)


@kernel
def _copy(work, source, slot):
    """Copy the placement of one slot to the other."""
    for i in range(work.axes.shape[1]):
        for k in range(3):
            work.origins[slot, i, k] = work.origins[source, i, k]
            work.axes[slot, i, k] = work.axes[source, i, k]
    for k in range(3):
        work.point[slot, k] = work.point[source, k]
        work.axis[slot, k] = work.axis[source, k]
        work.reference[slot, k] = work.reference[source, k]


@kernel
def accept(work):
    """Make the trial slot the current one."""
    _copy(work, NEXT, HERE)
    for k in range(3):
        work.error[HERE, k] = work.error[NEXT, k]


@kernel
def copy_slot(arrays, work):
    """Let slot 1 start from slot 0; its errors are against the present target."""
    _copy(work, HERE, NEXT)
    measure(arrays, work, NEXT)


@kernel
def off_target(arrays, work, slot):
    """m by which the tool point is off its target, less `near`.

    The surface's normal next to a target is another, and so is the frame that roll is measured in
    (see NEAR_COST; what `near` costs is taken off `Work.allowance`).
    """
    return max(work.error[slot, 0] - arrays.near, 0.0)


@kernel
def cone_used(arrays, work, slot):
    """The part of the cone chord that a slot uses, with what it costs to be off the target."""
    off = off_target(arrays, work, slot)
    return work.error[slot, 1] + arrays.off_target_cost * work.derivative_bound[2] * off


@kernel
def roll_lost(arrays, work, slot):
    """rad of the roll's range that it costs a slot to be off its target."""
    off = off_target(arrays, work, slot)
    # A pole costs nothing where the tool point is at its target.
    return arrays.off_target_cost * work.derivative_bound[8] * off if off > 0.0 else 0.0


@kernel
def roll_used(arrays, work, slot):
    """rad of the roll's half range that a slot uses, as `cone_used`."""
    return abs(work.error[slot, 2]) + roll_lost(arrays, work, slot)


@kernel
def put(target, source):
    """Copy numbers into an array of the same length; numba's `target[:] = source` is far longer."""
    for j in range(target.shape[0]):
        target[j] = source[j]
