"""The roll along a walk that follows the curves between cell centres."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable_arrays import Array
from feasibility.certification.curve_matching import CurveMatch
from feasibility.certification.rolls import (
    CLOSE_TO_ZERO,
    ROOT,
    ToolFrames,
    largest_off,
    off_middle,
    products_of_changes,
    roll_vectors,
)
from feasibility.roll import Roll
from feasibility.task import Task
from robots import Robot

LENGTH = 1.01  # [1] cubics of unit directions are no longer than this


class Rolls(NamedTuple):
    """What is known of the roll along a walk."""

    most: float
    """rad, bound on how far it is from the middle of its range; inf where it may be outside."""
    row: int
    """The waypoint where it is furthest off."""
    roll: float
    """rad, the roll there."""
    inside: bool
    """Is it in its range, all along?"""
    open: bool
    """Is it in its range at every waypoint at least?"""

    def refusal(self, task: Task) -> str:
        """Why the walk is refused."""
        low, high = task.roll_deg or (-180.0, 180.0)
        allowed = f"{low:g} to {high:g} deg are allowed"
        if self.open:
            return f"between waypoints the roll is not certified to stay in its range: {allowed}"
        return f"the roll is {np.degrees(self.roll):.4f} deg at waypoint {self.row + 1}, {allowed}"


def rolls_along(
    robot: Robot, roll: Roll, q: Array, axes: Array, frames: ToolFrames, matched: CurveMatch
) -> Rolls:
    """Bound the roll along a walk.

    Args:
        robot: the arm.
        roll: the range.
        q: (m, n) waypoints.
        axes: (m, 3) approach axes there.
        frames: reference axes there.
        matched: the walk compared with its targets.

    Raises:
        ValueError: it was not compared with frames.
    """
    if matched.frames is None:
        raise ValueError("the walk was not matched with frames")
    _, references, by_t, deviations = matched.frames
    b, t = matched.frames.approaches, references
    z = roll_vectors(frames.x, axes, t, b, roll)
    off = off_middle(z)
    row = int(np.argmax(np.nan_to_num(off, nan=np.inf))) if len(off) else 0
    at = float(np.arctan2(z[row, 1], z[row, 0])) + roll.middle if len(off) else 0.0
    inside = bool((off <= roll.half + CLOSE_TO_ZERO).all())
    dx, db, dt = (np.diff(values, axis=0) for values in (frames.x, b, t))
    dy, du = np.diff(np.cross(axes, frames.x), axis=0), np.diff(np.cross(b, t), axis=0)
    second_b, second_t = matched.derivative_bounds[:, 1], by_t[:, 1]
    with np.errstate(invalid="ignore"):  # inf * 0 is NaN, and refused
        slope_b = np.linalg.norm(db, axis=1) + 0.5 * second_b
        second_u = LENGTH * (second_b + second_t) + 2.0 * slope_b * by_t[:, 0]
        second = frames.second_derivatives(robot, np.abs(np.diff(q, axis=0))) + ROOT * (
            second_t + second_u
        )
        second += products_of_changes(dx, dy, dt, du)
        unknown = ROOT * LENGTH * (2.0 * deviations + matched.deviations[:, 1])
    ends = np.repeat(unknown[:, None], 2, axis=1)
    between = largest_off(z[:-1], z[1:], second, ends, roll.half)
    most = float(np.max(between, initial=np.max(off, initial=0.0)))
    return Rolls(most, row, at, inside and bool(most <= roll.half + CLOSE_TO_ZERO), inside)
