"""Axes that an arm or a surface is mounted on, inserted into a URDF's tree before it is checked.

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

from coverable_arrays import Array
from coverable_errors import MISSING, Checks, Fault, shown
from robots.errors import RobotError
from robots.mounting import FURTHEST_BASE, matrix_of
from robots.urdf.xml import MAX_LENGTH, MAX_NAME, Node, UrdfError

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


def insert_axes(robot: Node, axes: Sequence[Axis], base: Array | None, path: str) -> str:
    """Add the axes to a URDF's tree, as links and joints; changes the tree.

    Args:
        robot: the <robot> element.
        axes: from the world outwards.
        base: (4, 4) m, the URDF's root link in the world, or on the last axis that carries it.
        path: of the URDF, for messages.

    Returns:
        The root link of the URDF itself.

    Raises:
        UrdfError: a name is taken already, or the URDF has no one root link.
    """
    links = [link.attributes.get("name", "") for link in robot.all("link")]
    joints = {joint.attributes.get("name", "") for joint in robot.all("joint")}
    children = {
        child.attributes.get("link", "")
        for joint in robot.all("joint")
        for child in joint.all("child")
    }
    roots = [link for link in links if link not in children]
    if len(roots) != 1:
        raise UrdfError(f"has {len(roots)} root links; axes can be added to a tree only", path)
    taken = {**dict.fromkeys(joints, "joint"), **dict.fromkeys(links, "link")}
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
    world = free_name(WORLD, {*links, *names})
    robot.children.append(_link(world, robot.line))
    tips = {"base": world, "surface": world}
    for axis in axes:
        robot.children += [_link(axis.name, robot.line), _joint(axis, tips[axis.carries], robot)]
        tips[axis.carries] = axis.name
    mount = free_name("mount", {*joints, *names})
    robot.children.append(_fixed(mount, tips["base"], roots[0], base, robot.line))
    return roots[0]


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


def _link(name: str, line: int) -> Node:
    return Node("link", {"name": name}, line)


def _joint(axis: Axis, parent: str, robot: Node) -> Node:
    """The joint that moves the link of an axis."""
    rpy = " ".join(repr(math.radians(angle)) for angle in axis.rpy_deg)
    kind = "continuous" if axis.limits is None else axis.kind
    joint = Node("joint", {"name": axis.name, "type": kind}, robot.line)
    joint.children = [
        Node("parent", {"link": parent}, robot.line),
        Node("child", {"link": axis.name}, robot.line),
        Node("origin", {"xyz": _text(axis.position), "rpy": rpy}, robot.line),
        Node("axis", {"xyz": _text(axis.axis)}, robot.line),
    ]
    limit = {"velocity": repr(axis.max_velocity or 0.0), "effort": "0"}
    if axis.limits is not None:
        limit |= {"lower": repr(axis.limits[0]), "upper": repr(axis.limits[1])}
    joint.children.append(Node("limit", limit, robot.line))
    return joint


def _fixed(name: str, parent: str, child: str, place: Array | None, line: int) -> Node:
    """The joint that fixes the URDF's root link."""
    joint = Node("joint", {"name": name, "type": "fixed"}, line)
    joint.children = [Node("parent", {"link": parent}, line), Node("child", {"link": child}, line)]
    if place is not None:
        origin = {"xyz": _text(place[:3, 3]), "rpy": _text(rpy_of(place[:3, :3]))}
        joint.children.append(Node("origin", origin, line))
    return joint


def _text(values: Any) -> str:
    return " ".join(repr(float(value)) for value in values)


def rpy_of(rotation: Array) -> tuple[float, float, float]:
    """Fixed-axis roll, pitch and yaw, rad, of a rotation (3, 3).

    Standing upright (pitch +-90 degrees) only one of roll and yaw is determined; roll is read off
    after the other two are undone, so that the three give the rotation back to the last digits.
    """
    r = rotation
    pitch, yaw = math.atan2(-r[2, 0], math.hypot(r[0, 0], r[1, 0])), math.atan2(r[1, 0], r[0, 0])
    side = np.array([-math.sin(yaw), math.cos(yaw), 0.0])  # y after yaw and pitch
    return math.atan2(-(side @ r[:, 2]), side @ r[:, 1]), pitch, yaw
