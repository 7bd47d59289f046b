"""Quantities: the numbers of a case that are varied one at a time, step by step."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from feasibility.task import Task
from robots import Robot
from surfaces import Cells

ANGLE_STEP_DEG = 0.1  # resolution of cone and revolute joints
LENGTH_STEP = 1e-3  # [m], resolution of standoff, shifts and prismatic joints
LEAST_CONE_DEG = 3.0  # cap on tightening the cone: narrower ones take many times the waypoints
FURTHEST = 0.5  # [m], cap on shifts, on the standoff's growth and on the widening of a slide
TURN_DEG = 360.0  # cap on the widening of a revolute joint: more places the arm in no other way


class Kind(StrEnum):
    """What is varied."""

    CONE = "cone"
    LOWER = "lower_limit"
    UPPER = "upper_limit"
    STANDOFF = "standoff"
    SHIFT = "shift"


class Variant(NamedTuple):
    """A case, as given or with one quantity varied."""

    robot: Robot
    cells: Cells
    task: Task


@dataclass(frozen=True, slots=True)
class Quantity:
    """One number of a case, and the values that it may take: from the one given to a cap."""

    kind: Kind
    name: str
    """Such as 'cone', 'joint1 upper limit', 'shift along +x'."""
    unit: str
    """'rad' or 'm', of all values."""
    given: float
    """The value of the case as given; 0 for a shift."""
    end: float
    """The furthest value that is tried."""
    step: float
    """> 0, distance of neighbouring values; degrees for angles, m for lengths."""
    monotone: bool
    """Is there one threshold at most? True where every value allows all that the ones before it
    allow, or the other way round."""
    joint: int = -1
    """The joint whose limit it is; -1 for other kinds."""
    axis: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Unit vector of a shift, in the root frame."""

    @property
    def last(self) -> int:
        """Number of steps from the value given to the end; the last one may be shorter."""
        length = abs(self.end - self.given)
        length = math.degrees(length) if self.unit == "rad" else length
        return math.ceil(round(length / self.step, 6))

    def value(self, k: int) -> float:
        """The value (rad or m) after k steps, 0 <= k <= last."""
        if k >= self.last:
            return self.end
        sign = 1.0 if self.end >= self.given else -1.0
        if self.unit == "m":
            return round(self.given + sign * k * self.step, 9)
        return math.radians(round(math.degrees(self.given) + sign * k * self.step, 9))

    def applied(self, variant: Variant, k: int) -> Variant:
        """The case with this quantity k steps from the value given."""
        if k == 0:
            return variant
        robot, cells, task = variant
        value = self.value(k)
        if self.kind is Kind.CONE:
            return Variant(robot, cells, replace(task, cone_deg=round(math.degrees(value), 9)))
        if self.kind is Kind.STANDOFF:
            return Variant(robot, cells, replace(task, standoff=value))
        if self.kind is Kind.SHIFT:
            return Variant(robot, shifted(cells, value * np.array(self.axis)), task)
        limits = [float(robot.lower[self.joint]), float(robot.upper[self.joint])]
        limits[self.kind is Kind.UPPER] = value
        return Variant(robot.with_limits({robot.joint_names[self.joint]: limits}), cells, task)


def shifted(cells: Cells, translation: np.ndarray) -> Cells:
    """The same cells on the surface moved by a translation (3,) m of the root frame."""
    surface = cells.surface.moved(np.eye(3), translation)
    moved = replace(cells, surface=surface, centres=cells.centres + translation)
    # What is derived from the cells is moved too: deriving the curves again takes longer than a
    # search along them.
    cubics = cells.curves.cubics.copy()
    cubics[:, 0, :3] += translation  # the constant coefficients of the closest points
    vars(moved)["curves"] = replace(cells.curves, cubics=cubics)
    vars(moved)["neighbours"] = cells.neighbours
    return moved


def quantities(variant: Variant, widen: bool) -> tuple[Quantity, ...]:
    """What can be varied in a case.

    Args:
        variant: the case.
        widen: towards more freedom (for a case that is not feasible), or towards less. Standoff
            and shifts go both ways in any case.

    Returns:
        The cone; each finite limit of each joint; standoff; shifts along six directions. What
        cannot be varied (a cone of 180 degrees that is to be widened) is left out.
    """
    found = [_cone(variant.task, widen)]
    for joint in range(variant.robot.n):
        found += [_limit(variant.robot, joint, kind, widen) for kind in (Kind.LOWER, Kind.UPPER)]
    standoff = variant.task.standoff
    for name, end in (("smaller standoff", 0.0), ("larger standoff", standoff + FURTHEST)):
        found.append(Quantity(Kind.STANDOFF, name, "m", standoff, end, LENGTH_STEP, False))
    for index, letter in enumerate("xyz"):
        for sign in (1.0, -1.0):
            x, y, z = (sign if index == k else 0.0 for k in range(3))
            name = f"shift along {'+' if sign > 0 else '-'}{letter}"
            found.append(
                Quantity(Kind.SHIFT, name, "m", 0.0, FURTHEST, LENGTH_STEP, False, -1, (x, y, z))
            )
    return tuple(q for q in found if math.isfinite(q.given) and q.last > 0)


def _cone(task: Task, widen: bool) -> Quantity:
    """The cone, up to 180 degrees or down to the least one."""
    least = min(task.cone_deg, LEAST_CONE_DEG)
    end = math.radians(180.0 if widen else least)
    return Quantity(Kind.CONE, "cone", "rad", task.cone, end, ANGLE_STEP_DEG, True)


def _limit(robot: Robot, joint: int, kind: Kind, widen: bool) -> Quantity:
    """One limit of one joint, outwards up to the cap, or inwards as far as the other limit."""
    slides = bool(robot.prismatic[joint])
    lower, upper = float(robot.lower[joint]), float(robot.upper[joint])
    given, opposite = (lower, upper) if kind is Kind.LOWER else (upper, lower)
    most = FURTHEST if slides else math.radians(TURN_DEG)
    if not math.isfinite(opposite):  # tightened by no more than it would be widened
        opposite = given + (most if kind is Kind.LOWER else -most)
    outwards = given + (most if kind is Kind.UPPER else -most)
    return Quantity(
        kind=kind,
        name=f"{robot.joint_names[joint]} {'lower' if kind is Kind.LOWER else 'upper'} limit",
        unit="m" if slides else "rad",
        given=given,
        end=outwards if widen else opposite,
        step=LENGTH_STEP if slides else ANGLE_STEP_DEG,
        monotone=True,
        joint=joint,
    )
