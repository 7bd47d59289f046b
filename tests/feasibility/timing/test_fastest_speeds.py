"""The fastest speeds along a curve, against linear programs and against toppra."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from scipy.optimize import linprog

from feasibility.timing.fastest_speeds import Rows, fastest_speeds
from feasibility.timing.smoothing import control_points
from feasibility.timing.speed_limits import fine_grid, motion_limits, squared_speeds
from feasibility.timing.timed_curve import speed_bounds, timed_curve
from feasibility.verdict import Walk
from robots import load_robot


@pytest.mark.parametrize("seed", range(20))
def test_speeds_are_those_of_one_linear_program(seed):
    """Where accelerations count for more than bends, the fastest profile has the largest x at every
    place at once, so the largest sum too.
    """
    rng, m, r = np.random.default_rng(seed), 12, 5
    most = rng.uniform(0.5, 4.0, m)
    d = rng.normal(size=(m - 1, r))
    c = -d * rng.uniform(0.2, 3.0, (m - 1, r))
    d[rng.random((m - 1, r)) < 0.2] = 0.0
    x = fastest_speeds(most, Rows.of(c, d))
    rows = np.zeros((m - 1, r, m))
    at = np.arange(m - 1)
    rows[at, :, at], rows[at, :, at + 1] = c, d
    rows = rows.reshape(-1, m)
    most[[0, -1]] = 0.0
    best = linprog(
        -np.ones(m), np.vstack([rows, -rows]), np.ones(2 * len(rows)), bounds=[(0, b) for b in most]
    )
    assert (np.abs(rows @ x) <= 1.0 + 1e-9).all()
    assert (x >= 0.0).all()
    assert (x <= most).all()
    assert x == pytest.approx(best.x, abs=1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_a_motion_takes_as_long_as_toppra_says(seed):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its sources hold escapes that Python frowns at
        from toppra.algorithm import TOPPRA
        from toppra.constraint import JointAccelerationConstraint, LinearConstraint
        from toppra.interpolator import AbstractGeometricPath
    rng, robot = np.random.default_rng(seed), load_robot("ur5")
    walk = Walk(rng.uniform(-1.0, 1.0, (6, 6)), np.array([0, -1, -1, -1, -1, 1]))
    curve, limits = control_points(walk, np.full(6, 0.3)), motion_limits(robot, 0.3)
    spline = curve.spline()
    grid = fine_grid(robot, spline, curve.pieces)
    most = squared_speeds(robot, spline, grid, limits)

    class Path(AbstractGeometricPath):
        dof, path_interval = 6, grid[[0, -1]]

        def __call__(self, k, order=0):
            return spline.derivative(order)(np.clip(k, *grid[[0, -1]]))

    class Speed(LinearConstraint):
        identical = True

        def compute_constraint_params(self, path, gridpoints):
            return None, None, None, None, None, None, np.column_stack([0.0 * most, most])

    allowed = np.column_stack([-limits.acceleration, limits.acceleration])
    solver = TOPPRA(
        [Speed(), JointAccelerationConstraint(allowed)], Path(), gridpoints=grid,
        solver_wrapper="seidel",
    )  # fmt: skip
    _, rate, _ = solver.compute_parameterization(0.0, 0.0)
    duration = (2.0 * np.diff(grid) / (rate[:-1] + rate[1:])).sum()
    found = timed_curve(speed_bounds(robot, curve, limits)).duration
    # toppra asks for less, as accelerations inside pieces are free, and rounds at 1e-6 or so.
    assert 1.0 - 1e-4 <= found / duration <= 1.005
