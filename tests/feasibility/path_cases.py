"""Paths and trajectories that several tests look at, made once."""

from __future__ import annotations

from functools import cache

import numpy as np
from small_cases import paper_verdict

from feasibility import Task, check
from feasibility.coverage import coverage_path
from feasibility.timing import trajectory
from robots import load_robot
from surfaces import plane, sphere

FEASIBLE = ("4a", "4b", "4c", "4e", "5a", "5b", "5c", "5d", "5e", "5f")
BEST = dict.fromkeys(FEASIBLE, "shortest") | {"5c": "spiral", "5a": "columns"}
"""An order for each case; all four are tried in `test_coverage`."""
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
    return patch_verdict(name) if name in PATCHES else paper_verdict(name)


@cache
def path_of(name, order=None):
    """A path of a paper case or a patch."""
    return coverage_path(verdict_of(name), order or BEST.get(name, "rows"))


@cache
def run_of(name):
    """Its trajectory at `SPEED`."""
    return trajectory(path_of(name), SPEED)


def quintic(run, per_interval):
    """(m, n) between samples as a controller goes: quintic through q, dq and ddq of both ends.

    Polynomials by solving for their coefficients, so that nothing is shared with what made them.
    """
    t = np.linspace(0.0, 1.0, per_interval, endpoint=False)
    powers = np.arange(6)
    rows = []
    for order in range(3):
        factor = np.prod([powers - k for k in range(order)], axis=0) if order else np.ones(6)
        rows.append([np.where(powers >= order, factor, 0) * np.where(powers == order, 1, 0)])
        rows.append([np.where(powers >= order, factor, 0)])
    matrix = np.vstack(rows).astype(float)  # values at 0 and 1, slopes at 0 and 1, bends at 0 and 1
    h = np.diff(run.time)[:, None]
    sides = [run.q, run.dq, run.ddq]
    ends = np.stack(
        [side[k : len(run) - 1 + k] * h**order for order, side in enumerate(sides) for k in (0, 1)]
    )
    coefficients = np.linalg.solve(matrix, ends.reshape(6, -1)).reshape(ends.shape)
    dense = np.einsum("tp,pin->itn", np.vander(t, 6, increasing=True), coefficients)
    return np.vstack([dense.reshape(-1, run.q.shape[1]), run.q[-1:]])
