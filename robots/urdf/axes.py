"""Axes that an arm or a surface is mounted on, as joints before those of a URDF.

Few users have a URDF of their arm on its rail, or of the arm and a turntable. So an axis is given
by itself, and becomes a joint and a link of the tree like any other:

    world -- base axes, in order -- link of the last one -- (base) -- root link of the URDF
          \\- surface axes, in order -- link of the last one, which carries the surface
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from coverable.arrays import Array
from coverable.errors import MISSING, Checks, Fault, shown
from robots.errors import RobotError
from robots.poses import FURTHEST_BASE, matrix_of
from robots.urdf.elements import MAX_LENGTH, MAX_NAME, UrdfError
from robots.urdf.joints import JointInfo

CARRIES = ("base", "surface")
KINDS = ("revolute", "prismatic")
MOST_AXES = 20
WORLD = "world"

Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis that carries the arm's base or the surface.

    Raises:
        RobotError: with everything that is wrong with it.

    Example:
        >>> Axis("rail", "prismatic", (1, 0, 0), limits=(0.0, 4.0)).carries
        'base'
        >>> Axis("table", "revolute", limits_deg=(-180, 180), carries="surface").limits
        (-3.141592653589793, 3.141592653589793)
    """

    name: str
    """Of the joint, and of the link that it moves."""
    kind: Literal["revolute", "prismatic"]
    axis: Triple = (0.0, 0.0, 1.0)
    """In its own frame, of any length."""
    limits: tuple[float, float] | None = None
    """rad or m; None for a table that turns without end."""
    position: Triple = (0.0, 0.0, 0.0)
    """m, origin of its frame: in the world, or on the axis before it."""
    rpy_deg: Triple = (0.0, 0.0, 0.0)
    """How its frame is turned: fixed-axis roll, pitch and yaw."""
    carries: Literal["base", "surface"] = "base"
    max_velocity: float | None = None
    """rad/s or m/s; None where it is not known."""
    limits_deg: tuple[float, float] | None = None
    """In place of `limits`, for an axis that turns; kept as `limits`."""

    def __post_init__(self) -> None:
        """Refuse what is no axis, and keep plain numbers."""
        checks = Checks(f"axis {shown(self.name)}", RobotError)
        named = isinstance(self.name, str) and 0 < len(self.name.strip()) <= MAX_NAME
        if not named or not self.name.isprintable():
            checks.wrong("name", self.name, "must be a word that joint and link are called by")
        checks.choice("carries", self.carries, CARRIES)
        kind = checks.choice("type", self.kind, KINDS)
        limits = self._limits(checks, kind)
        matrix_of(checks, self.position, self.rpy_deg, FURTHEST_BASE)
        x, y, z = checks.direction("axis", self.axis)
        length = math.hypot(x, y, z)
        if self.max_velocity is not None:
            unit = "m/s" if kind == "prismatic" else "rad/s"
            checks.positive("max_velocity", self.max_velocity, unit)
        checks.done()
        kept: dict[str, Any] = {"limits": limits, "limits_deg": None}
        kept["axis"] = (x / length, y / length, z / length)
        for key in ("position", "rpy_deg"):
            kept[key] = tuple(map(float, getattr(self, key)))
        for key, value in kept.items():
            object.__setattr__(self, key, value)

    def _limits(self, checks: Checks, kind: str) -> tuple[float, float] | None:
        """rad or m; None for an axis that turns without end."""
        slides = kind == "prismatic"
        if self.limits_deg is not None and (slides or self.limits is not None):
            what = "is for an axis that turns" if slides else "contradicts limits; give one of them"
            checks.keep(Fault("limits_deg", what))
        elif self.limits_deg is not None:
            low, high = _ordered(checks, "limits_deg", self.limits_deg, "degrees")
            return math.radians(low), math.radians(high)
        elif self.limits is not None:
            return _ordered(checks, "limits", self.limits, "metres" if slides else "radians")
        elif slides:
            checks.wrong("limits", MISSING, "must be a pair (low, high) (metres)")
        return None


def _ordered(checks: Checks, key: str, value: Any, unit: str) -> tuple[float, float]:
    """Two finite numbers, the first not above the second: equal ones hold the axis there."""
    expected = f"must be a pair (low, high) of finite numbers with low <= high ({unit})"
    low, high = checks.numbers(key, value, 2, expected, MAX_LENGTH) or (0.0, 0.0)
    if low > high:
        checks.keep(Fault(key, f"got {shown(value)}, the wrong way round", expected=expected))
    return low, high


def axis_joints(
    axes: Sequence[Axis], base: Array | None, joints: Sequence[JointInfo], root: str, path: str
) -> tuple[JointInfo, ...]:
    """The joints of the axes, and the one that fixes a URDF's root link, before its own.

    Args:
        axes: from the world outwards.
        base: (4, 4) m, the URDF's root link in the world, or on the last axis that carries it.
        joints: of the URDF, from its root outwards.
        root: its root link.
        path: of the URDF, for messages.

    Raises:
        UrdfError: a name is taken already, or there are too many axes.
    """
    taken = dict.fromkeys((joint.name for joint in joints), "joint")
    taken |= dict.fromkeys((root, *(joint.child for joint in joints)), "link")
    faults = [
        Fault("axis", f"{axis.name!r} is the name of a {taken[axis.name]} already; choose another")
        for axis in axes
        if axis.name in taken
    ]
    names = [axis.name for axis in axes]
    faults += [
        Fault("axis", f"two axes are called {name!r}; choose another name for one of them")
        for name in sorted(set(names))
        if names.count(name) > 1
    ]
    if len(axes) > MOST_AXES:
        faults.append(Fault("axis", f"got {len(axes)} axes; at most {MOST_AXES} can be composed"))
    if faults:
        raise UrdfError(faults, path)
    world = free_name(WORLD, {*taken, *names})
    tips, found = {"base": world, "surface": world}, []
    for axis in axes:
        low, high = axis.limits or (-math.inf, math.inf)
        kind = "continuous" if axis.limits is None else axis.kind
        roll, pitch, yaw = map(math.radians, axis.rpy_deg)
        found.append(JointInfo(
            axis.name, kind, tips[axis.carries], axis.name, axis.position,
            (roll, pitch, yaw), axis.axis, low, high, axis.max_velocity, None, None, 0,
        ))  # fmt: skip
        tips[axis.carries] = axis.name
    place = np.eye(4) if base is None else base
    xyz, rpy = tuple(place[:3, 3].tolist()), rpy_of(place[:3, :3])
    mount = free_name("mount", {*taken, *names})
    found.append(JointInfo(
        mount, "fixed", tips["base"], root, xyz, rpy, (1.0, 0.0, 0.0), 0.0, 0.0, None, None, None, 0
    ))  # fmt: skip
    # Parents before children: what hangs on the surface's axes is last.
    return tuple(sorted(found, key=lambda j: j.child in _carried(axes))) + tuple(joints)


def _carried(axes: Sequence[Axis]) -> set[str]:
    return {axis.name for axis in axes if axis.carries == "surface"}


def free_name(wanted: str, taken: set[str]) -> str:
    """A name that is not taken yet."""
    name, number = wanted, 1
    while name in taken:
        number += 1
        name = f"{wanted} {number}"
    return name


def carrier_of_surface(axes: Sequence[Axis]) -> str | None:
    """The link of the last axis that carries the surface; None where there is none."""
    return next((axis.name for axis in reversed(axes) if axis.carries == "surface"), None)


def rpy_of(rotation: Array) -> tuple[float, float, float]:
    """Fixed-axis roll, pitch and yaw, rad, of a rotation (3, 3).

    Standing upright (pitch +-90 degrees) only one of roll and yaw is determined; roll is read off
    after the other two are undone, so that the three give the rotation back to the last digits.
    """
    r = rotation
    pitch, yaw = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0])), math.atan2(r[1, 0], r[0, 0])
    side = np.array([-math.sin(yaw), math.cos(yaw), 0.0])  # y after yaw and pitch
    return math.atan2(-(side @ r[:, 2]), side @ r[:, 1]), pitch, yaw
