"""Motions of verdicts by the referee at many places; tools of arms without a file by Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import plain
import referee
from numpy.typing import NDArray
from referee import Floats, evenly

from feasibility import Task, Verdict
from robots import Robot
from surfaces import Surface

dense, angles = evenly, referee.angles_between


def tools(robot: Robot, q: Floats) -> tuple[Floats, Floats]:
    """Tool points and approach axes (k, 3) of configurations (k, n), by Pinocchio alone."""
    model, data = robot.model, robot.model.createData()
    neutral = pin.neutral(model)
    points, axes = np.empty((len(q), 3)), np.empty((len(q), 3))
    for k, row in enumerate(q):
        pin.forwardKinematics(model, data, pin.integrate(model, neutral, np.ascontiguousarray(row)))
        pin.updateFramePlacement(model, data, robot.tool_frame_id)
        points[k] = data.oMf[robot.tool_frame_id].translation
        axes[k] = data.oMf[robot.tool_frame_id].rotation @ robot.approach_axis
    return points, axes


def placed(surface: Surface, task: Task, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Target points and approach directions (k, 3) at parameters, in the root frame."""
    form = plain.surface_of(surface)
    there = form.at(u, v)
    return there.points + form.sign * task.standoff * there.normals, -form.sign * there.normals


def assert_over(verdict: Verdict, cell: NDArray[np.int64], q: Floats) -> None:
    """Every q (k, n) holds the tool over the centre of its cell, inside all constraints."""
    aims, approaches = plain.targets_of(verdict.cells, verdict.task)
    asked = plain.asked_of(verdict.task, verdict.cells)
    points, axes = tools(verdict.robot, q)
    assert (np.linalg.norm(points - aims[cell], axis=1) <= asked.tolerance).all()
    assert (angles(axes, approaches[cell]) <= asked.cone + referee.SAME).all()
    assert (q >= verdict.robot.lower).all()
    assert (q <= verdict.robot.upper).all()


def assert_motion(verdict: Verdict, q: Floats) -> None:
    """The straight segments between the rows of q (m, n) keep tolerance, cone, limits and patch."""
    form, asked = (
        plain.surface_of(verdict.cells.surface),
        plain.asked_of(verdict.task, verdict.cells),
    )
    nothing = np.empty((0, 3)), np.empty((0, 3))
    assert referee.judge(plain.arm_of(verdict.robot), form, asked, q, nothing) == []


def assert_witness(verdict: Verdict) -> None:
    """The witness is one motion inside all constraints that visits every cell's centre."""
    assert plain.faults_of(verdict) == []
