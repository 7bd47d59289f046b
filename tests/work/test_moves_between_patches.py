"""Moves between patches that keep clear: found, certified, and judged by a library of their own."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from foreign_clearances import ForeignScene
from referee import closely

from coverable import Collision, Obstacle, Task, ToolShape, check, divide, load_robot, plane
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.collisions.asked_bodies import gather
from feasibility.collisions.kernels.memory import collision_buffer
from feasibility.division.between_patches import clear_moves
from feasibility.division.free_motion import FreeSpace, free_motion
from feasibility.division.reconfiguration import Reconfiguration
from feasibility.reports.division import as_text
from robots.kinematics import Kinematics

UR5 = load_robot("ur5")
POST = Obstacle.box("post", (0.1, 0.1, 1.2), position=(0.45, 0.0, 0.6))
BEHIND = plane((-0.1, 0.1), (-0.2, 0.2), "inside", (-0.6, 0.0, 0.3), (0, -90, 0))
POSTURE = {"shoulder_pan_joint": (-180, 180), "shoulder_lift_joint": (-90, 0),
           "elbow_joint": (0, 150), "wrist_1_joint": (-120, 120)}  # fmt: skip
"""The last one is not folded back onto the forearm."""
POSED = UR5.with_limits({name: np.radians(ends) for name, ends in POSTURE.items()})


@cache
def behind():
    """A plate behind an arm whose first joint ends there; a post in front, where it has to pass."""
    asked = Collision(clearance=0.005, scene=(POST,))
    return divide(POSED, BEHIND.cells(1, 5), Task(0.05, cone_deg=30, collision=asked))


def bodies_of(division):
    task = division.task
    return gather(division.robot, division.cells.surface, task.collision, task.standoff)


def text_of(division):
    return " ".join(as_text(division, "").split())


def test_the_move_between_two_patches_goes_around_the_post():
    division = behind()
    one, other = division.patches
    (move,) = division.moves
    assert division.whole
    np.testing.assert_array_equal(move.waypoints[0], one.walk.q[-1])
    np.testing.assert_array_equal(move.waypoints[-1], other.walk.q[0])
    robot, bodies = division.robot, bodies_of(division)
    assert not collision_replay(robot, bodies, np.stack([move.start, move.end])).accepted
    assert len(move.via) > 0
    assert (move.waypoints >= robot.lower).all()
    assert (move.waypoints <= robot.upper).all()
    again = collision_replay(robot, bodies, move.waypoints)
    assert again.accepted
    assert again == move.replayed
    assert again.min_clearance is not None
    assert not move.via.flags.writeable
    way = f"through {len(move.via)} configurations (--json has them); bodies at least"
    assert way in text_of(division)
    # fcl agrees, at single configurations.
    dense = closely(move.waypoints, np.radians(4.0))
    assert ForeignScene(robot, bodies).least_excess(dense).min() >= -1e-6
    for patch in division.patches:
        assert patch.accepted
        assert collision_replay(robot, bodies, patch.walk.q).accepted


def test_a_move_that_is_not_found_is_refused_and_said():
    """A wall around the arm but for the plate behind: patches as before, the move refused."""
    division = behind()
    wall = Obstacle.box("wall", (0.02, 4.0, 4.0), position=(0.2, 0.0, 0.0))
    task = replace(division.task, collision=Collision(clearance=0.005, scene=(wall,)))
    (move,) = clear_moves(division.robot, division.cells, task, division.moves)
    assert len(move.via) == 0
    assert move.refusal.startswith("no path around was found, and straight on")
    assert "wall overlap" in move.refusal
    assert f"refused: {move.refusal}" in text_of(replace(division, moves=(move,)))
    bodies = gather(division.robot, division.cells.surface, task.collision, task.standoff)
    space = FreeSpace(division.robot, collision_buffer(bodies, division.robot), 500)
    assert free_motion(space, division.moves[0].start, division.moves[0].end, 0) is None
    assert space.left <= 0
    # Nothing is checked where nothing is asked.
    free = replace(division.task, collision=None)
    moves = [Reconfiguration(("a",), np.zeros(1, dtype=bool), np.zeros(1), np.ones(1))]
    (same,) = clear_moves(division.robot, division.cells, free, moves)
    assert (same is moves[0], same.refusal) == (True, "")
    np.testing.assert_array_equal(same.waypoints, [[0.0], [1.0]])


FLAT = plane((0.4, 0.6), (-0.15, 0.15), "outside", (0.0, 0.0, 0.3)).cells(1, 3)
NOZZLE = ToolShape.cylinder(0.01, 0.1, position=(0.0, 0.0, -0.05))
# The links on the flange may meet the surface: the tool is the nozzle.
TOUCHING = Task(0.0, 20.0, collision=Collision(scene=(), tool=(NOZZLE,), clearance=0.001))


@cache
def ends():
    """Where the tool touches over the first and over the last cell."""
    walk = check(UR5, FLAT, TOUCHING).witness
    return walk.q[0], walk.q[-1]


def test_a_tool_that_touches_is_lifted_along_its_axis_and_drags_over_nothing():
    start, end = ends()
    move = Reconfiguration(UR5.joint_names, UR5.prismatic, start, end)
    bodies = gather(UR5, FLAT.surface, TOUCHING.collision, 0.0)
    lifted = gather(UR5, FLAT.surface, TOUCHING.collision, 0.02)
    contact = {(one.first, one.second) for one in bodies.left_out if one.why == "contact"}
    assert contact
    assert contact <= {(one.first, one.second) for one in lifted.pairs}
    assert not collision_replay(UR5, lifted, move.waypoints).accepted
    (clear,) = clear_moves(UR5, FLAT, TOUCHING, [move])
    assert clear.refusal == ""
    rows = clear.waypoints
    np.testing.assert_array_equal(rows[[0, -1]], [start, end])
    points, axes = Kinematics(UR5).tools(rows)
    for way in (1, -1):  # 20 mm straight up, in four steps, at both ends
        up, along = points[::way][:5], axes[::way][:5]
        heights = np.arange(5)[:, None] * 0.005
        np.testing.assert_allclose(up, up[0] - heights * along[0], atol=1e-5)
        np.testing.assert_allclose(along, np.tile(along[0], (5, 1)), atol=1e-5)
    # fcl agrees: from the lifted tool to the lifted tool nothing is nearer than it may be.
    between = rows[4:-4]
    assert ForeignScene(UR5, lifted).least_excess(closely(between, np.radians(0.5))).min() >= -1e-6
    judged = [collision_replay(UR5, bodies, rows), collision_replay(UR5, lifted, between)]
    assert all(one.accepted for one in judged)
    least = min(one.min_clearance for one in judged if one.min_clearance is not None)
    assert clear.replayed.min_clearance == pytest.approx(least)


def test_a_tool_that_cannot_be_lifted_is_refused():
    start, end = ends()
    low, high = np.minimum(start, end), np.maximum(start, end)
    robot = UR5.with_limits(np.column_stack([low, high]))
    move = Reconfiguration(robot.joint_names, robot.prismatic, start, end)
    (refused,) = clear_moves(robot, FLAT, TOUCHING, [move])
    assert len(refused.via) == 0
    assert "surface" in refused.refusal
