"""What limited rolls cost beside free ones, and what composed axes cost beside the arm alone."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from feasibility import Task, Verdict, check
from robots import Axis, Robot, load_robot
from surfaces import Cells, plane, poses

AXES = (
    Axis("rail", "prismatic", (0, 1, 0), limits=(-0.5, 0.5)),
    Axis("table", "revolute", limits_deg=(-180, 180), position=(0.55, 0, 0.1), carries="surface"),
)


class Pair(NamedTuple):
    """A question, the same with more to it, and how many times the cost is allowed."""

    plain: Callable[[], Verdict]
    more: Callable[[], Verdict]
    allowed: float


def square(arm: str, size: float, cone_deg: float, half_deg: float) -> Pair:
    """A square before an arm, 6 x 6 cells, with a free and a limited roll."""
    at = (0.45, 0.0, 0.2) if arm == "ur5" else (0.7, 0.1, 0.2)
    cells = plane((-size / 2, size / 2), (-size / 2, size / 2), "outside", at).cells(6, 6)
    task = Task(0.005, cone_deg, roll_reference=(1, 0, 0))
    limited = replace(task, roll_deg=(-half_deg, half_deg))
    robot = load_robot(arm)
    return Pair(lambda: check(robot, cells, task), lambda: check(robot, cells, limited), 2.0)


def composed(nu: int, nv: int) -> Pair:
    """A plate that a UR5 covers by itself, and with a rail and a turntable."""
    half, task = ((-0.15, 0.15), (-0.25, 0.25)), Task(0.01, 25)
    here = plane(*half, "outside", (0.55, 0.0, 0.1)).cells(nu, nv)
    on_table = plane(*half, "outside").cells(nu, nv)
    alone, both = load_robot("ur5"), load_robot("ur5", axes=AXES)
    return Pair(lambda: check(alone, here, task), lambda: check(both, on_table, task), 3.0)


def toolpath(robot: Robot) -> Callable[[], Verdict]:
    """1,000 poses along a wave, in their order."""
    s = np.linspace(0.0, 1.0, 1000)
    points = np.column_stack([0.4 + 0.2 * s, 0.15 * np.sin(9.0 * s), 0.2 + 0.0 * s])
    cells: Cells = poses(points, np.tile((0.0, 0.0, 1.0), (1000, 1)), side="outside")
    return lambda: check(robot, cells, Task(0.01, 25))


def cpu_ms(ask: Callable[[], Verdict], repeats: int = 15) -> tuple[float, Verdict]:
    """Least processor time of a check, and its verdict; the first does not count."""
    verdict, taken = ask(), []
    for _ in range(repeats):
        began = time.process_time()
        verdict = ask()
        taken.append(1e3 * (time.process_time() - began))
    return min(taken), verdict


def rows() -> tuple[str, list[dict[str, object]]]:
    """The pairs, and a toolpath by itself."""
    pairs = {
        f"{arm}, {size} m, cone {cone:g}, roll +-{half:g}": square(arm, size, cone, half)
        for arm in ("ur5", "puma560")
        for size, cone, half in (
            (0.15, 0.57, 0.57),
            (0.4, 20, 15),
            (0.4, 0.57, 0.57),
            (0.4, 20, 0.57),
        )
    }
    pairs |= {f"ur5, rail and table, {n} cells": composed(n // 10, 10) for n in (90, 400)}
    found: list[dict[str, object]] = []
    for name, pair in pairs.items():
        (ms, plain), (more_ms, more) = cpu_ms(pair.plain), cpu_ms(pair.more)
        before, after = (int(verdict.statistics["fk"]) for verdict in (plain, more))
        found.append({
            "case": name, "verdict": f"{plain.answer} / {more.answer}", "FK": before,
            "FK with": after, "FK ratio": after / before, "without ms": ms, "with ms": more_ms,
            "time ratio": more_ms / ms, "allowed": pair.allowed,
        })  # fmt: skip
    ms, verdict = cpu_ms(toolpath(load_robot("ur5")))
    found.append({
        "case": "ur5, 1,000 poses in order", "verdict": str(verdict.answer),
        "FK": int(verdict.statistics["fk"]), "FK with": "", "FK ratio": "",
        "without ms": ms, "with ms": "", "time ratio": "", "allowed": "300 ms",
    })  # fmt: skip
    return "Limited rolls, composed axes, a toolpath: one process, processor time", found
