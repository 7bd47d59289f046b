"""A surface as a tree of parts, each nearly flat, with rigorous bounds: what proofs work with.

On a part, points f and outward normals n follow an affine model of two parameters x in [-1, 1]^2:

    |f - (c_f + x_1 e_1 + x_2 e_2)| <= r_f        |n - (c_n + x_1 g_1 + x_2 g_2)| <= r_n

with the same x in both. Every place of the surface lies on some child of each part that it lies on,
so a search that starts at the root and discards parts misses nothing.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfaces.surface import Protected


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class SurfaceParts(Protected):
    """K parts of one surface; the root is part 0, and children come after their parents."""

    centre: NDArray[np.float64]
    """(K, 6) c_f (m) and c_n."""
    slopes: NDArray[np.float64]
    """(K, 2, 6) e_1, e_2 (m) beside g_1, g_2."""
    radius: NDArray[np.float64]
    """(K, 2) r_f (m) and r_n."""
    children: NDArray[np.int64]
    """(K, 2) the two parts that a part is cut into; -1, -1 for the finest ones."""
    axis: NDArray[np.int64]
    """(K,) 0 or 1 where the children are the halves x_axis <= 0 and x_axis >= 0 of the part, with
    x = 2 x_axis + 1 and 2 x_axis - 1 of their own; -1 where they are any two parts."""

    def __len__(self) -> int:
        """Number of parts."""
        return len(self.centre)
