"""A start: the motion begins there, and has to cover everything from there."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from asked import question, verdict_of

import coverable
from coverable import Collision, Search, Task, check, coverage_path, load_robot, plane, verify
from coverable.errors import ArgumentError
from robots.kinematics import Kinematics

UR5 = load_robot("ur5")
CLEAR_BUT_FOR_HULLS = (
    [-2.361, 0.726, 0.925, 1.859, -0.731, 3.128, 3.021],  # link5 and link7
    [-0.224, -1.135, 1.611, 0.198, -1.588, 2.205, -0.308],  # link2 and link4
)
PARTED_BY_THE_JUDGE_ALONE = [-1.937, 1.083, -2.766, -1.947, -0.155, 0.667, -0.835]
PLATE = plane((0.4, 0.6), (-0.15, 0.15), position=(0, 0, 0.2)).cells(3, 4)
TASK = Task(standoff=0.01, cone_deg=25)


@pytest.fixture(scope="module")
def anywhere():
    verdict = check(UR5, PLATE, TASK)
    assert verdict.feasible
    return verdict


@pytest.fixture(scope="module")
def started(anywhere):
    """In the middle of the motion that is found without a start, a little off the target."""
    walk = anywhere.witness
    row = np.flatnonzero(walk.cell == 5)[0]
    return replace(UR5, start=walk.q[row] + 2e-4)


def test_the_motion_begins_at_the_start(anywhere, started):
    verdict = check(started, PLATE, TASK)
    assert verdict.feasible
    np.testing.assert_array_equal(verdict.witness.q[0], started.start)
    assert verdict.witness.cell[0] == 5
    assert verify(started, PLATE, TASK, verdict.witness.q).holds
    assert verify(verdict).holds
    path = coverage_path(verdict, "rows")
    np.testing.assert_array_equal(path.walk.q[0], started.start)
    assert set(path.visits) == set(range(12))
    # Not so one that begins elsewhere, by one joint a little or by all of them.
    near = verdict.witness.q.copy()
    near = np.vstack([near[0] + np.eye(6)[5] * 1e-3, near])
    assert "off the start" in str(verify(started, PLATE, TASK, near).faults[-1])
    judged = verify(started, PLATE, TASK, anywhere.witness.q)
    assert not judged.holds
    assert "off the start" in str(judged.faults[-1])


def test_the_greedy_search_begins_there_too(started):
    search = Search(method="greedy", step_deg=0.2)
    verdict = check(started, PLATE, replace(TASK, tolerance=0.004), search)
    np.testing.assert_allclose(verdict.graph.nodes[verdict.start]["q"], started.start)


def test_a_start_off_the_motion_set_is_refused_with_its_distance(anywhere):
    row = np.flatnonzero(anywhere.witness.cell == 5)[0]
    start = anywhere.witness.q[row].copy()
    start[2] += 0.05
    with pytest.raises(ArgumentError, match=r"start is not on .* nearest cell, \[1, 1\], is .* mm"):
        check(replace(UR5, start=start), PLATE, TASK)
    with pytest.raises(ArgumentError, match=r"the tool axis .* deg off the approach direction"):
        check(replace(UR5, start=anywhere.witness.q[row]), PLATE, replace(TASK, cone_deg=1e-3))


def test_a_start_that_collides_is_refused(started):
    ball = coverable.Obstacle.sphere("ball", 0.32, position=(0.5, 0.0, 0.5))
    with pytest.raises(ArgumentError, match="start collides"):
        check(started, PLATE, replace(TASK, collision=Collision(scene=(ball,))))


def _under(robot, q):
    """Cells of a small plate beneath the tool at q, square to it."""
    point, axis = Kinematics(robot).tool(q)
    around = np.linalg.qr(np.column_stack([axis, np.eye(3)[np.argmin(np.abs(axis))]]))[0]
    rotation = np.column_stack([np.cross(around[:, 1], -axis), around[:, 1], -axis])
    rpy_deg = np.degrees(pin.rpy.matrixToRpy(rotation))
    place = point + 0.01 * axis
    sides = (-0.01, 0.01), (-0.01, 0.01)
    return plane(*sides, position=place, rpy_deg=rpy_deg, side="outside").cells(1, 1)


@pytest.mark.parametrize("q", CLEAR_BUT_FOR_HULLS)
def test_a_start_at_which_only_hulls_collide_is_none_that_collides(q):
    arm = replace(load_robot("xarm7"), start=np.array(q))
    cells, task = _under(arm, arm.start), replace(TASK, collision=Collision(surface=False))
    verdict = check(arm, cells, task)
    assert verdict.feasible
    np.testing.assert_array_equal(verdict.witness.q[0], arm.start)
    assert "the start would collide" in verdict.message
    assert verify(verdict).holds


def test_a_start_at_which_only_the_search_cannot_part_the_links_says_so():
    arm = replace(load_robot("panda"), start=np.array(PARTED_BY_THE_JUDGE_ALONE))
    task = replace(TASK, collision=Collision(surface=False))
    with pytest.raises(ArgumentError, match=r"start is clear, but .*panda_link5 and panda_hand"):
        check(arm, _under(arm, arm.start), task)


def test_only_what_the_start_leads_to_counts():
    """A stored problem whose configurations fall into two parts: 14 and 11 of 15 cells."""
    _, _, arm, cells, task, _ = question("puma560 190")
    free = verdict_of("puma560 190")
    sizes = [len(covered) for covered in free.components]
    assert len(sizes) > 1
    assert sizes[-1] < sizes[0] == free.n_covered
    for posture, covered in zip(free.postures, free.components, strict=True):
        bound = check(replace(arm, start=posture), cells, task)
        assert np.flatnonzero(bound.covered).tolist() == covered.tolist()
        assert bound.answer == free.answer
