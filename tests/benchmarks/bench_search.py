"""Search and judge: questions of the table, the paper's search, finer and finer cells."""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest
from asked import names, question, verdict_of

from coverable import Search, check
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.problem import Problem

PAPER = names("paper")
ASKED = [
    *PAPER,  # goals: 4a in 20,000 FK calls, 5c in 60,000, other feasible cases in 30,000
    "4a as a mesh", "5e as a mesh",  # three times the patch at most
    "4a within 15 degrees", "a square and a fixed tool", "a square turned",  # twice a free roll
    "a plate out of reach", "on a rail", "on a rail and a turntable", "a toolpath",
    "a large square and a stop of the wrist",  # parted, and a cut proves it: 1 s
    *names("bodies"),  # 1.5 times the check without for an arm alone, 4 times with things around
]  # fmt: skip
PEAK = """
import json, resource, sys
from coverable import check
from coverable import load_case
robot, cells, task, _ = load_case("paper/4a").build()
check(robot, cells, task)
verdict = check(robot, cells.surface.cells(int(sys.argv[1]), int(sys.argv[2])), task)
print(json.dumps([verdict.n_edges, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024]))
"""


@pytest.mark.parametrize("name", dict.fromkeys(ASKED))
def bench_check(name: str, measured: Callable[..., Any]) -> None:
    """A question, and what the causes of an infeasible one cost, with their proofs."""
    _, _, robot, cells, task, search = question(name)

    def ask() -> Any:
        verdict = check(robot, cells, task, search)
        assert len(verdict.causes) == len(cells) - verdict.n_covered
        return verdict

    measured(ask)


@pytest.mark.parametrize("name", names("bodies"))
def bench_judge(name: str, measured: Callable[..., Any]) -> None:
    """Goal: 40 ms for 200 waypoints, and five calls of coal a segment."""
    _, _, robot, cells, task, _ = question(name)
    witness, bodies = verdict_of(name).witness, Problem.of(robot, cells, task).bodies
    if witness is None:
        pytest.skip("no motion was found")
    segments = len(witness.q) - 1
    measured(
        lambda: collision_replay(robot, bodies, witness.q), 3, segments=lambda _: segments,
        **{"coal calls a segment": lambda found: round(found.calls / segments, 2)},
    )  # fmt: skip


@pytest.mark.parametrize(("moves", "step_deg"), [("single", 0.01), ("all", 0.5)])
@pytest.mark.parametrize("name", PAPER)
def bench_greedy(name: str, moves: Any, step_deg: float, measured: Callable[..., Any]) -> None:
    """The paper's search; goal of 4a with single moves: 400,000 FK calls."""
    _, _, robot, cells, task, _ = question(name)
    search = Search(method="greedy", moves=moves, step_deg=step_deg)
    counts = {k: (lambda v, k=k: int(v.statistics[k])) for k in ("starts", "calls", "checked")}
    measured(lambda: check(robot, cells, task, search), 2, **counts)


@pytest.mark.parametrize(("nu", "nv"), [(9, 10), (45, 50), (300, 300)])
def bench_grid(nu: int, nv: int, measured: Callable[..., Any]) -> None:
    """The sphere of 4a in finer and finer cells; goals 250 ms, and 2 s with 300 MB at most."""
    _, _, robot, cells, task, _ = question("paper 4a")
    fine = cells.surface.cells(nu, nv)
    done = subprocess.run([sys.executable, "-c", PEAK, str(nu), str(nv)], env={**os.environ},
                          capture_output=True, text=True, check=True)  # fmt: skip
    edges, peak = json.loads(done.stdout)
    found = measured(lambda: check(robot, fine, task), 3, MB=lambda _: round(peak))
    assert found.n_edges == edges
