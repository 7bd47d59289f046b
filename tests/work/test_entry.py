"""Entry and exit: straight along the approach direction, from and to home, inside all limits."""

from dataclasses import replace

import numpy as np
import pytest
from referee import evenly as dense
from timed_motions import keeps_to_limits

import coverable
from coverable import Collision, Obstacle, PathError, check, coverage_path, replay, trajectory
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.collisions.asked_bodies import gather
from feasibility.division.between_patches import ends_of
from feasibility.verdict import Walk
from robots.kinematics import Kinematics

UR5 = coverable.load_robot("ur5")
CELLS = coverable.plane((0.4, 0.6), (-0.1, 0.1), "outside", (0, 0, 0.3)).cells(2, 2)
HOME = (0.0, -90.0, 90.0, -90.0, -90.0, 0.0)
TASK = coverable.Task(standoff=0.02, cone_deg=15, home_deg=HOME)


@pytest.fixture(scope="module")
def path():
    return coverage_path(check(UR5, CELLS, TASK))


def test_the_tool_comes_and_goes_straight_along_the_approach(path):
    ends = ends_of(path, 0.08)
    assert np.array_equal([ends.entry[0], ends.exit[-1]], np.radians([HOME, HOME]))
    assert np.array_equal(ends.entry[-1], path.walk.q[0])
    assert np.array_equal(ends.exit[0], path.walk.q[-1])
    alone = ends_of(replace(path, task=replace(TASK, home_deg=None)), 0.08)
    assert (ends.from_home, alone.from_home) == (True, False)
    for rows in (alone.entry[::-1], alone.exit):
        points, axes = Kinematics(UR5).tools(dense(rows))
        away = points - points[0]
        assert np.abs(away[:, :2]).max() <= 1e-3
        assert away[-1, 2] == pytest.approx(0.08, abs=1e-6)
        assert np.abs(axes - axes[0]).max() <= 0.01
        assert (np.diff(away[:, 2]) >= -1e-9).all()
        assert points[-1, 2] == pytest.approx(0.3 + 0.02 + 0.08, abs=2e-3)


def test_the_whole_motion_keeps_to_all_limits_and_goes_along_the_path(path):
    limits, ends = coverable.motion_limits(UR5, 0.2), ends_of(path, 0.05)
    whole = trajectory(path, 0.2, entry=ends.entry, leave=ends.exit)
    assert np.allclose(whole.q[[0, -1]], np.radians(HOME))
    assert np.abs(whole.dq[[0, -1]]).max() <= 1e-9
    keeps_to_limits(UR5, whole, limits)
    over, visits = whole.over, whole.cell[whole.cell >= 0]
    assert np.array_equal(visits, path.visits)
    walk = Walk(whole.q[over], whole.cell[over])
    assert replay(UR5, CELLS, TASK, walk, path.needed).accepted
    assert whole.working[over].all()
    assert whole.working.sum() == over.stop - over.start
    for rows, end in ((ends.entry, over.start), (ends.exit, over.stop - 1)):  # all of them passed
        part = whole.q[: end + 1] if rows is ends.entry else whole.q[end:]
        away = np.abs(dense(part)[:, None] - rows).max(axis=2).min(axis=0)
        assert away.max() <= 0.02


def test_the_way_home_leads_around_what_is_in_its_way():
    asked = Collision(surface=False, clearance=0.005)
    cells = CELLS.surface.cells(1, 2)
    alone = coverage_path(check(UR5, cells, replace(TASK, collision=asked)))
    straight = dense(np.stack([np.radians(HOME), ends_of(alone, 0.05).entry[-2]]), 2)[1]
    place = Kinematics(UR5).tool(straight)[0]
    ball = Obstacle.sphere("ball", 0.03, position=tuple(place))
    task = replace(TASK, collision=replace(asked, scene=(ball,)))
    ends = ends_of(replace(alone, task=task), 0.05)
    bodies = gather(UR5, CELLS.surface, task.collision, task.standoff)
    for rows in (ends.entry, ends.exit):
        assert collision_replay(UR5, bodies, rows).accepted
    assert not collision_replay(UR5, bodies, np.stack([ends.entry[0], ends.entry[-11]])).accepted


def test_what_cannot_be_had_is_said(path):
    with pytest.raises(PathError, match=r"entry: the tool cannot be drawn back by 2000 mm: after"):
        ends_of(path, 2.0)
    sunk = replace(TASK, standoff=0.0, approach=(1.0, 0.0, 0.1), cone_deg=30)
    with pytest.raises(PathError, match=r"entry: the tool goes through the surface .* by 4"):
        ends_of(coverage_path(check(UR5, CELLS, sunk)), 0.05)
    point = Kinematics(UR5).tool(np.radians(HOME))[0]
    ball = Obstacle.sphere("ball", 0.1, position=tuple(point))
    asked = Collision(self_=False, surface=False, scene=(ball,))
    with pytest.raises(PathError, match=r"entry: home_deg: .*ball"):
        ends_of(replace(path, task=replace(TASK, collision=asked)), 0.05)
    for home, said in (((0.0, 1.0), "pan_joint"), ((*HOME[:5], 400.0), "wrist_3_joint at 400")):
        with pytest.raises(ValueError, match=said):
            check(UR5, CELLS, replace(TASK, home_deg=home))
    with pytest.raises(ValueError, match="finite"):
        replace(TASK, home_deg=(0.0, np.nan))
