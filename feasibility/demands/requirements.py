"""Speed, singularities and home in a task: checked before anything is searched."""

import numpy as np

from coverable.errors import ArgumentError, Fault
from feasibility.search_settings import Search
from feasibility.task import Task
from robots.robot import Robot


def check_requirements(robot: Robot, task: Task, search: Search) -> None:
    """Refuse a speed, a distance from singularities or a home that this arm cannot have.

    Raises:
        ArgumentError: joints without velocity limits, a speed beyond all of them, the greedy
            search, or a home that is no configuration of the arm.
    """
    _check_home(robot, task)
    if not task.requires_rates:
        return
    if search.method != "complete":
        what = "needs the complete search: the greedy one has no motion over the cells' centres"
        raise ArgumentError(Fault("speed" if task.speed else "min_manipulability", what), "task")
    from feasibility.certification.rate_replay import check_rates

    check_rates(robot, task)


def required_words(task: Task) -> str:
    """What a task requires of speed and singular values, as a sentence goes on; maybe nothing."""
    words = [] if task.speed is None else [f"at {task.speed:g} m/s"]
    if task.min_manipulability is not None:
        words.append(f"with singular values of {task.min_manipulability:g} at least")
    return " and ".join(words)


def _check_home(robot: Robot, task: Task) -> None:
    """Refuse a home that is no configuration of the arm.

    Raises:
        ArgumentError: it has another number of joints, one that slides, or one past its limits.
    """
    if task.home_deg is None:
        return
    what, names = "", ", ".join(robot.joint_names)
    home = np.radians(task.home_deg)
    if len(home) != robot.n:
        what = f"has {len(home)} values; expected one for each of {names}"
    elif robot.prismatic.any():
        what = f"gives degrees, but {robot.joint_names[int(np.argmax(robot.prismatic))]} slides"
    elif not ((home >= robot.lower) & (home <= robot.upper)).all():
        past = int(np.argmax(np.maximum(robot.lower - home, home - robot.upper)))
        limits = np.degrees([robot.lower[past], robot.upper[past]])
        what = (
            f"puts {robot.joint_names[past]} at {task.home_deg[past]:g} deg, outside its limits "
            f"{limits[0]:.4g} to {limits[1]:.4g} deg"
        )
    if what:
        raise ArgumentError(Fault("home_deg", what), "task")
