"""The distances of all pairs at one configuration, as sharp as they can be had."""

from __future__ import annotations

import numpy as np

from coverable.kernels import kernel
from feasibility.collisions.kernels import tables as T
from feasibility.collisions.kernels.distances import of_item
from feasibility.collisions.kernels.segments import slot_of_start
from feasibility.collisions.kernels.tables import row, rows_of


@kernel
def measure(m):  # type: ignore[no-untyped-def]
    """Bound every item at the configuration in `asked`, in the slot that is returned."""
    here = slot_of_start(m)
    for k in range(rows_of(m, T.ITEMS)):
        item = row(m, T.ITEMS, k)
        m[item + T.BOUND + here] = of_item(m, item, here, here, np.inf, np.inf, -np.inf)
    return np.float64(here)
