"""From a checked URDF to a `Robot`: parsed by Pinocchio, and reduced to its free joints."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from coverable_errors import Fault
from robots.arguments import AS_IN_URDF, Mounting
from robots.errors import RobotError
from robots.joint_checks import no_limit_set
from robots.joint_selection import MOST_GUESSES, Selection, select_joints, suggestion
from robots.mounting import place_base, place_tcp, rerooted
from robots.robot import Robot

if TYPE_CHECKING:
    from robots.urdf import CheckedUrdf

RESERVED = "universe"  # what Pinocchio calls the world's frame


def robot_from_urdf(
    checked: CheckedUrdf,
    *,
    name: str,
    tool_frame: str | None = None,
    approach_axis: ArrayLike = (0.0, 0.0, 1.0),
    lock: Mapping[str, float] | None = None,
    limits: str | Mapping[str, ArrayLike] | ArrayLike | None = None,
    limit_sets: Mapping[str, Mapping[str, tuple[float, float]]] | None = None,
    reference_axis: ArrayLike | None = None,
    mounting: Mounting = AS_IN_URDF,
) -> Robot:
    """Reduce a URDF to the chain from its root link to the tool frame.

    Free are the joints on the chain from the root link to the tool frame, unless `lock` names them.
    Where another link carries the surface, the chain begins there.
    Every other moving joint is held: at the value `lock` gives, or at zero clipped to its limits
    (a mimic joint where the joint it follows puts it, if that one is held too). A joint whose own
    limits are missing or make no sense needs `limits`.

    Args:
        checked: a URDF that has passed the check.
        name: what the robot is called in messages.
        tool_frame, approach_axis, lock, limits, reference_axis: as in `load_robot`.
        limit_sets: name -> joint name -> (lower, upper), rad or m. A set that lacks a free joint
            is left out.
        mounting: of tool, arm and surface.

    Raises:
        RobotError: the tool frame or a locked joint does not exist, a locked value is outside its
            limits, or a joint on the chain has a fault and is neither locked nor given limits.
    """
    if RESERVED in checked.links:
        fault = f"link {RESERVED!r}: the name {RESERVED!r} is Pinocchio's for the world; rename it"
        raise RobotError(fault, checked.path)
    chosen = select_joints(checked, tool_frame, lock or {}, limits, mounting.surface_link)
    faults = list(chosen.faults)
    sets = limit_sets or {}
    if not chosen.is_chain:
        faults += _limit_faults(checked, limits, sets)
        raise RobotError(faults, f"robot {name!r}")
    axes = (approach_axis, np.full(3, np.nan) if reference_axis is None else reference_axis)
    robot = _of_selection(checked, chosen, name, axes, sets, mounting)
    try:
        robot = robot if limits is None else robot.with_limits(limits)
    except RobotError as error:
        faults += error.faults
    if faults:
        raise RobotError(faults, f"robot {name!r}")
    return robot


def _of_selection(
    checked: CheckedUrdf,
    chosen: Selection,
    name: str,
    axes: tuple[ArrayLike, ArrayLike],
    limit_sets: Mapping[str, Mapping[str, tuple[float, float]]],
    mounting: Mounting,
) -> Robot:
    """The robot with its own limits; arguments as above, `axes` are approach and reference."""
    free_names = [joint.name for joint in chosen.free]
    composed = {joint.name: joint.limits for joint in chosen.free} if mounting.axes else {}
    own = {axis.name: composed[axis.name] for axis in mounting.axes if axis.name in composed}
    return Robot(
        name=name,
        model=_chain_model(checked, chosen, mounting),
        tool_frame=chosen.tool_frame,
        approach_axis=np.asarray(axes[0]),
        reference_axis=np.asarray(axes[1]),
        joint_names=tuple(free_names),
        joint_kinds=tuple(joint.kind for joint in chosen.free),
        # Not from Pinocchio's model, which loses the limits of continuous joints.
        lower=np.array([joint.limits[0] for joint in chosen.free]),
        upper=np.array([joint.limits[1] for joint in chosen.free]),
        max_velocity=np.array([joint.max_velocity or math.nan for joint in chosen.free]),
        limit_sets={
            title: np.array([{**own, **rows}[joint] for joint in free_names])
            for title, rows in limit_sets.items()
            if all(joint in rows or joint in own for joint in free_names)
        },
        urdf=os.path.abspath(checked.path),
        package_dirs=checked.package_dirs,
        locked=chosen.locked,
        notes=(*checked.warnings, *chosen.notes),
        root_link=checked.mounted,
        axes=mounting.axes,
        surface_link=mounting.surface_link,
    )


def _chain_model(checked: CheckedUrdf, chosen: Selection, mounting: Mounting) -> pin.Model:
    """The model of the free joints, from the surface's link or the world to the TCP."""
    names = [joint.name for joint in chosen.free]
    in_a_row = mounting.surface_link is None
    full = parse(checked.text, checked.path)
    model = reduced_model(full, names, chosen.locked, chosen.tool_frame, in_a_row)
    if mounting.base is not None and not mounting.axes:  # else it is in the text
        place_base(model, mounting.base)
    if mounting.tcp is not None:
        place_tcp(model, chosen.tool_frame, mounting.tcp)
    if in_a_row:
        return model
    body = pin.FrameType.BODY
    ends = (model.getFrameId(link, body) for link in (mounting.surface_link, chosen.tool_frame))
    return rerooted(model, *ends)


def _limit_faults(
    checked: CheckedUrdf,
    limits: str | Mapping[str, ArrayLike] | ArrayLike | None,
    limit_sets: Mapping[str, Mapping[str, tuple[float, float]]],
) -> list[Fault]:
    """What is wrong with limits whatever the tool frame is."""
    if isinstance(limits, str) and limits not in limit_sets:
        return [Fault("", no_limit_set(limits, limit_sets))]
    moving = [joint.name for joint in checked.joints if joint.moves]
    named = limits if isinstance(limits, Mapping) else {}
    unknown = [joint for joint in named if joint not in moving]
    hints = [f"; {suggestion(joint, moving)}" for joint in unknown[:MOST_GUESSES]]
    return [
        Fault("", f"limits name {joint!r}, which is no moving joint{hint}")
        for joint, hint in zip_longest(unknown, hints, fillvalue="")
    ]


def parse(text: str, path: str) -> pin.Model:
    """Parse checked URDF text with Pinocchio.

    Pinocchio prints what is wrong on the C stderr and raises only "not a valid URDF", so file
    descriptor 2 is caught meanwhile.

    Raises:
        RobotError: Pinocchio refuses the text.
    """
    with tempfile.TemporaryFile() as caught:
        saved = _duplicate(2)
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


def _duplicate(descriptor: int) -> int:
    """Another descriptor of the same file; of nowhere where there is none."""
    try:
        return os.dup(descriptor)
    except OSError:  # the process was started without it
        return os.open(os.devnull, os.O_WRONLY)


def reduced_model(
    model: pin.Model,
    free: Sequence[str],
    locked: Mapping[str, float],
    tool: str,
    in_a_row: bool = True,
) -> pin.Model:
    """Lock every joint of a model but the free ones.

    Args:
        model: a full model; joints named like a link are given another name in it.
        free: names of the joints to keep, base to tip.
        locked: value of every other joint, rad or m.
        tool: the link that the free joints carry.
        in_a_row: whether the free joints form one chain from the root; else their order is free.

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
    found = list(reduced.names)[1:]
    same = found == expected if in_a_row else sorted(found) == sorted(expected)
    if not same or not reduced.existFrame(tool, pin.FrameType.BODY):
        raise RobotError(
            f"Pinocchio reads the joints {', '.join(found)} in robot "
            f"{model.name!r} where {', '.join(expected)} lead to {tool!r}"
        )
    return reduced


def _rename_clashing_joints(model: pin.Model) -> dict[str, str]:
    """Give joints that are named like a link another name in `model`; return old -> new.

    A URDF may name both alike; Pinocchio parses it, and then cannot lock joints, because it looks
    up frames by name alone.
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
