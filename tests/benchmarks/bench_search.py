"""The search: the paper's cases with both methods, fine grids, rolls, axes, toolpaths."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from feasibility import Evidence, Search, Task, check
from feasibility.cases import builtin_cases, load_case
from robots import Axis, load_robot
from surfaces import plane, poses

PAPER = sorted(builtin_cases())
AXES = (
    Axis("rail", "prismatic", (0, 1, 0), limits=(-0.5, 0.5)),
    Axis("table", "revolute", limits_deg=(-180, 180), position=(0.55, 0, 0.1), carries="surface"),
)
PEAK = """
import json, resource, sys
from feasibility import check
from feasibility.cases import load_case
robot, cells, task, _ = load_case("paper/4a").build()
check(robot, cells, task)
verdict = check(robot, cells.surface.cells(int(sys.argv[1]), int(sys.argv[2])), task)
print(json.dumps([verdict.n_edges, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024]))
"""


@pytest.mark.parametrize("name", PAPER)
def bench_complete(name: str, measured: Callable[..., Any]) -> None:
    """Goals: 4a in 20,000 FK calls, 5c in 60,000, other feasible cases in 30,000."""
    robot, cells, task, _ = load_case(name).build()
    measured(lambda: check(robot, cells, task), 9)


@pytest.mark.parametrize("name", [n for n in PAPER if n[-1] in "def"])
def bench_causes(name: str, measured: Callable[..., Any]) -> None:
    """What the causes of an infeasible case cost, with their proofs."""
    robot, cells, task, _ = load_case(name).build()
    causes = measured(lambda: check(robot, cells, task).causes, 3, causes=len)
    assert all(cause.cell < len(cells) for cause in causes)


@pytest.mark.parametrize(("moves", "step_deg"), [("single", 0.01), ("all", 0.5)])
@pytest.mark.parametrize("name", PAPER)
def bench_greedy(name: str, moves: Any, step_deg: float, measured: Callable[..., Any]) -> None:
    """The paper's search; goal of 4a with single moves: 400,000 FK calls."""
    robot, cells, task, _ = load_case(name).build()
    search = Search(method="greedy", moves=moves, step_deg=step_deg)
    names = ("starts", "calls", "checked")
    counts = {k: (lambda v, k=k: int(v.statistics[k])) for k in names}
    measured(lambda: check(robot, cells, task, search), 2, **counts)


@pytest.mark.parametrize(("nu", "nv"), [(9, 10), (45, 50), (300, 300)])
def bench_grid(nu: int, nv: int, measured: Callable[..., Any]) -> None:
    """The sphere of 4a in finer and finer cells; goals 250 ms, and 2 s with 300 MB at most."""
    robot, cells, task, _ = load_case("paper/4a").build()
    fine = cells.surface.cells(nu, nv)
    done = subprocess.run([sys.executable, "-c", PEAK, str(nu), str(nv)], env={**os.environ},
                          capture_output=True, text=True, check=True)  # fmt: skip
    edges, peak = json.loads(done.stdout)
    found = measured(lambda: check(robot, fine, task), 3, MB=lambda _: round(peak))
    assert found.n_edges == edges


@pytest.mark.parametrize("apart", [0.25, 0.6])
def bench_parted(apart: float, measured: Callable[..., Any]) -> None:
    """Every cell is reached, by no single component, and a cut proves it; goal 1 s."""
    robot = load_robot("ur5")
    robot = robot.with_limits({"shoulder_pan_joint": np.radians([-170.0, 170.0])})
    band = plane((-0.1, 0.1), (-apart, apart), "outside", (-0.5, 0.0, 0.1))
    verdict = measured(lambda: check(robot, band.cells(9, 10), Task(0.0, 1.0, tolerance=1e-3)), 2)
    assert verdict.evidence in (Evidence.PROOF, Evidence.SEARCH)


@pytest.mark.parametrize("half_deg", [None, 15.0, 0.57])
@pytest.mark.parametrize(("size", "cone"), [(0.15, 0.57), (0.4, 20.0), (0.4, 0.57)])
@pytest.mark.parametrize("arm", ["ur5", "puma560"])
def bench_roll(
    arm: str, size: float, cone: float, half_deg: float | None, measured: Callable[..., Any]
) -> None:
    """A limited roll may cost twice what a free one costs."""
    at = (0.45, 0.0, 0.2) if arm == "ur5" else (0.7, 0.1, 0.2)
    half = (-size / 2, size / 2)
    cells, task = plane(half, half, "outside", at).cells(6, 6), Task(0.005, cone)
    if half_deg is not None:
        task = replace(task, roll_deg=(-half_deg, half_deg), roll_reference=(1, 0, 0))
    robot = load_robot(arm)
    measured(lambda: check(robot, cells, task), 9)


@pytest.mark.parametrize("axes", [(), AXES], ids=["alone", "rail and table"])
@pytest.mark.parametrize("rows", [9, 40])
def bench_axes(axes: tuple[Axis, ...], rows: int, measured: Callable[..., Any]) -> None:
    """A plate that a UR5 covers by itself, and with a rail and a turntable: three times at most."""
    at = (0.0, 0.0, 0.0) if axes else (0.55, 0.0, 0.1)
    cells = plane((-0.15, 0.15), (-0.25, 0.25), "outside", at).cells(rows, 10)
    robot = load_robot("ur5", axes=axes)
    measured(lambda: check(robot, cells, Task(0.01, 25)))


def bench_toolpath(measured: Callable[..., Any]) -> None:
    """A thousand poses along a wave, in their order; goal 300 ms."""
    s = np.linspace(0.0, 1.0, 1000)
    points = np.column_stack([0.4 + 0.2 * s, 0.15 * np.sin(9.0 * s), 0.2 + 0.0 * s])
    cells = poses(points, np.tile((0.0, 0.0, 1.0), (1000, 1)), side="outside")
    measured(lambda: check(load_robot("ur5"), cells, Task(0.01, 25)))
