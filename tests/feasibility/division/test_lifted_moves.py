"""A tool that touches the surface is lifted between patches, and nothing drags over it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from foreign_clearances import ForeignScene, samples

from feasibility import Task, check
from feasibility.certification import collision_replay
from feasibility.collisions import Collision, ToolShape, gather
from feasibility.division import Reconfiguration
from feasibility.division.between_patches import LIFT, STEPS, clear_moves, lift
from feasibility.verdict import Walk
from robots import Kinematics, load_robot
from surfaces import plane

UR5 = load_robot("ur5")
CELLS = plane((0.4, 0.6), (-0.15, 0.15), "outside", (0.0, 0.0, 0.3)).cells(1, 3)
NOZZLE = ToolShape.cylinder(0.01, 0.1, position=(0.0, 0.0, -0.05))
# The links on the flange may meet the surface: the tool is the nozzle.
TASK = Task(0.0, 20.0, collision=Collision(scene=(), tool=(NOZZLE,), clearance=0.001))


@cache
def ends() -> tuple[np.ndarray, np.ndarray]:
    """Where the tool touches over the first and over the last cell."""
    walk = check(UR5, CELLS, TASK).witness
    assert isinstance(walk, Walk)
    return walk.q[0], walk.q[-1]


def test_the_tool_is_drawn_back_along_its_axis() -> None:
    tools = Kinematics(UR5)
    for q in ends():
        rows = lift(UR5, q)
        assert rows is not None
        assert rows.shape == (STEPS, 6)
        (point, *points), (axis, *axes) = tools.tools(np.vstack([q, rows]))
        heights = LIFT * np.arange(1, STEPS + 1) / STEPS
        np.testing.assert_allclose(points, point - heights[:, None] * axis, atol=1e-5)
        np.testing.assert_allclose(axes, np.tile(axis, (STEPS, 1)), atol=1e-5)


def test_a_limit_in_the_way_is_said() -> None:
    q, _ = ends()
    assert lift(UR5.with_limits(np.column_stack([q - 1e-4, q + 1e-4])), q) is None


def test_a_move_between_patches_does_not_drag_the_tool() -> None:
    start, end = ends()
    move = Reconfiguration(UR5.joint_names, UR5.prismatic, start, end)
    bodies = gather(UR5, CELLS.surface, TASK.collision, 0.0)
    lifted = gather(UR5, CELLS.surface, TASK.collision, LIFT)
    assert bodies is not None
    assert lifted is not None
    contact = {(one.first, one.second) for one in bodies.left_out if one.why == "contact"}
    assert contact
    assert not contact & {(one.first, one.second) for one in bodies.pairs}
    assert contact <= {(one.first, one.second) for one in lifted.pairs}
    assert not collision_replay(UR5, lifted, move.waypoints).accepted
    (clear,) = clear_moves(UR5, CELLS, TASK, np.zeros(0), [move])
    assert clear.refusal == ""
    assert len(clear.via) >= 2 * STEPS
    np.testing.assert_array_equal(clear.waypoints[[0, -1]], [start, end])
    # fcl agrees: from the lifted tool to the lifted tool nothing is nearer than it may be.
    between = clear.waypoints[STEPS:-STEPS]
    assert ForeignScene(UR5, lifted).least_excess(samples(between, np.radians(0.5))) >= -1e-6
    points, _ = Kinematics(UR5).tools(clear.waypoints)
    assert (np.diff(points[: STEPS + 1, 2]) > 0.0).all()
    assert (np.diff(points[-STEPS - 1 :, 2]) < 0.0).all()
    assert clear.replayed is not None
    assert clear.replayed.min_clearance == pytest.approx(
        min(
            collision_replay(UR5, bodies, clear.waypoints).min_clearance or 0.0,
            collision_replay(UR5, lifted, between).min_clearance or 0.0,
        )
    )


def test_a_tool_that_cannot_be_lifted_is_refused() -> None:
    start, end = ends()
    low, high = np.minimum(start, end), np.maximum(start, end)
    robot = UR5.with_limits(np.column_stack([low, high]))
    move = Reconfiguration(robot.joint_names, robot.prismatic, start, end)
    (refused,) = clear_moves(robot, CELLS, TASK, np.zeros(0), [move])
    assert len(refused.via) == 0
    assert "surface" in refused.refusal
