"""What the judge says of bodies whose distances are known by hand."""

from __future__ import annotations

import arm_urdfs
import numpy as np
import pytest
import random_arms
from capsule_arms import (
    along_x,
    at,
    bodies_of,
    box_mesh,
    capsule_links,
    pair,
    planar_arm,
    wall_at,
)

from feasibility.certification import collision_replay
from feasibility.certification.collisions.budgets import Budget, TooNear
from feasibility.collisions import Bodies, HalfSpace, Obstacle, Pair, Soup
from robots.shapes import Solid
from robots.urdf import Box, Capsule, Cylinder, Sphere

CLOSE = 2e-6  # m, what coal is trusted with


def judged(robot, bodies, *rows):
    return collision_replay(robot, bodies, np.array(rows, dtype=float))


def touches_from(judge, low, high):
    """The angle or length between low (accepted) and high (refused) where the judge changes."""
    assert judge(low).accepted
    assert not judge(high).accepted
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if judge(middle).accepted else (low, middle)
    return low


@pytest.mark.parametrize("clearance", [0.0, 0.01, 0.05])
def test_a_forearm_folds_onto_the_upper_arm(clearance):
    """The tip of link 3 is sin(angle) l from link 1: 2 r + c there, to the micrometre."""
    l2, l3, r = 0.3, 0.5, 0.02
    robot = planar_arm([0.6, l2, l3])
    links = capsule_links([0.6, l2, l3], r)
    bodies = bodies_of(links, pairs=[pair("link1", "link3", clearance)])
    # Link 2 stands at right angles on link 1; link 3 comes back towards it.
    folded = touches_from(lambda q3: judged(robot, bodies, [0.3, np.pi / 2, q3]), 1.6, np.pi)
    expected = np.pi / 2 + np.arcsin((l2 - 2 * r - clearance) / l3)
    assert folded == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("clearance", [0.0, 0.03])
def test_an_arm_turns_towards_a_wall(clearance):
    """The end of link 2 is at l1 cos q + l2 cos q; its capsule reaches the radius further."""
    robot, links = planar_arm([0.5, 0.4]), capsule_links([0.5, 0.4], 0.03)
    bodies = bodies_of(links, [wall_at(0.7)], [pair("link2", "wall", clearance)])
    turned = touches_from(lambda q: judged(robot, bodies, [q, 0.0]), 1.5, 0.0)
    assert turned == pytest.approx(np.arccos((0.7 - 0.03 - clearance) / 0.9), abs=1e-6)
    swept = touches_from(lambda q: judged(robot, bodies, [1.5, 0.0], [q, 0.0]), 1.4, 0.0)
    assert swept == pytest.approx(turned, abs=1e-6)


SHAPES = {
    "ball": (Sphere(0.1), 0.1),
    "box": (Box((0.2, 0.3, 0.4)), 0.1),
    "capsule": (Capsule(0.1, 0.4), 0.1),
    "cylinder": (Cylinder(0.1, 0.4), 0.1),
    "mesh": (box_mesh((0.2, 0.3, 0.4)), 0.1),
}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("other", SHAPES)
def test_distances_along_x(name, other):
    """Each shape reaches 0.1 m along x: carried along a rail, they are x - 0.2 m apart."""
    robot = planar_arm([0.1], ["prismatic"])
    (shape, half), (thing, more) = SHAPES[name], SHAPES[other]
    solid = Solid("link1", 1, np.eye(4), shape)
    bodies = bodies_of([solid], [Obstacle("thing", thing, at(1.0))], [pair("link1", "thing")])
    for x in (0.0, 0.5, 0.75):
        found = judged(robot, bodies, [x])
        assert found.min_clearance == pytest.approx(1.0 - x - half - more, abs=1e-6)
        assert found.min_clearance <= 1.0 - x - half - more
        assert found.nearest_pair == ("link1", "thing")
    moved = judged(robot, bodies, [-0.5], [0.75], [0.1])
    assert 0.9 * 0.05 - 1e-6 <= moved.min_clearance <= 0.05
    through = judged(robot, bodies, [0.0], [2.0])
    assert not through.accepted
    assert through.min_clearance <= 1e-9
    assert "link1 and thing overlap by" in through.refusal or "touch" in through.refusal


@pytest.mark.parametrize("name", SHAPES)
def test_distances_from_a_half_space_and_a_sheet(name):
    shape, half = SHAPES[name]
    robot = planar_arm([0.1], ["prismatic"])
    solid = Solid("link1", 1, np.eye(4), shape)
    bodies = bodies_of([solid], [wall_at(0.5)], [pair("link1", "wall")])
    found = judged(robot, bodies, [0.0], [0.3])
    assert found.min_clearance == pytest.approx(0.2 - half, abs=CLOSE)
    corners = np.array([[0.5, y, z] for y in (-1, 1) for z in (-1, 1)], dtype=float)
    sheet = Soup("surface", corners[[[0, 1, 2], [1, 3, 2]]], 0.004, False)
    bodies = bodies_of([solid], pairs=[pair("link1", "surface")], soups=[sheet])
    found = judged(robot, bodies, [0.0], [0.3])
    assert found.min_clearance == pytest.approx(0.196 - half, abs=CLOSE)
    assert not judged(robot, bodies, [0.0], [1.0]).accepted  # through it to its other side
    beyond = judged(robot, bodies, [0.8], [1.0])
    assert beyond.min_clearance == pytest.approx(0.296 - half, abs=CLOSE)


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("carried", [True, False])
def test_a_ball_wholly_inside_a_mesh(closed, carried):
    """A closed mesh is a solid: nothing may be inside. An open one is a sheet."""
    robot = planar_arm([0.1], ["prismatic"])
    mesh, ball = box_mesh((2.0, 2.0, 2.0), closed), Sphere(0.1)
    solid = Solid("link1", 1, np.eye(4), mesh if carried else ball)
    thing = Obstacle("thing", ball if carried else mesh, np.eye(4))
    found = judged(robot, bodies_of([solid], [thing], [pair("link1", "thing")]), [0.0], [0.2])
    assert found.accepted is not closed
    if closed:
        assert found.faults[0].row == 0
        assert "one is inside the other" in found.refusal
    else:
        assert 0.0 < found.min_clearance <= 0.7


def test_a_mesh_within_a_mesh_and_a_room_with_walls():
    """A room is solid in its walls alone: its inner shell is turned inwards."""
    robot = planar_arm([0.1], ["prismatic"])
    inner, outer = box_mesh((1.0, 1.0, 1.0)), box_mesh((1.2, 1.2, 1.2))
    faces = np.vstack([outer.faces, inner.faces[:, ::-1] + len(outer.vertices)])
    room = type(inner)(np.vstack([outer.vertices, inner.vertices]), faces, True)
    solid = Solid("link1", 1, np.eye(4), box_mesh((0.2, 0.2, 0.2)))
    for thing, accepted in ((outer, False), (room, True)):
        scene = [Obstacle("thing", thing, np.eye(4))]
        bodies = bodies_of([solid], scene, [pair("link1", "thing")])
        assert judged(robot, bodies, [-0.2], [0.3]).accepted is accepted
    assert not judged(robot, bodies, [-0.2], [0.45]).accepted


def test_a_hollow_link_is_not_its_hull():
    """A post between the arms of a U-shaped link: the hull says no, the mesh says 0.2 m."""
    robot = planar_arm([0.1], ["prismatic"])
    arms = [box_mesh((1.0, 0.1, 0.1)) for _ in range(2)]
    aside = np.array([0.0, 0.35, 0.0])
    sides = [arms[0].vertices + aside, arms[1].vertices - aside]
    faces = np.vstack([arms[0].faces, arms[1].faces + 8])
    fork = type(arms[0])(np.vstack(sides), faces, True)
    solid = Solid("link1", 1, np.eye(4), fork)
    for thing in (Cylinder(0.1, 1.0), box_mesh((0.2, 0.2, 1.0)), Sphere(0.1)):
        scene = [Obstacle("post", thing, np.eye(4))]
        for clearance, accepted in ((0.19, True), (0.21, False)):
            bodies = bodies_of([solid], scene, [pair("link1", "post", clearance)])
            found = judged(robot, bodies, [-0.3], [0.3])
            assert found.accepted is accepted
            assert found.min_clearance <= 0.2 + CLOSE


def test_several_bodies_of_one_owner():
    robot = planar_arm([0.1], ["prismatic"])
    solids = [Solid("link1", 1, at(y=y), Sphere(0.1)) for y in (0.0, 0.3)]
    scene = [Obstacle("ball", Sphere(0.1), at(y=0.7)), Obstacle("floor", HalfSpace(), at(z=-1.0))]
    pairs = [pair("link1", "floor"), pair("link1", "ball")]
    found = judged(robot, bodies_of(solids, scene, pairs), [0.0], [0.0])
    assert found.min_clearance == pytest.approx(0.2, abs=CLOSE)
    assert found.nearest_pair == ("link1", "ball")


def test_the_capsule_helper_lies_along_x():
    ends = along_x(0.6) @ np.array([[0, 0, -0.3, 1], [0, 0, 0.3, 1]]).T
    np.testing.assert_allclose(sorted(ends[0]), [0.0, 0.6], atol=1e-12)


@pytest.mark.parametrize("needed", [0.05, 0.079, 0.081, 0.2])
def test_distances_alone_certify_what_is_there_between_rows_and_no_more(needed):
    """A body that comes as near as 0.08 m in the middle, by as much as its points move at most."""

    def measured(row, share):
        return 0.08 + 0.3 * abs(share - 0.5)

    rows, wanted = np.zeros(1, dtype=np.intp), np.array([needed])
    budget = Budget(measured, np.array([0.3]), 1000)
    if needed > 0.08:
        with pytest.raises(TooNear):
            budget.certify(rows, wanted, 1.0)
    else:
        assert needed <= budget.certify(rows, wanted, 1.0) <= 0.08
    with pytest.raises(TooNear):
        Budget(measured, np.array([0.3]), 2).certify(rows, wanted, 1.0)


@pytest.mark.parametrize("gap", [0.003, 0.0139, 0.0141, 0.2])
def test_what_triangles_may_be_off_is_taken_off_their_distance(gap):
    """A ball at rest before a triangle of a surface that is known to 4 mm; 10 mm are needed."""
    robot = random_arms.robot_of([arm_urdfs.joint(1)])
    ball = Solid("tool", 1, np.eye(4), Sphere(0.1))
    x = 0.1 + gap
    triangle = np.array([[[x, -1.0, -1.0], [x, 1.0, -1.0], [x, 0.0, 1.0]]])
    soup, wanted = Soup("surface", triangle, 0.004, False), Pair("tool", "surface", 0.01)
    found = collision_replay(robot, Bodies((ball,), (), (soup,), (), (wanted,)), np.zeros((1, 1)))
    assert found.accepted == (gap > 0.014)
    assert gap - 0.0041 <= found.min_clearance <= gap - 0.004 + 1e-6
    if found.accepted:
        assert found.measured_clearance == pytest.approx(gap + 0.004)
