"""An oracle's problem as the project's own objects."""

from __future__ import annotations

import numpy as np
from oracle_cases import Problem

from feasibility import Task
from robots import Robot
from surfaces import Cells, Surface, cylinder, hyperboloid, plane, sphere


def surface_of(problem: Problem) -> Surface:
    """The surface."""
    pose = {
        "side": problem.side,
        "position": problem.position,
        "rpy_deg": problem.rpy_deg,
    }
    if problem.kind == "plane":
        return plane(problem.u, problem.v, **pose)
    if problem.kind == "sphere":
        return sphere(*problem.size, problem.u, problem.v, **pose)
    if problem.kind == "cylinder":
        return cylinder(*problem.size, problem.u, problem.v, **pose)
    return hyperboloid(*problem.size, problem.u, problem.v, **pose)


def built(problem: Problem, arm: Robot) -> tuple[Robot, Cells, Task]:
    """What `feasibility.check` wants of a problem, for `arm` with the problem's limits."""
    return (
        arm.with_limits(np.radians(problem.limits_deg)),
        surface_of(problem).cells(*problem.cells),
        Task(standoff=problem.standoff, cone_deg=problem.cone_deg),
    )
