"""Poses and toolpaths: their verdicts, and runs in order."""

import dataclasses

import numpy as np
import pytest
from arm_urdfs import joint
from random_arms import robot_of

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


def test_poses_that_are_only_reached_by_going_back_are_missed_by_runs_in_order():
    """One motion of three joints reaches all points: but its sheets fold back over the path."""
    right = np.pi / 2
    joints = [
        joint(1, "revolute", (-0.15, 0.46, -0.31), (0, -right, -right), limits=(-1.48, 1.29)),
        joint(2, "revolute", (-0.12, -0.05, 0.29), (right, -right, 0), limits=(-1.15, 4.64)),
        joint(3, "revolute", (0.05, 0.14, 0.26), (-right, -right, right), limits=(-1.78, 1.12)),
        joint(4, "fixed", (0.08, -0.01, -0.01)),
    ]
    ends = np.array([[-0.27, 0.55, -0.68], [-0.48, 0.68, -0.55], [-0.2, 0.82, -0.72]])
    t = np.linspace(0.0, 1.0, 12)[:, None]
    points = np.hstack([(1.0 - t) ** 2, 2.0 * t * (1.0 - t), t**2]) @ ends
    path = poses(points, np.tile([0.0, 0.0, 1.0], (12, 1)))
    verdict = check(robot_of(joints), path, Task(0.0, 180, tolerance=0.01))
    assert verdict.covered.tolist() == 11 * [True] + [False]
    assert "One motion reaches all 12 poses, but none was found that runs them" in verdict.message
    (cause,) = verdict.causes
    assert (cause.cell, cause.kind, cause.proved) == (11, coverable.CauseKind.DISCONNECTED, False)
    assert "runs in order end over pose 10" in cause.detail
    assert not verdict.feasible


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
