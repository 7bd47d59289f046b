"""A short search of one placement, and the margins that its motion leaves.

The margins are shares from 0 (none) to 1 (all):

- limits: over every cell, how far a joint stays from the nearer end of its range, by half the range
- cone: over every cell, how far the tool axis stays inside the cone, by its angle
- reach: how far the furthest target stays inside the reach bound, by the reach

The measure of a placement is the least of the three. Each cell counts with the configuration of the
covering motion's component that leaves most of limits and cone, after self-motions over the cell's
centre away from both; each such step is certified, as those of the search are.
"""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array, Ints, Mask
from coverable_kernels import allocating_entry, kernel, put
from feasibility.division import undominated
from feasibility.roadmap import (
    CONE_SLACK,
    HERE,
    NEWTON_AT_REST,
    NEXT,
    PROJECTION_STEPS,
    Exploration,
    accept,
    copy_slot,
    linearise,
    look_at,
    margin_objective,
    moved_clear,
    place,
    project,
    project_onto_cell,
    seed_middle,
    segment_holds,
)
from feasibility.sensitivity import apart
from surfaces import Cells

PROBES = 8  # cells that represent the surface, besides the furthest and the nearest
STARTS = 16  # Newton starts at each
MORE_CELLS = 4  # cells that nothing has reached, seeded in a short search
SELF_MOTIONS = 6  # of the border of the best component, in a short search
MOST_COVERS = 8  # components that are kept of a placement, the largest


@allocating_entry
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


def probe(exploration: Exploration, cells: Ints) -> Mask:
    """(k,) whether Newton's method finds a configuration over some cells (k,).

    Where collisions are checked, one that is clear of them.
    """
    hits, guesses = np.zeros(len(cells), dtype=np.int64), exploration.guesses(STARTS)
    _probe(exploration.arrays, exploration.work, cells, guesses, hits)
    if len(exploration.arrays.collisions):
        for k in np.flatnonzero(hits).tolist():
            hits[k] = _projects_clear(exploration, int(cells[k]), guesses)
    return hits.astype(bool)


def _projects_clear(exploration: Exploration, cell: int, guesses: Array) -> bool:
    """Does any guess lead to a configuration over the cell that does not collide?"""
    at = exploration.arrays, exploration.work, cell
    return any(
        project_onto_cell(*at, q, PROJECTION_STEPS) and moved_clear(*at, q) for q in guesses.copy()
    )


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
    return apart(features, PROBES, cells.middle, same=0.0)


def covers_of(exploration: Exploration) -> Mask:
    """(K, N) the largest components, none inside another, the best first."""
    roots = [root for root in exploration.roots() if exploration.roadmap.size[root] > 0]
    covers = exploration.roadmap.covers(roots[: 4 * MOST_COVERS])
    return np.asarray(covers[undominated(covers)][:MOST_COVERS])


NARROW = 0.1  # [1] of the cone: no axis is led further inside
MARGIN_STEPS = np.int64(80)  # over one cell's centre, away from limits and boundary of the cone
STALE = 8  # of them without gain end it
MOST_SETTLED = 2  # configurations over one cell from which margins are widened


@kernel
def _margins_at(problem, work, q, out):  # type: ignore[no-untyped-def]
    """Shares of half range and of cone that q leaves (slot 0 holds it)."""
    out[0] = 1.0
    for j in range(q.shape[0]):
        half = 0.5 * (problem.upper[j] - problem.lower[j])
        if half > 0.0 and half < np.inf:
            out[0] = min(out[0], 1.0 - abs((q[j] - problem.lower[j]) / half - 1.0))
    out[1] = max(0.0, 1.0 - work.error[0, 1] / problem.cone_chord)


@allocating_entry
def _widen_margins(problem, aimed, work, cell, q, best):  # type: ignore[no-untyped-def]
    """Self-motion over a cell away from limits and boundary of the cone; changes q and `best`.

    As `self_motion.settle`, but further: each step leads the axis inwards by a part of its angle,
    down to the cone of `aimed`. Every step is certified. `best` gets the margins.
    """
    n = q.shape[0]
    here = np.empty(2)
    look_at(problem, work, cell)
    place(problem, work, HERE, q)
    _margins_at(problem, work, q, best)
    size, stale = 0.3, 0
    for _ in range(MARGIN_STEPS):
        copy_slot(problem, work)
        linearise(problem, work, NEXT)
        margin_objective(problem, work, q, size)
        for j in range(n):
            work.trial[j] = q[j]
        slack = CONE_SLACK * size / 0.3
        good = project(aimed, work, work.trial, slack, work.error[1, 1], NEWTON_AT_REST)
        if good:
            position, cone = segment_holds(problem, work, q, work.trial)
            good = position <= 1.0 and cone <= 1.0
        if not good:
            size *= 0.5
            if size < 0.01:
                return
            continue
        for j in range(n):
            q[j] = work.trial[j]
        accept(work)
        _margins_at(problem, work, q, here)
        stale += 1
        if min(here[0], here[1]) > min(best[0], best[1]) + 1e-3:
            best[0], best[1], stale = here[0], here[1], 0
        if stale > STALE:
            return


def least_margins(exploration: Exploration) -> Array:
    """(2,) shares of limits and of cone that the best component leaves over every cell."""
    problem, work = exploration.arrays, exploration.work
    # Steps over a centre head for a cone that is next to nothing, and keep to the task's.
    aimed = problem._replace(
        cone_chord=NARROW * problem.cone_chord if problem.cone_chord < np.inf else np.inf
    )
    roadmap, component, here = exploration.roadmap, exploration.best, np.empty(2)
    best = np.full((len(exploration.cells), 2), -1.0)
    for cell, nodes in enumerate(roadmap.over):
        mine = [node for node in nodes if roadmap.root_of(node) == component]
        for node in mine[:MOST_SETTLED]:
            _widen_margins(problem, aimed, work, cell, roadmap.q[node].copy(), here)
            if here.min() > best[cell].min():
                best[cell] = here
    return np.clip(best.min(axis=0), 0.0, 1.0)
