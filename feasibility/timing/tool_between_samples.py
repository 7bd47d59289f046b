"""How fast the tool point gets on what a controller makes of a trajectory.

At the samples it is known. Between two of them its velocity p' is off the straight line from one to
the other by at most h^2/8 max |p'''|, and with sums over the joints of the largest |q'|, |q''| and
|q'''|, called B, A and J, and L the longest lever arm,

    |p'''| <= L (J + 3 A B + B^3),        L <= (1 + h B) times that at the nearer sample,

because each derivative by a joint turns what comes behind it, and at the end there is a lever arm.
Where the joints run evenly that is enough. Elsewhere the tool is computed in between.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from coverable_arrays import Array
from feasibility.timing.sampled_trajectory import (
    KINDS,
    PLACES,
    Trajectory,
    Used,
    coefficients,
    derivative,
    used_by_joints,
    values,
)
from feasibility.timing.speed_limits import MotionLimits, speeds
from robots import Robot, moved_by_joints


def used(robot: Robot, run: Trajectory, limits: MotionLimits) -> Used:
    """How much of its limits a trajectory uses, however it is interpolated; of one sample, 0."""
    by_joints = used_by_joints(run, limits)
    if len(run) < 2:
        return by_joints
    tool = fastest_tool(robot, run, limits.tool_speed)
    return replace(by_joints, tool_speed=tool / limits.tool_speed)


def fastest_tool(robot: Robot, run: Trajectory, enough: float) -> float:
    """m/s, the tool's largest speed, however samples are interpolated; at least two of them.

    Stretches that a bound shows to be slower than `enough` (m/s) are not looked at any closer.
    """
    moved = moved_by_joints(robot.chain, run.q)
    at = speeds(moved, run.dq)
    levers = np.sqrt((moved**2).sum(axis=1)).max(axis=0)
    ends = np.maximum(at[:-1], at[1:])
    fastest, h = float(at.max()), np.diff(run.time)
    for kind in KINDS:
        points = coefficients(run, kind)
        slopes = derivative(run, points)
        seconds = derivative(run, slopes)
        rates = (slopes, seconds, derivative(run, seconds))
        b, a, j = (np.abs(rate).max(axis=0).sum(axis=1) for rate in rates)
        longest = np.maximum(levers[:-1], levers[1:]) * (1.0 + h * b)
        most = ends + 0.125 * h * h * longest * (j + 3.0 * a * b + b * b * b)
        open_ = np.flatnonzero(~(most <= enough))
        if len(open_):
            q, dq = (values(some[:, open_], PLACES) for some in (points, slopes))
            inner = speeds(moved_by_joints(robot.chain, q), dq).reshape(-1, PLACES)
            fastest = max(fastest, _largest(np.column_stack([inner, at[open_ + 1]])))
    return fastest


def _largest(rows: Array) -> float:
    """m/s, the largest of speeds (k, PLACES + 1) at equal steps, and in between.

    Between two places a parabola is higher by up to 1/8 of its second difference than the larger
    of both; twice that is allowed for.
    """
    most_second = np.abs(np.diff(rows, n=2, axis=1)).max(axis=1)
    return float((rows.max(axis=1) + 0.25 * most_second).max())
