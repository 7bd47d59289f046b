"""Landings by other code: the claim of a certified tile, tried at random places.

Targets from the formulas of the surfaces written once more, tool points and Jacobians from
Pinocchio alone. A tile says that every place x of it has a solution q + G v near the configuration
q over its middle, inside limits and cone: Newton's method in v finds it, or the tile is wrong.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from feasibility.area import CertifiedArea
from feasibility.verdict import Verdict

Floats = NDArray[np.float64]

STEPS = 30
SOLVED = 1e-10  # m


class Landings(NamedTuple):
    """What came of random places."""

    tried: int
    failed: int
    cone_used: float
    """The largest share of the cone's angle."""
    room: float
    """rad or m, the least distance from a limit."""


def place_of(surface, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Points (k, 3) m and outward normals by the textbook's formulas."""
    if surface.kind == "sphere":
        normal = np.stack([np.sin(u) * np.cos(v), np.sin(u) * np.sin(v), np.cos(u)], axis=1)
        point = surface.radius * normal
    elif surface.kind == "cylinder":
        normal = np.stack([np.cos(u), np.sin(u), 0.0 * u], axis=1)
        point = surface.radius * normal + np.stack([0.0 * v, 0.0 * v, v], axis=1)
    elif surface.kind == "hyperboloid":
        r = surface.waist * np.hypot(1.0, v / surface.flare)
        slope = surface.waist**2 * v / (surface.flare**2 * r)
        point = np.stack([r * np.cos(u), r * np.sin(u), v], axis=1)
        normal = np.stack([np.cos(u), np.sin(u), -slope], axis=1) / np.hypot(1.0, slope)[:, None]
    else:
        assert surface.kind == "plane"
        point = np.stack([u, v, 0.0 * u], axis=1)
        normal = np.tile([0.0, 0.0, 1.0], (len(u), 1))
    return point @ surface.rotation.T + surface.position, normal @ surface.rotation.T


def targets_of(verdict: Verdict, u: Floats, v: Floats) -> tuple[Floats, Floats]:
    """Targets T (k, 3) m and approach directions b (k, 3) over places."""
    point, normal = place_of(verdict.cells.surface, u, v)
    inside = verdict.cells.surface.side == "inside"
    return point + (-1.0 if inside else 1.0) * verdict.task.standoff * normal, (
        normal if inside else -normal
    )


def random_landings(
    verdict: Verdict, area: CertifiedArea, count: int, rng: np.random.Generator
) -> Landings:
    """Solve for random places of the certified tiles of a patch."""
    robot, task = verdict.robot, verdict.task
    row = rng.choice(len(area.areas), size=count, p=area.areas / area.areas.sum())
    low, high = area.tiles.corners[row, 0], area.tiles.corners[row, 2]
    u, v = (low + rng.uniform(size=(count, 2)) * (high - low)).T
    wanted, along = targets_of(verdict, u, v)
    data = robot.model.createData()
    frame, failed, used, room = robot.tool_frame_id, 0, 0.0, np.inf
    cone = np.radians(task.cone_deg)
    for k in range(count):
        start, gain = area.q[row[k]], area.gains[row[k]]
        shift = np.zeros(3)
        for _ in range(STEPS):
            q = start + gain @ shift
            whole = q if robot.model.nq == robot.n else pin.integrate(
                robot.model, pin.neutral(robot.model), q)  # fmt: skip
            jacobian = pin.computeFrameJacobian(
                robot.model, data, whole, frame, pin.LOCAL_WORLD_ALIGNED
            ).reshape(6, robot.n)[:3]
            pin.updateFramePlacement(robot.model, data, frame)
            off = wanted[k] - data.oMf[frame].translation
            if np.linalg.norm(off) < SOLVED:
                break
            shift = shift + np.linalg.solve(jacobian @ gain, off)
        axis = data.oMf[frame].rotation @ robot.approach_axis
        angle = np.arctan2(np.linalg.norm(np.cross(axis, along[k])), axis @ along[k])
        margin = float(np.minimum(q - robot.lower, robot.upper - q).min())
        solved = np.linalg.norm(off) < SOLVED
        failed += not (solved and margin >= -1e-12 and angle <= cone + 1e-9)
        used, room = max(used, float(angle / cone)), min(room, margin)
    return Landings(count, failed, used, room)
