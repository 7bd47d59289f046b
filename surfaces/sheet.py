"""A surface as an obstacle: triangles, and how far the surface may be from them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfaces.protected import Protected


@dataclass(frozen=True, eq=False, slots=True)
class Sheet(Protected):
    """A two-sided sheet of triangles in the root frame, without thickness.

    The whole surface is meant, margins outside the outermost cell centres included.
    """

    triangles: NDArray[np.float64]
    """(k, 3, 3) m, the corners of each triangle."""
    deviation: float
    """m, no point of the surface is further than this from a triangle."""
