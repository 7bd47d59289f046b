"""A replay of a witness that shares nothing with the packages but the numbers that define a case.

Pinocchio places the tool at many points of every segment; heights, normals, parameters and cell
centres come from the formulas of six kinds of surface, written out here.
"""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from feasibility import Task, Verdict
from robots import Robot
from surfaces import Cells, Surface

Floats = NDArray[np.float64]
PER_SEGMENT = 20
SAME = 1e-9  # [m], [rad]: rounding between two computations of one number


def tools(robot: Robot, q: Floats) -> tuple[Floats, Floats]:
    """Tool points and approach axes (k, 3) of configurations (k, n), by Pinocchio alone."""
    model, data = robot.model, robot.model.createData()
    frame = model.getFrameId(robot.tool_frame, pin.FrameType.BODY)
    neutral = pin.neutral(model)
    points, axes = np.empty((len(q), 3)), np.empty((len(q), 3))
    for k, row in enumerate(q):
        pin.forwardKinematics(model, data, pin.integrate(model, neutral, np.ascontiguousarray(row)))
        pin.updateFramePlacement(model, data, frame)
        points[k] = data.oMf[frame].translation
        axes[k] = data.oMf[frame].rotation @ robot.approach_axis
    return points, axes


def local_frame(surface: Surface, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Points and outward normals (k, 3) at parameters, in the surface's own frame."""
    size, kind = surface.lengths, surface.kind
    if kind == "plane":
        zero = np.zeros_like(u)
        return np.stack([u, v, zero], -1), np.stack([zero, zero, zero + 1.0], -1)
    if kind == "sphere":
        normal = np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], -1)
        return size[0] * normal, normal
    if kind == "torus":
        flat = np.cos(v)
        normal = np.stack([flat * np.cos(u), flat * np.sin(u), np.sin(v)], -1)
        return size[0] * np.stack([np.cos(u), np.sin(u), 0.0 * u], -1) + size[1] * normal, normal
    if kind == "cone":
        radius, normal = size[0] + size[1] * v, np.stack([np.cos(u), np.sin(u), 0.0 * u], -1)
        point = radius[..., None] * normal + np.stack([0.0 * v, 0.0 * v, v], -1)
        normal = (normal - np.array([0.0, 0.0, size[1]])) / np.hypot(1.0, size[1])
        return point, normal
    slant = v / size[1] if kind == "hyperboloid" else 0.0 * v
    radius = size[0] * np.sqrt(1.0 + slant**2)
    slope = size[0] ** 2 * slant / (size[-1] * radius) if kind == "hyperboloid" else slant
    normal = np.stack([np.cos(u), np.sin(u), -slope], -1)
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
    return np.stack([radius * np.cos(u), radius * np.sin(u), v], -1), normal


def closest_points(surface: Surface, points: Floats) -> tuple[Floats, Floats]:
    """Parameters (k,) of the surface's points nearest to points (k, 3) of the root frame."""
    x, y, z = ((points - surface.position) @ surface.rotation).T
    across = np.hypot(x, y)
    if surface.kind == "plane":
        return x, y
    if surface.kind == "sphere":
        return np.arctan2(across, z), np.arctan2(y, x)
    if surface.kind == "torus":
        return np.arctan2(y, x), np.arctan2(z, across - surface.lengths[0])
    if surface.kind == "cone":
        radius, slope = surface.lengths
        return np.arctan2(y, x), (z + slope * (across - radius)) / (1.0 + slope**2)
    v = z.copy()
    if surface.kind == "hyperboloid":
        waist, flare = surface.lengths
        for _ in range(50):  # Newton on d/dv of the squared distance from the profile
            radius = waist * np.sqrt(1.0 + (v / flare) ** 2)
            rise = waist**2 * v / (flare**2 * radius)
            bend = waist**4 / (flare**2 * radius**3)
            v -= ((radius - across) * rise + v - z) / (1.0 + rise**2 + (radius - across) * bend)
    return np.arctan2(y, x), v


def centre_targets(cells: Cells, task: Task) -> tuple[Floats, Floats]:
    """Target points and approach directions (N, 3) of all cell centres, from the ranges alone."""
    surface, (nu, nv) = cells.surface, cells.shape
    (u0, u1), (v0, v1) = surface.u_range, surface.v_range
    u = np.repeat(u0 + (u1 - u0) * (np.arange(nu) + 0.5) / nu, nv)
    v = np.tile(v0 + (v1 - v0) * (np.arange(nv) + 0.5) / nv, nu)
    return placed(surface, task, u, v)


def placed(surface: Surface, task: Task, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Target points and approach directions (k, 3) at parameters, in the root frame."""
    point, normal = local_frame(surface, u, v)
    sign = -1.0 if surface.side == "inside" else 1.0
    target = (point + sign * task.standoff * normal) @ surface.rotation.T + surface.position
    return target, -sign * normal @ surface.rotation.T


def onto_patch(surface: Surface, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Parameters brought into the patch's ranges; an angle first to the turn nearest to them."""
    found = []
    ranges = (surface.u_range, surface.v_range)
    for value, (low, high), unit in zip((u, v), ranges, surface.units, strict=True):
        if unit == "rad":
            middle = 0.5 * (low + high)
            value = middle + (value - middle + np.pi) % (2.0 * np.pi) - np.pi
        found.append(np.clip(value, low, high))
    return found[0], found[1]


def angles(a: Floats, b: Floats) -> Floats:
    """Angles between unit vectors (k, 3), rad; exact near zero too."""
    return 2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(a - b, axis=-1), 0.0, 1.0))


def dense(rows: Floats, per_segment: int = PER_SEGMENT) -> Floats:
    """Rows (k, n) and others evenly on the straight lines between them."""
    part = np.arange(per_segment)[:, None] / per_segment
    between = rows[:-1, None] * (1.0 - part) + rows[1:, None] * part
    return np.concatenate([between.reshape(-1, rows.shape[1]), rows[-1:]])


def assert_over(verdict: Verdict, cell: NDArray[np.int64], q: Floats) -> None:
    """Every q (k, n) holds the tool over the centre of its cell, inside all constraints."""
    robot, cells, task = verdict.robot, verdict.cells, verdict.task
    tolerance = 1e-3 if task.tolerance is None else task.tolerance
    points, axes = tools(robot, q)
    target, approach = centre_targets(cells, task)
    assert (np.linalg.norm(points - target[cell], axis=1) <= tolerance).all()
    assert (angles(axes, approach[cell]) <= task.cone + SAME).all()
    assert (q >= robot.lower).all()
    assert (q <= robot.upper).all()


def assert_motion(verdict: Verdict, q: Floats) -> None:
    """The straight segments between the rows of q (m, n) keep tolerance, cone, limits and patch."""
    robot, task, surface = verdict.robot, verdict.task, verdict.cells.surface
    tolerance = 1e-3 if task.tolerance is None else task.tolerance
    assert np.isfinite(q).all()
    assert (q >= robot.lower).all()
    assert (q <= robot.upper).all()
    points, axes = tools(robot, dense(q))
    u, v = onto_patch(surface, *closest_points(surface, points))
    target, approach = placed(surface, task, u, v)
    assert np.linalg.norm(points - target, axis=1).max() <= tolerance + SAME
    assert angles(axes, approach).max() <= task.cone + SAME


def assert_witness(verdict: Verdict) -> None:
    """The witness is one motion inside all constraints that visits every cell's centre."""
    walk = verdict.witness
    assert walk is not None
    assert_motion(verdict, walk.q)
    at = walk.cell >= 0
    assert_over(verdict, walk.cell[at], walk.q[at])
    assert set(walk.cell[at].tolist()) == set(range(len(verdict.cells)))
