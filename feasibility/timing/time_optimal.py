"""The fastest timing of a curve, by toppra, and how well it keeps to accelerations.

Between two places of the grid d^2s/dt^2 = u is constant, so x = (ds/dt)^2 runs straight there, and
d^2q/dt^2 = q'(s) u + q''(s) x is a parabola in s, whose Bernstein coefficients bound it.

H. Pham and Q.-C. Pham, A new approach to time-optimal path parameterization based on reachability
analysis, IEEE Transactions on Robotics 34 (2018).
"""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from feasibility.paths import PathError

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

Array = NDArray[np.float64]


def acceleration_excess(spline: BSpline, grid: Array, x: Array, most: Array) -> Array:
    """(m - 1,) largest share of its limit that a joint's acceleration has on each piece."""
    h = np.diff(grid)
    u = 0.5 * np.diff(x) / h
    slope, bend = spline.derivative(1), spline.derivative(2)
    values = [
        slope(grid[:-1] + part * h) * u[:, None]
        + bend(grid[:-1] + part * h) * (x[:-1] + part * np.diff(x))[:, None]
        for part in (0.0, 0.5, 1.0)
    ]
    # The last place of a piece is evaluated on the piece: second derivatives are continuous.
    inner = 2.0 * values[1] - 0.5 * (values[0] + values[2])
    shares = [(np.abs(value) / most).max(axis=1) for value in (values[0], inner, values[2])]
    return np.asarray(np.max(shares, axis=0))


def parameterised(
    spline: BSpline, grid: Array, unit: float, most: Array, acceleration: Array
) -> Array:
    """(m,) the largest (ds/dt)^2 from rest to rest, s = unit * k, as toppra finds it."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its sources hold escapes that Python frowns at
        from toppra.algorithm import TOPPRA
        from toppra.constraint import JointAccelerationConstraint, LinearConstraint
        from toppra.interpolator import AbstractGeometricPath

    class Path(AbstractGeometricPath):
        """The curve in the form that toppra needs."""

        dof = spline.c.shape[1]
        path_interval = np.array([grid[0], grid[-1]]) * unit

        def __call__(self, s: Any, order: int = 0) -> Array:
            """Derivatives by s."""
            k = np.clip(np.asarray(s) / unit, grid[0], grid[-1])
            return np.asarray(spline.derivative(order)(k)) / unit**order

    class Speed(LinearConstraint):
        """Bounds on (ds/dt)^2."""

        def __init__(self) -> None:
            """No other variables."""
            super().__init__()
            self.identical = True

        def compute_constraint_params(self, path: Any, gridpoints: Array) -> tuple[Any, ...]:
            """Only the bounds on (ds/dt)^2."""
            bounds = np.column_stack([np.zeros(len(gridpoints)), most * unit**2])
            return None, None, None, None, None, None, bounds

    solver = TOPPRA(
        [Speed(), JointAccelerationConstraint(np.column_stack([-acceleration, acceleration]))],
        Path(), gridpoints=grid * unit, solver_wrapper="seidel",
    )  # fmt: skip
    _, rate, _ = solver.compute_parameterization(0.0, 0.0)
    if rate is None or not np.isfinite(rate).all():
        raise PathError("no timing was found that keeps to the velocities and accelerations")
    return np.asarray(rate) ** 2
