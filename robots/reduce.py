"""From a checked URDF to a `Robot`: which joints are free, which are locked, and at what value."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from robots.robot import Robot, RobotError

if TYPE_CHECKING:
    import pinocchio as pin

    from robots.urdf import CheckedUrdf, JointInfo

ONE_DOF = ("revolute", "continuous", "prismatic")


def robot_from_urdf(
    checked: CheckedUrdf,
    *,
    name: str,
    tool_frame: str | None = None,
    approach_axis: ArrayLike = (0.0, 0.0, 1.0),
    lock: Mapping[str, float] | None = None,
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

    Raises:
        RobotError: the tool frame or a locked joint does not exist, a locked value is outside its
            limits, or the path holds a joint that is no free one-dof joint.
    """
    tool = _tool_frame(checked, name, tool_frame)
    fixed_values = {joint: float(value) for joint, value in (lock or {}).items()}
    _check_lock(checked, name, fixed_values)
    path = joints_between(checked, tool)
    free = [joint for joint in path if joint.kind != "fixed" and joint.name not in fixed_values]
    _check_free(name, tool, free)
    locked = _locked_values(checked, {joint.name for joint in free}, fixed_values)
    model = reduced_model(name, parse(checked.text, str(checked.path)), locked, free, tool)
    turning = [joint.kind == "continuous" for joint in free]
    return Robot(
        name=name,
        model=model,
        tool_frame=tool,
        approach_axis=np.asarray(approach_axis, dtype=float),
        joint_names=tuple(joint.name for joint in free),
        joint_kinds=tuple(joint.kind for joint in free),
        lower=np.where(turning, -np.inf, [_or(joint.lower, -math.inf) for joint in free]),
        upper=np.where(turning, np.inf, [_or(joint.upper, math.inf) for joint in free]),
        urdf=str(checked.path),
        package_dirs=tuple(str(folder) for folder in checked.package_dirs),
        locked=locked,
    )


def joints_between(checked: CheckedUrdf, link: str) -> list[JointInfo]:
    """Joints from the root link to `link`, root first, fixed ones included."""
    above = {joint.child: joint for joint in checked.joints}
    path: list[JointInfo] = []
    while link in above:
        path.append(above[link])
        link = above[link].parent
    return path[::-1]


def _or(value: float | None, default: float) -> float:
    return default if value is None else value


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


def suggestion(asked: str, known: Sequence[str], limit: int = 40) -> str:
    """Names that come close to `asked`, or the known ones if none does."""
    import difflib

    close = difflib.get_close_matches(asked, known, n=5, cutoff=0.5)
    if close:
        return f"did you mean {' or '.join(repr(match) for match in close)}?"
    shown = ", ".join(list(known)[:limit])
    return f"it has: {shown}" + (", ..." if len(known) > limit else "")


def _check_lock(checked: CheckedUrdf, name: str, lock: Mapping[str, float]) -> None:
    """Refuse locked joints that do not exist, do not move, or stand outside their limits."""
    moving = {joint.name: joint for joint in checked.joints if joint.kind in ONE_DOF}
    faults = []
    for joint_name, value in lock.items():
        joint = moving.get(joint_name)
        if joint is None:
            hint = suggestion(joint_name, list(moving))
            faults.append(f"lock names {joint_name!r}, which is no moving joint; {hint}")
            continue
        unit = "m" if joint.kind == "prismatic" else "rad"
        low, high = _range(joint)
        if not (math.isfinite(value) and low <= value <= high):
            faults.append(
                f"lock holds joint {joint_name!r} at {value:g} {unit}, outside its limits "
                f"{low:g} .. {high:g} {unit}"
            )
    if faults:
        raise RobotError(f"robot {name!r}: " + "; ".join(faults))


def _range(joint: JointInfo) -> tuple[float, float]:
    """Limits of a joint; a continuous one turns freely whatever its <limit> says."""
    if joint.kind == "continuous":
        return -math.inf, math.inf
    return _or(joint.lower, -math.inf), _or(joint.upper, math.inf)


def _check_free(name: str, tool: str, free: Sequence[JointInfo]) -> None:
    """Refuse a path without free joints, or with joints that the chain cannot hold."""
    if not free:
        raise RobotError(
            f"robot {name!r}: no free joint lies between the root link and {tool!r}; "
            "choose a tool_frame further out, or lock fewer joints"
        )
    faults = []
    for joint in free:
        if joint.kind not in ONE_DOF:
            faults.append(
                f"joint {joint.name!r} on the way to {tool!r} is {joint.kind}; only "
                f"{', '.join(ONE_DOF)} and fixed joints can carry the tool"
            )
        elif joint.mimic:
            faults.append(
                f"joint {joint.name!r} on the way to {tool!r} mimics another joint; "
                f"hold it with lock = {{ {joint.name} = ... }}, or choose another tool_frame"
            )
    if faults:
        raise RobotError(f"robot {name!r}: " + "; ".join(faults))


def _locked_values(
    checked: CheckedUrdf, free: set[str], lock: Mapping[str, float]
) -> dict[str, float]:
    """Where every one-dof joint that is not free is held, rad or m."""
    held: dict[str, float] = {}
    for joint in checked.joints:
        if joint.kind in ONE_DOF and joint.name not in free:
            low, high = _range(joint)
            held[joint.name] = lock.get(joint.name, min(max(0.0, low), high))
    return held


def parse(text: str, path: str) -> pin.Model:
    """Parse checked URDF text with Pinocchio.

    Pinocchio prints what is wrong on the C stderr and raises only "not a valid URDF", so file
    descriptor 2 is caught meanwhile.

    Raises:
        RobotError: Pinocchio refuses the text.
    """
    import pinocchio as pin

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
    name: str,
    model: pin.Model,
    locked: Mapping[str, float],
    free: Sequence[JointInfo],
    tool: str,
) -> pin.Model:
    """Lock every joint of `model` but the free ones, and make sure that just those are left."""
    import pinocchio as pin

    names = tuple(joint.name for joint in free)
    reference = pin.neutral(model)
    for joint, value in locked.items():
        if not model.existJointName(joint):
            raise RobotError(f"robot {name!r}: Pinocchio reads no joint {joint!r}")
        entry = model.joints[model.getJointId(joint)]
        if entry.nq == 2:  # continuous
            reference[entry.idx_q : entry.idx_q + 2] = math.cos(value), math.sin(value)
        else:
            reference[entry.idx_q] = value
    drop = [i for i in range(1, model.njoints) if model.names[i] not in names]
    reduced = pin.buildReducedModel(model, drop, reference)
    if tuple(reduced.names)[1:] != names or not reduced.existFrame(tool):
        raise RobotError(
            f"robot {name!r}: Pinocchio reads the joints {', '.join(list(reduced.names)[1:])} "
            f"where {', '.join(names)} lead to {tool!r}"
        )
    return reduced
