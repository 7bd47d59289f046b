"""Paths and trajectories that several tests look at, made once."""

from __future__ import annotations

from functools import cache

import numpy as np
from small_cases import paper_verdict

from feasibility import Task, check
from feasibility.paths import coverage_path
from feasibility.timing import trajectory
from robots import Kinematics, load_robot
from surfaces import plane, sphere

FEASIBLE = ("4a", "4b", "4c", "4e", "5a", "5b", "5c", "5d", "5e", "5f")
COARSE = {f"{name}, coarse": name for name in ("4a", "4c", "5c")}
"""Paper cases with few cells, whose trajectories take a tenth of the time."""
BEST = dict.fromkeys((*FEASIBLE, *COARSE), "shortest")
BEST |= {"5c": "spiral", "5c, coarse": "spiral", "5a": "columns"}
"""An order for each case; `test_paths` tries all four for some."""
PATCHES = ("ur5", "panda")
SPEED = 0.15  # [m/s]


@cache
def patch_verdict(name):
    """A plate for the UR5, a piece of a ball for the panda."""
    if name == "ur5":
        patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
    else:
        patch = sphere(0.25, (10, 45), (150, 210), position=(0.65, 0, 0.1), side="outside")
    return check(load_robot(name), patch.cells(3, 4), Task(standoff=0.02, cone_deg=25))


def verdict_of(name):
    """The verdict of a paper case or a patch."""
    if name in COARSE:
        return paper_verdict(COARSE[name], "surface.cells=[4, 4]")
    return patch_verdict(name) if name in PATCHES else paper_verdict(name)


@cache
def path_of(name, order=None):
    """A path of a paper case or a patch."""
    return coverage_path(verdict_of(name), order or BEST.get(name, "rows"))


@cache
def run_of(name):
    """Its trajectory at `SPEED`."""
    return trajectory(path_of(name), SPEED)


def interpolated(run, degree, per_interval):
    """q, dq and ddq, (m, n) each, between samples as a controller goes.

    Quintics go through q, dq and ddq of both ends, cubics through q and dq. Polynomials by solving
    for their coefficients, so that nothing is shared with what made them.
    """
    t = np.linspace(0.0, 1.0, per_interval, endpoint=False)
    powers = np.arange(degree + 1)

    def falling(order):
        """Factors of the derivatives of the powers."""
        return np.prod([powers - k for k in range(order)], axis=0) if order else powers**0

    sides = [run.q, run.dq, run.ddq][: (degree + 1) // 2]
    rows = [
        np.where(where, falling(order), 0)
        for order in range(len(sides))
        for where in (powers == order, powers >= order)  # at 0, at 1
    ]
    h = np.diff(run.time)[:, None]
    ends = np.stack(
        [side[k : len(run) - 1 + k] * h**order for order, side in enumerate(sides) for k in (0, 1)]
    )
    solved = np.linalg.solve(np.vstack(rows).astype(float), ends.reshape(degree + 1, -1))
    coefficients = solved.reshape(ends.shape)
    found = []
    for order, side in enumerate((run.q, run.dq, run.ddq)):
        values = np.where(powers >= order, falling(order), 0) * t[:, None] ** np.maximum(
            powers - order, 0
        )
        dense = np.einsum("tp,pin->itn", values, coefficients) / h[:, None] ** order
        found.append(np.vstack([dense.reshape(-1, run.q.shape[1]), side[-1:]]))
    return found


def assert_keeps_to_limits(verdict, run, limits):
    """Joints, velocities, accelerations and the tool's speed, however samples are interpolated."""
    robot, kinematics = verdict.robot, Kinematics(verdict.robot)
    for degree in (3, 5):
        q, dq, ddq = interpolated(run, degree, per_interval=7)
        assert (q >= robot.lower).all()
        assert (q <= robot.upper).all()
        assert (np.abs(dq) <= limits.velocity * (1 + 1e-9)).all()
        assert (np.abs(ddq[:-1]) <= limits.acceleration * (1 + 1e-9)).all()
        speed = [np.linalg.norm(kinematics.jacobians(a)[0] @ b) for a, b in zip(q, dq, strict=True)]
        assert max(speed) <= limits.tool_speed * (1 + 1e-6)
