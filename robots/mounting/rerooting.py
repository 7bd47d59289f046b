"""The chain between two links: the one that carries the surface, and the one that carries the tool.

A joint moves what lies beyond it against what lies before it. Seen from a link beyond it, it is the
link before it that moves, about the opposite axis, by the same value. So the joints from the
surface's link inwards are turned round and those outwards to the tool follow as they are; values,
limits and velocities keep their meaning. The world itself becomes a body of the new model.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import pinocchio as pin

WORLD = "coverable world"  # name of its frame in a model


def joints_between(model: pin.Model, frame: int, tool: int) -> tuple[list[int], list[int]]:
    """The joints on the way from one frame to another, as numbers of a model.

    Args:
        model: a tree of joints.
        frame: index of the frame to start from.
        tool: index of the frame to end at.

    Returns:
        Those that lead inwards from `frame`, outermost first, and those that lead outwards to
        `tool`, innermost first; joints that move both are in neither.
    """
    inwards = _to_root(model, int(model.frames[frame].parentJoint))
    outwards = _to_root(model, int(model.frames[tool].parentJoint))
    common = set(inwards) & set(outwards)
    return (
        [joint for joint in inwards if joint not in common],
        [joint for joint in reversed(outwards) if joint not in common],
    )


def _to_root(model: pin.Model, joint: int) -> list[int]:
    """A joint and those that carry it, up to the root, which is left out."""
    found = []
    while joint:
        found.append(joint)
        joint = int(model.parents[joint])
    return found


def world_frame(model: pin.Model) -> int:
    """Index of the frame that is the world."""
    import pinocchio as pin

    kind = pin.FrameType.OP_FRAME
    return int(model.getFrameId(WORLD, kind)) if model.existFrame(WORLD, kind) else 0


def rerooted(model: pin.Model, frame: int, tool: int) -> pin.Model:
    """The chain from one frame of a model to another, as a model of its own.

    Joints of one degree of freedom on the way from `frame` to `tool` are kept; all others have to
    be locked before. Continuous joints become revolute ones, so that their value is a real number.

    Args:
        model: a tree of joints.
        frame: index of the frame that becomes the root frame.
        tool: index of the frame that the chain ends at.

    Returns:
        A chain whose root frame is `frame`, its joints in the order of `joints_between`, with all
        frames of links, and of TCP and world, where they were.
    """
    import pinocchio as pin

    inwards, outwards = joints_between(model, frame, tool)
    subspaces = _subspaces(model)
    made = pin.Model()
    made.name = model.name
    start = int(model.frames[frame].parentJoint)
    offset = model.frames[frame].placement.inverse()
    seats = {start: (0, offset)}  # old joint -> the new joint that carries it, and where it is
    for joint in inwards:
        number = _add(made, model.names[joint], subspaces[joint], offset, -1.0)
        offset = model.jointPlacements[joint].inverse()
        seats[int(model.parents[joint])] = (number, offset)
    for joint in outwards:
        offset = offset * model.jointPlacements[joint]
        number = _add(made, model.names[joint], subspaces[joint], offset, 1.0)
        offset = pin.SE3.Identity()
        seats[joint] = (number, offset)
    _carry_frames(model, made, seats)
    return made


def _subspaces(model: pin.Model) -> dict[int, np.ndarray]:
    """The motion subspace (6,) of every joint in its own frame: linear, angular."""
    import pinocchio as pin

    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    found = {}
    for joint in range(1, model.njoints):
        local = pin.getJointJacobian(model, data, joint, pin.ReferenceFrame.LOCAL)
        # Pinocchio flattens a single column.
        found[joint] = local.reshape(6, model.nv)[:, model.joints[joint].idx_v].copy()
    return found


def _add(made: pin.Model, name: str, subspace: np.ndarray, placement: pin.SE3, sign: float) -> int:
    """Add a joint to the end of the chain; return its number."""
    import pinocchio as pin

    linear, angular = subspace[:3], subspace[3:]
    slides = np.linalg.norm(angular) < 0.5
    kind = pin.JointModelPrismaticUnaligned if slides else pin.JointModelRevoluteUnaligned
    axis = sign * (linear if slides else angular)
    number = int(made.addJoint(made.njoints - 1, kind(axis), placement, name))
    made.addJointFrame(number)  # Pinocchio asks for it when the joint is to be locked
    return number


def _carry_frames(model: pin.Model, made: pin.Model, seats: dict[int, tuple[int, pin.SE3]]) -> None:
    """Put all frames of links, and of TCP and world, where they were."""
    import pinocchio as pin

    kept = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
    frames = [frame for frame in model.frames if frame.type in kept]
    if world_frame(model) == 0:
        frames.append(pin.Frame(WORLD, 0, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    for frame in frames:
        joint, offset = seats[int(frame.parentJoint)]
        placement = offset * frame.placement
        made.addFrame(pin.Frame(frame.name, joint, 0, placement, frame.type), False)
