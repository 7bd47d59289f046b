"""Timed motions: one in closed form, and what a controller makes of any between its samples."""

import numpy as np
from scipy.interpolate import BPoly

from coverable import Trajectory, load_robot
from robots.kinematics import Kinematics

UR5 = load_robot("ur5")
TURN = 180.0 / np.pi


def at(time, n):
    """q, dq and ddq (k, n) of a smooth motion from rest to rest in two seconds."""
    s = np.clip(np.asarray(time)[:, None] / 2.0, 0.0, 1.0)
    way = np.linspace(2.0, 0.5, n)
    q = np.linspace(-1.0, 1.0, n) + s**3 * (10 - 15 * s + 6 * s**2) * way
    return q, 15 * (s * (1 - s)) ** 2 * way, 15 * s * (1 - s) * (1 - 2 * s) * way


def motion(robot):
    """Its samples, one of them between the regular ones."""
    time = np.sort(np.append(np.arange(0.0, 2.0 + 1e-9, 0.02), 0.1234567))
    still = np.zeros(len(time))
    return Trajectory(robot.joint_names, time, *at(time, robot.n), still, still.astype(int) - 1)


def interpolated(run, degree, places):
    """q, dq, ddq (m, n) at places between samples: quintics through these, cubics without ddq."""
    sides = run.q, run.dq, run.ddq
    curve = BPoly.from_derivatives(run.time, np.stack(sides[: (degree + 1) // 2], axis=1))
    share = np.linspace(0.0, 1.0, places, endpoint=False)
    at = (run.time[:-1, None] + np.diff(run.time)[:, None] * share).ravel()
    return [
        np.vstack([(curve.derivative(order) if order else curve)(at), side[-1:]])
        for order, side in enumerate(sides)
    ]


def keeps_to_limits(robot, run, limits):
    """Joints, velocities, accelerations and the tool's speed, however samples are interpolated."""
    kinematics = Kinematics(robot)
    for degree in (3, 5):
        q, dq, ddq = interpolated(run, degree, 7)
        assert (q >= robot.lower).all()
        assert (q <= robot.upper).all()
        assert (np.abs(dq) <= limits.velocity * (1 + 1e-9)).all()
        assert (np.abs(ddq[:-1]) <= limits.acceleration * (1 + 1e-9)).all()
        speed = [np.linalg.norm(kinematics.jacobians(a)[0] @ b) for a, b in zip(q, dq, strict=True)]
        assert max(speed) <= limits.tool_speed * (1 + 1e-6)
