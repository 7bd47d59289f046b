"""The motion behind a component that a search found, found again and replayed."""

from contextlib import suppress
from typing import NamedTuple

from coverable.arrays import Mask
from feasibility.clock import Clock, OutOfTime
from feasibility.demands.motion_rates import replay_at_rates
from feasibility.roadmap.rounds import explore
from feasibility.roadmap.search import exploration_of
from feasibility.roadmap.walk import covering_walk
from feasibility.search_settings import Search
from feasibility.task import Task
from feasibility.verdict import Walk
from robots.robot import Robot
from surfaces.cells import Cells


class OneMotion(NamedTuple):
    """A motion over some cells, or why there is none."""

    walk: Walk | None
    """None where it is refused."""
    refusal: str
    """Empty where the independent replay accepts it."""


def motion_over(
    robot: Robot, cells: Cells, task: Task, search: Search, cover: Mask, clock: Clock | None = None
) -> OneMotion:
    """One continuous motion over what a component covers.

    Args:
        robot, cells, task, search: those of the verdict that the component is of.
        cover: (N,) its cells.
        clock: whose time limit counts.
    """
    clock = (Clock() if clock is None else clock).allow(search.evaluations)
    exploration = exploration_of(robot, cells, task, search.seed, clock)
    exploration.early = search.early
    with suppress(OutOfTime):
        explore(exploration)
    exploration.clock = Clock()
    for root in exploration.roots():
        found = exploration.covers(root)
        if (found >= cover).all():
            walk = covering_walk(exploration.roadmap, root)
            refusal = replay_at_rates(robot, cells, task, walk, found)[1]
            return OneMotion(None if refusal else walk, refusal)
    return OneMotion(None, "the search did not find this motion again")
