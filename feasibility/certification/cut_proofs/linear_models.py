"""Linear models of the constraints over boxes, with proved remainders: what cut trees are held to.

A box has intervals of the n joints and of two parameters x of a part of the surface. With c its
centre and y - c = d, the *residual* is what the constraints keep short:

    p(q) - T(x)     within the tolerance, R_p       p: tool point, T: target point
    m (a(q) - b(x)) within the cone, m R_a          a: tool axis, b: approach, m: a length

By the lemma of `feasibility.certification.lever_bounds`, p(c + d) - p(c) - J d is at most D / 2
long, and a likewise.

Where the roll is limited, each end of its range adds a coordinate (`rolls.box_models`).

On a part of the surface T and b differ from an affine model of x by at most r_T and r_b. So
|residual(c) + C d| <= tolerance + D/2 + r_T, where C has the columns J_j and those of the model.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Rows
from feasibility.certification.lever_bounds import (
    Jacobians,
    jacobians,
    longest_levers,
    second_derivative_bound,
)
from feasibility.certification.roll_box_models import (
    Directions,
    ToolModel,
    reference_parts,
    roll_models,
)
from feasibility.roll import Roll
from feasibility.task import Targets, Task
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.parts import SurfaceParts

TYPICAL = 0.2  # of the longest lever: what a difference of axes is weighed by; found by trying
ANY_AXIS = 4.0  # a chord that two unit vectors never have
GUARD = 1e-9  # [m], [1] added to every radius; rounding of double arithmetic is about 1e-15


@dataclass(frozen=True, eq=False, slots=True)
class Parts(SurfaceParts, Rows):
    """Parts of the surface that the tool point is to be on: T (m) for points, and b for normals."""

    references: Directions
    """Reference directions over the same parts; those of no use where the roll is free."""


def target_parts(parts: SurfaceParts, cells: Cells, task: Task) -> Parts:
    """T = f + side d n and b = -side n on every part, from its points f and normals n.

    The approach may be one direction instead, and the reference direction one, too.
    """
    side_sign, fixed = cells.surface.side_sign, task.fixed_approach(cells)
    shift = side_sign * task.standoff

    def moved(values: Array) -> Array:
        points, normals = values[..., :3], values[..., 3:]
        return np.concatenate([points + shift * normals, -side_sign * normals], axis=-1)

    centre, slopes = moved(parts.centre), moved(parts.slopes)
    radius = np.column_stack([parts.radius @ [1.0, task.standoff], parts.radius[:, 1]])
    if fixed is not None:
        centre[:, 3:], slopes[..., 3:], radius[:, 1] = fixed, 0.0, 0.0
    reference = None if task.roll is None else task.fixed_reference(cells)
    e = Directions.fixed(np.zeros(3) if reference is None else reference, len(parts))
    held = reference_parts(Directions(centre[:, 3:], slopes[..., 3:], radius[:, 1]), e)
    return Parts(centre, slopes, radius, parts.children, parts.axis, held)


def cell_parts(targets: Targets) -> Parts:
    """A part that is a point for each cell's target."""
    points, approaches, references = targets
    count = len(points)
    known = np.zeros_like(points) if references is None else references
    return Parts(
        np.concatenate([points, approaches], axis=1),
        np.zeros((count, 2, 6)),
        np.zeros((count, 2)),
        np.full((count, 2), -1),
        np.full(count, -1),
        Directions(known, np.zeros((count, 2, 3)), np.zeros(count)),
    )


class Allowed(NamedTuple):
    """How far the tool may be from where it has to be."""

    position: float
    """m, the tolerance."""
    axis: float
    """|a - b| at the boundary of the cone; more than 2 where any axis will do."""
    length: float
    """m, which differences of axes are multiplied by: a typical lever."""
    roll: Roll | None = None
    """The range of the roll, at most 180 deg; None where the roll is not looked at."""

    @staticmethod
    def by(task: Task, robot: Robot, low: Array, high: Array) -> Allowed:
        """What a task allows an arm with joints inside low .. high (n,), both finite."""
        length = max(TYPICAL * float(longest_levers(robot, low, high).max()), 1e-3)
        # A wider range leaves out too little for boxes to show it; so does what is proved without.
        roll = task.roll if task.roll is not None and task.roll.half <= 0.5 * np.pi else None
        return Allowed(task.effective_tolerance, min(task.cone_chord, ANY_AXIS), length, roll)


@dataclass(frozen=True, eq=False, slots=True)
class Boxes(Rows):
    """m boxes of joints and surface parameters."""

    low: Array
    """(m, n + 2) rad or m, and x in -1 .. 1 of the part."""
    high: Array
    """(m, n + 2)"""
    part: Ints
    """(m,) index of the part."""
    claim: Ints
    """(m,) number of what is to be proved about it."""

    def __len__(self) -> int:
        """Number of boxes."""
        return len(self.low)

    @property
    def centre(self) -> Array:
        """(m, n + 2) their centres."""
        return 0.5 * (self.low + self.high)


@dataclass(frozen=True, eq=False, slots=True)
class Models(Rows):
    """Linear models of m boxes: |residual + columns . d| <= radius, for d from low to high."""

    residual: Array
    """(m, 6) p - T (m) and length (a - b) (m), at the centre; and one coordinate more for each end
    of the roll's range, likewise times the length."""
    columns: Array
    """(m, n + 2, 6) their derivatives by joints and surface parameters, m."""
    radius: Array
    """(m, 2) bounds on the lengths of the two halves, and of each coordinate more, m."""
    low: Array
    """(m, n + 2) the box, seen from its centre."""
    high: Array
    """(m, n + 2)"""
    reach: Array
    """(m, n + 2) m, by how much each variable can change the residual, about, for cutting boxes."""


def models_of(kinematics: Kinematics, boxes: Boxes, parts: Parts, allowed: Allowed) -> Models:
    """The linear model of every box."""
    robot, length, part = kinematics.robot, allowed.length, boxes.part
    n = robot.n
    centre, half = boxes.centre, 0.5 * (boxes.high - boxes.low)
    at_centre = jacobians(kinematics, centre[:, :n])
    by_joint = np.concatenate([at_centre.point, length * at_centre.axis], axis=1)
    by_joint = np.ascontiguousarray(by_joint.transpose(0, 2, 1))
    tool = np.concatenate([at_centre.points, length * at_centre.axes], axis=1)
    weights = np.array([1.0, 1.0, 1.0, length, length, length])
    slopes = parts.slopes[part] * weights
    target = parts.centre[part] * weights
    target = target + (centre[:, n:, None] * slopes).sum(axis=1)
    h = half[:, :n]
    levers, sines = at_centre.levers, at_centre.sines
    of_point, of_axis = (second_derivative_bound(r, h, robot.prismatic) for r in (levers, sines))
    radius = np.empty((len(boxes), 2))
    radius[:, 0] = allowed.position + parts.radius[boxes.part, 0] + 0.5 * of_point
    radius[:, 1] = allowed.axis + parts.radius[boxes.part, 1] + 0.5 * of_axis
    reach = [(levers + length * sines) * h, np.linalg.norm(slopes, axis=2) * half[:, n:]]
    made = Models(
        residual=tool - target,
        columns=np.concatenate([by_joint, -slopes], axis=1),
        radius=(radius + GUARD) * [1.0, length],
        low=boxes.low - centre,
        high=boxes.high - centre,
        reach=np.concatenate(reach, axis=1),
    )
    if allowed.roll is None:
        return made
    b = Directions(parts.centre[part, 3:], parts.slopes[part][..., 3:], parts.radius[part, 1])
    b, t = (one.at(centre[:, n:]) for one in (b, parts.references.of(part)))
    frame = _frames(kinematics, centre[:, :n], h, at_centre)
    found = roll_models(frame, b, t, half[:, n:], allowed.roll)
    made.reach[:, :n] += length * np.linalg.norm(frame.columns, axis=3).sum(axis=2) * h
    return replace(
        made,
        residual=np.concatenate([made.residual, length * found.residual], axis=1),
        columns=np.concatenate([made.columns, length * found.columns], axis=2),
        radius=np.concatenate([made.radius, length * found.radius], axis=1),
    )


def _frames(kinematics: Kinematics, q: Array, half: Array, at: Jacobians) -> ToolModel:
    """x and y of the tool over boxes of joints of half widths (m, n) about q (m, n)."""
    x, slides = kinematics.held(q)[2], kinematics.robot.prismatic
    both = np.stack([x, np.cross(at.axes, x)], axis=1)
    turned = [np.cross(at.angular, both[:, k, :, None], axis=1) for k in (0, 1)]
    sines = [np.linalg.norm(one, axis=1) for one in turned]
    moves = [np.minimum((one * half).sum(axis=1), 2.0) for one in sines]
    seconds = [second_derivative_bound(one, half, slides) for one in sines]
    columns = np.stack(turned, axis=1).transpose(0, 3, 1, 2)
    return ToolModel(both, columns, np.column_stack(seconds), np.column_stack(moves))
