"""The distances of all pairs at one configuration, as sharp as they can be had."""

from __future__ import annotations

import numpy as np

from coverable_kernels import kernel
from feasibility.collisions.kernels.distances import of_item
from feasibility.collisions.kernels.segments import slot_of_start
from feasibility.collisions.kernels.tables import (
    BLAMED,
    BOUND,
    BOUNDS,
    CLEARANCE,
    ITEMS,
    PAIR,
    STATE,
    row,
    rows_of,
)
from feasibility.collisions.kernels.witness import witness


@kernel
def measure(m):  # type: ignore[no-untyped-def]
    """Bound every item at the configuration in `asked`, in the slot that is returned.

    `found` gets what is nearest to, or furthest below, the clearance that it needs.
    """
    here, items = slot_of_start(m), rows_of(m, ITEMS)
    least, worst = np.inf, row(m, ITEMS, np.int64(0))
    for k in range(items + 1):  # once more for the worst, whose witness is to be left
        item = row(m, ITEMS, k) if k < items else worst
        m[STATE + BOUNDS] += 1.0
        m[item + BOUND + here] = of_item(m, item, here, here, np.inf, np.inf, -np.inf)
        margin = m[item + BOUND + here] - m[item + CLEARANCE]
        if margin < least:
            least, worst = margin, item
    witness(m, worst, here)
    m[STATE + BLAMED] = m[worst + PAIR]
    return np.float64(here)
