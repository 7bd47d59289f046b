"""Missed cells counted by cause, of which only a few are examined."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

import numpy as np

from feasibility.verdict import CauseKind, Verdict

EXAMINED = 6  # missed cells whose causes are determined; the others take that of the nearest one


class CauseCounts(NamedTuple):
    """Why the cells of one verdict are missed."""

    cells: dict[str, int]
    """Number of missed cells by cause, the most frequent first."""
    examined: int
    """How many cells were examined for it."""


def cause_counts(verdict: Verdict) -> CauseCounts:
    """Count the missed cells of a verdict by cause.

    Cells that another component covers are disconnected. Of the cells that no component covers,
    `EXAMINED` are examined, and the others count as the nearest of these.
    """
    missed = np.flatnonzero(~verdict.covered)
    if len(missed) == 0:
        return CauseCounts({}, 0)
    if verdict.method == "greedy":
        kinds = [str(cause.kind) for cause in verdict.causes]
        return CauseCounts(_counted(kinds), len(kinds))
    from feasibility.roadmap import Exploration, arrays_of, diagnose

    reached = np.zeros(len(verdict.cells), dtype=bool)
    for cells in verdict.components:
        reached[cells] = True
    kinds = [str(CauseKind.DISCONNECTED)] * int(reached[missed].sum())
    lost = missed[~reached[missed]]
    if len(lost) == 0:
        return CauseCounts(_counted(kinds), 0)
    # A new exploration: only its Newton's method and its random starts are used.
    arrays = arrays_of(verdict.robot, verdict.cells, verdict.task)
    exploration = Exploration(verdict.robot, verdict.cells, arrays, verdict.seed)
    few = lost[np.unique(np.linspace(0, len(lost) - 1, EXAMINED).round().astype(np.int64))]
    examined = [diagnose(exploration, int(cell)) for cell in few]
    centres = verdict.cells.centres
    away = np.linalg.norm(centres[lost][:, None] - centres[few][None], axis=2)  # (L, E)
    kinds += [str(examined[int(k)].kind) for k in away.argmin(axis=1)]
    return CauseCounts(_counted(kinds), len(examined))


def _counted(kinds: list[str]) -> dict[str, int]:
    """Causes with their number of cells, the most frequent first."""
    return dict(sorted(Counter(kinds).items(), key=lambda entry: (-entry[1], entry[0])))
