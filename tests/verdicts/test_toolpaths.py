"""Poses and toolpaths: their verdicts, and runs in order."""

import dataclasses

import numpy as np
import pytest

import coverable
from coverable import Task, check, coverage_path, load_robot, plane, poses, replay, verify
from feasibility.verdict import Answer

PATCH = plane((0.3, 0.7), (-0.2, 0.2), position=(0, 0, 0.3), side="outside").cells(6, 6)
TASK = Task(standoff=0.02, cone_deg=10)
SNAKE = [6 * i + (j if i % 2 == 0 else 5 - j) for i in range(6) for j in range(6)]
UR5 = load_robot("ur5")


def test_a_toolpath_is_run_in_order_and_never_back():
    cells = poses(PATCH.centres[SNAKE], PATCH.normals[SNAKE])
    verdict = check(UR5, cells, TASK)
    marks = verdict.witness.cell[verdict.witness.cell >= 0]
    assert set(np.diff(marks)) <= {0, 1}
    assert (marks[0], marks[-1]) == (0, 35)
    assert verdict.statistics["in_place"] == 0
    assert "without going back" in verdict.message
    assert verify(verdict).holds
    assert verify(UR5, cells, TASK, verdict.witness.q).holds
    backwards = verify(UR5, cells, TASK, verdict.witness.q[::-1])
    assert "goes back along the toolpath" in backwards.refusal
    walk = verdict.witness  # to and fro it covers all, too
    order = np.concatenate([np.arange(len(walk.q)), np.arange(len(walk.q))[::-1]])
    again = dataclasses.replace(walk, q=walk.q[order], cell=walk.cell[order])
    found = replay(UR5, cells, TASK, again, np.ones(36, dtype=bool))
    assert not found.accepted
    assert "goes back from pose 35 to pose 34" in found.refusal
    path = coverage_path(verdict)
    assert (path.order, path.visits.tolist()) == ("given", list(range(36)))
    with pytest.raises(coverable.PathError, match="is run in its order"):
        coverage_path(verdict, "shortest")


@pytest.mark.parametrize("standoff", [0.0, 0.02])
def test_the_tool_may_turn_on_the_spot_and_a_pose_may_come_twice(standoff):
    angle = np.radians([0, 0, 40, 40, 80, 80])
    points = np.column_stack([[0.5, 0.55, 0.55, 0.55, 0.55, 0.6], np.zeros(6), np.full(6, 0.3)])
    normals = np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    cells = poses(points, normals)
    verdict = check(UR5, cells, dataclasses.replace(TASK, standoff=standoff))
    assert verdict.feasible
    assert verify(UR5, cells, verdict.task, verdict.witness.q).holds


def test_collisions_with_a_surface_are_left_out_where_there_is_none():
    cells = poses(PATCH.centres[SNAKE][:6], PATCH.normals[SNAKE][:6])
    verdict = check(UR5, cells, TASK, collision=coverable.Collision(allow=(("tool", "surface"),)))
    assert verdict.task.collision.checked == ("self",)
    assert verdict.answer is Answer.FEASIBLE
    assert any("no surface between them" in note for note in cells.notes)
