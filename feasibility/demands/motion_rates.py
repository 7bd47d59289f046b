"""What some motions allow: speed of the tool, and distance from singularities."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.motion_replay import replay
from feasibility.certification.rate_replay import RateReplay, in_place, replay_rates
from feasibility.certification.segment_rates import SegmentRates, segment_rates
from feasibility.demands.every_demand import TOGETHER, further
from feasibility.paths.coverage import CoveragePath
from feasibility.paths.order import PathError
from feasibility.task import Task
from feasibility.verdict import Certificate, Walk
from robots.robot import Robot
from surfaces.cells import Cells


class MotionRates(NamedTuple):
    """Of k motions."""

    speed: Array
    """(k,) m/s, lower bound of what the tool may have all along, but where it waits; inf where it
    does not move."""
    sigma: Array
    """(k,) lower bound of the smallest singular value; inf where it was not requested."""
    sampled_sigma: Array
    """(k,) upper bound of it."""
    joint: Ints
    """(k,) the joint that allows no more speed."""
    share: Array
    """(k,) m/s allowed over that joint's limit: v / share is what the joint needs for v."""

    def enough(self, task: Task) -> Mask:
        """(k,) which hold what a task requires."""
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
            f"{task.min_manipulability:g} is required"
        )


def too_slow_words(robot: Robot, joint: int, share: float, speed: float, where: str = "") -> str:
    """What a joint would need for a speed (m/s), and what it has.

    `share` is the m/s that the tool has where the joint turns by one rad/s; `where` is " at ..." or
    nothing.
    """
    unit = "m/s" if robot.prismatic[joint] else "rad/s"
    needed = f"{speed / share:.3g} {unit}" if share > 0.0 else "endless speed"
    allows = f"it allows {robot.max_velocity[joint]:.3g}"
    return f"{robot.joint_names[joint]} would need {needed}{where}; {allows}"


def motion_rates(robot: Robot, cells: Cells, task: Task, motions: Sequence[Array]) -> MotionRates:
    """Rate motions of (m, n) rows, straight in joint space between them, all at once.

    The tool may wait over the centres of cells. Singular values are computed where the task limits
    them.
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


def replay_at_rates(
    robot: Robot, cells: Cells, task: Task, walk: Walk, needed: Mask
) -> tuple[Certificate, str]:
    """Replay a motion over the cells `needed` (N,), and judge all else that it has to hold alone.

    Returns:
        What was measured, and why the motion is refused; empty if it is accepted.
    """
    replayed = replay(robot, cells, task, walk, needed)
    refusal = replayed.refusal or further(robot, cells, task, [walk], TOGETHER).refusal
    return replayed.certificate, refusal


def path_rates(path: CoveragePath, walk: Walk | None = None) -> RateReplay | None:
    """The judge's answer about a path's motion; None where the task requires nothing.

    A path in an order of its own need not be as fast as the motion of the verdict. That is
    reported, not refused: timing runs it slower there. `walk` may be another motion over the same
    cells, such as the samples of its trajectory.

    Raises:
        PathError: singular values fall below what the task requires.
    """
    task = path.task
    if not task.requires_rates:
        return None
    replayed = replay_rates(path.robot, path.cells, task, path.walk if walk is None else walk)
    least = task.min_manipulability
    if least is not None and not replayed.sigma >= least:
        raise PathError(
            f"the {'path' if walk is None else 'timed path'} in this order comes too near to a "
            f"singularity: {replayed.refusals[-1]}; try another --order"
        )
    return replayed
