"""Seeds: random configurations projected onto one cell, and moved clear of collisions."""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array
from coverable_kernels import allocating_entry, entry, put
from feasibility.collisions import clearance_gradient, segment_clear
from feasibility.roadmap.expansion import join
from feasibility.roadmap.graph import COMPONENTS, add_node, is_full
from feasibility.roadmap.motions import (
    CONE_SLACK,
    HERE,
    NEWTON_STEPS,
    PROJECTION_STEPS,
    SETTLE_STEPS,
    SearchArrays,
    Work,
    copy_slot,
    look_at,
    place,
    project,
    project_near_cell,
    settle,
)

NONE = np.int64(-1)
PUSHES = 8  # steps that a colliding configuration gets
PUSH = 0.2  # [rad] or [m] of one step


def moved_clear(arrays: SearchArrays, work: Work, cell: int, q: Array) -> bool:
    """Move q (n,), in place, over its cell until it collides no more; False where it still does.

    Each step goes down the gradient of the penetration, and is projected back onto the target. This
    is no motion of the arm: q becomes another start.
    """
    return len(arrays.collisions) == 0 or bool(_pushed_clear(arrays, work, cell, q))


@entry
def _pushed_clear(arrays, work, cell, q):  # type: ignore[no-untyped-def]
    """`moved_clear`, where collisions are checked."""
    if segment_clear(arrays.collisions, q, q) > 0.0:
        return True
    look_at(arrays, work, cell)
    for _ in range(PUSHES):
        place(arrays, work, HERE, q)
        copy_slot(arrays, work)
        for j in range(q.shape[0]):
            work.secondary_step[j] = 0.0
        clearance_gradient(arrays.collisions, q, work.secondary_step, PUSH)
        put(work.trial, q)
        if not project(arrays, work, work.trial, CONE_SLACK, np.inf, NEWTON_STEPS):
            return False
        put(q, work.trial)
        if segment_clear(arrays.collisions, q, q) > 0.0:
            return True
    return False


@allocating_entry
def seed_cell(arrays, work, roadmap, cell, guesses):  # type: ignore[no-untyped-def]
    """Project guesses onto the constraints over one cell; new configurations become components.

    Args:
        arrays, work: the `SearchArrays` and the `Work`.
        roadmap: the `Roadmap`, with space for a node and a component per guess, see `grown`.
        cell: the cell.
        guesses: (k, n) configurations inside the limits.

    Returns:
        (configurations found, new components made).
    """
    count = roadmap.counters
    found, made = 0, 0
    for k in range(guesses.shape[0]):
        if count[COMPONENTS] >= len(roadmap.parent) or is_full(roadmap):
            break
        q = guesses[k].copy()
        if not project_near_cell(arrays, work, cell, q, PROJECTION_STEPS):
            continue
        found += 1
        if len(arrays.collisions) > 0 and not _pushed_clear(arrays, work, cell, q):
            continue
        settle(arrays, work, cell, q, SETTLE_STEPS)
        node, _ = join(arrays, work, roadmap, cell, q, NONE, np.int64(0), np.int64(0))
        if node >= 0:
            continue
        component = count[COMPONENTS]
        count[COMPONENTS] += 1
        add_node(arrays, work, roadmap, cell, q, component)
        made += 1
    return found, made
