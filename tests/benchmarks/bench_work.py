"""What is built on a verdict: paths, passes, placements, studies, live pages."""

import time
from collections.abc import Callable
from typing import Any

import asked
import mesh_patches
import numpy as np
import pytest

import coverable
from coverable import load_case, parallel_passes, path, plan_passes, trajectory
from feasibility.certification.motion_replay import replay
from surfaces.meshes.triangle_mesh import TriangleMesh

PAPER = [f"paper/{figure}{letter}" for figure in "45" for letter in "abcdef"]

BODIES = ("clear of itself", "beside a post", "over a floor with a tool", "beside a hull",
          "a wall 4a", "a wall 4c", "a wall 4e", "a wall 5e")  # fmt: skip


@pytest.mark.parametrize("name", [name for name in PAPER if name[-1] in "abc"])
def bench_path(name: str, measured: Callable[..., Any]) -> None:
    """The path over a case and its motion at up to 0.1 m/s; goal of 4a: 300 ms, 15 % revisited."""
    verdict = coverable.check(*load_case(name).build()[:3])
    if not verdict.feasible:
        pytest.skip("no motion")
    share = path(verdict).figures.revisited_share
    measured(lambda: trajectory(path(verdict), 0.1), 2, samples=len,
             **{"revisited %": lambda _: round(100.0 * share, 1)})  # fmt: skip


@pytest.mark.parametrize("collisions", [False, True])
def bench_panel(collisions: bool, measured: Callable[..., Any]) -> None:
    """Passes 30 mm apart over a bent panel of 10,000 faces, timed at 0.25 m/s; goal 3 s."""
    bent = mesh_patches.bent(
        lambda u, v: (0.6 * u, 0.4 * v, 0.06 * (1.0 - (2.0 * u - 1.0) ** 2)), 100, 50
    )
    at = (0.35, -0.2, 0.1)
    panel = coverable.mesh(TriangleMesh(*bent), side="outside", position=at)
    gun = coverable.ToolShape.cylinder(radius=0.015, length=0.14, position=(0.0, 0.0, -0.08))
    around = coverable.Collision(clearance=0.005, tool_clearance=0.01, tool=(gun,))
    robot = coverable.load_robot("ur10", tcp=((0.0, 0.0, 0.15), (0.0, 0.0, 0.0)))
    task = coverable.Task(0.05, 15.0, footprint=0.05, collision=around if collisions else None)

    def work() -> Any:
        along = plan_passes(robot, parallel_passes(panel, 0.03, overrun=0.0, step=0.03), task)
        return trajectory(path(along.verdict), speed=0.25)

    measured(work, 2, samples=len)


@pytest.mark.parametrize("name", PAPER)
def bench_explain(name: str, measured: Callable[..., Any]) -> None:
    """What would make a case feasible; goal: 15 verdicts in the middle, 40 at most."""
    asked = load_case(name).build()[:3]
    measured(lambda: coverable.explain(*asked), 2, FK=lambda found: int(found.evaluations))


@pytest.mark.parametrize("name", BODIES)
def bench_margin(name: str, measured: Callable[..., Any]) -> None:
    """A motion among bodies, certified with its placement margin; goal: a fifth of it for that."""
    robot, cells, task, search = asked.question(name)[2:]
    walk, certified, margin = coverable.check(robot, cells, task, search).witness, [], []

    def work() -> None:
        began = time.process_time()
        found = replay(robot, cells, task, walk, np.ones(len(cells), dtype=bool)).certificate
        certified.append(time.process_time() - began)
        assert found.placement_margin is not None
        margin.append(time.process_time() - began - certified[-1])

    share = {"margin / certified %": lambda _: round(100.0 * min(margin) / min(certified))}
    measured(work, 9, **share)
