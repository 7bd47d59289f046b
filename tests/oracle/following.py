"""Motions over a surface by inverse kinematics of small steps, and what they really keep.

Nothing of the search is used: Pinocchio gives tool and Jacobian, Gauss-Newton with joints held at
their limits follows places of the surface, and the formulas of `dense_replay` say where they are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from dense_replay import Floats, angles, dense, placed, tools

from feasibility import Task
from robots import Robot
from surfaces import Cells

STEP = 4e-3  # [m] between places of a raster
MOST_TURN = 0.12  # [rad] of a joint from place to place
PER_STEP = 6  # samples between places, when a motion is measured


class Arm:
    """Tool point, axis and their Jacobians, by Pinocchio alone."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.lower, self.upper = robot.lower, robot.upper
        self._data = robot.model.createData()
        self._neutral = pin.neutral(robot.model)
        self._frame = robot.model.getFrameId(robot.tool_frame, pin.FrameType.BODY)

    def tool(self, q: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Point (3,), axis (3,) and their derivatives (3, n) at q (n,)."""
        model, data = self.robot.model, self._data
        jacobian = pin.computeFrameJacobian(
            model,
            data,
            pin.integrate(model, self._neutral, np.ascontiguousarray(q)),
            self._frame,
            pin.ReferenceFrame.LOCAL_WORLD_ALIGNED,
        )
        pin.updateFramePlacement(model, data, self._frame)
        axis = data.oMf[self._frame].rotation @ self.robot.approach_axis
        point = data.oMf[self._frame].translation.copy()
        return point, axis, jacobian[:3], -pin.skew(axis) @ jacobian[3:]

    def random(self, rng: np.random.Generator) -> Floats:
        """A configuration inside the limits; within half a turn of 0 where there are none."""
        low = np.where(np.isfinite(self.lower), self.lower, -np.pi)
        high = np.where(np.isfinite(self.upper), self.upper, np.pi)
        return np.asarray(rng.uniform(low, high))


def settled(
    arm: Arm, q: Floats, point: Floats, approach: Floats, cone: float = 0.0, most: int = 40
) -> Floats:
    """Bring the tool as near to a point as the limits allow, its axis within `cone` (rad).

    A cone of 0 asks for the axis exactly. Damped Gauss-Newton; a joint that would leave its limits
    is set to the limit, and left out of the step.
    """
    q = np.clip(q, arm.lower, arm.upper)
    chord = 2.0 * np.sin(0.5 * min(cone, 3.0))
    for _ in range(most):
        p, a, dp, da = arm.tool(q)
        off = approach - a
        too_far = max(np.linalg.norm(off) - chord, 0.0)
        if too_far > 0.0:
            off *= too_far / np.linalg.norm(off)
            rows, wanted = np.vstack([dp, da]), np.concatenate([point - p, off])
        else:
            rows, wanted = dp, point - p
        free = np.ones(len(q), dtype=bool)
        step = np.zeros(len(q))
        for _ in range(len(q)):
            part = rows[:, free]
            inner = part @ part.T + 1e-10 * np.eye(len(part))
            step = np.zeros(len(q))
            step[free] = part.T @ np.linalg.solve(inner, wanted)
            out = free & ((q + step < arm.lower) | (q + step > arm.upper))
            out &= np.where(step < 0.0, q <= arm.lower + 1e-12, q >= arm.upper - 1e-12)
            if not out.any():
                break
            free &= ~out
            if not free.any():
                return q
        largest = np.abs(step).max()
        step *= min(1.0, 0.2 / max(largest, 1e-12))
        q = np.clip(q + step, arm.lower, arm.upper)
        if largest < 1e-10:
            break
    return np.asarray(q)


class Raster(NamedTuple):
    """Places of a surface in the order in which a tool visits them."""

    uv: Floats
    """(m, 2) parameters, rad or m."""
    cell: Floats
    """(m,) the cell whose centre it is, -1 between centres."""


def raster(cells: Cells, task: Task, corner: str = "first", step: float = STEP) -> Raster:
    """All cell centres to and fro, with places at most `step` m apart between them."""
    surface, (nu, nv) = cells.surface, cells.shape
    (u0, u1), (v0, v1) = surface.u_range, surface.v_range
    order = np.arange(nu * nv).reshape(nu, nv)
    order[1::2] = order[1::2, ::-1]
    flat = order.ravel() if corner == "first" else order.ravel()[::-1]
    u = u0 + (u1 - u0) * (flat // nv + 0.5) / nu
    v = v0 + (v1 - v0) * (flat % nv + 0.5) / nv
    places, names = [np.array([u[0], v[0]])], [int(flat[0])]
    for k in range(len(flat) - 1):
        part = np.linspace(0.0, 1.0, 9)
        line = placed(
            surface, task, u[k] + part * (u[k + 1] - u[k]), v[k] + part * (v[k + 1] - v[k])
        )
        length = np.linalg.norm(np.diff(line[0], axis=0), axis=1).sum()
        turn = angles(line[1][1:], line[1][:-1]).sum()
        pieces = int(max(np.ceil(length / step), np.ceil(turn / 0.02), 1))
        for i in range(1, pieces + 1):
            share = i / pieces
            places.append(
                np.array([u[k] + share * (u[k + 1] - u[k]), v[k] + share * (v[k + 1] - v[k])])
            )
            names.append(int(flat[k + 1]) if i == pieces else -1)
    return Raster(np.array(places), np.array(names))


def follow(
    arm: Arm, cells: Cells, task: Task, way: Raster, start: Floats, cone: float
) -> Floats | None:
    """Configurations (m, n) over the places of a raster; None where a joint has to jump.

    Args:
        arm: with the limits that hold.
        cells: what the raster is over.
        task: where the targets are.
        way: the raster.
        start: (n,) over its first place.
        cone: rad, the cone that the motion keeps to; 0 for exactly along the approach direction.
    """
    points, approaches = placed(cells.surface, task, *way.uv.T)
    q = settled(arm, start, points[0], approaches[0], cone)
    rows = [q]
    for point, approach in zip(points[1:], approaches[1:], strict=True):
        q = settled(arm, q, point, approach, cone)
        if np.abs(q - rows[-1]).max() > MOST_TURN:
            return None
        rows.append(q)
    return np.array(rows)


class Kept(NamedTuple):
    """What a motion keeps at its worst, on samples between its rows too."""

    distance: float
    """m from the place it is over."""
    tilt: float
    """rad between axis and approach direction."""
    room: float
    """rad or m to the nearest limit; negative: outside."""


def measured(
    robot: Robot, cells: Cells, task: Task, way: Raster, q: Floats, per_step: int = PER_STEP
) -> Kept:
    """Sample a motion, straight in joints between rows, against the places straight between."""
    points, approaches = placed(cells.surface, task, *dense(way.uv, per_step).T)
    tips, axes = tools(robot, dense(q, per_step))
    return Kept(
        float(np.linalg.norm(tips - points, axis=1).max()),
        float(angles(axes, approaches).max()),
        float(np.minimum(q - robot.lower, robot.upper - q).min()),
    )
