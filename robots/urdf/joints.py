"""One <joint> of a URDF, checked."""

from __future__ import annotations

import math
from dataclasses import dataclass

from robots.urdf.attributes import BadValue, Faults, Triple, name_of, numbers, only, triple
from robots.urdf.joint_limits import read_limits
from robots.urdf.xml import Node, nearest, shown

# fmt: off
CHILDREN = (
    "parent", "child", "origin", "axis", "limit", "mimic", "calibration", "dynamics",
    "safety_controller",
)
# fmt: on
KINDS = ("revolute", "continuous", "prismatic", "fixed")
MIN_AXIS = 1e-6  # a shorter axis has no direction worth trusting


@dataclass(frozen=True, eq=False, slots=True)
class Mimic:
    """This joint follows another: q = multiplier * q_joint + offset."""

    joint: str
    multiplier: float
    offset: float


@dataclass(frozen=True, eq=False, slots=True)
class JointInfo:
    """One joint, with numbers that are finite and an axis of length one."""

    name: str
    kind: str
    """'revolute', 'continuous', 'prismatic' or 'fixed'."""
    parent: str
    child: str
    xyz: Triple
    """Origin in the parent link's frame, m."""
    rpy: Triple
    """Fixed-axis roll, pitch, yaw of the same, rad."""
    axis: Triple
    """Unit vector in the joint's frame; (1, 0, 0) for a fixed joint."""
    lower: float | None
    """rad or m; -inf for a continuous joint; None where `fault` says why there is none."""
    upper: float | None
    """rad or m; +inf for a continuous joint; None where `fault` says why there is none."""
    max_velocity: float | None
    """rad/s or m/s; None where the file states no positive one."""
    mimic: Mimic | None
    """What it follows, if anything."""
    fault: str | None
    """Why it cannot be used as written, and what would do; None for a sound joint.

    A fault matters only to a user of this joint: an arm is sound when a finger's limit is missing.
    """
    line: int
    """Line of the file that it starts on."""

    @property
    def moves(self) -> bool:
        """True for every kind but 'fixed'."""
        return self.kind != "fixed"

    @property
    def limits(self) -> tuple[float, float]:
        """Lower and upper, rad or m; infinite where `fault` says why there are none."""
        if self.lower is None or self.upper is None:
            return -math.inf, math.inf
        return self.lower, self.upper


def read_joint(node: Node, faults: Faults) -> JointInfo | None:
    """Check one <joint>; None when a fault leaves nothing to build on."""
    before = len(faults.errors)
    name = name_of(node, faults)
    owner = f"joint {shown(name or '?')}"
    _check_children(node, owner, faults)
    kind = _kind(node, owner, faults)
    ends = [_link_name(node, tag, owner, faults) for tag in ("parent", "child")]
    origin = only(node, "origin", faults, owner)
    axis_node = only(node, "axis", faults, owner) if kind != "fixed" else None
    limit = only(node, "limit", faults, owner) if kind != "fixed" else None
    mimic_node = only(node, "mimic", faults, owner) if kind != "fixed" else None
    _check_attributes(origin, ("xyz", "rpy"), owner, faults)
    _check_attributes(axis_node, ("xyz",), owner, faults)
    xyz = _triple(origin, "xyz", (0.0, 0.0, 0.0), owner, faults)
    rpy = _triple(origin, "rpy", (0.0, 0.0, 0.0), owner, faults)
    if origin is not None and max(map(abs, rpy)) > 2 * math.pi + 1e-3:
        faults.warn(
            origin, f"{owner}: rpy={shown(_text(rpy))} is read in radians; were degrees meant?"
        )
    if origin is not None and max(map(abs, xyz)) > 100.0:
        faults.warn(origin, f"{owner}: xyz={shown(_text(xyz))} is read in metres; were mm meant?")
    axis = _axis(axis_node, owner, faults)
    if len(faults.errors) > before or name is None or ends[0] is None or ends[1] is None:
        return None
    limits = read_limits(node, limit, kind, owner, faults)
    mimic, mimic_fault = _mimic(mimic_node)
    fault = limits.fault or mimic_fault
    return JointInfo(
        name, limits.kind, ends[0], ends[1], xyz, rpy, axis, limits.lower, limits.upper,
        limits.max_velocity, mimic, f"line {node.line}: {owner} {fault}" if fault else None,
        node.line,
    )  # fmt: skip


def _text(values: Triple) -> str:
    return " ".join(f"{value:g}" for value in values)


def _kind(node: Node, owner: str, faults: Faults) -> str:
    kind = node.attributes.get("type")
    if kind in KINDS:
        return kind
    if kind in ("floating", "planar"):
        faults.error(
            node,
            f"{owner} is {kind}, which has no single coordinate; make it fixed if the base "
            "stands still, or a chain of prismatic and revolute joints",
        )
        return "fixed"
    near = nearest(kind or "", KINDS)
    did_you_mean = f" (did you mean {near!r}?)" if near else ""
    what = "has no type" if kind is None else f"has the unknown type {shown(kind)}"
    faults.error(node, f"{owner} {what}; expected one of {', '.join(KINDS)}{did_you_mean}")
    return "fixed"


def _link_name(node: Node, tag: str, owner: str, faults: Faults) -> str | None:
    end = only(node, tag, faults, owner)
    if end is None:
        faults.error(node, f'{owner} has no {tag}; write <{tag} link="..."/>')
        return None
    return name_of(end, faults, "link", owner)


def _check_children(node: Node, owner: str, faults: Faults) -> None:
    """Report misspelt elements: without <origin> the origin would silently be zero."""
    for child in node.children:
        if child.tag in CHILDREN:
            continue
        near = nearest(child.tag, CHILDREN, cutoff=0.75)
        if near:
            faults.error(child, f"{owner}: <{child.tag[:60]}> is no element; write <{near}>")
        else:
            faults.warn(child, f"{owner}: the unknown element <{child.tag[:60]}> is ignored")


def _check_attributes(
    node: Node | None, known: tuple[str, ...], owner: str, faults: Faults
) -> None:
    """Report unknown attributes: a pose in one of them would silently be lost."""
    if node is None:
        return
    for attribute in node.attributes:
        if attribute in known:
            continue
        what = f"{owner}: <{node.tag}> has the unknown attribute {shown(attribute)}"
        if nearest(attribute, known) or "quat" in attribute.lower():
            faults.error(node, f"{what}; write {' and '.join(known)}")
        else:
            faults.warn(node, f"{what}, which is ignored")


def _triple(
    node: Node | None, attribute: str, default: Triple, owner: str, faults: Faults
) -> Triple:
    try:
        return triple(node, attribute, default)
    except BadValue as bad:
        if node is not None:
            faults.error(node, f"{owner}: {bad}")
        return default


def _axis(node: Node | None, owner: str, faults: Faults) -> Triple:
    """The unit axis; URDF's default is x."""
    default = (1.0, 0.0, 0.0)
    if node is None:
        return default
    if "xyz" not in node.attributes:
        faults.error(node, f'{owner}: <axis> has no xyz; write <axis xyz="0 0 1"/>')
        return default
    before = len(faults.errors)
    x, y, z = _triple(node, "xyz", default, owner, faults)
    if len(faults.errors) > before:
        return default
    length = math.hypot(x, y, z)
    if length < MIN_AXIS:
        faults.error(
            node,
            f"{owner}: <axis> xyz={shown(node.attributes['xyz'])} has no direction; "
            'write a vector that is not zero, such as "0 0 1"',
        )
        return default
    if abs(length - 1.0) < 1e-15:
        return x, y, z
    return x / length, y / length, z / length


def _mimic(node: Node | None) -> tuple[Mimic | None, str | None]:
    """The joint that it follows, or why that cannot be read."""
    if node is None:
        return None, None
    leader = node.attributes.get("joint")
    if not leader:
        return None, 'has a <mimic> without joint; write <mimic joint="..."/>, or lock the joint'
    try:
        factors = [
            numbers(node, attribute, 1)[0] if attribute in node.attributes else default
            for attribute, default in (("multiplier", 1.0), ("offset", 0.0))
        ]
    except BadValue as bad:
        return None, f"has a bad mimic: {bad}; correct it, or lock the joint"
    return Mimic(leader, factors[0], factors[1]), None
