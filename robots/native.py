"""Pinocchio's side of loading a robot: parse a checked text, lock joints."""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Mapping, Sequence

import pinocchio as pin

from robots.robot import RobotError


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
