"""The compiled chain: forward kinematics and Jacobian for the search loops.

Every constant is read from the `pin.Model`, so there is one source of truth; Pinocchio's frame
placements remain the authority (`robots.kinematics`), and the two are compared once for each robot
(`Robot.chain`).

Each joint i turns or slides about the z axis of its own frame:

    T(q) = C_0 M_0(q_0) C_1 M_1(q_1) ... C_{n-1} M_{n-1}(q_{n-1}) C_tool

with C_i constant, M_i(q) = Rot(z, q) or Trans(z, q). Pinocchio lets an axis point anywhere; the
rotation that brings it onto z is folded into the constants once, so that the loop below needs only
one sine, one cosine and one matrix product per joint.

The compiled chain's kinematics at many configurations at once, without a compiler.

The same steps as `frames` and `jacobians` in `robots.chain`, on arrays over the configurations:
for tens of thousands of them six times faster than Pinocchio one by one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin

from coverable.arrays import Array, Mask
from coverable.kernels import allocating_entry
from robots.errors import RobotError
from robots.pinocchio_model import joint_axes

AGREEMENT = 1e-9  # [m], [1]: largest difference from Pinocchio that is accepted
SAMPLES = 20  # configurations at which the two are compared


class Chain(NamedTuple):
    """Constants of a serial chain of n one-dof joints; a plain tuple of arrays for numba."""

    rotations: Array
    """(n, 3, 3) joint frame in the previous joint's frame, before the joint moves."""
    translations: Array
    """(n + 1, 3) origins of the same, m; last the tool point in the last joint's frame."""
    prismatic: Mask
    """(n,) True where a joint slides along z, False where it turns about it."""
    approach: Array
    """(3,) the approach axis in the last joint's frame."""
    reference: Array
    """(3,) the reference axis of roll in the last joint's frame."""


def checked_chain(
    name: str,
    model: pin.Model,
    tool_frame: int,
    approach_axis: Array,
    reference_axis: Array,
    lower: Array,
    upper: Array,
) -> Chain:
    """Read the constants of a chain, and compare it with Pinocchio at random configurations.

    Args:
        name: what the robot is called in messages.
        model: the n free joints.
        tool_frame: index of the TCP's frame in the model.
        approach_axis, reference_axis: (3,) in that frame.
        lower, upper: (n,) rad or m.

    Raises:
        RobotError: a joint has more than one degree of freedom, the joints do not form one chain
            that ends at the tool frame, or the two differ by more than `AGREEMENT`.
    """
    n, frame = len(lower), model.frames[tool_frame]
    if model.nv != n or list(model.parents)[1:] != list(range(n)) or frame.parentJoint != n:
        raise RobotError(
            f"robot {name!r}: its {model.nv} free joints do not form one serial chain of "
            f"one-dof joints that ends at {frame.name!r}; lock the joints not on that chain"
        )
    chain = _constants(model, tool_frame, approach_axis, reference_axis)
    data = model.createData()
    rng = np.random.default_rng(0)
    low = np.where(np.isfinite(lower), lower, -np.pi)
    high = np.where(np.isfinite(upper), upper, np.pi)
    for _ in range(SAMPLES):
        q = low + (high - low) * rng.random(n)
        point, axis = tool(chain, q)
        pin.forwardKinematics(model, data, q)
        expected = pin.updateFramePlacement(model, data, tool_frame)
        error = max(
            np.abs(point - expected.translation).max(),
            np.abs(axis - expected.rotation @ approach_axis).max(),
        )
        if not error <= AGREEMENT:
            raise RobotError(
                f"robot {name!r}: the compiled chain and Pinocchio differ by {error:.2g} "
                f"at q = {q.tolist()}; this is a defect of coverable, please report it"
            )
    return chain


def _constants(
    model: pin.Model,
    tool_frame: int,
    approach_axis: Array,
    reference_axis: Array,
) -> Chain:
    """Every joint's frame in that of the joint before it, turned so that its axis is z."""
    n, frame = model.nv, model.frames[tool_frame]
    rotations, translations = np.empty((n, 3, 3)), np.empty((n + 1, 3))
    prismatic, alignments = _turns_onto_z(model)
    align = np.eye(3)  # brings z onto the axis of the previous joint
    for i in range(n):
        placement = model.jointPlacements[i + 1]
        rotations[i] = align.T @ placement.rotation @ alignments[i]
        translations[i] = align.T @ placement.translation
        align = alignments[i]
    translations[n] = align.T @ frame.placement.translation
    approach = align.T @ frame.placement.rotation @ approach_axis
    reference = align.T @ frame.placement.rotation @ reference_axis
    return Chain(rotations, translations, prismatic, approach, reference)


def joint_alignments(model: pin.Model) -> Array:
    """(n, 3, 3) the frames of `Chain` in those of Pinocchio's joints: the same origins, z the axis.

    A point p in Pinocchio's frame of joint i, counted from 1, is alignments[i - 1].T @ p in that
    of the chain.
    """
    return _turns_onto_z(model)[1]


def _turns_onto_z(model: pin.Model) -> tuple[Mask, Array]:
    """Which joints slide, and the rotation that brings z onto each joint's axis."""
    slides, axes = joint_axes(model)
    return slides, np.array([_rotation_onto(axis) for axis in axes])


def _rotation_onto(axis: Array) -> Array:
    """A rotation whose z column is `axis`; the identity when the axis is z already."""
    z = axis / np.linalg.norm(axis)
    if z[2] == 1.0 and z[0] == z[1] == 0.0:
        return np.eye(3)
    helper = np.eye(3)[np.argmin(np.abs(z))]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


@allocating_entry
def frames(chain, q, origins, axes, point, axis, reference):  # noqa: ANN001, ANN201
    """Tool point, approach and reference axis, and every joint's axis, in the root frame.

    Args:
        chain: a `Chain`.
        q: (n,) configuration.
        origins: (n, 3) out, a point on each joint axis, m.
        axes: (n, 3) out, unit joint axes.
        point: (3,) out, the tool point, m.
        axis: (3,) out, the unit approach axis.
        reference: (3,) out, the unit reference axis of roll.
    """
    n = q.shape[0]
    xx, xy, xz = 1.0, 0.0, 0.0  # columns of the rotation so far
    yx, yy, yz = 0.0, 1.0, 0.0
    zx, zy, zz = 0.0, 0.0, 1.0
    px, py, pz = 0.0, 0.0, 0.0
    for i in range(n):
        t = chain.translations[i]
        px += xx * t[0] + yx * t[1] + zx * t[2]
        py += xy * t[0] + yy * t[1] + zy * t[2]
        pz += xz * t[0] + yz * t[1] + zz * t[2]
        r = chain.rotations[i]
        ax = xx * r[0, 0] + yx * r[1, 0] + zx * r[2, 0]
        ay = xy * r[0, 0] + yy * r[1, 0] + zy * r[2, 0]
        az = xz * r[0, 0] + yz * r[1, 0] + zz * r[2, 0]
        bx = xx * r[0, 1] + yx * r[1, 1] + zx * r[2, 1]
        by = xy * r[0, 1] + yy * r[1, 1] + zy * r[2, 1]
        bz = xz * r[0, 1] + yz * r[1, 1] + zz * r[2, 1]
        # The third column of a rotation is the cross product of the first two.
        zx = ay * bz - az * by
        zy = az * bx - ax * bz
        zz = ax * by - ay * bx
        origins[i, 0], origins[i, 1], origins[i, 2] = px, py, pz
        axes[i, 0], axes[i, 1], axes[i, 2] = zx, zy, zz
        if chain.prismatic[i]:
            xx, xy, xz = ax, ay, az
            yx, yy, yz = bx, by, bz
            px += zx * q[i]
            py += zy * q[i]
            pz += zz * q[i]
        else:
            c, s = np.cos(q[i]), np.sin(q[i])
            xx, xy, xz = c * ax + s * bx, c * ay + s * by, c * az + s * bz
            yx, yy, yz = c * bx - s * ax, c * by - s * ay, c * bz - s * az
    t = chain.translations[n]
    point[0] = px + xx * t[0] + yx * t[1] + zx * t[2]
    point[1] = py + xy * t[0] + yy * t[1] + zy * t[2]
    point[2] = pz + xz * t[0] + yz * t[1] + zz * t[2]
    t = chain.approach
    axis[0] = xx * t[0] + yx * t[1] + zx * t[2]
    axis[1] = xy * t[0] + yy * t[1] + zy * t[2]
    axis[2] = xz * t[0] + yz * t[1] + zz * t[2]
    t = chain.reference
    reference[0] = xx * t[0] + yx * t[1] + zx * t[2]
    reference[1] = xy * t[0] + yy * t[1] + zy * t[2]
    reference[2] = xz * t[0] + yz * t[1] + zz * t[2]


@allocating_entry
def jacobians(chain, origins, axes, point, axis, point_rows, axis_rows):  # noqa: ANN001, ANN201
    """Derivatives of tool point and approach axis by q, from what `frames` returned.

    Revolute joint: dp = z x (p - o), da = z x a. Prismatic joint: dp = z, da = 0.

    Args:
        chain, origins, axes, point, axis: as in `frames`.
        point_rows: (3, n) out, d point / dq.
        axis_rows: (3, n) out, d axis / dq.
    """
    for i in range(axes.shape[0]):
        zx, zy, zz = axes[i, 0], axes[i, 1], axes[i, 2]
        if chain.prismatic[i]:
            point_rows[0, i], point_rows[1, i], point_rows[2, i] = zx, zy, zz
            axis_rows[:, i] = 0.0
        else:
            rx = point[0] - origins[i, 0]
            ry = point[1] - origins[i, 1]
            rz = point[2] - origins[i, 2]
            point_rows[0, i] = zy * rz - zz * ry
            point_rows[1, i] = zz * rx - zx * rz
            point_rows[2, i] = zx * ry - zy * rx
            axis_rows[0, i] = zy * axis[2] - zz * axis[1]
            axis_rows[1, i] = zz * axis[0] - zx * axis[2]
            axis_rows[2, i] = zx * axis[1] - zy * axis[0]


def tool(chain: Chain, q: Array) -> tuple[Array, Array]:
    """Tool point (3,) m and approach axis (3,) at one configuration, by `frames`."""
    n = len(q)
    point, axis, at = np.empty(3), np.empty(3), np.ascontiguousarray(q, float)
    frames(chain, at, np.empty((n, 3)), np.empty((n, 3)), point, axis, np.empty(3))
    return point, axis


ROWS = 8192  # configurations at once: what the processor's caches hold


def moved_by_joints(chain: Chain, q: Array) -> Array:
    """(n, 3, m) derivatives of the tool point by each joint at configurations q (m, n), root frame.

    m for each radian, or 1 for each metre. The length of one is the joint's lever arm.

    Example:
        >>> from coverable import load_robot
        >>> arm = load_robot("puma560")
        >>> np.linalg.norm(moved_by_joints(arm.chain, np.zeros((4, 6))), axis=1)[0].round(6)
        array([0.806226, 0.806226, 0.806226, 0.806226])
    """
    found = np.empty((q.shape[1], 3, len(q)))
    for first in range(0, len(q), ROWS):
        some = slice(first, first + ROWS)
        found[:, :, some] = _moved(chain, np.ascontiguousarray(q[some].T))
    return found


def _moved(chain: Chain, q: Array) -> Array:
    """`moved_by_joints` of some, q as (n, m)."""
    n, m = q.shape
    x, y, z = np.eye(3)[:, :, None] * np.ones(m)  # columns of the rotation so far
    point = np.zeros((3, m))
    axes, origins = np.empty((2, n, 3, m))
    for i in range(n):
        point = point + _combined(x, y, z, chain.translations[i])
        ahead, across = (_combined(x, y, z, chain.rotations[i, :, k]) for k in (0, 1))
        z = _cross(ahead, across)
        axes[i], origins[i] = z, point
        if chain.prismatic[i]:
            x, y = ahead, across
            point = point + z * q[i]
        else:
            cosine, sine = np.cos(q[i]), np.sin(q[i])
            x, y = cosine * ahead + sine * across, cosine * across - sine * ahead
    point = point + _combined(x, y, z, chain.translations[n])
    moved = [
        axis if slides else _cross(axis, point - origin)
        for axis, origin, slides in zip(axes, origins, chain.prismatic, strict=True)
    ]
    return np.stack(moved)


def _combined(x: Array, y: Array, z: Array, parts: Array) -> Array:
    """(3, m) the vectors (3,) `parts` of frames with the axes x, y, z (3, m)."""
    total = np.zeros_like(x)
    for axis, part in zip((x, y, z), parts.tolist(), strict=True):
        if part != 0.0:
            total += axis * part
    return total


def _cross(a: Array, b: Array) -> Array:
    """(3, m) cross products; numpy's own take longer."""
    return np.stack(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )
