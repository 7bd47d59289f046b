"""Relaxed problems over one cell, solved by Newton from random starts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.roadmap.motions import PROJECTION_STEPS, SearchArrays, Work, project_onto_cell

STARTS = 16  # Newton starts for each relaxed problem


def solve(
    arrays: SearchArrays, work: Work, cell: int, guesses: NDArray[np.float64],
    solutions: NDArray[np.float64],
) -> int:  # fmt: skip
    """Fill `solutions` with configurations of a relaxed problem over one cell; returns how many."""
    found = 0
    for guess in guesses:
        solutions[found] = guess
        if project_onto_cell(arrays, work, cell, solutions[found], PROJECTION_STEPS):
            found += 1
            if found == len(solutions):
                break
    return found


def with_cone(arrays: SearchArrays, cone_chord: float) -> SearchArrays:
    """The same arrays with another cone, for one cell's centre: no curve deviates there."""
    return arrays._replace(cone_chord=cone_chord, inner_cone_chord=cone_chord)
