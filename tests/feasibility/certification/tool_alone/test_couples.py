"""Two balls, and what they may be moved by: a collision in every pose is said where it is one."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from random_arms import planar_arm

from feasibility.certification.tool_alone.couples import SLACK, Body, Couple, couples_of
from feasibility.certification.tool_alone.every_pose import never_clear
from feasibility.collisions import Bodies, Obstacle, Pair, Soup
from robots.shapes import Solid
from robots.urdf import Box, Sphere

TIP, AXIS = np.array([0.3, 0.1, 0.0]), np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("moved", [0.0, 0.01, 0.03])
@pytest.mark.parametrize("wanted", [-0.005, 0.0, 0.02])
def test_balls_that_may_be_moved_collide_up_to_what_is_left_of_the_clearance(moved, wanted):
    still, ball = Body(Sphere(0.2), np.eye(4)), Body(Sphere(0.1), np.eye(4))
    couple = Couple(ball, still, wanted, TIP, AXIS)
    edge = 0.3 + wanted - moved
    for beyond, said in ((3.0 * SLACK, False), (-3.0 * SLACK, True)):
        pose = pin.SE3(np.eye(3), np.array([0.0, edge + beyond, 0.0]))
        assert couple.collides(pose, moved) == said


def test_no_point_of_the_tool_is_further_from_tip_and_axis_than_is_said():
    place = pin.SE3(pin.exp3(np.array([0.3, -0.5, 0.2])), np.array([0.1, 0.2, -0.1]))
    sides = np.array([0.2, 0.06, 0.4])
    couple = Couple(
        Body(Box(tuple(sides)), place.homogeneous), Body(Sphere(0.1), np.eye(4)), 0.0, TIP, AXIS
    )
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    away = (0.5 * signs * sides) @ place.rotation.T + place.translation - TIP
    assert couple.reach == pytest.approx(np.linalg.norm(away, axis=1).max())
    assert couple.lateral == pytest.approx(np.hypot(away[:, 0], away[:, 1]).max())


def test_of_a_surface_s_triangles_what_they_may_be_off_is_lost():
    robot = planar_arm(2)
    triangle = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], dtype=float)
    tool = Solid("tool", 2, np.eye(4), Sphere(0.1))
    soup = Soup("surface", triangle, 0.004, False)
    bodies = Bodies((tool,), (), (soup,), (), (Pair("tool", "surface", 0.01),))
    (couple,) = couples_of(robot, bodies, AXIS)
    assert couple.wanted == pytest.approx(0.006)


@pytest.mark.parametrize("gap", [None, *np.linspace(-np.pi, np.pi, 9)])
def test_one_gap_at_any_roll_is_enough(gap):
    """A ball goes round the tool axis, through a wall that leaves out one direction."""
    robot = planar_arm(2)  # its tool axis is x of the last joint, and the tip 0.3 m along it
    place = np.eye(4)
    place[:3, 3] = 0.3, 0.0, 0.3
    tool = Solid("tool", 2, place, Sphere(0.05))
    turned, shift = np.eye(4), 0.4 if gap is not None else 0.0
    turned[:3, :3] = pin.exp3(np.array([0.0, 0.0, gap or 0.0]))
    turned[:3, 3] = turned[:3, :3] @ [-shift, 0.0, 0.0]
    wall = Obstacle("wall", Box((1.0, 1.0, 0.2)), turned)
    bodies = Bodies((tool,), (), (), (wall,), (Pair("tool", "wall", 0.0),))
    asked = robot, bodies, 0.0, 1e-3, np.zeros(3), np.array([0.0, 0.0, 1.0])
    assert never_clear(*asked).confirmed == (gap is None)
    assert not never_clear(*asked, most=1).confirmed
