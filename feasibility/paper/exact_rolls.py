"""The roll of the tool over any surface, from Pinocchio and the surface itself; see `roll.py`."""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array
from feasibility.roll import projected, roll_of
from feasibility.targets.references import u_directions
from feasibility.task import Task
from robots.kinematics import Kinematics, reference_axes
from surfaces.cells import Cells


def approaches_at(cells: Cells, task: Task, points: Array) -> Array:
    """(k, 3) approach directions b under tool points (k, 3) m: eq. (3)."""
    fixed = task.fixed_approach(cells)
    if fixed is not None:
        return np.broadcast_to(fixed, points.shape)
    return -cells.surface.side_sign * cells.surface.closest(points).normal


def rolls_at(kinematics: Kinematics, cells: Cells, task: Task, q: Array) -> Array:
    """(k,) rad, the angles about b from the reference direction on the surface to the TCP's.

    NaN where the surface has no reference direction.

    Args:
        kinematics: of the arm.
        cells: its surface counts.
        task: whose approach and reference count.
        q: (k, n) configurations, rad or m.
    """
    points, axes = kinematics.tools(q)
    reference = task.fixed_reference(cells)
    if reference is None:
        reference = u_directions(cells.surface, points)
    if reference is None:
        return np.full(len(q), np.nan)
    b = approaches_at(cells, task, points)
    x = reference_axes(kinematics.robot, q)
    return roll_of(x, axes, projected(reference, b)[0], b)
