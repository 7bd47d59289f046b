"""Linear models of the constraints over boxes, with proved remainders: what cut trees are held to.

A box has intervals of the n joints and of two parameters x of a part of the surface. With c its
centre and y - c = d, the *residual* is what the constraints keep short:

    p(q) - T(x)     within the tolerance, R_p       p: tool point, T: target point
    m (a(q) - b(x)) within the cone, m R_a          a: tool axis, b: approach, m: a length

By the lemma of `feasibility.certification.lever_bounds`, p(c + d) - p(c) - J d is at most D / 2
long, and a likewise.

On a part of the surface T and b differ from an affine model of x by at most r_T and r_b. So
|residual(c) + C d| <= tolerance + D/2 + r_T, where C has the columns J_j and those of the model.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.certification.lever_bounds import Array, lever_bounds, longest_levers
from robots import Kinematics, Robot
from surfaces import SurfaceParts

GUARD = 1e-9  # [m], [1] added to every radius; rounding of double arithmetic is about 1e-15


class Parts(NamedTuple):
    """Parts of the surface that the tool point is to be on, with target points and approaches."""

    centre: Array
    """(K, 6) T (m) and b at x = 0."""
    slopes: Array
    """(K, 2, 6) what x_1 and x_2 change T and b by."""
    radius: Array
    """(K, 2) r_T (m) and r_b."""
    children: NDArray[np.int64]
    """(K, 2) the parts that each is cut into; -1, -1 for the finest."""
    axis: NDArray[np.int64]
    """(K,) the parameter that the cut halves; -1 where the children are any two parts."""


def target_parts(parts: SurfaceParts, side_sign: float, standoff: float) -> Parts:
    """T = f + side d n and b = -side n on every part, from its points f and normals n."""
    shift = side_sign * standoff

    def moved(values: Array) -> Array:
        points, normals = values[..., :3], values[..., 3:]
        return np.concatenate([points + shift * normals, -side_sign * normals], axis=-1)

    radius = np.column_stack([parts.radius @ [1.0, standoff], parts.radius[:, 1]])
    return Parts(moved(parts.centre), moved(parts.slopes), radius, parts.children, parts.axis)


def with_cells(parts: Parts, points: Array, approaches: Array) -> Parts:
    """The parts, and after them one that is a point for each cell's target (N, 3)."""
    count = len(points)
    finest = np.full((count, 2), -1)
    return Parts(
        np.concatenate([parts.centre, np.concatenate([points, approaches], axis=1)]),
        np.concatenate([parts.slopes, np.zeros((count, 2, 6))]),
        np.concatenate([parts.radius, np.zeros((count, 2))]),
        np.concatenate([parts.children, finest]),
        np.concatenate([parts.axis, finest[:, 0]]),
    )


class Allowed(NamedTuple):
    """How far the tool may be from where it has to be."""

    position: float
    """m, the tolerance."""
    axis: float
    """|a - b| at the boundary of the cone; more than 2 where any axis will do."""
    length: float
    """m, which differences of axes are multiplied by: a typical lever."""


@dataclass(frozen=True, eq=False, slots=True)
class Boxes:
    """m boxes of joints and surface parameters."""

    low: Array
    """(m, n + 2) rad or m, and x in -1 .. 1 of the part."""
    high: Array
    """(m, n + 2)"""
    part: NDArray[np.int64]
    """(m,) index of the part."""
    claim: NDArray[np.int64]
    """(m,) number of what is to be proved about it."""

    def __len__(self) -> int:
        """Number of boxes."""
        return len(self.low)

    @property
    def centre(self) -> Array:
        """(m, n + 2) their centres."""
        return 0.5 * (self.low + self.high)

    def __getitem__(self, which: NDArray[np.bool_] | NDArray[np.int64] | slice) -> Boxes:
        """Some of the boxes."""
        return Boxes(self.low[which], self.high[which], self.part[which], self.claim[which])

    @staticmethod
    def joined(boxes: list[Boxes]) -> Boxes:
        """All of them in one."""
        return Boxes(
            np.concatenate([some.low for some in boxes]),
            np.concatenate([some.high for some in boxes]),
            np.concatenate([some.part for some in boxes]),
            np.concatenate([some.claim for some in boxes]),
        )


@dataclass(frozen=True, eq=False, slots=True)
class Models:
    """Linear models of m boxes: |residual + columns . d| <= radius, for d from low to high."""

    residual: Array
    """(m, 6) p - T (m) and length (a - b) (m), at the centre."""
    columns: Array
    """(m, n + 2, 6) their derivatives by joints and surface parameters, m."""
    radius: Array
    """(m, 2) bounds on the lengths of the two halves, m."""
    low: Array
    """(m, n + 2) the box, seen from its centre."""
    high: Array
    """(m, n + 2)"""
    reach: Array
    """(m, n + 2) m, by how much each variable can change the residual, at most."""

    def __getitem__(self, which: NDArray[np.bool_] | NDArray[np.int64]) -> Models:
        """Some of the models."""
        return Models(*(getattr(self, name)[which] for name in Models.__slots__))


class Arm:
    """Pinocchio's view of one arm, and the levers that no configuration exceeds."""

    def __init__(self, robot: Robot, low: Array, high: Array) -> None:
        """Work with joints inside low .. high (n,), both finite."""
        self.kinematics = Kinematics(robot)
        self.prismatic = robot.prismatic
        self.n = robot.n
        self.caps = longest_levers(robot, low, high)

    def models(self, boxes: Boxes, parts: Parts, allowed: Allowed) -> Models:
        """The linear model of every box."""
        n, length = self.n, allowed.length
        centre, half = boxes.centre, 0.5 * (boxes.high - boxes.low)
        by_joint, tool = derivatives(self.kinematics, centre[:, :n], length)
        weights = np.array([1.0, 1.0, 1.0, length, length, length])
        slopes = parts.slopes[boxes.part] * weights
        target = parts.centre[boxes.part] * weights
        target = target + (centre[:, n:, None] * slopes).sum(axis=1)
        h = half[:, :n]
        levers = np.linalg.norm(by_joint[..., :3], axis=2)
        sines = np.linalg.norm(by_joint[..., 3:], axis=2) / length
        of_point = lever_bounds(levers, h, self.prismatic, self.caps)
        of_axis = lever_bounds(sines, h, self.prismatic, np.ones(n))
        radius = np.empty((len(boxes), 2))
        radius[:, 0] = allowed.position + parts.radius[boxes.part, 0] + 0.5 * of_point.second
        radius[:, 1] = allowed.axis + parts.radius[boxes.part, 1] + 0.5 * of_axis.second
        radius = (radius + GUARD) * [1.0, length]
        return Models(
            residual=tool - target,
            columns=np.concatenate([by_joint, -slopes], axis=1),
            radius=radius,
            low=boxes.low - centre,
            high=boxes.high - centre,
            reach=np.concatenate(
                [
                    (of_point.largest + length * of_axis.largest) * h,
                    np.linalg.norm(slopes, axis=2) * half[:, n:],
                ],
                axis=1,
            ),
        )


def derivatives(kinematics: Kinematics, q: Array, length: float) -> tuple[Array, Array]:
    """Derivatives (m, n, 6) of tool point and axis by joints (m, n), and the two themselves (m, 6).

    Those of the axis are multiplied by `length` (m).
    """
    twists = kinematics.twists(q).transpose(0, 2, 1)
    points, axes = kinematics.tools(q)
    turning = twists[..., 3:]
    by_joint = np.concatenate(
        [
            twists[..., :3] + _cross(turning, points[:, None]),
            length * _cross(turning, axes[:, None]),
        ],
        axis=2,
    )
    return by_joint, np.concatenate([points, length * axes], axis=1)


def _cross(a: Array, b: Array) -> Array:
    """Cross products of the last axes; `np.cross` takes twice as long."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)
