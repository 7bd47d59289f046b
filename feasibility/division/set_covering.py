"""The fewest sets that cover all elements, to the proven optimum.

How few of K components cover N cells is the set cover problem,

    minimise sum_k y_k   so that   sum_{k covers c} y_k >= 1 for each cell c,   y_k in {0, 1}.

It is NP-hard, but in the tables of a search few components are not contained in another one, and
cells covered by the same components need one row only. HiGHS then solves it in milliseconds.
"""

import math

import numpy as np

from coverable.arrays import Ints, Mask
from coverable.errors import ArgumentError

ROUNDING = 1e-6  # by how much HiGHS's numbers may differ from integers


def undominated(covers: Mask) -> Ints:
    """The sets, rows of `covers` (K, N), that no other one contains; of equal ones the first."""
    sizes = covers.sum(axis=1)
    shared = covers.astype(np.float64) @ covers.T.astype(np.float64)  # exact: counts below 2^53
    index = np.arange(len(covers))
    contained = shared == sizes[:, None]
    better = (sizes[None] > sizes[:, None]) | (
        (sizes[None] == sizes[:, None]) & (index[None] < index[:, None])
    )
    return np.flatnonzero((sizes > 0) & ~(contained & better).any(axis=1))


def set_cover(covers: Mask, time_limit: float) -> tuple[list[int], int]:
    """The fewest rows of a table that together have every column.

    Args:
        covers: (K, N) True where set k holds element c; every element is in some set.
        time_limit: s; running out leaves a gap between the number of rows and the bound.

    Returns:
        The rows in order of index, and a number that no fewer sets than it cover everything: that
        of the rows where the optimum is proved.

    Raises:
        ArgumentError: an element is in no set.
    """
    if not covers.any(axis=0).all():
        missing = np.flatnonzero(~covers.any(axis=0))
        raise ArgumentError(f"element {missing[0]} (of {len(missing)}) is in no set")
    if covers.shape[1] == 0:
        return [], 0
    kept = undominated(covers)
    table = np.unique(covers[kept], axis=1)
    rows, bound = _solved(table, time_limit)
    return sorted(kept[rows].tolist()), bound


def _solved(table: Mask, time_limit: float) -> tuple[list[int], int]:
    """Rows and bound by HiGHS; the greedy rows where it has nothing better."""
    from scipy.optimize import Bounds, LinearConstraint, milp

    greedy = _greedy(table)
    found = milp(
        np.ones(len(table)),
        integrality=np.ones(len(table)),
        bounds=Bounds(0, 1),
        constraints=LinearConstraint(table.T.astype(float), lb=1.0),
        options={"time_limit": max(time_limit, 0.01)},
    )
    bound = 1  # where the solver gives none
    if found.mip_dual_bound is not None and math.isfinite(found.mip_dual_bound):
        bound = max(1, math.ceil(found.mip_dual_bound - ROUNDING))
    if found.x is None:
        return greedy, bound
    rows = np.flatnonzero(found.x > 0.5).tolist()
    # The solver's rows are checked: rounding must not lose an element.
    valid = bool(table[rows].any(axis=0).all()) and len(rows) < len(greedy)
    return (rows if valid else greedy), bound


def _greedy(table: Mask) -> list[int]:
    """The set with most new elements, again and again."""
    left = np.ones(table.shape[1], dtype=bool)
    rows = []
    while left.any():
        rows.append(int(np.argmax((table & left).sum(axis=1))))
        left &= ~table[rows[-1]]
    return rows
