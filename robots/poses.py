"""Poses as they are given, a pair (position, rpy_deg) or a matrix: checked, as (4, 4) matrices.

The two axes of a tool: where it points, and what its roll is measured by.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from coverable.arrays import Array, unit_along
from coverable.errors import Checks, Fault, shown

PARALLEL = 1e-6  # [1], sine of the angle below which two directions count as parallel


def unit_axis(axis: Array) -> Array:
    """(3,) the axis brought to length one; NaN where it is zero or not finite."""
    largest = float(np.abs(axis).max())
    if not 1e-9 < largest < np.inf:
        return np.full(3, np.nan)
    return unit_along(axis)


def made_orthogonal(reference: Array, approach: Array) -> Array:
    """(3,) unit vector: the part of `reference` that is orthogonal to `approach`.

    Args:
        reference: (3,) of any length; NaN for the default, +x, or +z where x is parallel to
            `approach`.
        approach: (3,) unit vector.

    Returns:
        NaN where `reference` is zero, not finite, or parallel to `approach`.
    """
    if np.isnan(reference).all():
        across = np.hypot(approach[1], approach[2])
        reference = np.eye(3)[2 if across < PARALLEL else 0]
    unit = unit_axis(reference)
    part = unit - (unit @ approach) * approach
    length = np.linalg.norm(part)
    if not length >= PARALLEL:
        return np.full(3, np.nan)
    part = part / length
    return unit_axis(part - (part @ approach) * approach)  # once more, for the last digits


FURTHEST_TCP = 10.0  # [m] from tool_frame: no tool is longer, but many are given in millimetres
FURTHEST_BASE = 1e4  # [m] from the origin of the world
_RIGID = 1e-6  # [1], how far a rotation may be from one


def checked_pose(checks: Checks, key: str, value: Any, furthest: float) -> Array:
    """A pose as a (4, 4) matrix; the identity after a fault.

    Args:
        checks: keeps the faults.
        key: what the pose is called.
        value: a pair (position in m, fixed-axis roll, pitch and yaw in degrees) as in a case file,
            or the (4, 4) matrix of a rigid motion, such as a `pin.SE3`.
        furthest: m, largest coordinate of its position.
    """
    value = getattr(value, "homogeneous", value)  # of a pin.SE3
    if isinstance(value, Sequence) and len(value) == 2 and not isinstance(value, (str, bytes)):
        position, rpy_deg = value
        return matrix_of(checks, position, rpy_deg, furthest, f"{key}.")
    return rigid_matrix(checks, key, value, furthest, "a pair (position, rpy_deg), or ")


def matrix_of(
    checks: Checks, position: Any, rpy_deg: Any, furthest: float, before: str = ""
) -> Array:
    """The (4, 4) matrix of a frame, turned by roll, pitch and yaw about fixed axes.

    Args:
        checks: keeps the faults, under "position" and "rpy_deg".
        position: (3,) m.
        rpy_deg: (3,) degrees.
        furthest: m, largest coordinate of the position.
        before: put before the two names.
    """
    expected = "must be three finite numbers (metres)"
    place = checks.numbers(f"{before}position", position, 3, expected, furthest, "; millimetres?")
    expected = "must be three finite numbers (degrees)"
    angles = checks.numbers(f"{before}rpy_deg", rpy_deg, 3, expected)
    matrix = np.eye(4)
    matrix[:3, :3] = about_fixed_axes(*map(math.radians, angles or (0.0, 0.0, 0.0)))
    matrix[:3, 3] = place or (0.0, 0.0, 0.0)
    return matrix


def rigid_matrix(checks: Checks, key: str, value: Any, furthest: float, other: str = "") -> Array:
    """A (4, 4) rigid motion; the identity after a fault.

    Args:
        checks: keeps the fault.
        key: what it is called.
        value: anything that numpy reads as such a matrix.
        furthest: m, largest coordinate of its translation.
        other: what else would have done, for the message.
    """
    try:
        matrix = np.array(value, dtype=float)
    except (TypeError, ValueError):
        matrix = np.empty(0)
    expected = (
        f"must be {other}a 4 x 4 matrix of a rigid motion, its rotation without scale or mirror, "
        f"within {furthest:g} m"
    )
    if matrix.shape != (4, 4):
        checks.wrong(key, value, expected)
        return np.eye(4)
    turn, place = matrix[:3, :3], matrix[:3, 3]
    if np.isfinite(matrix).all() and np.abs(matrix).max() <= max(furthest, 2.0):
        rigid = np.abs(turn @ turn.T - np.eye(3)).max() <= _RIGID and np.linalg.det(turn) > 0.0
        if rigid and np.abs(place).max() <= furthest and (matrix[3] == (0, 0, 0, 1)).all():
            return matrix
    checks.keep(Fault(key, f"got {shown(matrix.tolist())}", expected=expected))
    return np.eye(4)


def about_fixed_axes(roll: float, pitch: float, yaw: float) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll), (3, 3), from radians: URDF's fixed-axis roll, pitch, yaw.

    Through half angles, as scipy does it, to the last bit; scipy takes long to import.

    Example:
        >>> about_fixed_axes(0.0, 0.0, 0.5 * math.pi).round(9) @ [1, 0, 0]
        array([0., 1., 0.])
    """
    turned = math.cos(0.5 * roll), math.sin(0.5 * roll), 0.0, 0.0
    turned = _product((math.cos(0.5 * pitch), 0.0, math.sin(0.5 * pitch), 0.0), turned)
    w, x, y, z = _product((math.cos(0.5 * yaw), 0.0, 0.0, math.sin(0.5 * yaw)), turned)
    ww, xx, yy, zz = w * w, x * x, y * y, z * z
    return np.array(
        [
            [xx - yy - zz + ww, 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)],
            [2.0 * (x * y + z * w), -xx + yy - zz + ww, 2.0 * (y * z - x * w)],
            [2.0 * (x * z - y * w), 2.0 * (y * z + x * w), -xx - yy + zz + ww],
        ]
    )


_Quaternion = tuple[float, float, float, float]  # (w, x, y, z)


def _product(left: _Quaternion, right: _Quaternion) -> _Quaternion:
    """The rotation `right`, and then `left`."""
    a, b, c, d = left
    w, x, y, z = right
    return (
        a * w - b * x - c * y - d * z,
        a * x + w * b + (c * z - d * y),
        a * y + w * c + (d * x - b * z),
        a * z + w * d + (b * y - c * x),
    )
