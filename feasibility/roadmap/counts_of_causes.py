"""Missed cells counted by cause, where only a few are looked at closely."""

from __future__ import annotations

from collections import Counter
from typing import NamedTuple

import numpy as np

from feasibility.verdict import CauseKind, Verdict

EXAMINED = 6  # missed cells whose causes are looked for; the others take the nearest one's


class CauseCounts(NamedTuple):
    """Why the cells of one verdict are missed."""

    cells: dict[str, int]
    """Number of missed cells by cause, the most frequent first."""
    examined: int
    """How many cells were looked at for it."""


def cause_counts(verdict: Verdict) -> CauseCounts:
    """Count the missed cells of a verdict by cause.

    What another component covers is disconnected; of the cells that nothing reaches, `EXAMINED`
    are examined, and the others count as the nearest of these.
    """
    missed = np.flatnonzero(~verdict.covered)
    if len(missed) == 0:
        return CauseCounts({}, 0)
    if verdict.method == "greedy":
        kinds = [str(cause.kind) for cause in verdict.causes]
        return CauseCounts(_counted(kinds), len(kinds))
    from feasibility.roadmap.arrays import arrays_of
    from feasibility.roadmap.diagnosis import diagnose
    from feasibility.roadmap.exploration import Exploration

    reached = np.zeros(len(verdict.cells), dtype=bool)
    for cells in verdict.components:
        reached[cells] = True
    kinds = [str(CauseKind.DISCONNECTED)] * int(reached[missed].sum())
    lost = missed[~reached[missed]]
    if len(lost) == 0:
        return CauseCounts(_counted(kinds), 0)
    # A fresh explorer: what is asked of it are Newton's method and random starts alone.
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
