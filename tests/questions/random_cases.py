"""Stored problems of random patches and limits, and what the oracles say of them.

Drawn at random, and kept only where the answer stays the same on both domains, at two resolutions,
and with cone, limits and place of the surface a little tighter, wider and elsewhere; those of
"apart" are without that filter, with the oracles' answers to a little tighter and wider ones.
"""

import json
from pathlib import Path

import numpy as np
from oracle_cases import Answer, Problem

from coverable import Cells, Robot, Surface, Task, cylinder, hyperboloid, plane, sphere

HERE = Path(__file__).parent


def read(arm: str) -> list[tuple[Problem, Answer]]:
    """The stored problems of an arm, feasible ones first, then those with cells out of reach, then
    those that fall apart, then those that a search once got wrong."""
    found = []
    for case in json.loads((HERE / f"{arm}.json").read_text("utf-8")):
        said = Answer(*(case.pop(field) for field in Answer._fields))
        found.append((Problem.read(case), said))
    return found


def draw(rng: np.random.Generator, arm: str = "puma560") -> Problem:
    problems = read(arm)
    return problems[int(rng.integers(len(problems)))][0]


def surface_of(problem: Problem) -> Surface:
    made = {"plane": plane, "sphere": sphere, "cylinder": cylinder, "hyperboloid": hyperboloid}
    pose = {"side": problem.side, "position": problem.position, "rpy_deg": problem.rpy_deg}
    return made[problem.kind](*problem.size, problem.u, problem.v, **pose)


def built(problem: Problem, arm: Robot) -> tuple[Robot, Cells, Task]:
    """What `feasibility.check` wants of a problem, for `arm` with the problem's limits."""
    robot = arm.with_limits(np.radians(problem.limits_deg))
    task = Task(standoff=problem.standoff, cone_deg=problem.cone_deg)
    return robot, surface_of(problem).cells(*problem.cells), task
