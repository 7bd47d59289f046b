"""Patches of cylinders about z of their frame: Table III, eqs. (12) and (13) of the paper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from surfaces.arguments import ORIGIN, Checks
from surfaces.patches.patch import ClosedFormPatch
from surfaces.surface import Side


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Cylinder(ClosedFormPatch):
    """u is the angle about z, v the height along z."""

    kind: ClassVar[str] = "cylinder"
    units: ClassVar[tuple[str, str]] = ("rad", "m")
    code: ClassVar[int] = 2
    u_angle: ClassVar[bool] = True
    radius: float
    """m."""

    def local_point(self, u: Array, v: Array) -> Array:
        """(R cos u, R sin u, v)."""
        return np.stack([self.radius * np.cos(u), self.radius * np.sin(u), v], axis=-1)

    def local_normal(self, u: Array, v: Array) -> Array:
        """Away from the axis."""
        return np.stack([np.cos(u), np.sin(u), np.zeros_like(u)], axis=-1)

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """R (u1 - u0) (v1 - v0)."""
        u0, u1, v0, v1 = (np.asarray(value, float) for value in (u0, u1, v0, v1))
        return np.asarray(self.radius * (u1 - u0) * (v1 - v0))


def cylinder(
    radius: float,
    angle_deg: Sequence[float],
    height: Sequence[float],
    side: Side = "inside",
    position: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
) -> Cylinder:
    """A patch of a cylinder about the z axis of its own frame.

    Args:
        radius: m.
        angle_deg: (low, high) angle about z, at most a full turn apart.
        height: (low, high) along z, m.
        side: 'inside' or 'outside', where the tool works; see `plane` for position and rpy_deg.

    Raises:
        SurfaceError: one or more of the numbers do not describe a patch; all are named.
    """
    check = Checks("cylinder")
    made = Cylinder(
        u_range=check.angles("angle_deg", angle_deg),
        v_range=check.interval("height", height, "metres"),
        radius=check.positive("radius", radius),
        **check.pose(side, position, rpy_deg),
    )
    check.done()
    return made
