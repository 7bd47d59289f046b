"""Are the cells of a result file still those that its case is cut into now?"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.archive import Archive
from surfaces import Cells

CLOSE = 1e-9  # [m], [1]: centres and normals of the same cells


def places(cells: Cells) -> NDArray[np.float64]:
    """(N, 6) centre (m) and outward normal of each cell."""
    return np.hstack([cells.centres, cells.normals])


def check_cells(cells: Cells, label: str, archive: Archive) -> None:
    """Refuse cells that are not the ones that the result was found for.

    A mesh file may have changed since, and so may the way in which surfaces are cut.

    Args:
        cells: as the case makes them now.
        label: what the surface is called.
        archive: the file, with the array `places`.

    Raises:
        ArchiveError: they differ.
    """
    stored = archive.array("places", np.float64, (None, 6))
    if stored.shape != (len(cells), 6):
        how = f"has {len(cells):,} cells now, and had {len(stored):,} then"
    elif len(stored) and np.abs(stored - places(cells)).max() > CLOSE:
        how = "has its cells in other places now"
    else:
        return
    raise archive.error(
        f"was found for another surface than the one that is loaded now: {label} {how}; run the "
        "check again"
    )
