"""Which joints of a checked URDF are free, which are held, and at what value."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from numpy.typing import ArrayLike

from coverable_errors import close_matches
from robots.errors import RobotError

if TYPE_CHECKING:
    from robots.urdf import CheckedUrdf, JointInfo

MOST_NAMES = 40  # that a message lists


class Selection(NamedTuple):
    """The joints of a robot."""

    tool_frame: str
    free: tuple[JointInfo, ...]
    """Base to tip."""
    locked: dict[str, float]
    """Every other moving joint with the value it is held at, rad or m."""


def select_joints(
    checked: CheckedUrdf,
    name: str,
    tool_frame: str | None,
    lock: Mapping[str, float],
    limits: str | Mapping[str, ArrayLike] | ArrayLike | None,
) -> Selection:
    """Choose the free joints, those from the root link to the tool frame, and hold all others.

    Arguments and errors are those of `robots.pinocchio_model.robot_from_urdf`.
    """
    tool = _tool_frame(checked, name, tool_frame)
    _check_lock(checked, name, lock)
    free = _free_joints(checked, tool, lock)
    _check_free(checked, name, tool, free, limits)
    return Selection(tool, free, _locked_values(checked, {joint.name for joint in free}, lock))


def _tool_frame(checked: CheckedUrdf, name: str, link: str | None) -> str:
    """The tool link: the one that is named, or the only leaf."""
    if link is None:
        if len(checked.leaves) == 1:
            return checked.leaves[0]
        raise RobotError(
            f"robot {name!r}: {checked.path} has {len(checked.leaves)} leaf links, so tool_frame "
            f"must name one: {', '.join(checked.leaves)} (or any other link)"
        )
    if link not in checked.links:
        raise RobotError(
            f"robot {name!r}: {checked.path} has no link {link!r} for tool_frame; "
            + suggestion(link, checked.links)
        )
    return link


def suggestion(name: str, known: Sequence[str]) -> str:
    """Names that come close to `name`, or the known ones if none does."""
    close = close_matches(name, known, most=5, cutoff=0.5)
    if close:
        return f"did you mean {' or '.join(repr(match) for match in close)}?"
    shown = ", ".join(list(known)[:MOST_NAMES])
    return f"it has: {shown}" + (", ..." if len(known) > MOST_NAMES else "")


def _check_lock(checked: CheckedUrdf, name: str, lock: Mapping[str, float]) -> None:
    """Refuse locked joints that do not exist, do not move, or are held outside their limits."""
    moving = {joint.name: joint for joint in checked.joints if joint.moves}
    faults = []
    for joint_name, value in lock.items():
        joint = moving.get(joint_name)
        if joint is None:
            hint = suggestion(joint_name, list(moving))
            faults.append(f"lock names {joint_name!r}, which is no moving joint; {hint}")
            continue
        unit = "m" if joint.kind == "prismatic" else "rad"
        low, high = joint.limits
        if not low <= value <= high:
            faults.append(
                f"lock holds joint {joint_name!r} at {value:g} {unit}, outside its limits "
                f"{low:g} .. {high:g} {unit}"
            )
    if faults:
        raise RobotError(faults, f"robot {name!r}")


def _free_joints(
    checked: CheckedUrdf, tool: str, lock: Mapping[str, float]
) -> tuple[JointInfo, ...]:
    """The moving joints on the chain to the tool that nothing holds.

    A mimic joint is held when the joint that leads it is.
    """
    free = [joint for joint in checked.path_to(tool) if joint.moves and joint.name not in lock]
    while True:
        names = {joint.name for joint in free}
        kept = [
            joint
            for joint in free
            if joint.mimic is None or joint.fault is not None or joint.mimic.joint in names
        ]
        if len(kept) == len(free):
            return tuple(free)
        free = kept


def _check_free(
    checked: CheckedUrdf,
    name: str,
    tool: str,
    free: Sequence[JointInfo],
    limits: str | Mapping[str, ArrayLike] | ArrayLike | None,
) -> None:
    """Refuse a chain without free joints, or with joints that cannot move freely."""
    if not free:
        raise RobotError(
            f"robot {name!r}: no free joint lies between the root link {checked.root!r} and "
            f"{tool!r} of {checked.path}; choose a tool_frame further out, or lock fewer joints"
        )
    faults = []
    for joint in free:
        if joint.mimic is not None and joint.fault is None:
            faults.append(
                f"line {joint.line}: joint {joint.name!r} on the chain to {tool!r} mimics "
                f"{joint.mimic.joint!r}; lock one of the two, or choose another tool_frame"
            )
        elif joint.fault is not None:
            gets_limits = limits is not None and (
                not isinstance(limits, Mapping) or joint.name in limits
            )
            # Limits given by the caller replace bad limits, not a mimic of an unknown joint.
            if not (gets_limits and joint.lower is None and joint.mimic is None):
                faults.append(joint.fault)
    if faults:
        raise RobotError(faults, f"robot {name!r}, {checked.path}")


def _locked_values(
    checked: CheckedUrdf, free: set[str], lock: Mapping[str, float]
) -> dict[str, float]:
    """Where every one-dof joint that is not free is held, rad or m.

    A mimic joint whose leader is free keeps its own value; it moves nothing that carries the tool.
    A joint with a fault follows nothing, so that a ring of mimics ends there.
    """
    held = {joint.name: joint for joint in checked.joints if joint.moves and joint.name not in free}

    def value(joint: JointInfo) -> float:
        independent = joint.fault is not None or joint.name in lock
        if joint.mimic is None or independent or joint.mimic.joint not in held:
            low, high = joint.limits
            return float(lock.get(joint.name, min(max(0.0, low), high)))
        return joint.mimic.multiplier * value(held[joint.mimic.joint]) + joint.mimic.offset

    return {title: value(joint) for title, joint in held.items()}
