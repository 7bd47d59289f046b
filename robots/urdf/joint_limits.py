"""The <limit> of one joint of a URDF, checked."""

from __future__ import annotations

import math
from typing import NamedTuple

from robots.urdf.attributes import MAX_LENGTH, BadValue, Faults, numbers
from robots.urdf.xml import Node

FREE_TURN = MAX_LENGTH  # [rad] a revolute limit this wide (1e16 is the custom) means "none"
LIKELY_DEGREES = 20.0  # [rad] three turns: a limit beyond it was probably meant in degrees


class Limits(NamedTuple):
    """What a <limit> comes to."""

    kind: str
    """The joint's kind; a revolute joint without real stops is continuous."""
    lower: float | None
    """rad or m; None where `fault` says why there is none."""
    upper: float | None
    """rad or m; None where `fault` says why there is none."""
    max_velocity: float | None = None
    """rad/s or m/s; None where the file states no positive one."""
    fault: str | None = None


def read_limits(node: Node, limit: Node | None, kind: str, owner: str, faults: Faults) -> Limits:
    """Check the limits of one joint.

    Args:
        node: its <joint>.
        limit: the <limit> in it.
        kind: of the joint, as the file has it.
        owner: what it is called in messages.
        faults: where warnings are noted.
    """
    limits = _range(node, limit, kind, owner, faults)
    return limits._replace(max_velocity=_max_velocity(limit))


def _range(node: Node, limit: Node | None, kind: str, owner: str, faults: Faults) -> Limits:
    """The interval that a joint may move in."""
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
    if limit is None or not given:
        what = "no <limit>" if limit is None else "a <limit> without lower and upper"
        return Limits(*nothing, fault=f"is {kind} and has {what}; {remedy}")
    ends = {"lower": 0.0, "upper": 0.0}
    try:
        for attribute in given:
            (ends[attribute],) = numbers(limit, attribute, 1, bound=math.inf)
    except BadValue as bad:
        return Limits(*nothing, fault=f"has a bad limit: {bad}; {remedy}")
    lower, upper = ends["lower"], ends["upper"]
    if kind == "revolute" and lower <= -FREE_TURN and upper >= FREE_TURN:
        faults.warn(limit, f"{owner} has limits beyond 1,600 turns and is read as continuous")
        return Limits("continuous", -math.inf, math.inf)
    if max(abs(lower), abs(upper)) > MAX_LENGTH:
        return Limits(
            *nothing, fault=f"has limits [{lower:g}, {upper:g}] {unit}, no real stops; {remedy}"
        )
    if lower >= upper:
        what = "it is locked" if lower == upper else "lower lies above upper"
        if len(given) == 1:
            what += f" (a missing limit counts as 0; only {given[0]} is written)"
        return Limits(*nothing, fault=f"has limits [{lower:g}, {upper:g}]: {what}; {remedy}")
    if len(given) == 1:
        missing = "upper" if given == ["lower"] else "lower"
        faults.warn(limit, f"{owner} has no {missing} limit; URDF's default of 0 is used")
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
    if limit is None or "velocity" not in limit.attributes:
        return None
    try:
        (value,) = numbers(limit, "velocity", 1, bound=math.inf)
    except BadValue:
        return None
    return value if value > 0.0 else None


def _has_narrower_soft_limits(node: Node, lower: float, upper: float) -> bool:
    """Whether the joint's controller would stop it earlier than its limits do."""
    soft = node.first("safety_controller")
    if soft is None:
        return False
    try:
        low, high = (
            numbers(soft, attribute, 1)[0] if attribute in soft.attributes else 0.0
            for attribute in ("soft_lower_limit", "soft_upper_limit")
        )
    except BadValue:
        return False  # soft limits are only compared, never used
    return (low, high) != (0.0, 0.0) and (low > lower + 1e-9 or high < upper - 1e-9)
