"""A few Newton starts, and a short search: what can be said of a placement in milliseconds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.compiled import kernel, put
from feasibility.division import undominated
from feasibility.roadmap import LANDING_STEPS, Explorer, land, roomy
from surfaces import Cells

PROBES = 8  # cells that represent the surface, besides the furthest and the nearest
STARTS = 16  # Newton starts at each
PIVOT_SEEDS = 8  # guesses at the middle cell
MORE_CELLS = 4  # cells that nothing has reached, seeded in a short search
STIRS = 6  # of the border of the best component, in a short search
MOST_COVERS = 8  # components that are kept of a placement, the largest


@kernel
def _probe(problem, work, cells, guesses, hits):  # type: ignore[no-untyped-def]
    """Newton at each of some cells, from where the last one ended and from guesses."""
    n = guesses.shape[1]
    q, last, known = np.empty(n), np.empty(n), False
    for k in range(cells.shape[0]):
        hits[k] = 0
        for g in range(-1, guesses.shape[0]):
            if g < 0 and not known:
                continue
            if g < 0:
                put(q, last)
            else:
                put(q, guesses[g])
            if land(problem, work, cells[k], q, LANDING_STEPS):
                put(last, q)
                known = True
                hits[k] = 1
                break


def probe(explorer: Explorer, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(k,) whether Newton's method finds a configuration over some cells (k,)."""
    hits = np.zeros(len(cells), dtype=np.int64)
    _probe(explorer.problem, explorer.work, cells, explorer.guesses(STARTS), hits)
    return hits.astype(bool)


def skim(explorer: Explorer, early: bool) -> None:
    """A short search: the middle cell, some that it leaves unreached, some stirring at borders.

    With `early` it ends at a cell over which nothing is found: no motion will cover that one.
    """
    pivot = explorer.cells.middle
    guesses = explorer.guesses(PIVOT_SEEDS)
    room = roomy(explorer.problem, explorer.work, pivot, guesses)
    for k in np.argsort(-room, kind="stable"):
        if room[k] >= 0.0:
            explorer.plant(pivot, guesses[k : k + 1])
        if explorer.complete:
            return
    for _ in range(MORE_CELLS):
        missed = np.flatnonzero(~explorer.covered)
        lost = missed[~explorer.reached[missed]]
        some = lost if len(lost) else missed
        found = explorer.plant(int(explorer.rng.choice(some)), explorer.guesses(STARTS))
        if explorer.complete or (early and len(lost) and not found):
            return
    for _ in range(STIRS):
        for root in explorer.roots()[:2]:
            border = explorer.border(root)
            if len(border):
                explorer.stir(int(explorer.rng.choice(border)))
            if explorer.complete:
                return


def spread_cells(cells: Cells) -> list[int]:
    """Some cells that differ most in place and normal, the middle one first."""
    size = float(np.linalg.norm(np.ptp(cells.centres, axis=0))) or 1.0
    features = np.hstack([cells.centres / size, 0.5 * cells.normals])
    chosen = [cells.middle]
    nearest = np.linalg.norm(features - features[chosen[0]], axis=1)
    while len(chosen) < min(PROBES, len(cells)):
        chosen.append(int(nearest.argmax()))
        nearest = np.minimum(nearest, np.linalg.norm(features - features[chosen[-1]], axis=1))
    return chosen


def covers_of(explorer: Explorer) -> NDArray[np.bool_]:
    """(K, N) the largest components, none inside another, the best first."""
    roots = [root for root in explorer.roots() if explorer.roadmap.size[root] > 0]
    covers = explorer.roadmap.cover[roots[: 4 * MOST_COVERS]].astype(bool)
    return np.asarray(covers[undominated(covers)][:MOST_COVERS])
