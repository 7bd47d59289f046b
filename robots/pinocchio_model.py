"""From a checked URDF to a `Robot`: which joints are free, which are locked, and at what value."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Mapping, Sequence
from numbers import Real
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from robots.robot import Robot, RobotError

if TYPE_CHECKING:
    from robots.urdf import CheckedUrdf, JointInfo


import pinocchio as pin

MOST_NAMES = 40  # that a message lists


def robot_from_urdf(
    checked: CheckedUrdf,
    *,
    name: str,
    tool_frame: str | None = None,
    approach_axis: ArrayLike = (0.0, 0.0, 1.0),
    lock: Mapping[str, float] | None = None,
    limits: str | Mapping[str, ArrayLike] | ArrayLike | None = None,
    limit_sets: Mapping[str, Mapping[str, tuple[float, float]]] | None = None,
) -> Robot:
    """Reduce a URDF to the chain from its root link to the tool frame.

    Free are the joints on the path from the root link to the tool frame, unless `lock` names them.
    Every other moving joint is held: at the value `lock` gives, or at zero brought into its limits
    (a mimic joint where the joint it follows puts it, if that one is held too).

    Args:
        checked: a URDF that has passed the gate.
        name: what the robot is called in messages.
        tool_frame: a link; None takes the only leaf.
        approach_axis: (3,) in the tool frame.
        lock: joint name -> value, rad or m.
        limits: replaces the URDF's limits, see `Robot.with_limits`. A joint whose own limits are
            missing or senseless needs them.
        limit_sets: name -> joint name -> (lower, upper), rad or m. A set that lacks a free joint
            is left out.

    Raises:
        RobotError: the tool frame or a locked joint does not exist, a locked value is outside its
            limits, or a joint on the path cannot be used as it stands and is not locked.
    """
    tool = _tool_frame(checked, name, tool_frame)
    fixed_values = dict(lock or {})
    _check_lock(checked, name, fixed_values)
    free = _free_joints(checked, tool, fixed_values)
    _check_free(checked, name, tool, free, limits)
    locked = _locked_values(checked, {joint.name for joint in free}, fixed_values)
    free_names = [joint.name for joint in free]
    model = reduced_model(parse(checked.text, checked.path), free_names, locked, tool)
    robot = Robot(
        name=name,
        model=model,
        tool_frame=tool,
        approach_axis=np.asarray(approach_axis),
        joint_names=tuple(free_names),
        joint_kinds=tuple(joint.kind for joint in free),
        # Pinocchio's own limits are not asked: it loses those of continuous joints.
        lower=np.array([_range(joint)[0] for joint in free]),
        upper=np.array([_range(joint)[1] for joint in free]),
        max_velocity=np.array([joint.max_velocity or math.nan for joint in free]),
        limit_sets={
            title: np.array([rows[joint.name] for joint in free])
            for title, rows in (limit_sets or {}).items()
            if all(joint.name in rows for joint in free)
        },
        urdf=os.path.abspath(checked.path),
        package_dirs=checked.package_dirs,
        locked=locked,
        notes=checked.warnings,
    )
    return robot if limits is None else robot.with_limits(limits)


def _tool_frame(checked: CheckedUrdf, name: str, asked: str | None) -> str:
    """The tool link: the one asked for, or the only leaf."""
    if asked is None:
        if len(checked.leaves) == 1:
            return checked.leaves[0]
        raise RobotError(
            f"robot {name!r}: {checked.path} has {len(checked.leaves)} leaf links, so tool_frame "
            f"must name one: {', '.join(checked.leaves)} (or any other link)"
        )
    if asked not in checked.links:
        raise RobotError(
            f"robot {name!r}: {checked.path} has no link {asked!r} for tool_frame; "
            + suggestion(asked, checked.links)
        )
    return asked


def suggestion(asked: str, known: Sequence[str]) -> str:
    """Names that come close to `asked`, or the known ones if none does."""
    import difflib

    close = difflib.get_close_matches(asked, known, n=5, cutoff=0.5)
    if close:
        return f"did you mean {' or '.join(repr(match) for match in close)}?"
    shown = ", ".join(list(known)[:MOST_NAMES])
    return f"it has: {shown}" + (", ..." if len(known) > MOST_NAMES else "")


def _check_lock(checked: CheckedUrdf, name: str, lock: Mapping[str, float]) -> None:
    """Refuse locked joints that do not exist, do not move, or stand outside their limits."""
    moving = {joint.name: joint for joint in checked.joints if joint.moves}
    faults = []
    for joint_name, value in lock.items():
        joint = moving.get(joint_name)
        if joint is None:
            hint = suggestion(joint_name, list(moving))
            faults.append(f"lock names {joint_name!r}, which is no moving joint; {hint}")
            continue
        unit = "m" if joint.kind == "prismatic" else "rad"
        low, high = _range(joint)
        if isinstance(value, bool) or not isinstance(value, Real):
            faults.append(f"lock holds joint {joint_name!r} at {value!r}, not a number ({unit})")
        elif not (math.isfinite(value) and low <= value <= high):
            faults.append(
                f"lock holds joint {joint_name!r} at {value:g} {unit}, outside its limits "
                f"{low:g} .. {high:g} {unit}"
            )
    if faults:
        raise RobotError(faults, f"robot {name!r}")


def _range(joint: JointInfo) -> tuple[float, float]:
    """Limits of a joint, rad or m; infinite where the file gives none that make sense."""
    if joint.lower is None or joint.upper is None:
        return -math.inf, math.inf
    return joint.lower, joint.upper


def _free_joints(
    checked: CheckedUrdf, tool: str, lock: Mapping[str, float]
) -> tuple[JointInfo, ...]:
    """The moving joints on the way to the tool that nothing holds.

    A mimic joint is held when the joint that leads it is.
    """
    free = [joint for joint in checked.path_to(tool) if joint.moves and joint.name not in lock]
    names = {joint.name for joint in free}
    while True:
        led = {
            joint.name
            for joint in free
            if joint.mimic is not None and joint.fault is None and joint.mimic.joint not in names
        }
        if not led & names:
            return tuple(joint for joint in free if joint.name in names)
        names -= led


def _check_free(
    checked: CheckedUrdf,
    name: str,
    tool: str,
    free: Sequence[JointInfo],
    limits: str | Mapping[str, ArrayLike] | ArrayLike | None,
) -> None:
    """Refuse a path without free joints, or with joints that cannot move freely."""
    if not free:
        raise RobotError(
            f"robot {name!r}: no free joint lies between the root link {checked.root!r} and "
            f"{tool!r} of {checked.path}; choose a tool_frame further out, or lock fewer joints"
        )
    faults = []
    for joint in free:
        if joint.mimic is not None and joint.fault is None:
            faults.append(
                f"line {joint.line}: joint {joint.name!r} on the way to {tool!r} mimics "
                f"{joint.mimic.joint!r}; lock one of the two, or choose another tool_frame"
            )
        elif joint.fault is not None:
            gets_limits = limits is not None and (
                not isinstance(limits, Mapping) or joint.name in limits
            )
            # Given limits mend limits, not a mimic that leads nowhere.
            if not (gets_limits and joint.lower is None and joint.mimic is None):
                faults.append(joint.fault)
    if faults:
        raise RobotError(faults, f"robot {name!r}, {checked.path}")


def _locked_values(
    checked: CheckedUrdf, free: set[str], lock: Mapping[str, float]
) -> dict[str, float]:
    """Where every one-dof joint that is not free is held, rad or m."""
    by_name = {joint.name: joint for joint in checked.joints}
    held: dict[str, float] = {}
    for joint in checked.joints:
        if joint.moves and joint.name not in free:
            low, high = _range(joint)
            held[joint.name] = float(lock.get(joint.name, min(max(0.0, low), high)))
    return {title: _followed(by_name[title], by_name, held, lock) for title in held}


def _followed(
    joint: JointInfo,
    joints: Mapping[str, JointInfo],
    held: Mapping[str, float],
    lock: Mapping[str, float],
) -> float:
    """Where a held joint stands that may mimic another one.

    A mimic joint whose leader is free stays where it is; it moves nothing that carries the tool.
    A joint with a fault follows nothing, so that a ring of mimics ends here.
    """
    on_its_own = joint.fault is not None or joint.name in lock
    if joint.mimic is None or on_its_own or joint.mimic.joint not in held:
        return held[joint.name]
    leader = _followed(joints[joint.mimic.joint], joints, held, lock)
    return joint.mimic.multiplier * leader + joint.mimic.offset


def parse(text: str, path: str) -> pin.Model:
    """Parse checked URDF text with Pinocchio.

    Pinocchio prints what is wrong on the C stderr and raises only "not a valid URDF", so file
    descriptor 2 is caught meanwhile.

    Raises:
        RobotError: Pinocchio refuses the text.
    """
    with tempfile.TemporaryFile() as caught:
        saved = os.dup(2)
        try:
            os.dup2(caught.fileno(), 2)
            model = pin.buildModelFromXML(text)
        except (ValueError, RuntimeError) as error:
            caught.seek(0)
            printed = " ".join(caught.read().decode(errors="replace").split())
            raise RobotError(f"{path}: Pinocchio refuses this URDF: {printed or error}") from error
        finally:
            os.dup2(saved, 2)
            os.close(saved)
    return model


def reduced_model(
    model: pin.Model, free: Sequence[str], locked: Mapping[str, float], tool: str
) -> pin.Model:
    """Lock every joint of a model but the free ones.

    Args:
        model: a full model; joints named like a link are given another name in it.
        free: names of the joints to keep, base to tip.
        locked: value of every other joint, rad or m.
        tool: the link that the free joints carry.

    Raises:
        RobotError: what is left is not just the free joints and the tool.
    """
    called = _rename_clashing_joints(model)
    expected = [called.get(joint, joint) for joint in free]
    reference = pin.neutral(model)
    for joint, value in locked.items():
        title = called.get(joint, joint)
        if not model.existJointName(title):  # getJointId would return the number of joints
            raise RobotError(f"Pinocchio reads no joint {joint!r} in robot {model.name!r}")
        entry = model.joints[model.getJointId(title)]
        if entry.nq == 2:  # continuous
            reference[entry.idx_q : entry.idx_q + 2] = math.cos(value), math.sin(value)
        else:
            reference[entry.idx_q] = value
    drop = [i for i in range(1, model.njoints) if model.names[i] not in expected]
    reduced = pin.buildReducedModel(model, drop, reference)
    if list(reduced.names)[1:] != expected or not reduced.existFrame(tool, pin.FrameType.BODY):
        raise RobotError(
            f"Pinocchio reads the joints {', '.join(list(reduced.names)[1:])} in robot "
            f"{model.name!r} where {', '.join(expected)} lead to {tool!r}"
        )
    return reduced


def _rename_clashing_joints(model: pin.Model) -> dict[str, str]:
    """Give joints that are named like a link another name in `model`; return old -> new.

    A URDF may name both alike; Pinocchio parses it, and then cannot lock joints, because it asks
    for frames by name alone.
    """
    links = {frame.name for frame in model.frames if frame.type == pin.FrameType.BODY}
    taken = {frame.name for frame in model.frames}
    called: dict[str, str] = {}
    for frame in model.frames:
        if frame.type in (pin.FrameType.JOINT, pin.FrameType.FIXED_JOINT) and frame.name in links:
            new = frame.name + "/joint"
            while new in taken:
                new += "/joint"
            taken.add(new)
            called[frame.name] = frame.name = new
    for i in range(1, model.njoints):
        model.names[i] = called.get(model.names[i], model.names[i])
    return called
