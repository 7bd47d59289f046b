"""Which joints of a checked URDF are free, which are held, and at what value.

What is to be said about the joints of an arm: kinds, limits, a start, joints of no use.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from coverable.errors import Fault, close_matches, listed
from robots.errors import RobotError

if TYPE_CHECKING:
    from robots.urdf.checked_urdf import CheckedUrdf
    from robots.urdf.joints import JointInfo


KINDS = ("revolute", "continuous", "prismatic")


def joint_faults(
    names: Sequence[str],
    kinds: Sequence[str],
    lower: Array,
    upper: Array,
    start: Array | None,
) -> list[str]:
    """Joints of unknown kind, empty limit ranges, and a start outside of the limits.

    Args:
        names, kinds: of the joints, base to tip.
        lower, upper: (n,) rad or m.
        start: (n,) rad or m, if there is one.
    """
    faults = []
    if not names or len(kinds) != len(names):
        faults.append(
            f"{len(names)} joint names and {len(kinds)} kinds; "
            "there must be at least one joint, and one kind for each"
        )
    for joint, kind in zip(names, kinds, strict=False):
        if kind not in KINDS:
            faults.append(f"joint {joint!r} is {kind!r}, not one of {', '.join(KINDS)}")
    for joint, low, high in zip(names, lower, upper, strict=True):
        if not (low <= high and low < np.inf and high > -np.inf):
            faults.append(
                f"joint {joint!r} has limits {low:g} .. {high:g}; the lower one must not be "
                "above the upper one (rad or m)"
            )
    if start is not None and not faults:
        faults += [
            f"start puts joint {joint!r} at {value:g}, outside its limits {low:g} .. {high:g}"
            for joint, value, low, high in zip(names, start, lower, upper, strict=True)
            if not low <= value <= high
        ]
    return faults


def moves_both(joint: str, link: str, value: float, slides: bool) -> str:
    """That a joint is held because it moves the surface, which `link` carries, and the tool."""
    return (
        f"joint {joint!r} moves both the surface, on link {link!r}, and the tool, so it does not "
        f"help and is held at {value:g} {'m' if slides else 'rad'}"
    )


def no_limit_set(name: str, known: Iterable[str]) -> str:
    """That there is no limit set of this name, and which there are."""
    return f"there is no limit set {name!r}; it has: {', '.join(sorted(known)) or 'none'}"


def numbers(values: ArrayLike, what: str, shape: tuple[int, ...] | None = None) -> Array:
    """A write-protected copy as an array of floats of that shape; RobotError where it is none."""
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError) as error:
        raise RobotError(f"{what} must be an array of numbers, got {values!r}") from error
    if shape is not None and array.shape != shape:
        raise RobotError(f"{what} has shape {array.shape}, not {shape}")
    array.flags.writeable = False
    return array


MOST_NAMES = 40  # that a message lists
MOST_GUESSES = 20  # unknown names for which a known one is looked up
MOST_OTHERS = 8  # leaf links that a note lists

TOOL_LINKS = ("tcp", "tool0", "flange", "ee_link")
"""Names of the link that carries the tool, as arms have them; the first one present is taken."""


class Selection(NamedTuple):
    """The joints of a robot."""

    tool_frame: str
    """Empty where it is not known."""
    free: tuple[JointInfo, ...]
    """Base to tip."""
    locked: dict[str, float]
    """Every other moving joint with the value it is held at, rad or m."""
    notes: tuple[str, ...]
    """What was chosen."""
    faults: tuple[Fault, ...]
    """What is wrong; all else is without it."""
    is_chain: bool
    """Whether the free joints can be used."""


def select_joints(
    checked: CheckedUrdf,
    tool_frame: str | None,
    lock: Mapping[str, float],
    limits: str | Mapping[str, ArrayLike] | ArrayLike | None,
    surface_link: str | None = None,
) -> Selection:
    """Choose the free joints, those from the root link to the tool frame, and hold all others.

    Where a link carries the surface, they are those between it and the tool frame. Arguments are
    those of `robots.from_urdf.robot_from_urdf`; nothing is raised, so that all that is wrong
    can be said at once.
    """
    tool, words = _tool_frame(checked, tool_frame)
    faults = [] if tool else [Fault("", words)]
    notes: tuple[str, ...] = (words,) if tool and words else ()
    wrong = _lock_faults(checked, lock)
    faults += wrong.values()
    if surface_link is not None and surface_link not in checked.links:
        hint = suggestion(surface_link, checked.links)
        what = f"{checked.path} has no link {surface_link!r} that could carry the surface; {hint}"
        return Selection(tool, (), {}, notes, (*faults, Fault("surface_link", what)), False)
    held = {joint: value for joint, value in lock.items() if joint not in wrong}
    outwards = checked.path_to(tool) if tool else ()
    inwards = checked.path_to(surface_link) if tool and surface_link is not None else ()
    common = [joint for joint in outwards if joint in inwards]  # move surface and tool together
    between = [joint for joint in (*reversed(inwards), *outwards) if joint not in common]
    free = _free_joints(between, held)
    of_chain = _chain_faults(checked, tool, free, limits) if tool else []
    if tool and not free:
        of_chain = [_nothing_moves(checked, tool, surface_link, between, common)]
    locked = _locked_values(checked, {joint.name for joint in free}, held)
    notes += tuple(
        moves_both(joint.name, surface_link or "", locked[joint.name], joint.kind == "prismatic")
        for joint in common
        if joint.moves and joint.name not in held
    )
    is_chain = bool(tool) and not of_chain
    return Selection(tool, free, locked, notes, (*faults, *of_chain), is_chain)


def _nothing_moves(
    checked: CheckedUrdf,
    tool: str,
    surface_link: str | None,
    between: Sequence[JointInfo],
    common: Sequence[JointInfo],
) -> Fault:
    """The fault of an arm without a free joint."""
    if surface_link is None:
        return Fault(
            "",
            f"no free joint lies between the root link {checked.root!r} and {tool!r} of "
            f"{checked.path}; choose a tool_frame further out, or lock fewer joints",
        )
    moving = [joint.name for joint in between if joint.moves]
    if moving:
        what = f"every joint between it and the tool is held: {', '.join(moving)}; lock fewer"
    elif any(joint.moves for joint in common):
        what = f"it moves with the tool, {tool!r}: no joint lies between the two"
    else:
        what = f"neither it nor the tool, {tool!r}, is moved by any joint"
    return Fault("surface_link", f"link {surface_link!r} cannot carry the surface: {what}")


def _tool_frame(checked: CheckedUrdf, link: str | None) -> tuple[str, str]:
    """The tool link, and what is to be said about it.

    The named link, or the only leaf; among several leaves the first of `TOOL_LINKS`, or the only
    leaf that moves. Where none of this helps it is empty, and the words are a fault.
    """
    if link is not None and link in checked.links:
        return link, ""
    if link is not None:
        hint = suggestion(link, checked.links)
        return "", f"{checked.path} has no link {link!r} for tool_frame; {hint}"
    if len(checked.leaves) == 1:
        return checked.leaves[0], ""
    bodies = _bodies(checked)
    leaves = [leaf for leaf in checked.leaves if leaf in bodies]
    known = next((name for name in TOOL_LINKS if name in bodies), None)
    if known is not None:
        others = [repr(leaf) for leaf in leaves if bodies[leaf] != bodies[known]]
        beside = f"; joints also move {listed(others, MOST_OTHERS)}" if others else ""
        return known, f"tool_frame is {known!r}, chosen by its name{beside}"
    if len(leaves) == 1:
        return leaves[0], f"tool_frame is {leaves[0]!r}, the only leaf link that a joint moves"
    known_leaves = leaves or checked.leaves
    return "", (
        f"{checked.path} has {len(known_leaves)} leaf links, so tool_frame must name one: "
        f"{listed(known_leaves, MOST_NAMES)} (or any other link)"
    )


def _bodies(checked: CheckedUrdf) -> dict[str, str]:
    """The links that a moving joint lies before, each with the first link that it is fixed to."""
    first: dict[str, str] = {}
    for joint in checked.joints:  # from the root outwards
        if joint.moves or joint.parent in first:
            first[joint.child] = joint.child if joint.moves else first[joint.parent]
    return first


def suggestion(name: str, known: Sequence[str]) -> str:
    """Names that come close to `name`, or the known ones if none does."""
    close = close_matches(name, known, most=5, cutoff=0.5)
    if close:
        return f"did you mean {' or '.join(repr(match) for match in close)}?"
    return f"it has: {listed(list(known), MOST_NAMES)}"


def _lock_faults(checked: CheckedUrdf, lock: Mapping[str, float]) -> dict[str, Fault]:
    """By name, locked joints that do not exist, do not move, or are held outside their limits."""
    moving = {joint.name: joint for joint in checked.joints if joint.moves}
    faults: dict[str, Fault] = {}
    for joint_name, value in lock.items():
        joint = moving.get(joint_name)
        if joint is None:
            hint = f"; {suggestion(joint_name, list(moving))}" if len(faults) < MOST_GUESSES else ""
            text = f"lock names {joint_name!r}, which is no moving joint{hint}"
            faults[joint_name] = Fault("", text)
            continue
        unit = "m" if joint.kind == "prismatic" else "rad"
        low, high = joint.limits
        if not low <= value <= high:
            faults[joint_name] = Fault(
                "",
                f"lock holds joint {joint_name!r} at {value:g} {unit}, outside its limits "
                f"{low:g} .. {high:g} {unit}",
            )
    return faults


def _free_joints(between: Sequence[JointInfo], lock: Mapping[str, float]) -> tuple[JointInfo, ...]:
    """The moving joints between surface and tool that nothing holds.

    A mimic joint is held when the joint that leads it is.
    """
    free = [joint for joint in between if joint.moves and joint.name not in lock]
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


def _chain_faults(
    checked: CheckedUrdf,
    tool: str,
    free: Sequence[JointInfo],
    limits: str | Mapping[str, ArrayLike] | ArrayLike | None,
) -> list[Fault]:
    """What is wrong with joints that cannot move freely."""
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
    return [Fault("", fault, place=checked.path) for fault in faults]


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
