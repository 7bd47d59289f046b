"""What collisions cost a check: time beside the same check without, and what is counted."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from paper_cases import PAPER_CASES

from feasibility import Task, check
from feasibility.certification import collision_replay
from feasibility.clock import Clock
from feasibility.collisions import Collision, Obstacle
from feasibility.collisions.kernels import counts
from feasibility.problem import Problem
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions import arrays_of
from feasibility.roadmap.search import close, explore
from robots import Robot, load_robot
from surfaces import Cells, plane

Question = tuple[Robot, Cells, Task]
POST = Obstacle.cylinder("post", 0.04, 1.0, (0.3, 0.32, 0.5))
SHELF = Obstacle.box("shelf", (0.5, 0.6, 0.02), (0.55, 0.0, 0.5))
SELF = Collision(surface=False, clearance=0.005)
WALL = Collision(clearance=0.005)


def _plate(name: str) -> Question:
    """The plate of 0.3 m x 0.4 m before an arm."""
    cells = plane((0.35, 0.65), (-0.2, 0.2), "outside", (0.0, 0.0, 0.1)).cells(6, 8)
    return load_robot(name), cells, Task(0.02, 20.0)


def _paper(name: str) -> Question:
    case = PAPER_CASES[name]
    return case.robot(), case.cells(), case.task()


CASES: dict[str, tuple[Callable[[], Question], Collision, str]] = {
    "ur5, self": (lambda: _plate("ur5"), SELF, "ratio 1.5"),
    "ur5, self + surface": (lambda: _plate("ur5"), WALL, "ratio 4"),
    "ur5, + post": (lambda: _plate("ur5"), replace(WALL, scene=(POST,)), "ratio 4"),
    "panda, self": (lambda: _plate("panda"), SELF, "ratio 1.5"),
    "panda, self + surface": (lambda: _plate("panda"), WALL, "ratio 4"),
    "panda, + post + shelf": (
        lambda: _plate("panda"),
        replace(WALL, scene=(POST, SHELF)),
        "ratio 4",
    ),
    "4a, self": (lambda: _paper("4a"), SELF, "ratio 1.5"),
    "4a, self + dome": (lambda: _paper("4a"), WALL, "200 ms"),
    "4c, self + wall": (lambda: _paper("4c"), WALL, ""),
    "5e, self + wall": (lambda: _paper("5e"), WALL, "400 ms"),
}


def _cpu_ms(ask: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Least processor time of a call, and what the last one returned; the first does not count."""
    answer, taken = ask(), []
    for _ in range(repeats):
        began = time.process_time()
        answer = ask()
        taken.append(1e3 * (time.process_time() - began))
    return min(taken), answer


def _row(name: str, repeats: int) -> dict[str, object]:
    """One case: the whole check, the search's counts, and the judge of collisions."""
    make, collision, goal = CASES[name]
    robot, cells, task = make()
    plain_ms, plain = _cpu_ms(lambda: check(robot, cells, task), repeats)
    asked = replace(task, collision=collision)
    ms, verdict = _cpu_ms(lambda: check(robot, cells, asked), repeats)
    problem = Problem.of(robot, cells, asked)
    arrays = arrays_of(robot, cells, asked)
    exploration = Exploration(robot, cells, arrays, 0, Clock())
    began = time.process_time()
    explore(exploration)
    close(exploration)
    search_ms = 1e3 * (time.process_time() - began)
    done = counts(arrays.collisions)
    judge_ms, judged, rows = 0.0, None, 0
    if verdict.witness is not None and problem.bodies is not None:
        q, bodies = verdict.witness.q, problem.bodies
        judge_ms, judged = _cpu_ms(lambda: collision_replay(robot, bodies, q), repeats)
        rows = len(q)
    return {
        "case": name,
        "verdict": f"{verdict.answer}, {verdict.n_covered} of {len(cells)}",
        "without ms": plain_ms,
        "with ms": ms,
        "ratio": ms / plain_ms,
        "search ms": search_ms,
        "judge ms": judge_ms,
        "goal": goal,
        "FK without": plain.statistics["fk"],
        "FK": verdict.statistics["fk"],
        "segments": done.segments,
        "decided by budgets": f"{100 * done.by_budget / max(done.items, 1):.1f} %",
        "swept tests a segment (goal 10)": done.swept / max(done.segments, 1),
        "directions a bound (goal 8)": done.iterations / max(done.swept + done.bounds, 1),
        "waypoints": rows,
        "judge ms of 200 waypoints (goal 40)": 200.0 * judge_ms / max(rows, 1),
        "coal calls a segment (goal 5)": (judged.calls if judged else 0) / max(rows - 1, 1),
    }


def rows(repeats: int = 5) -> tuple[str, list[dict[str, object]]]:
    """One row for each case; what the first check costs, which compiles, is in another table."""
    title = f"Collisions beside the same check without: processor time, least of {repeats}"
    return title, [_row(name, repeats) for name in CASES]
