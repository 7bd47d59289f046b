"""One <joint> of a URDF and its limits, checked."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from coverable.errors import close_matches
from robots.urdf.elements import (
    MAX_LENGTH,
    BadValue,
    Faults,
    Node,
    Triple,
    name_of,
    number,
    only,
    shown,
    triple,
)

CHILDREN = (
    "parent", "child", "origin", "axis", "limit", "mimic", "calibration", "dynamics",
    "safety_controller",
)  # fmt: skip
KINDS = ("revolute", "continuous", "prismatic", "fixed")
MIN_AXIS = 1e-6  # a shorter axis has no direction worth trusting
FREE_TURN = MAX_LENGTH  # [rad] a revolute limit this wide (1e16 is the custom) means "none"
LIKELY_DEGREES = 20.0  # [rad] three turns: a limit beyond it was probably meant in degrees


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
    for key, values, most, units in (
        ("rpy", rpy, 2 * math.pi + 1e-3, "read in radians; were degrees"),
        ("xyz", xyz, 100.0, "read in metres; were mm"),
    ):
        if origin is not None and max(map(abs, values)) > most:
            text = " ".join(f"{value:g}" for value in values)
            faults.warn(origin, f"{owner}: {key}={shown(text)} is {units} meant?")
    axis = _axis(axis_node, owner, faults)
    if len(faults.errors) > before or name is None or ends[0] is None or ends[1] is None:
        return None
    limits = _limits(node, limit, kind, owner, faults)
    mimic, mimic_fault = _mimic(mimic_node)
    fault = limits.fault or mimic_fault
    return JointInfo(
        name, limits.kind, ends[0], ends[1], xyz, rpy, axis, limits.lower, limits.upper,
        _max_velocity(limit), mimic, f"line {node.line}: {owner} {fault}" if fault else None,
        node.line,
    )  # fmt: skip


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
    near = close_matches(kind, KINDS)
    did_you_mean = f" (did you mean {near[0]!r}?)" if near else ""
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
        near = close_matches(child.tag, CHILDREN, cutoff=0.75)
        if near:
            faults.error(child, f"{owner}: <{child.tag[:60]}> is no element; write <{near[0]}>")
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
        if close_matches(attribute, known) or "quat" in attribute.lower():
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
        return Mimic(leader, number(node, "multiplier", 1.0), number(node, "offset", 0.0)), None
    except BadValue as bad:
        return None, f"has a bad mimic: {bad}; correct it, or lock the joint"


class Limits(NamedTuple):
    """Kind and interval of a `JointInfo`; a revolute joint without real stops is continuous."""

    kind: str
    lower: float | None
    upper: float | None
    fault: str | None = None


def _limits(node: Node, limit: Node | None, kind: str, owner: str, faults: Faults) -> Limits:
    """Check the limits of one joint, which messages call `owner`."""
    if kind == "fixed":
        return Limits(kind, 0.0, 0.0)
    unit = "metres" if kind == "prismatic" else "radians"
    remedy = f'write <limit lower="..." upper="..."/> in {unit}, or give its limits or lock it'
    given = [a for a in ("lower", "upper") if limit is not None and a in limit.attributes]
    if kind == "continuous":
        if given:
            faults.warn(
                limit or node,
                f"{owner} is continuous, so the limits written there are ignored; make it "
                "revolute, or give it limits, if it has stops",
            )
        return Limits(kind, -math.inf, math.inf)
    nothing = (kind, None, None)
    missing = [end for end in ("lower", "upper") if end not in given]
    if limit is None or missing:
        what = "no <limit>" if limit is None else f"a <limit> without {' and '.join(missing)}"
        return Limits(*nothing, f"is {kind} and has {what}; {remedy}")
    try:
        lower, upper = (number(limit, end, 0.0, bound=math.inf) for end in ("lower", "upper"))
    except BadValue as bad:
        return Limits(*nothing, f"has a bad limit: {bad}; {remedy}")
    if kind == "revolute" and lower <= -FREE_TURN and upper >= FREE_TURN:
        faults.warn(limit, f"{owner} has limits beyond 1,600 turns and is read as continuous")
        return Limits("continuous", -math.inf, math.inf)
    if max(abs(lower), abs(upper)) > MAX_LENGTH:
        return Limits(
            *nothing, fault=f"has limits [{lower:g}, {upper:g}] {unit}, no real stops; {remedy}"
        )
    if lower >= upper:
        what = "it is locked" if lower == upper else "lower lies above upper"
        return Limits(*nothing, f"has limits [{lower:g}, {upper:g}]: {what}; {remedy}")
    if kind == "revolute" and max(abs(lower), abs(upper)) > LIKELY_DEGREES:
        faults.warn(
            limit,
            f"{owner} has limits [{lower:g}, {upper:g}], read in radians; were degrees meant?",
        )
    if _has_narrower_soft_limits(node, lower, upper):
        faults.soft_limits.append(owner.removeprefix("joint "))
    return Limits(kind, lower, upper)


def _max_velocity(limit: Node | None) -> float | None:
    """The velocity limit; one that makes no sense counts as missing: only timing needs it."""
    try:
        value = 0.0 if limit is None else number(limit, "velocity", 0.0, bound=math.inf)
    except BadValue:
        return None
    return value if value > 0.0 else None


def _has_narrower_soft_limits(node: Node, lower: float, upper: float) -> bool:
    """Whether the joint's controller would stop it earlier than its limits do."""
    soft = node.first("safety_controller")
    if soft is None:
        return False
    try:
        low, high = number(soft, "soft_lower_limit", 0.0), number(soft, "soft_upper_limit", 0.0)
    except BadValue:
        return False  # soft limits are only compared, never used
    return (low, high) != (0.0, 0.0) and (low > lower + 1e-9 or high < upper - 1e-9)
