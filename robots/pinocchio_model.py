"""A Pinocchio model straight from the checked joints of a URDF.

The tree is walked from the link that becomes the root frame. A joint moves what lies beyond it
against what lies before it; passed the other way it is the link before it that moves, about the
opposite axis, by the same value, so that limits and velocities keep their meaning. Joints that are
held are fixed placements, and a continuous joint is a revolute one whose value is a real number.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from coverable.arrays import Array, Mask

if TYPE_CHECKING:
    from robots.urdf.checked_urdf import CheckedUrdf
    from robots.urdf.joints import JointInfo

# Names of their frames in a model.
TCP_FRAME = "coverable tcp"
WORLD_FRAME = "coverable world"


def chain_model(
    tree: CheckedUrdf,
    free: Sequence[str],
    held: Mapping[str, float],
    seen_from: str | None = None,
    base: Array | None = None,
    tcp: tuple[str, Array] | None = None,
) -> pin.Model:
    """The free joints of a tree as a model of their own, with the frames of all links.

    Joints get their numbers in the order in which they are met, depth first; those of a chain are
    numbered from the root frame to the tool.

    Args:
        tree: a URDF that has passed the check, at most a few thousand links.
        free: names of the joints that are kept; all of them move.
        held: value of every other moving joint, rad or m; 0 where it is not named.
        seen_from: the link whose frame becomes the root frame; None for the world.
        base: (4, 4) m, the root link in the world; None where they are the same.
        tcp: a link and (4, 4) m, the tool centre point in it; None where they are the same.
    """
    model = pin.Model()
    model.name = tree.name
    place = pin.SE3.Identity() if base is None else pin.SE3(base)
    # Of each link: the joint of the new model that carries it, and its placement there.
    seats = {tree.root: (0, place)} if seen_from is None else {seen_from: (0, pin.SE3.Identity())}
    beside: dict[str, list[JointInfo]] = {link: [] for link in tree.links}
    for joint in tree.joints:
        for link in (joint.parent, joint.child):
            beside[link].append(joint)
    pending = list(seats)
    while pending:
        link = pending.pop()
        for joint in beside[link]:
            outwards = joint.parent == link
            other = joint.child if outwards else joint.parent
            if other not in seats:
                seats[other] = _passed(model, joint, outwards, seats[link], free, held)
                pending.append(other)
    frames = [(link, *seats[link], pin.FrameType.BODY) for link in tree.links]
    point = pin.FrameType.OP_FRAME
    if tcp is not None:
        carrier, offset = seats[tcp[0]]
        frames.append((TCP_FRAME, carrier, offset * pin.SE3(tcp[1]), point))
    if seen_from is not None:
        carrier, offset = seats[tree.root]
        frames.append((WORLD_FRAME, carrier, offset * place.inverse(), point))
    for title, carrier, offset, kind in frames:
        model.addFrame(pin.Frame(title, carrier, 0, offset, kind), False)  # without an inertia
    return model


def _passed(
    model: pin.Model,
    joint: JointInfo,
    outwards: bool,
    seat: tuple[int, pin.SE3],
    free: Sequence[str],
    held: Mapping[str, float],
) -> tuple[int, pin.SE3]:
    """The seat of the link on the other side of a joint; a free joint is added to the model."""
    (carrier, offset), slides = seat, joint.kind == "prismatic"
    origin = pin.SE3(_turned(*joint.rpy), np.array(joint.xyz))
    axis = np.array(joint.axis) if outwards else -np.array(joint.axis)
    if joint.name in free:
        kind = pin.JointModelPrismaticUnaligned if slides else pin.JointModelRevoluteUnaligned
        placement = offset * origin if outwards else offset
        number = int(model.addJoint(carrier, kind(axis), placement, joint.name))
        return number, pin.SE3.Identity() if outwards else origin.inverse()
    motion, value = pin.SE3.Identity(), held.get(joint.name, 0.0)
    if slides:
        motion.translation = value * axis
    elif value:
        motion.rotation = pin.AngleAxis(value, axis).matrix()
    return carrier, offset * (origin * motion if outwards else motion * origin.inverse())


def _turned(roll: float, pitch: float, yaw: float) -> Array:
    """(3, 3) the rotation of a joint's origin, to the last bit as Pinocchio's own reader has it.

    By the quaternion of urdfdom, in its order: where a search finds no motion and no proof, what it
    finds instead depends on the last bit.
    """
    a, b, c, u, v, w = (f(0.5 * turn) for f in (cos, sin) for turn in (roll, pitch, yaw))
    x, y, z = u * b * c - a * v * w, a * v * c + u * b * w, a * b * w - u * v * c
    real = a * b * c + u * v * w
    length = sqrt(x * x + y * y + z * z + real * real)
    turned = pin.Quaternion(*(part / length for part in (real, x, y, z)))
    return np.asarray(turned.matrix())


def world_frame(model: pin.Model) -> int:
    """Index of the frame that is the world."""
    kind = pin.FrameType.OP_FRAME
    return int(model.getFrameId(WORLD_FRAME, kind)) if model.existFrame(WORLD_FRAME, kind) else 0


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
