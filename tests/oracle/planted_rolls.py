"""Random cases with an orientation that is (nearly) fixed, feasible by a motion that is planted.

From a random configuration the tool's whole placement is followed over a small surface by
Pinocchio, from centre to centre. Limits of some joints then end a few degrees beyond that motion.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from feasibility import Task
from robots import Robot, load_robot
from surfaces import Cells, Surface, cylinder, plane, sphere

STANDOFF = 0.01  # [m]
STEPS = 10  # from one centre to the next
LEAST = 0.03  # [1] singular value of the Jacobian: nearer to a singularity no motion is planted
FARTHEST = 0.5  # [rad] of one joint in one step
MARGINS_DEG = (1.0, 3.0, 10.0)
RANGES_DEG = ((0.5, 0.5), (10.0, 5.0), (30.0, 1.0))  # cone, and half range of roll


class Planted(NamedTuple):
    """A case that is feasible."""

    robot: Robot
    cells: Cells
    task: Task


class _Follower:
    """One arm whose tool is led from placement to placement."""

    def __init__(self, robot: Robot) -> None:
        self.robot, self.data = robot, robot.model.createData()
        a, x = robot.approach_axis, robot.reference_axis
        self.tool = np.column_stack([x, np.cross(a, x), a])

    def placement(self, q: np.ndarray) -> pin.SE3:
        model = self.robot.model
        pin.forwardKinematics(model, self.data, pin.integrate(model, pin.neutral(model), q))
        return pin.updateFramePlacement(model, self.data, self.robot.tool_frame_id)

    def newton(self, q: np.ndarray, goal: pin.SE3) -> np.ndarray | None:
        """The configuration next to q whose tool is at `goal`; None near a singularity."""
        model = self.robot.model
        for _ in range(12):
            error = pin.log6(self.placement(q).inverse() * goal).vector
            if np.linalg.norm(error) < 1e-9:
                return q
            at = pin.integrate(model, pin.neutral(model), q)
            jacobian = pin.computeFrameJacobian(
                model, self.data, at, self.robot.tool_frame_id, pin.ReferenceFrame.LOCAL
            )
            if np.linalg.svd(jacobian, compute_uv=False)[-1] < LEAST:
                return None
            q = q + np.linalg.solve(jacobian, error)
        return None

    def over(self, surface: Surface, place: np.ndarray, reference: np.ndarray) -> pin.SE3:
        """The tool straight over a place (2,), its reference axis along the projected one."""
        u, v = place[:, None]
        (normal,), (point,) = surface.normal(u, v), surface.point(u, v)
        b = -surface.side_sign * normal
        t = reference - (reference @ b) * b
        t /= np.linalg.norm(t)
        goal = np.column_stack([t, np.cross(b, t), b])
        return pin.SE3(goal @ self.tool.T, point - STANDOFF * b)

    def follow(
        self, surface: Surface, reference: np.ndarray, q: np.ndarray, way: np.ndarray
    ) -> list[np.ndarray] | None:
        """Configurations along places (2, 2) of a surface, from q on."""
        found: list[np.ndarray] = []
        for share in np.arange(1, STEPS + 1) / STEPS:
            place = way[0] + share * (way[1] - way[0])
            after = self.newton(q, self.over(surface, place, reference))
            if after is None or np.abs(after - q).max() > FARTHEST:
                return None
            q = after
            found.append(q)
        return found


def _patch(rng: np.random.Generator) -> Surface:
    """A piece of 0.1 to 0.4 m of a plane, a ball or a tube, in its own frame."""
    size, radius = rng.uniform(0.1, 0.4), rng.uniform(0.25, 0.8)
    half, side = np.degrees(0.5 * size / radius), str(rng.choice(["inside", "outside"]))
    kind = rng.choice(["plane", "sphere", "cylinder"])
    if kind == "sphere":
        return sphere(radius, (90 - half, 90 + half), (-half, half), side=side)
    if kind == "cylinder":
        return cylinder(radius, (-half, half), (-0.5 * size, 0.5 * size), side=side)
    return plane((-0.5 * size, 0.5 * size), (-0.5 * size, 0.5 * size), side=side)


def planted_roll(name: str, rng: np.random.Generator) -> Planted:
    """A random feasible case of an arm of six joints; as often as needed until there is one."""
    while True:
        made = _attempt(load_robot(name), rng)
        if made is not None:
            return made


def _attempt(robot: Robot, rng: np.random.Generator) -> Planted | None:
    """A case; None where the planted motion ends early, or leaves the limits."""
    follower, surface = _Follower(robot), _patch(rng)
    low, high = np.maximum(robot.lower, -np.pi), np.minimum(robot.upper, np.pi)
    q = 0.9 * rng.uniform(low, high)
    start = follower.placement(q).copy()
    middle = np.array([np.mean(surface.u_range), np.mean(surface.v_range)])
    across = np.cross(surface.normal(*middle[:, None])[0], rng.normal(size=3))
    across /= np.linalg.norm(across)
    onto = start * follower.over(surface, middle, across).inverse()
    surface = surface.moved(onto.rotation, onto.translation)
    reference, cells = onto.rotation @ across, surface.cells(4, 4)
    places = np.column_stack([cells.u, cells.v])
    way = follower.follow(surface, reference, q, np.array([middle, places[cells.middle]]))
    if way is None:
        return None
    at, waiting = {cells.middle: way[-1]}, deque([cells.middle])
    indptr, indices = cells.neighbours
    while waiting:
        cell = waiting.popleft()
        for other in indices[indptr[cell] : indptr[cell + 1]].tolist():
            if other in at:
                continue
            more = follower.follow(surface, reference, at[cell], places[[cell, other]])
            if more is None:
                return None
            at[other] = more[-1]
            way += more
            waiting.append(other)
    least, most = np.min(way, axis=0), np.max(way, axis=0)
    if (least < robot.lower).any() or (most > robot.upper).any():
        return None
    margin = np.radians(rng.choice(MARGINS_DEG))
    tight = rng.random(robot.n) < 0.5
    limits = np.column_stack(
        [
            np.where(tight, np.maximum(least - margin, robot.lower), robot.lower),
            np.where(tight, np.minimum(most + margin, robot.upper), robot.upper),
        ]
    )
    cone_deg, half = RANGES_DEG[int(rng.integers(len(RANGES_DEG)))]
    off = rng.uniform(-0.4, 0.4) * half
    task = Task(
        STANDOFF,
        cone_deg,
        roll_deg=(off - half, off + half),
        roll_reference=tuple((surface.rotation.T @ reference).tolist()),
    )
    return Planted(robot.with_limits(limits), cells, task)
