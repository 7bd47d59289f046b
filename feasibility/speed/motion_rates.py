"""What some motions allow: speed of the tool, and distance from singularities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.rates import SegmentRates, in_place, segment_rates
from feasibility.task import Task
from robots import Robot
from surfaces import Cells

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class MotionRates(NamedTuple):
    """Of k motions."""

    speed: Array
    """(k,) m/s, lower bound of what the tool may have all along, but where it waits; inf where it
    does not move."""
    sigma: Array
    """(k,) lower bound of the smallest singular value; inf where it was not asked for."""
    sampled_sigma: Array
    """(k,) upper bound of it."""
    joint: Ints
    """(k,) the joint that allows no more speed."""
    share: Array
    """(k,) m/s allowed over that joint's limit: v / share is what the joint needs for v."""

    def fine(self, task: Task) -> NDArray[np.bool_]:
        """(k,) which do what a task asks."""
        speed, sigma = task.speed or -np.inf, task.min_manipulability or -np.inf
        return np.asarray((self.speed >= speed) & (self.sigma >= sigma))

    def best(self, some: Ints) -> int:
        """Which of some motions allows most."""
        return int(some[np.lexsort((self.speed[some], self.sigma[some]))[-1]])

    def words(self, robot: Robot, task: Task, which: int) -> str:
        """Why one of them does not do: the joint that is too slow, or the singular values."""
        if task.speed is not None and self.speed[which] < task.speed:
            return too_slow_words(robot, int(self.joint[which]), self.share[which], task.speed)
        return (
            f"the smallest singular value falls to {self.sampled_sigma[which]:.3g}; "
            f"{task.min_manipulability:g} is asked"
        )


def too_slow_words(robot: Robot, joint: int, share: float, speed: float, where: str = "") -> str:
    """What a joint would need for a speed (m/s), and what it has.

    Args:
        robot: the arm.
        joint: its number.
        share: m/s that the tool has where the joint turns by one rad/s.
        speed: m/s.
        where: " at ...", if that is to be said.
    """
    unit = "m/s" if robot.prismatic[joint] else "rad/s"
    needed = f"{speed / share:.3g} {unit}" if share > 0.0 else "endless speed"
    allows = f"it allows {robot.max_velocity[joint]:.3g}"
    return f"{robot.joint_names[joint]} would need {needed}{where}; {allows}"


def motion_rates(robot: Robot, cells: Cells, task: Task, motions: Sequence[Array]) -> MotionRates:
    """Rate motions, all at once.

    Args:
        robot: the arm.
        cells: over the centres of which the tool may wait.
        task: singular values are looked at where it asks for some.
        motions: (m, n) rows each, straight in joint space between them.
    """
    count = len(motions)
    if not count:
        none = np.zeros(0)
        return MotionRates(none, none, none, np.zeros(0, dtype=np.int64), none)
    q = np.vstack(motions)
    owner = np.repeat(np.arange(count), [len(motion) for motion in motions])
    inside = owner[:-1] == owner[1:]
    resting = in_place(robot, cells, task, q)[inside]
    found = segment_rates(
        robot, q[:-1][inside], q[1:][inside],
        sigma=task.min_manipulability, group=owner[:-1][inside], resting=resting,
    )  # fmt: skip
    return _least(robot, count, owner[:-1][inside], found)


def _least(robot: Robot, count: int, owner: Ints, found: SegmentRates) -> MotionRates:
    """The least of each motion's segments."""
    speed, sigma, sampled, share = (np.full(count, np.inf) for _ in range(4))
    joint = np.zeros(count, dtype=np.int64)
    np.minimum.at(sigma, owner, found.sigma)
    np.minimum.at(sampled, owner, found.sampled_sigma)
    order = np.lexsort((found.speed, owner))
    moving, first = np.unique(owner[order], return_index=True)
    rows = order[first]
    speed[moving], joint[moving] = found.speed[rows], found.joint[rows]
    share[moving] = found.sampled_speed[rows] / robot.max_velocity[joint[moving]]
    return MotionRates(speed, sigma, sampled, joint, share)
