"""`cells = "auto"`: cells so small that a tool over their centres treats the whole surface."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from coverable_errors import Fault
from feasibility.cases.mesh_keys import MOST_MESH_CELLS
from feasibility.cases.surface_keys import MOST_CELLS
from feasibility.cases.table_reader import CaseError

if TYPE_CHECKING:
    from surfaces.meshes import MeshSurface
    from surfaces.patches import Patch

AUTO: Final = "auto"
WIDTH = 0.65  # [1] of the footprint: the corners of a square are 0.46 of it from its centre
UNEVEN = 0.5  # [1] of the footprint, of cells of a mesh, which are no squares

Footprint = tuple[float, float]


def automatic_count(surface: MeshSurface, footprint: Footprint) -> int:
    """How many cells of a mesh are small enough for a footprint (m).

    Raises:
        CaseError: there would be too many of them.
    """
    area = float(np.sum(surface.mesh.area))
    count = max(1, math.ceil(area / (UNEVEN * min(footprint)) ** 2))
    _check(count, footprint, MOST_MESH_CELLS)
    return count


def _check(count: int, footprint: Footprint, most: int) -> None:
    """Refuse more cells than a surface may have."""
    if count > most:
        what = (
            f"is {AUTO!r}, which makes {count:,} cells for a footprint of "
            f"{1e3 * min(footprint):.3g} mm, more than {most:,}"
        )
        wanted = "give their number yourself, or a larger footprint"
        raise CaseError([Fault("surface.cells", what, expected=wanted)])


def grid_of(
    patch: Patch, cells: tuple[int, int] | Literal["auto"], footprint: Footprint | None
) -> tuple[int, int]:
    """Cells along u and v of a patch, as given or fine enough for a footprint (m).

    Raises:
        CaseError: they are to be fine enough for a footprint, and there is none; or too many.
    """
    if cells != AUTO:
        return cells
    if footprint is None:
        raise CaseError([Fault("surface.cells", f"is {AUTO!r}, without a footprint")])
    from surfaces.passes import grid_shape

    nu, nv = grid_shape(patch, WIDTH * min(footprint))
    _check(nu * nv, footprint, MOST_CELLS)
    return nu, nv
