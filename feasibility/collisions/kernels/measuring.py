"""The distances of all pairs at one configuration, as sharp as they can be had."""

from __future__ import annotations

import numpy as np

from feasibility.collisions.kernels.distances import of_item
from feasibility.collisions.kernels.segments import slot_of_start
from feasibility.collisions.kernels.tables import BLAMED, BOUNDS, CLEARANCE, PAIR
from feasibility.collisions.kernels.witness import witness
from feasibility.compiled import kernel


@kernel
def measure(t):  # type: ignore[no-untyped-def]
    """Bound every item at the configuration in `asked`, from which the slot returned now knows.

    `found` gets what is nearest to, or furthest below, the clearance that it needs.
    """
    here = slot_of_start(t)
    least, worst = np.inf, 0
    for item in range(t.items.shape[0]):
        t.state[0, BOUNDS] += 1.0
        t.bounds[here, item] = of_item(t, item, here, here, np.inf, np.inf, -np.inf)
        margin = t.bounds[here, item] - t.items[item, CLEARANCE]
        if margin < least:
            least, worst = margin, item
    if t.items.shape[0] > 0:
        of_item(t, worst, here, here, np.inf, np.inf, -np.inf)
        witness(t, worst, here)
        t.state[0, BLAMED] = t.items[worst, PAIR]
    return np.float64(here)
