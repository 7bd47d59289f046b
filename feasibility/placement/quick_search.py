"""A few Newton starts, and a short search: what can be said of a placement in milliseconds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.compiled import kernel, put
from feasibility.division import undominated
from feasibility.roadmap import PROJECTION_STEPS, Exploration, project_onto_cell, seed_middle
from surfaces import Cells

PROBES = 8  # cells that represent the surface, besides the furthest and the nearest
STARTS = 16  # Newton starts at each
MORE_CELLS = 4  # cells that nothing has reached, seeded in a short search
SELF_MOTIONS = 6  # of the border of the best component, in a short search
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
            if project_onto_cell(problem, work, cells[k], q, PROJECTION_STEPS):
                put(last, q)
                known = True
                hits[k] = 1
                break


def probe(exploration: Exploration, cells: NDArray[np.int64]) -> NDArray[np.bool_]:
    """(k,) whether Newton's method finds a configuration over some cells (k,)."""
    hits = np.zeros(len(cells), dtype=np.int64)
    _probe(exploration.arrays, exploration.work, cells, exploration.guesses(STARTS), hits)
    return hits.astype(bool)


def search_quickly(exploration: Exploration, early: bool) -> None:
    """A short search: the middle cell, some cells that it misses, some self-motions at borders.

    With `early` it ends at a cell over which nothing is found: no motion will cover that one.
    """
    if seed_middle(exploration):
        return
    for _ in range(MORE_CELLS):
        missed = np.flatnonzero(~exploration.covered)
        lost = missed[~exploration.reached[missed]]
        some = lost if len(lost) else missed
        found = exploration.add_seeds(
            int(exploration.rng.choice(some)), exploration.guesses(STARTS)
        )
        if exploration.complete or (early and len(lost) and not found):
            return
    for _ in range(SELF_MOTIONS):
        for root in exploration.roots()[:2]:
            border = exploration.border(root)
            if len(border):
                exploration.explore_self_motions(int(exploration.rng.choice(border)))
            if exploration.complete:
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


def covers_of(exploration: Exploration) -> NDArray[np.bool_]:
    """(K, N) the largest components, none inside another, the best first."""
    roots = [root for root in exploration.roots() if exploration.roadmap.size[root] > 0]
    covers = exploration.roadmap.cover[roots[: 4 * MOST_COVERS]].astype(bool)
    return np.asarray(covers[undominated(covers)][:MOST_COVERS])
