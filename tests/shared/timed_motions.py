"""A timed motion in closed form, for the tests of programs."""

import numpy as np

from feasibility.timing import Trajectory
from robots import load_robot

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
