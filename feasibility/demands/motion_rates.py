"""What some motions allow: speed of the tool, and distance from singularities."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.certification.motion_replay import replay
from feasibility.certification.rate_replay import RateReplay, in_place, replay_rates
from feasibility.certification.segment_rates import segment_rates
from feasibility.demands.every_demand import TOGETHER, further
from feasibility.paths.coverage import CoveragePath
from feasibility.paths.order import PathError
from feasibility.task import Task
from feasibility.verdict import Certificate, Walk
from robots.robot import Robot
from surfaces.cells import Cells


class MotionRates(NamedTuple):
    """What one motion allows."""

    speed: float
    """m/s, lower bound of what the tool may have all along, but where it waits; inf where it does
    not move."""
    sigma: float
    """Lower bound of the smallest singular value; inf where it was not requested."""
    sampled_sigma: float
    """Upper bound of it."""
    joint: int
    """The joint that allows no more speed."""
    share: float
    """m/s allowed over that joint's limit: v / share is what the joint needs for v."""

    def fault(self, robot: Robot, task: Task, where: str = "") -> str:
        """Why it does not hold what a task requires; empty where it does.

        That is the joint that is too slow, `where` (" at ...", or nothing), or the singular values.
        """
        if task.speed is not None and self.speed < task.speed:
            unit = "m/s" if robot.prismatic[self.joint] else "rad/s"
            needed = (
                f"{task.speed / self.share:.3g} {unit}" if self.share > 0.0 else "endless speed"
            )
            allows = f"it allows {robot.max_velocity[self.joint]:.3g}"
            return f"{robot.joint_names[self.joint]} would need {needed}{where}; {allows}"
        least = task.min_manipulability
        if least is None or self.sigma >= least:
            return ""
        return f"singular values fall to {self.sampled_sigma:.3g} on the way; {least:g} is required"


def motion_rates(
    robot: Robot, cells: Cells, task: Task, motions: Sequence[Array]
) -> list[MotionRates]:
    """Rate motions of (m, n) rows, straight in joint space between them, all at once.

    The tool may wait over the centres of cells. Singular values are computed where the task limits
    them.
    """
    count = len(motions)
    if not count:
        return []
    q = np.vstack(motions)
    owner = np.repeat(np.arange(count), [len(motion) for motion in motions])
    inside = owner[:-1] == owner[1:]
    owner, resting = owner[:-1][inside], in_place(robot, cells, task, q)[inside]
    found = segment_rates(
        robot, q[:-1][inside], q[1:][inside],
        sigma=task.min_manipulability, group=owner, resting=resting,
    )  # fmt: skip
    speed, sigma, sampled, share = (np.full(count, np.inf) for _ in range(4))
    joint = np.zeros(count, dtype=np.int64)
    np.minimum.at(sigma, owner, found.sigma)
    np.minimum.at(sampled, owner, found.sampled_sigma)
    order = np.lexsort((found.speed, owner))
    moving, first = np.unique(owner[order], return_index=True)
    rows = order[first]
    speed[moving], joint[moving] = found.speed[rows], found.joint[rows]
    share[moving] = found.sampled_speed[rows] / robot.max_velocity[joint[moving]]
    each = (column.tolist() for column in (speed, sigma, sampled, joint, share))
    return [MotionRates(*row) for row in zip(*each, strict=True)]


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
