"""Configurations over a cell that collide, moved clear by the free directions where they can be."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from feasibility.collisions import clearance_gradient, segment_clear
from feasibility.compiled import put
from feasibility.roadmap.arrays import SearchArrays, Work, copy_slot, look_at, place
from feasibility.roadmap.projection import project
from feasibility.roadmap.self_motion import CONE_SLACK, NEWTON_STEPS

PUSHES = 8  # steps that a colliding configuration gets
PUSH = 0.2  # [rad] or [m] of one step


def moved_clear(arrays: SearchArrays, work: Work, cell: int, q: NDArray[np.float64]) -> bool:
    """Move q (n,), in place, over its cell until it collides no more; False where it still does.

    Each step goes down the gradient of the penetration, and is projected back onto the target. The
    way is no motion of the arm: q becomes another start.
    """
    if len(arrays.collisions) == 0 or segment_clear(arrays.collisions, q, q) > 0.0:
        return True
    look_at(arrays, work, arrays.points[cell], arrays.approaches[cell])
    for _ in range(PUSHES):
        place(arrays, work, 0, q)
        copy_slot(work)
        work.secondary_step[:] = 0.0
        clearance_gradient(arrays.collisions, q, work.secondary_step, PUSH)
        put(work.trial, q)
        if not project(arrays, work, work.trial, CONE_SLACK, np.inf, NEWTON_STEPS):
            return False
        put(q, work.trial)
        if segment_clear(arrays.collisions, q, q) > 0.0:
            return True
    return False
