"""Quantities of a case that are varied one at a time, and thresholds along them.

A threshold lies between two values of one quantity at which the verdicts differ; each side is given
with its evidence.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.read_only import ReadOnlyArrays
from feasibility.task import Task
from feasibility.verdict import Answer, Evidence, Verdict, Walk
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
    task = variant.task
    end = math.radians(180.0 if widen else min(task.cone_deg, LEAST_CONE_DEG))
    found = [Quantity(Kind.CONE, "cone", "rad", task.cone, end, ANGLE_STEP_DEG, True)]
    for joint in range(variant.robot.n):
        found += [_limit(variant.robot, joint, kind, widen) for kind in (Kind.LOWER, Kind.UPPER)]
    for name, end in (("smaller standoff", 0.0), ("larger standoff", task.standoff + FURTHEST)):
        found.append(Quantity(Kind.STANDOFF, name, "m", task.standoff, end, LENGTH_STEP, False))
    for index, letter in enumerate("xyz"):
        for sign in (1.0, -1.0):
            x, y, z = (sign if index == k else 0.0 for k in range(3))
            name = f"shift along {'+' if sign > 0 else '-'}{letter}"
            found.append(
                Quantity(Kind.SHIFT, name, "m", 0.0, FURTHEST, LENGTH_STEP, False, -1, (x, y, z))
            )
    return tuple(q for q in found if math.isfinite(q.given) and q.last > 0)


def _limit(robot: Robot, joint: int, kind: Kind, widen: bool) -> Quantity:
    """One limit of one joint, outwards up to the cap, or inwards to a step from the other limit.

    Limits without any width are no limits that a case may have.
    """
    slides = bool(robot.prismatic[joint])
    lower, upper = float(robot.lower[joint]), float(robot.upper[joint])
    given, opposite = (lower, upper) if kind is Kind.LOWER else (upper, lower)
    most = FURTHEST if slides else math.radians(TURN_DEG)
    if not math.isfinite(opposite):  # tightened by no more than it would be widened
        opposite = given + (most if kind is Kind.LOWER else -most)
    outwards = given + (most if kind is Kind.UPPER else -most)
    step = LENGTH_STEP if slides else math.radians(ANGLE_STEP_DEG)
    inwards = max(opposite - step, given), min(opposite + step, given)
    return Quantity(
        kind=kind,
        name=f"{robot.joint_names[joint]} {'lower' if kind is Kind.LOWER else 'upper'} limit",
        unit="m" if slides else "rad",
        given=given,
        end=outwards if widen else inwards[kind is Kind.UPPER],
        step=LENGTH_STEP if slides else ANGLE_STEP_DEG,
        monotone=True,
        joint=joint,
    )


@dataclass(frozen=True, slots=True)
class Finding:
    """The verdict at one value of a quantity."""

    value: float
    """rad or m."""
    answer: Answer
    evidence: Evidence
    """What the answer rests on; an undecided one with `BUDGET` means that nothing was found with
    the effort allowed."""
    detail: str
    """What was found, proved or tried, in one sentence."""
    cell: int | None = None
    """The cell that a proof is about; None without a proof."""
    witness: Walk | None = None
    """The covering motion; None unless feasible."""
    unaided: bool | None = None
    """Does the search of `check`, with the seed given and no motion known, find a covering motion
    too? None where that was not tried. With `witness` as its `seeds`, `check` finds it."""

    @property
    def feasible(self) -> bool:
        """True when a covering motion is known that the replay accepted."""
        return self.answer is Answer.FEASIBLE


@dataclass(frozen=True, slots=True)
class Span:
    """Where a range of feasible values that begins at a threshold ends."""

    feasible: Finding
    """The last value found to be feasible."""
    other: Finding | None
    """The value nearest to it at which the case is not; None where the range goes on to the cap."""


@dataclass(frozen=True, slots=True)
class Threshold:
    """Where the verdict changes along one quantity, with the verdict on both sides.

    The quantity goes from the value given towards `quantity.end`. Where the case as given is not
    feasible, that is towards more freedom, and `feasible` is the first value found to be
    feasible; None when no value helps. Where it is feasible, that is towards less freedom, and
    `feasible` is the last value found to be feasible; `other` is None when all of them are.
    """

    quantity: Quantity
    feasible: Finding | None
    """The value nearest to the threshold at which the case is feasible."""
    other: Finding | None
    """The value nearest to the threshold at which it is not: proved, exhausted, or not found.
    Without a feasible value: what is known at the far end."""
    span: Span | None = None
    """The far end of the feasible range, for the standoff of a case that is not feasible."""
    tried: str = ""
    """What was tried, where no value helps or not every value was tried."""
    each_proved: bool = False
    """Of a quantity that is not monotone: is each value on its way to the end proved infeasible?
    Values between those that were tried remain open."""

    @property
    def resolution(self) -> float | None:
        """Distance (rad or m) of the two values; None where there is one side only."""
        if self.feasible is None or self.other is None:
            return None
        return abs(self.feasible.value - self.other.value)

    @property
    def steps_apart(self) -> int:
        """How many of the quantity's steps lie between the two sides; 0 with one side only."""
        apart = self.resolution or 0.0
        return round(
            (math.degrees(apart) if self.quantity.unit == "rad" else apart) / self.quantity.step
        )

    @property
    def margin(self) -> float:
        """How far (rad or m, >= 0) the feasible value is from the one given; -1 without one."""
        return -1.0 if self.feasible is None else abs(self.feasible.value - self.quantity.given)

    @property
    def ruled_out(self) -> bool:
        """Is it proved that no value up to the end helps?"""
        end = self.other is not None and self.other.value == self.quantity.end
        proved = self.other is not None and self.other.evidence is Evidence.PROOF
        return self.feasible is None and self.quantity.monotone and end and proved


@dataclass(frozen=True, slots=True)
class Change:
    """One quantity, and a value of it other than the one given."""

    quantity: Quantity
    value: float
    """rad or m."""


@dataclass(frozen=True, eq=False, slots=True)
class Pair:
    """Two changes that make a case feasible together, where none of them does alone."""

    changes: tuple[Change, ...]
    witness: Walk
    """The covering motion, which the replay accepted."""


@dataclass(frozen=True, eq=False, slots=True)
class Dropped(ReadOnlyArrays):
    """The cells without which one motion covers the rest."""

    cells: NDArray[np.int64]
    """(k,) flat indices."""
    area: float
    """m^2."""
    share: float
    """Of the whole area, 0..1."""
    waypoints: int | None
    """Of the motion that covers all others, which the replay accepted; None where there is none."""
    witness: Walk | None = None
    """That motion."""


@dataclass(frozen=True, eq=False, slots=True)
class Explanation:
    """The thresholds of a case; see `explain`."""

    verdict: Verdict
    thresholds: tuple[Threshold, ...]
    """One for each quantity that was tried, in the order of `quantities`."""
    left_out: tuple[str, ...]
    """Names of the quantities for which no time was left."""
    dropped: Dropped | None
    """None for a feasible case."""
    evaluations: int
    """Evaluations of the arm that the thresholds took, a box of a proof counting as one."""
    seconds: float
    """Time that they took."""
    pair: Pair | None = None
    """Two changes together, where no single one helps; None where none was found either."""
    alone: Verdict | None = None
    """What `check` says with the seed given and no motion known, where `verdict` owes its motion to
    the witness of a threshold; None where `verdict` is that."""
