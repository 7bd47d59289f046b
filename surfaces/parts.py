"""A surface as a tree of parts, each nearly flat, with rigorous bounds: what proofs work with.

On a part, points f and outward normals n follow an affine model of two parameters x in [-1, 1]^2:

    |f - (c_f + x_1 e_1 + x_2 e_2)| <= r_f        |n - (c_n + x_1 g_1 + x_2 g_2)| <= r_n

with the same x in both. Every place of the surface lies on some child of each part that it lies on,
so a search that starts at the root and discards parts misses nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coverable.arrays import Array, Ints, Protected, Rows

MOST_PARTS = 8192
RELATIVE, ABSOLUTE = 1e-9, 1e-12  # what is added to a radius for rounding
_COORDINATE = 1e-14  # of the largest coordinate, likewise


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class SurfaceParts(Protected):
    """K parts of one surface; the root is part 0, and children come after their parents."""

    centre: Array
    """(K, 6) c_f (m) and c_n."""
    slopes: Array
    """(K, 2, 6) e_1, e_2 (m) beside g_1, g_2."""
    radius: Array
    """(K, 2) r_f (m) and r_n."""
    children: Ints
    """(K, 2) the two parts that a part is cut into; -1, -1 for the finest ones."""
    axis: Ints
    """(K,) 0 or 1 where the children are the halves x_axis <= 0 and x_axis >= 0 of the part, with
    x = 2 x_axis + 1 and 2 x_axis - 1 of their own; -1 where they are any two parts."""

    def __len__(self) -> int:
        """Number of parts."""
        return len(self.centre)


@dataclass(frozen=True, eq=False, slots=True)
class PartModels(Rows):
    """Affine models of k parts, and what their radii come from."""

    centre: Array
    """(k, 6) see `SurfaceParts`."""
    slopes: Array
    """(k, 2, 6)"""
    radius: Array
    """(k, 2)"""
    along: Array
    """(k, 2, 2) which share of r_f and r_n (last axis) comes from the extent along x_1, and x_2:
    halving that axis takes most of it away. Only says how to cut."""

    def placed(self, rotation: Array, position: Array, sign: float = 1.0) -> PartModels:
        """After the rigid motion x -> rotation x + position; normals turned over by sign -1.0."""
        centre = np.hstack(
            [
                self.centre[:, :3] @ rotation.T + position,
                self.centre[:, 3:] @ (sign * rotation.T),
            ]
        )
        slopes = np.concatenate(
            [self.slopes[..., :3] @ rotation.T, self.slopes[..., 3:] @ (sign * rotation.T)], axis=-1
        )
        return replace(self, centre=centre, slopes=slopes)

    def guarded(self) -> PartModels:
        """The same with room for rounding; what is not finite becomes a model that always holds.

        A unit vector lies within 1 of zero, so r_n is never more than that.
        """
        size = np.abs(self.centre[:, :3]).max(axis=1, initial=0.0)
        radius = self.radius * (1.0 + RELATIVE) + ABSOLUTE
        radius[:, 0] += _COORDINATE * size
        centre, slopes = self.centre.copy(), self.slopes.copy()
        for column, some in ((0, slice(0, 3)), (1, slice(3, 6))):
            known = np.isfinite(centre[:, some]).all(axis=1) & np.isfinite(radius[:, column])
            known &= np.isfinite(slopes[..., some]).all(axis=(1, 2))
            if column == 1:
                known &= radius[:, 1] < 1.0
            if not known.all():
                centre[~known, some], slopes[~known, :, some] = 0.0, 0.0
                radius[~known, column] = 1.0 + ABSOLUTE if column else np.inf
        return PartModels(centre, slopes, radius, np.nan_to_num(self.along, posinf=0.0))
