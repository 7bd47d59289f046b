"""Quantities of a case that are varied one at a time."""

import math
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from coverable.arrays import unit_along
from feasibility.cases.toml import toml_key
from feasibility.collisions.settings import Collision
from feasibility.task import Task
from robots.robot import Robot
from surfaces.cells import Cells

ANGLE_STEP_DEG = 0.1  # resolution of cone and revolute joints
LENGTH_STEP = 1e-3  # [m], resolution of standoff, shifts and prismatic joints
MOST_TILT_DEG = 60.0  # cap on tilting an approach direction
LEAST_CONE_DEG = 3.0  # cap on tightening the cone: narrower ones take many times the waypoints
LEAST_ROLL_DEG = 1.0  # cap on tightening half the range of the roll, likewise
FURTHEST = 0.5  # [m], cap on shifts, on the standoff's growth and on the widening of a slide
MOST_CLEARANCE = 0.1  # [m], cap on clearances of a feasible case
MOST_OBJECTS = 12  # objects of the scene that are left out, one at a time
TURN_DEG = 360.0  # cap on the widening of a revolute joint: more places the arm in no other way


class Kind(StrEnum):
    """What is varied."""

    CONE = "cone"
    ROLL = "roll"
    """Half the range of the roll, about its middle."""
    TILT = "tilt"
    """The angle of an approach direction that is given, from that."""
    LOWER = "lower_limit"
    UPPER = "upper_limit"
    STANDOFF = "standoff"
    SHIFT = "shift"
    CLEARANCE = "clearance"
    TOOL_CLEARANCE = "tool_clearance"
    WITHOUT = "without"
    """One object of the scene, or collisions altogether, as if not there."""


BOTH_WAYS = (Kind.TILT, Kind.STANDOFF, Kind.SHIFT)  # neither way allows more
OF_COLLISIONS = (Kind.CLEARANCE, Kind.TOOL_CLEARANCE, Kind.WITHOUT)


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
    """Such as 'cone', 'joint1 upper limit', 'shift along +x', 'without shelf'."""
    unit: str
    """'rad' or 'm', of all values; empty for what is there (0) or not (1)."""
    given: float
    """The value of the case as given; 0 for a shift."""
    end: float
    """The furthest value that is tried."""
    key: str = ""
    """The key of the case file that holds it: 'task.cone_deg', 'robot.limits_deg.joint1'."""
    which: str = ""
    """Which of the key's numbers it is, such as 'upper' or '-y'; empty where there is one."""
    joint: int = -1
    """The joint whose limit it is; -1 for other kinds."""
    axis: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Unit vector of a shift, in the root frame; or towards which the approach tilts, square to it,
    in the surface's."""
    obstacle: str = ""
    """What is left out: the name of an object, or nothing for all collisions."""

    @property
    def monotone(self) -> bool:
        """Is there one threshold at most?

        True where every value allows all that the ones before it allow, or the other way round.
        """
        return self.kind not in BOTH_WAYS

    @property
    def step(self) -> float:
        """Distance of neighbouring values; degrees for angles, m for lengths."""
        return {"rad": ANGLE_STEP_DEG, "m": LENGTH_STEP}.get(self.unit, 1.0)

    @property
    def label(self) -> str:
        """The key, and which of its numbers: 'robot.limits_deg.joint1 (upper)', '... (-y)'."""
        if self.kind is Kind.WITHOUT:
            return f"{self.key} {self.name}" if self.obstacle else self.name
        return f"{self.key} ({self.which})" if self.which else self.key

    @property
    def last(self) -> int:
        """Number of steps from the value given to the end; the last one may be shorter."""
        return math.ceil(round(self.steps(self.end), 6))

    def steps(self, value: float) -> float:
        """How many steps a value (rad or m) is away from the one given, towards the end."""
        length = value - self.given if self.end >= self.given else self.given - value
        return (math.degrees(length) if self.unit == "rad" else length) / self.step

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
        if self.kind is Kind.ROLL:
            return Variant(robot, cells, replace(task, roll_deg=range_of(task, value)))
        if self.kind is Kind.TILT:
            return Variant(robot, cells, replace(task, approach=tilted(task, self.axis, value)))
        if self.kind is Kind.STANDOFF:
            return Variant(robot, cells, replace(task, standoff=value))
        if self.kind is Kind.SHIFT:
            return Variant(robot, shifted(cells, value * np.array(self.axis)), task)
        if self.kind in OF_COLLISIONS:
            return Variant(robot, cells, replace(task, collision=self._avoided(task, value)))
        limits = [float(robot.lower[self.joint]), float(robot.upper[self.joint])]
        limits[self.kind is Kind.UPPER] = value
        return Variant(robot.with_limits({robot.joint_names[self.joint]: limits}), cells, task)

    def _avoided(self, task: Task, value: float) -> Collision | None:
        """What the arm stays clear of with this quantity at a value."""
        settings = task.collision
        if settings is None or (self.kind is Kind.WITHOUT and not self.obstacle):
            return None
        if self.kind is Kind.CLEARANCE:
            return replace(settings, clearance=value)
        if self.kind is Kind.TOOL_CLEARANCE:
            return replace(settings, tool_clearance=value)
        return replace(
            settings,
            scene=tuple(one for one in settings.scene if one.name != self.obstacle),
            allow=tuple(pair for pair in settings.allow if self.obstacle not in pair),
            clearances=tuple(c for c in settings.clearances if self.obstacle not in c[:2]),
        )


def range_of(task: Task, half: float) -> tuple[float, float]:
    """Degrees: the range of a task's roll, limited, with another half width (rad)."""
    low, high = task.roll_deg or (0.0, 0.0)
    middle, half = 0.5 * (low + high), round(math.degrees(half), 9)
    middle -= 360.0 * round(middle / 360.0)
    return round(middle - half, 9), round(middle + half, 9)


def tilted(
    task: Task, towards: tuple[float, float, float], angle: float
) -> tuple[float, float, float]:
    """A task's approach direction, a given one, tilted by an angle (rad) towards a unit vector."""
    if task.approach is None or isinstance(task.approach, str):
        raise ValueError("the approach direction is the surface's")
    x, y, z = math.cos(angle) * unit_along(task.approach) + math.sin(angle) * np.array(towards)
    return float(x), float(y), float(z)


def shifted(cells: Cells, translation: np.ndarray) -> Cells:
    """The same cells on the surface moved by a translation (3,) m of the root frame."""
    surface = cells.surface.moved(np.eye(3), translation)
    moved = replace(cells, surface=surface, centres=cells.centres + translation)
    # Deriving the curves again takes longer than a search along them.
    vars(moved)["curves"] = cells.curves.moved(np.eye(3), translation)
    vars(moved)["neighbours"] = cells.neighbours
    return moved


def quantities(variant: Variant, widen: bool) -> tuple[Quantity, ...]:
    """What can be varied in a case, in the order in which it is tried.

    It is widened, towards more freedom (for a case that is not feasible), or goes towards less;
    standoff and shifts go both ways in any case. What cannot be varied (a cone of 180 degrees that
    is to be widened) is left out.
    """
    task = variant.task
    widest = 180.0 if task.roll is None else 90.0
    end = math.radians(widest if widen else min(task.cone_deg, LEAST_CONE_DEG))
    found = [Quantity(Kind.CONE, "cone", "rad", task.cone, end, "task.cone_deg")]
    found += _of_directions(task, widen)
    limits = [
        _limit(variant.robot, joint, kind, widen)
        for joint in range(variant.robot.n)
        for kind in (Kind.LOWER, Kind.UPPER)
    ]
    of_collisions = _of_collisions(task, widen)
    found += of_collisions or limits
    for which, end in (("smaller", 0.0), ("larger", task.standoff + FURTHEST)):
        ends, name = (task.standoff, end), f"{which} standoff"
        found.append(Quantity(Kind.STANDOFF, name, "m", *ends, "task.standoff", which))
    for index, letter in enumerate("xyz"):
        for sign in (1.0, -1.0):
            x, y, z = (sign if index == k else 0.0 for k in range(3))
            which = f"{'+' if sign > 0 else '-'}{letter}"
            words = "surface.position", which
            ends, name = (0.0, FURTHEST), f"shift along {which}"
            found.append(Quantity(Kind.SHIFT, name, "m", *ends, *words, axis=(x, y, z)))
    if of_collisions:  # limits come last where the time may run out: places matter more there
        found += limits
    return tuple(q for q in found if math.isfinite(q.given) and q.last > 0)


def _of_directions(task: Task, widen: bool) -> list[Quantity]:
    """Half the range of the roll, and the tilt of a given approach to four sides."""
    found = []
    if task.roll is not None:
        least = min(task.roll.half, math.radians(LEAST_ROLL_DEG))
        end = math.pi if widen else least
        ends, words = (task.roll.half, end), ("task.roll_deg", "half its range")
        found.append(Quantity(Kind.ROLL, "roll", "rad", *ends, *words))
    if task.approach is None or isinstance(task.approach, str):
        return found
    b = unit_along(task.approach)
    across = np.eye(3)[np.argsort(np.abs(b))[:2]]
    for axis in across:
        for sign in (1.0, -1.0):
            square = sign * (axis - (axis @ b) * b)
            x, y, z = (square / np.linalg.norm(square)).tolist()
            letter = "xyz"[int(np.argmax(axis))]
            which = f"tilted to {'+' if sign > 0 else '-'}{letter}"
            ends, words = (0.0, math.radians(MOST_TILT_DEG)), ("task.approach", which)
            name = f"approach {which}"
            found.append(Quantity(Kind.TILT, name, "rad", *ends, *words, axis=(x, y, z)))
    return found


def _of_collisions(task: Task, widen: bool) -> list[Quantity]:
    """Clearances; and, of a case that is not feasible, collisions at all and one object at a time.

    The tool may not come nearer to the surface than its point does, so the standoff is the largest
    clearance of the tool that is tried.
    """
    settings = task.collision
    if settings is None or not settings.checked:
        return []
    given = settings.clearance
    end = 0.0 if widen else max(given, MOST_CLEARANCE)
    found = [Quantity(Kind.CLEARANCE, "clearance", "m", given, end, "collision.clearance")]
    if settings.surface and task.standoff > 0.0:
        given = settings.tool_clearance
        end = 0.0 if widen else max(given, task.standoff)
        key = "collision.tool_clearance"
        found.append(Quantity(Kind.TOOL_CLEARANCE, "tool clearance", "m", given, end, key))
    if widen:
        every = Quantity(Kind.WITHOUT, "without collisions", "", 0.0, 1.0, "collision")
        found.append(every)
        found += [
            replace(every, name=f"without {one.name}", obstacle=one.name, key="collision.scene")
            for one in settings.scene[:MOST_OBJECTS]
        ]
    return found


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
    model, at, turn = robot.model, robot.model.idx_qs[joint + 1], math.radians(TURN_DEG)
    if not slides and model.nqs[joint + 1] == 1:  # no further than a turn beyond the URDF's limit
        if outwards > given:
            outwards = max(min(outwards, float(model.upperPositionLimit[at]) + turn), given)
        else:
            outwards = min(max(outwards, float(model.lowerPositionLimit[at]) - turn), given)
    step = LENGTH_STEP if slides else math.radians(ANGLE_STEP_DEG)
    inwards = max(opposite - step, given), min(opposite + step, given)
    name, which = robot.joint_names[joint], "lower" if kind is Kind.LOWER else "upper"
    end = outwards if widen else inwards[kind is Kind.UPPER]
    unit, key = ("m", "limits_m") if slides else ("rad", "limits_deg")
    key = f"robot.{key}.{toml_key(name)}"
    return Quantity(kind, f"{name} {which} limit", unit, given, end, key, which, joint)
