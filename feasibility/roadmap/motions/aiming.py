"""Where the tool is to be: the kernels that set the target of a step, and what it may use."""

import numpy as np

from coverable.kernels import entry, kernel
from feasibility.roadmap.motions.roll_kernels import frame_rates, level
from feasibility.roadmap.motions.search_arrays import NEAR_COST

# [1] share of a piece by which the curve's point closest to a waypoint may lie off the one aimed at
BESIDE = 0.05
CENTRE_SHARE = 0.999  # [1] of the tolerance, for self-motions: curves deviate at the centres too


@entry
def stand_still(arrays, work):
    """Let `work.target` be at rest, at a cell's centre or next to it."""
    for part in range(work.derivative_bound.shape[0]):
        work.derivative_bound[part] = 0.0
    work.derivative_bound[2] = arrays.curvature
    work.derivative_bound[8] = arrays.roll_rate
    work.allowance[0] = CENTRE_SHARE * arrays.tolerance
    work.allowance[1] = arrays.inner_cone_chord
    work.allowance[2] = max(arrays.roll[1] - arrays.roll_lost, 0.0)


@entry
def look_at(arrays, work, cell):
    """Set `work.target` to that of a cell's centre, at rest."""
    for k in range(3):
        work.target[0, k] = arrays.points[cell, k]
        work.target[1, k] = arrays.approaches[cell, k]
        if arrays.roll[1] < np.inf:
            work.target[2, k] = arrays.references[cell, k]
    stand_still(arrays, work)


@entry
def aim(arrays, work, curve, t):
    """Set `work.target` to the target of a curve at t in [0, 1]."""
    first = arrays.first_piece[curve]
    count = arrays.first_piece[curve + 1] - first
    piece = min(np.int64(t * count), count - 1)
    s = t * count - piece
    for k in range(3):
        for part in range(2):
            value = arrays.targets[first + piece, 3, 3 * part + k]
            for power in range(2, -1, -1):
                value = value * s + arrays.targets[first + piece, power, 3 * part + k]
            work.target[part, k] = value
    if arrays.roll[1] < np.inf:
        for k in range(3):
            value = arrays.frames[first + piece, 3, k]
            for power in range(2, -1, -1):
                value = value * s + arrays.frames[first + piece, power, k]
            work.target[2, k] = value
        level(work.target)


@kernel
def speed_at(arrays, curve, t):
    """Speed of the target along a curve by t, at t in [0, 1], m."""
    first = arrays.first_piece[curve]
    count = arrays.first_piece[curve + 1] - first
    piece = min(np.int64(t * count), count - 1)
    s = t * count - piece
    square = 0.0
    for k in range(3):
        slope = 3.0 * s * arrays.targets[first + piece, 3, k]
        slope = arrays.targets[first + piece, 1, k] + s * (
            2.0 * arrays.targets[first + piece, 2, k] + slope
        )
        square += slope * slope
    return np.sqrt(square) * count


@kernel
def bounds_between(arrays, work, curve, t0, t1):
    """Set `work.derivative_bound` and `work.allowance` for a step along a curve.

    The step goes from t0 to t1, in either direction.
    """
    first = arrays.first_piece[curve]
    count = arrays.first_piece[curve + 1] - first
    low = min(np.int64(max(min(t0, t1) * count - BESIDE, 0.0)), count - 1)
    high = min(np.int64(max(t0, t1) * count + BESIDE), count - 1)
    for part in range(3):
        most = 0.0
        for piece in range(low, high + 1):
            most = max(most, arrays.derivative_bounds[first + piece, part])
        work.derivative_bound[part] = most * (t1 - t0) ** 2 if part < 2 else most
    work.derivative_bound[3] = speed_at(arrays, curve, t0) * abs(t1 - t0)
    work.derivative_bound[4] = speed_at(arrays, curve, t1) * abs(t1 - t0)
    # Never more than self-motions may use, and as much on an ordinary curve: every configuration
    # that is valid over a cell can start from it.
    lost = (
        arrays.cone_chord
        - arrays.deviations[curve, 1]
        - NEAR_COST * work.derivative_bound[2] * arrays.near
    )
    work.allowance[0] = max(arrays.tolerance - arrays.deviations[curve, 0], 0.0)
    work.allowance[1] = max(min(arrays.inner_cone_chord, lost), 0.0)
    if arrays.roll[1] < np.inf:
        _frames_between(arrays, work, curve, t0, t1, first + low, first + high)


@kernel
def _frames_between(arrays, work, curve, t0, t1, low, high):
    """`bounds_between` for roll; low and high are the first and the last piece."""
    step = abs(t1 - t0)
    slope, curl, rate = 0.0, 0.0, 0.0
    for piece in range(low, high + 1):
        slope = max(slope, arrays.frame_bounds[piece, 0] * step)
        curl = max(curl, arrays.frame_bounds[piece, 1] * step * step)
        rate = max(rate, arrays.frame_bounds[piece, 2])
    aim(arrays, work, curve, t0)
    x, y, z = work.target[1, 0], work.target[1, 1], work.target[1, 2]
    aim(arrays, work, curve, t1)
    x, y, z = work.target[1, 0] - x, work.target[1, 1] - y, work.target[1, 2] - z
    speed, turn, second = frame_rates(
        np.sqrt(x * x + y * y + z * z),
        work.derivative_bound[1],
        slope,
        curl,
        arrays.deviations[curve, 1],
        arrays.frame_deviations[curve, 0],
    )
    work.derivative_bound[5] = speed
    work.derivative_bound[6] = turn
    work.derivative_bound[7] = second
    work.derivative_bound[8] = rate
    lost = max(arrays.roll_lost, arrays.frame_deviations[curve, 1] + NEAR_COST * rate * arrays.near)
    work.allowance[2] = max(arrays.roll[1] - lost, 0.0)
