"""What stops an arm that goes on along passes."""

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from feasibility.collisions.problem_bodies import Pair
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions import search_arrays as stop
from feasibility.roadmap.motions.tracking import track
from feasibility.speed.motion_rates import motion_rates
from feasibility.task import Task

WORDS = {
    stop.CONE: "the tool axis would leave the cone",
    stop.ROLL: "the roll of the tool would leave its range",
    stop.SINGULAR: "the arm comes to a singularity",
    stop.LONG: "the motion takes too many steps",
    stop.FOLD: "the surface is creased, or its offset folds",
}


class RunStop(NamedTuple):
    """Where a motion along poses ends."""

    pose: int
    """The last pose that it reaches."""
    cause: str
    """Why it does not reach the next one; empty where it reaches the last."""


def where_it_stops(
    exploration: Exploration,
    task: Task,
    pose: int,
    q: Array,
    pairs: tuple[Pair, ...],
) -> RunStop:
    """Follow the poses from a configuration q (n,) over one of them, as far as it goes.

    Speed and singular values count where the task limits them; `pairs` are the bodies that had to
    stay clear of each other.
    """
    first, cause, motions = pose, "", list[Array]()
    while pose < len(exploration.cells) - 1:
        curve = exploration.curve(pose, pose + 1)
        motion = track(exploration.arrays, exploration.work, curve, 0.0, 1.0, q)
        if motion is None:
            code, joint = (int(value) for value in exploration.work.stop_reason)
            cause = _words(exploration, code, joint, pairs)
            break
        motions.append(np.vstack([q, motion]))
        q = motion[-1]
        pose += 1
    if task.requires_rates:
        rates = motion_rates(exploration.robot, exploration.cells, task, motions)
        slow = np.flatnonzero(~rates.enough(task))
        if len(slow):
            which = int(slow[0])
            return RunStop(first + which, rates.words(exploration.robot, task, which))
    return RunStop(pose, cause)


def _words(exploration: Exploration, code: int, joint: int, pairs: tuple[Pair, ...]) -> str:
    """A reason that tracking stopped."""
    names = exploration.robot.joint_names
    if code == stop.LIMIT:
        which = names[joint] if 0 <= joint < len(names) else "a joint"
        return f"{which} comes to its limit"
    if code == stop.COLLISION:
        if not 0 <= joint < len(pairs):
            return "bodies come too near to each other"
        return f"{pairs[joint].first} and {pairs[joint].second} come too near to each other"
    return WORDS.get(code, "no motion is found")
