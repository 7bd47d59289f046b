"""Cells that the arm reaches inside limits and cone, but only where it collides."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.collisions import Pair, configuration_bounds
from feasibility.roadmap.branch_and_bound import Ruling
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.off_target import project_near_cell
from feasibility.roadmap.projection import PROJECTION_STEPS
from feasibility.verdict import Cause, CauseKind

LANDINGS = 60  # random configurations that are projected onto the cell
NAMED = 2  # pairs that the detail names with their share of the landings


def colliding(exploration: Exploration, cell: int, pairs: tuple[Pair, ...]) -> Cause | None:
    """The cause of a cell where every configuration that was found collides; None otherwise.

    Args:
        exploration: a finished search.
        cell: a cell that no component covers.
        pairs: those that are asked for, in the order of the search's arrays.
    """
    arrays, work = exploration.arrays, exploration.work
    if not len(arrays.collisions) or exploration.rulings.get(cell) is Ruling.PROVED:
        return None
    needed = np.array([pair.clearance for pair in pairs])
    spare = []  # of each landing: distance beyond the clearance, by pair
    for q in exploration.guesses(LANDINGS):
        if project_near_cell(arrays, work, cell, q, PROJECTION_STEPS):
            spare.append(configuration_bounds(arrays.collisions, q) - needed)
    if not spare or any((row > 0.0).all() for row in spare):
        return None
    return _worded(cell, np.array(spare), pairs)


def _worded(cell: int, spare: NDArray[np.float64], pairs: tuple[Pair, ...]) -> Cause:
    """The pair that is least in the way of the best landing, and who blocks how many of them."""
    worst = spare.argmin(axis=1)
    best = int(spare.min(axis=1).argmax())
    pair = pairs[worst[best]]
    distance = float(spare[best].min()) + pair.clearance
    if distance < 0.0:
        how = f"overlap by {-1e3 * distance:.1f} mm"
    else:
        how = f"come within {1e3 * distance:.1f} mm, {1e3 * pair.clearance:g} mm are asked for"
    blocked = (spare <= 0.0).sum(axis=0)
    most = np.argsort(-blocked, kind="stable")[:NAMED]
    shares = ", ".join(
        f"{pairs[k].first} and {pairs[k].second} in {blocked[k]}" for k in most if blocked[k]
    )
    detail = (
        f"at best {pair.first} and {pair.second} {how}; of {len(spare)} configurations over the "
        f"cell none is clear: {shares}"
    )
    return Cause(cell, CauseKind.COLLISION, False, detail, (pair.first, pair.second), distance)
