"""From a checked URDF to a `Robot`: which of its joints are free, and with what limits."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from coverable.errors import Fault
from robots.arguments import AS_IN_URDF, Mounting
from robots.errors import RobotError
from robots.joint_selection import MOST_GUESSES, Selection, no_limit_set, select_joints, suggestion
from robots.pinocchio_model import chain_model
from robots.robot import Robot

if TYPE_CHECKING:
    from robots.urdf.checked_urdf import CheckedUrdf


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
    chosen = select_joints(checked, tool_frame, lock or {}, limits, mounting.surface_link)
    faults = list(chosen.faults)
    sets = limit_sets or {}
    if chosen.is_chain:
        axes = (approach_axis, np.full(3, np.nan) if reference_axis is None else reference_axis)
        robot = _of_selection(checked, chosen, name, axes, sets, mounting)
        try:
            robot = robot if limits is None else robot.with_limits(limits)
        except RobotError as error:
            faults += error.faults
        if not faults:
            return robot
    else:
        faults += _limit_faults(checked, limits, sets)
    refused = RobotError(faults, f"robot {name!r}")
    refused.joint_kinds = {joint.name: joint.kind for joint in checked.joints if joint.moves}
    raise refused


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
        model=chain_model(
            checked,
            free_names,
            chosen.locked,
            mounting.surface_link,
            None if mounting.axes else mounting.base,  # with axes it is among the joints
            None if mounting.tcp is None else (chosen.tool_frame, mounting.tcp),
        ),
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
