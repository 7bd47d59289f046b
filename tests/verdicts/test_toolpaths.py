"""Poses and toolpaths: their verdicts, and runs in order."""

import dataclasses

import numpy as np
import pytest

from feasibility import Task, check, verify
from feasibility.certification import replay
from feasibility.collisions import Collision
from feasibility.paths import PathError, coverage_path
from feasibility.roadmap.forward.run import layers_of
from feasibility.roadmap.graph import Roadmap
from feasibility.roadmap.walk import route_walk
from feasibility.verdict import Answer
from robots import load_robot
from surfaces import plane, poses

PATCH = plane((0.3, 0.7), (-0.2, 0.2), position=(0, 0, 0.3), side="outside").cells(6, 6)
TASK = Task(standoff=0.02, cone_deg=10)
SNAKE = [6 * i + (j if i % 2 == 0 else 5 - j) for i in range(6) for j in range(6)]


@pytest.fixture(scope="module")
def ur5():
    return load_robot("ur5")


def test_a_toolpath_is_run_in_order_and_never_back(ur5):
    cells = poses(PATCH.centres[SNAKE], PATCH.normals[SNAKE])
    verdict = check(ur5, cells, TASK)
    marks = verdict.witness.cell[verdict.witness.cell >= 0]
    assert set(np.diff(marks)) <= {0, 1}
    assert (marks[0], marks[-1]) == (0, 35)
    assert verdict.statistics["in_place"] == 0
    assert "without going back" in verdict.message
    assert verify(verdict).holds
    assert verify(ur5, cells, TASK, verdict.witness.q).holds
    backwards = verify(ur5, cells, TASK, verdict.witness.q[::-1])
    assert "goes back along the toolpath" in backwards.refusal
    walk = verdict.witness  # to and fro it covers all, too
    order = np.concatenate([np.arange(len(walk.q)), np.arange(len(walk.q))[::-1]])
    again = dataclasses.replace(walk, q=walk.q[order], cell=walk.cell[order])
    found = replay(ur5, cells, TASK, again, np.ones(36, dtype=bool))
    assert not found.accepted
    assert "goes back from pose 35 to pose 34" in found.refusal
    path = coverage_path(verdict)
    assert (path.order, path.visits.tolist()) == ("given", list(range(36)))
    assert coverage_path(verdict, only=[4, 9]).visits.tolist() == [4, 5, 6, 7, 8, 9]
    with pytest.raises(PathError, match="is run in its order"):
        coverage_path(verdict, "shortest")


@pytest.mark.parametrize("standoff", [0.0, 0.02])
def test_the_tool_may_turn_on_the_spot_and_a_pose_may_come_twice(ur5, standoff):
    angle = np.radians([0, 0, 40, 40, 80, 80])
    points = np.column_stack([[0.5, 0.55, 0.55, 0.55, 0.55, 0.6], np.zeros(6), np.full(6, 0.3)])
    normals = np.column_stack([np.sin(angle), 0 * angle, np.cos(angle)])
    cells = poses(points, normals)
    verdict = check(ur5, cells, dataclasses.replace(TASK, standoff=standoff))
    assert verdict.feasible
    assert verify(ur5, cells, verdict.task, verdict.witness.q).holds


def _roadmap(nodes, edges):
    """A roadmap of nodes over cells, joined by edges of one waypoint."""
    roadmap = Roadmap(8)
    for x, cell in enumerate(nodes):
        roadmap.add_node(cell, np.full(2, float(x)), np.zeros(2), roadmap.add_component())
    for x, y in edges:
        roadmap.add_edge(x, y, roadmap.q[y][None])
    return roadmap


def test_a_run_is_a_path_through_the_layers_that_never_goes_back():
    # One sheet over poses 0 to 3, one back from 3 to 1, one on from 1 to 5: all are joined.
    nodes = [0, 1, 2, 3, 3, 2, 1, 1, 2, 3, 4, 5]
    sheets = [(0, 1), (1, 2), (2, 3), (4, 5), (5, 6), (7, 8), (8, 9), (9, 10), (10, 11)]
    folded = layers_of(_roadmap(nodes, [*sheets, (3, 4), (6, 7)]))
    assert (folded.furthest, folded.start) == (3, 0)
    # With a change of posture over pose 2 there is a run; edges may be known from their ends.
    turned = [(y, x) for x, y in sheets]
    roadmap = _roadmap(nodes, [*turned, (3, 4), (6, 7), (2, 8)])
    run = layers_of(roadmap)
    assert run.furthest == 5
    walk = route_walk(roadmap, run.start, run.route)
    assert walk.cell.tolist() == [0, 1, 2, 2, 3, 4, 5]
    assert walk.q[:, 0].tolist() == [0, 1, 2, 8, 9, 10, 11]


def test_collisions_with_a_surface_are_left_out_where_there_is_none(ur5):
    cells = poses(PATCH.centres[SNAKE][:6], PATCH.normals[SNAKE][:6])
    verdict = check(ur5, cells, TASK, collision=Collision(allow=(("tool", "surface"),)))
    assert verdict.task.collision.checked == ("self",)
    assert verdict.answer is Answer.FEASIBLE
    assert any("no surface between them" in note for note in cells.notes)
