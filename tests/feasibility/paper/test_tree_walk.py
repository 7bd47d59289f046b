"""The greedy search's covering motion: one motion, over every cell, inside all constraints."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest

from feasibility import Search, Task, Verdict, greedy_check
from feasibility.paper import tree_walk
from feasibility.paper.jcell_steps import Steps
from feasibility.paper.tree_replay import within_cells
from feasibility.reports.verdict import as_csv
from robots import Kinematics, load_robot
from surfaces import sphere

PUMA = load_robot("puma560", limits="set-1")
DOME = sphere(1.0, (10, 90), (10, 180), side="inside").cells(5, 6)
TASK = Task(0.005, 45)


@pytest.mark.parametrize(("moves", "step"), [("single", 0.05), ("all", 0.5)])
def test_its_csv_is_one_motion_that_enters_every_cell(moves: str, step: float) -> None:
    search = Search(method="greedy", moves=moves, step_deg=step)
    verdict = greedy_check(PUMA, DOME, TASK, search)
    assert verdict.feasible
    text = as_csv(verdict)
    assert text is not None
    header, *rows = csv.reader(io.StringIO(text))
    assert header == ["cell", *PUMA.joint_names]
    corners = np.array([row[1:] for row in rows], dtype=float)

    # Whole moves from corner to corner, and so the J-cells between them.
    size = np.radians(step)
    moved = np.diff(corners, axis=0) / size
    count = np.abs(moved).max(axis=1).round().astype(int)
    assert np.abs(moved - moved.round()).max() < 1e-7
    assert (count >= 1).all()
    steps_of_one = moved / count[:, None]
    assert set(np.abs(steps_of_one).round(7).ravel()) <= {0.0, 1.0}
    if moves == "single":
        assert (np.abs(steps_of_one).round().sum(axis=1) == 1).all()
    q = np.concatenate(
        [a + np.arange(k)[:, None] * (b - a) / k
         for a, b, k in zip(corners[:-1], corners[1:], count, strict=True)]
        + [corners[-1:]]
    )  # fmt: skip
    assert len(corners) < len(q)

    steps = Steps.of(PUMA, DOME, TASK, search)
    assert ((q >= PUMA.lower) & (q <= PUMA.upper)).all()
    points, axes = Kinematics(PUMA).tools(q)
    closest_point = DOME.surface.closest(points)
    sign = DOME.surface.side_sign
    assert closest_point.inside.all()
    assert (
        np.abs(closest_point.height - sign * TASK.standoff).max() + steps.sag.max()
        <= steps.tolerance
    )
    chord = np.linalg.norm(axes + sign * closest_point.normal, axis=1).max() + steps.turn.max()
    assert 2.0 * np.arcsin(0.5 * chord) <= TASK.cone
    at = np.column_stack([closest_point.u, closest_point.v])
    for cell in range(len(DOME)):
        assert within_cells(DOME, at, [cell] * len(q)).any()


def test_a_row_is_at_a_cell_only_where_the_tool_is_at_its_centre() -> None:
    verdict = greedy_check(PUMA, DOME, TASK, Search(method="greedy", step_deg=0.05))
    walk = tree_walk(verdict)
    assert walk is not None
    points, _ = Kinematics(PUMA).tools(walk.q)
    away = np.linalg.norm(points[:, None] - TASK.targets(DOME).points, axis=2)
    np.testing.assert_array_equal(walk.cell >= 0, away.min(axis=1) <= 1e-3)
    at = np.flatnonzero(walk.cell >= 0)
    np.testing.assert_array_equal(walk.cell[at], away[at].argmin(axis=1))
    assert walk.cell[0] == verdict.start


def test_what_is_not_feasible_has_no_motion() -> None:
    arm = PUMA.with_limits({"joint1": np.radians([-30.0, 20.0])})
    verdict: Verdict = greedy_check(arm, DOME, TASK, Search(method="greedy", step_deg=0.2))
    assert not verdict.feasible
    assert as_csv(verdict) is None
