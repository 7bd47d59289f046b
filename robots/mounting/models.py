"""Changes of a Pinocchio model: its base, its tool centre point, and the link it is seen from.

A joint moves what lies beyond it against what lies before it. Seen from a link beyond it, it is the
link before it that moves, about the opposite axis, by the same value. So the joints from the
surface's link inwards are reversed and those outwards to the tool follow as they are; values,
limits and velocities keep their meaning. The world itself becomes a body of the new model.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from coverable_arrays import Array, Mask
from coverable_errors import Fault, close_matches
from robots.errors import RobotError

# Names of their frames in a model.
TCP_FRAME = "coverable tcp"
WORLD_FRAME = "coverable world"


def place_base(model: pin.Model, base: Array) -> None:
    """Put the root link of a model at the pose `base` (4, 4) in the world; changes the model."""
    place = pin.SE3(base)
    for joint in range(1, model.njoints):
        if model.parents[joint] == 0:
            model.jointPlacements[joint] = place * model.jointPlacements[joint]
    for number in range(1, model.nframes):  # frame 0 is the world
        if model.frames[number].parentJoint == 0:
            model.frames[number].placement = place * model.frames[number].placement


def place_tcp(model: pin.Model, tool: str, tcp: Array) -> None:
    """Add the tool centre point to a model, at the pose `tcp` (4, 4) in the link `tool`."""
    number = model.getFrameId(tool, pin.FrameType.BODY)
    link = model.frames[number]
    place = link.placement * pin.SE3(tcp)
    frame = pin.Frame(TCP_FRAME, link.parentJoint, number, place, pin.FrameType.OP_FRAME)
    model.addFrame(frame, False)  # without an inertia of its own


class SeenFrom(NamedTuple):
    """The chain from a link to the tool."""

    model: pin.Model
    order: tuple[int, ...]
    """Which of the old joints, counted from 0, each joint is."""
    held: tuple[int, ...]
    """The others."""


def seen_from(model: pin.Model, link: str, tool: int, rest: Array) -> SeenFrom:
    """The chain from a link to the tool frame; the other joints are held.

    Args:
        model: of n joints.
        link: whose frame becomes the root frame.
        tool: index of the tool frame.
        rest: (n,) rad or m, where joints that lie elsewhere are held.

    Raises:
        RobotError: there is no such link, or no joint lies between it and the tool.
    """
    body = pin.FrameType.BODY
    if not model.existFrame(link, body):
        links = [frame.name for frame in model.frames if frame.type == body]
        near = close_matches(link, links, most=3) or links[:20]
        what = f"there is no link {link!r}; did you mean {' or '.join(map(repr, near))}?"
        raise RobotError([Fault("surface_link", what)])
    inwards, outwards = _joints_between(model, model.getFrameId(link, body), tool)
    order = tuple(int(model.joints[joint].idx_v) for joint in (*inwards, *outwards))
    if not order:
        what = (
            f"link {link!r} cannot carry the surface: no free joint lies between it and the tool; "
            f"load_robot(..., surface_link={link!r}) frees those that are held"
        )
        raise RobotError([Fault("surface_link", what)])
    held = tuple(number for number in range(model.nv) if number not in order)
    frame = model.frames[tool]
    chain = _locked(model, held, rest)
    ends = chain.getFrameId(link, body), chain.getFrameId(frame.name, frame.type)
    return SeenFrom(rerooted(chain, *ends), order, held)


def _locked(model: pin.Model, held: Sequence[int], rest: Array) -> pin.Model:
    """The model with some of its joints, counted from 0, held."""
    if not held:
        return model
    q = pin.integrate(model, pin.neutral(model), rest)
    numbers = {model.joints[joint].idx_v: joint for joint in range(1, model.njoints)}
    return pin.buildReducedModel(model, [numbers[number] for number in held], q)


def _joints_between(model: pin.Model, frame: int, tool: int) -> tuple[list[int], list[int]]:
    """The joints between two frames, as numbers of a model.

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
    kind = pin.FrameType.OP_FRAME
    return int(model.getFrameId(WORLD_FRAME, kind)) if model.existFrame(WORLD_FRAME, kind) else 0


def rerooted(model: pin.Model, frame: int, tool: int) -> pin.Model:
    """The chain from one frame of a model to another, as a model of its own.

    Joints of one degree of freedom between `frame` and `tool` are kept; all others have to
    be locked before. Continuous joints become revolute ones, so that their value is a real number.

    Args:
        model: a tree of joints.
        frame: index of the frame that becomes the root frame.
        tool: index of the frame that the chain ends at.

    Returns:
        A chain whose root frame is `frame`, its joints in the order of `_joints_between`, with all
        frames of links, and of TCP and world, where they were.
    """
    inwards, outwards = _joints_between(model, frame, tool)
    slides, axes = joint_axes(model)
    made = pin.Model()
    made.name = model.name

    def add(joint: int, axis: Array, placement: pin.SE3) -> int:
        slide, turn = pin.JointModelPrismaticUnaligned, pin.JointModelRevoluteUnaligned
        kind = slide if slides[joint - 1] else turn
        number = int(made.addJoint(made.njoints - 1, kind(axis), placement, model.names[joint]))
        made.addJointFrame(number)  # Pinocchio asks for it when the joint is to be locked
        return number

    start = int(model.frames[frame].parentJoint)
    offset = model.frames[frame].placement.inverse()
    seats = {start: (0, offset)}  # old joint -> the new joint that carries it, and where it is
    for joint in inwards:
        number = add(joint, -axes[joint - 1], offset)
        offset = model.jointPlacements[joint].inverse()
        seats[int(model.parents[joint])] = (number, offset)
    for joint in outwards:
        offset = offset * model.jointPlacements[joint]
        number = add(joint, axes[joint - 1], offset)
        offset = pin.SE3.Identity()
        seats[joint] = (number, offset)
    _carry_frames(model, made, seats)
    return made


def joint_axes(model: pin.Model) -> tuple[Mask, Array]:
    """Which of the n joints slide, and (n, 3) their unit axes, each in the joint's own frame."""
    n, data = model.nv, model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    slides, axes = np.empty(n, dtype=bool), np.empty((n, 3))
    for i in range(n):
        # The joint's motion subspace: (linear, angular); Pinocchio flattens a single column.
        jacobian = pin.getJointJacobian(model, data, i + 1, pin.ReferenceFrame.LOCAL)
        subspace = jacobian.reshape(6, n)[:, model.joints[i + 1].idx_v]
        slides[i] = np.linalg.norm(subspace[3:]) < 0.5
        axes[i] = subspace[:3] if slides[i] else subspace[3:]
    return slides, axes


def _carry_frames(model: pin.Model, made: pin.Model, seats: dict[int, tuple[int, pin.SE3]]) -> None:
    """Put all frames of links, and of TCP and world, where they were."""
    kept = (pin.FrameType.BODY, pin.FrameType.OP_FRAME)
    frames = [frame for frame in model.frames if frame.type in kept]
    if world_frame(model) == 0:
        frames.append(pin.Frame(WORLD_FRAME, 0, 0, pin.SE3.Identity(), pin.FrameType.OP_FRAME))
    for frame in frames:
        joint, offset = seats[int(frame.parentJoint)]
        placement = offset * frame.placement
        made.addFrame(pin.Frame(frame.name, joint, 0, placement, frame.type), False)
