"""Configurations over a cell that collide, moved clear where that is possible."""

import numpy as np

from coverable.kernels import entry
from feasibility.collisions.kernels.clearance import clearance_gradient, segment_clear
from feasibility.roadmap.motions.aiming import look_at
from feasibility.roadmap.motions.projection import project
from feasibility.roadmap.motions.self_motion import CONE_SLACK, NEWTON_AT_REST
from feasibility.roadmap.motions.working_memory import HERE, copy_slot, place, put

PUSHES = 8  # steps that a colliding configuration gets
PUSH = 0.2  # [rad] or [m] of one step


@entry
def moved_clear(arrays, work, cell, q):
    """Move q (n,), in place, over its cell until it collides no more; False where it still does.

    Each step goes down the gradient of the penetration, and is projected back onto the target. This
    is no motion of the arm: q becomes another start. Collisions have to be checked.
    """
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
        if not project(arrays, work, work.trial, CONE_SLACK, np.inf, NEWTON_AT_REST):
            return False
        put(q, work.trial)
        if segment_clear(arrays.collisions, q, q) > 0.0:
            return True
    return False
