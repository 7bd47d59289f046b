"""Patches of planes."""

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
class Plane(ClosedFormPatch):
    """u and v are x and y of its own frame, the normal is +z."""

    kind: ClassVar[str] = "plane"
    units: ClassVar[tuple[str, str]] = ("m", "m")
    code: ClassVar[int] = 0

    def local_point(self, u: Array, v: Array) -> Array:
        """(u, v, 0)."""
        return np.stack([u, v, np.zeros_like(u)], axis=-1)

    def local_normal(self, u: Array, v: Array) -> Array:
        """+z."""
        zero = np.zeros_like(u)
        return np.stack([zero, zero, np.ones_like(u)], axis=-1)

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """(u1 - u0) (v1 - v0)."""
        u0, u1, v0, v1 = (np.asarray(value, float) for value in (u0, u1, v0, v1))
        return np.asarray((u1 - u0) * (v1 - v0))


def plane(
    width: Sequence[float],
    length: Sequence[float],
    side: Side = "inside",
    position: Sequence[float] = ORIGIN,
    rpy_deg: Sequence[float] = ORIGIN,
) -> Plane:
    """A rectangle in the xy plane of its own frame, its normal +z.

    Args:
        width: (low, high) along x, m.
        length: (low, high) along y, m.
        side: 'outside' for a tool on the +z side, 'inside' for one on the -z side.
        position: (3,) m, origin of the surface's frame in the root frame.
        rpy_deg: (3,) fixed-axis roll, pitch, yaw of the surface's frame.

    Raises:
        SurfaceError: one or more of the numbers do not describe a patch; all are named.
    """
    check = Checks("plane")
    made = Plane(
        u_range=check.interval("width", width, "metres"),
        v_range=check.interval("length", length, "metres"),
        **check.pose(side, position, rpy_deg),
    )
    check.done()
    return made
