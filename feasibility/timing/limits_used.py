"""How much of its limits a motion uses, between samples too; and what it passes joint limits by.

Between samples accelerations run straight, so their largest values are at the ends; velocities are
parabolas and places are cubics, largest at the ends or where they turn. The tool is looked at in
`PLACES` of each piece, and twice what a parabola through them may be higher is allowed for.
"""

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array
from feasibility.timing.sampled_trajectory import Trajectory, bends
from feasibility.timing.speed_limits import MotionLimits, tool_speeds
from robots.robot import Robot

PLACES = 4  # at which the tool is looked at on each piece, its first end among them


@dataclass(frozen=True, eq=False, slots=True)
class Used:
    """How much of its limits a motion uses; 1 is all."""

    velocity: Array
    """(n,) share of each joint's velocity."""
    acceleration: Array
    """(n,) the same for accelerations."""
    tool_speed: float
    """Share of the tool's speed."""

    @property
    def too_fast(self) -> float:
        """How many times slower all must run to keep to the limits."""
        root = float(np.sqrt(self.acceleration.max(initial=0.0)))
        return max(float(self.velocity.max(initial=0.0)), root, self.tool_speed)


def used(robot: Robot, run: Trajectory, limits: MotionLimits) -> Used:
    """How much of its limits a motion uses, as the spline that it is; of one sample, nothing."""
    most = used_each(robot, run, limits).max(axis=0, initial=0.0)
    return Used(most[: robot.n], most[robot.n : -1], float(most[-1]))


def used_each(robot: Robot, run: Trajectory, limits: MotionLimits) -> Array:
    """(k - 1, 2 n + 1) the same between any two of k samples: velocities, accelerations, tool."""
    if len(run) < 2:
        return np.zeros((0, 2 * robot.n + 1))
    first, last = bends(run)
    steps = np.diff(run.time)[:, None]
    with np.errstate(divide="ignore", invalid="ignore"):
        turn = np.clip(np.nan_to_num(first / (first - last), posinf=0.0, neginf=0.0), 0.0, 1.0)
    peaks = run.dq[:-1] + turn * steps * (first + 0.5 * turn * (last - first))
    velocity = np.max(np.abs([run.dq[:-1], peaks, run.dq[1:]]), axis=0)
    acceleration = np.max(np.abs([first, last, run.ddq[:-1], run.ddq[1:]]), axis=0)
    inner = (run.time[:-1, None] + np.arange(PLACES) / PLACES * steps).ravel()
    tool = tool_speeds(robot, run.at(inner), run.at(inner, 1)).reshape(-1, PLACES)
    rows = np.column_stack([tool, np.append(tool[1:, 0], run.tool_speed[-1])])
    # Between two places a parabola is higher by up to 1/8 of its second difference.
    most = rows.max(axis=1) + 0.25 * np.abs(np.diff(rows, n=2, axis=1)).max(axis=1)
    return np.column_stack(
        [velocity / limits.velocity, acceleration / limits.acceleration, most / limits.tool_speed]
    )


def past_limits(robot: Robot, run: Trajectory) -> Array:
    """(n,) rad or m, how far each joint goes past its limits; negative where it keeps away."""
    low, high = run.q.min(axis=0), run.q.max(axis=0)
    turns = run.spline.derivative().roots(extrapolate=False) if len(run) > 1 else ()
    for joint, times in enumerate(turns):  # NaN follows the beginning of a rest
        q = run.at(times[np.isfinite(times)])[:, joint]
        low[joint], high[joint] = q.min(initial=low[joint]), q.max(initial=high[joint])
    return np.asarray(np.maximum(robot.lower - low, high - robot.upper))
