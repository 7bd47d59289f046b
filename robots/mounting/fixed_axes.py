"""Roll, pitch and yaw as a rotation, without scipy, which takes long to import."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray


def about_fixed_axes(roll: float, pitch: float, yaw: float) -> NDArray[np.float64]:
    """Rz(yaw) Ry(pitch) Rx(roll), (3, 3), from radians: URDF's fixed-axis roll, pitch, yaw.

    Through half angles, as scipy does it, to the last bit.

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


_Quaternion = tuple[float, float, float, float]
"""(w, x, y, z)."""


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
