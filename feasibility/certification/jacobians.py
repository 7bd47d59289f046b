"""Tool points, tool axes and their Jacobians at many configurations, from Pinocchio's twists.

Column j of the tool point's Jacobian, z_j x (p - o_j), is as long as the lever arm r_j; that of the
axis, z_j x a, has the length s_j, a sine. A joint that slides has z_j in place of the first, and 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from feasibility.certification.rows import Rows
from robots.kinematics import Kinematics
from robots.robot import Robot

BLOCK = 4096  # configurations at once, to bound the memory


@dataclass(frozen=True, eq=False, slots=True)
class Jacobians(Rows):
    """Of m configurations."""

    points: Array
    """(m, 3) m, tool points."""
    axes: Array
    """(m, 3) approach axes."""
    point: Array
    """(m, 3, n) derivatives of the tool point."""
    axis: Array
    """(m, 3, n) derivatives of the approach axis."""

    @property
    def levers(self) -> Array:
        """(m, n) m, r_j; 1 for a joint that slides."""
        return lengths(self.point)

    @property
    def sines(self) -> Array:
        """(m, n) s_j; 0 for a joint that slides."""
        return lengths(self.axis)


def jacobians(kinematics: Kinematics, q: Array) -> Jacobians:
    """Of configurations q (m, n), rad or m."""
    points, axes, twists = kinematics.tools_and_twists(q)
    moving = np.ascontiguousarray(twists.transpose(1, 0, 2)).transpose(1, 0, 2)  # by coordinate
    linear, angular = moving[:, :3], moving[:, 3:]
    return Jacobians(points, axes, linear + cross(angular, points), cross(angular, axes))


def cross(a: Array, b: Array) -> Array:
    """(m, 3, n) products of n vectors (m, 3, n) with one (m, 3); `np.cross` is slower."""
    x, y, z = b.T[:, :, None]
    u, v, w = a[:, 0], a[:, 1], a[:, 2]
    return np.stack([v * z - w * y, w * x - u * z, u * y - v * x]).transpose(1, 0, 2)


def lengths(a: Array) -> Array:
    """(m, n) lengths of vectors (m, 3, n); numpy's own sums are slow over three numbers."""
    x, y, z = a[:, 0], a[:, 1], a[:, 2]
    return np.sqrt(x * x + y * y + z * z)


class ToolPlacements(NamedTuple):
    """Tool points and axes of m configurations, and the lengths of their derivatives."""

    points: Array
    """(m, 3) tool points, m."""
    axes: Array
    """(m, 3) approach axes."""
    levers: Array
    """(m, n) distance of the tool point from each revolute axis, m; 1 for a prismatic joint."""
    sines: Array
    """(m, n) sine of the angle between each revolute axis and the approach axis; 0 if prismatic."""


def placements(robot: Robot, q: Array) -> ToolPlacements:
    """Tool points, axes and lever arms at q (m, n)."""
    kinematics, parts = Kinematics(robot), []
    for first in range(0, max(len(q), 1), BLOCK):
        at = jacobians(kinematics, q[first : first + BLOCK])
        parts.append((at.points, at.axes, at.levers, at.sines))
    return ToolPlacements(*(np.concatenate(part) for part in zip(*parts, strict=True)))
