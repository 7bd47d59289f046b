"""The target surface as branch and bound reads it: part by part, fine enough for the task."""

from __future__ import annotations

import numpy as np

from feasibility.roadmap.branch_and_bound import Places
from feasibility.targets import target_parts
from feasibility.task import Task
from surfaces import Surface

FLAT = 0.5  # [1] of the tolerance: largest radius of target points on the finest parts
STRAIGHT = 0.1  # [1] of the cone chord: the same of approach directions
STRAIGHTEST = 1e-3  # [1] whatever the cone
MOST_PARTS = 4096


def places_on(surface: Surface, task: Task) -> Places:
    """The places that the tool may be at over a surface.

    What is proved holds for the surface itself; how fine the parts are only decides what can be.
    """
    chord = min(task.cone_chord, 2.0)
    parts = target_parts(
        surface,
        task.standoff,
        flat=FLAT * task.effective_tolerance,
        straight=max(STRAIGHT * chord, STRAIGHTEST),
        most=MOST_PARTS,
        approach=None if isinstance(task.approach, str) else task.approach,
    )
    return Places(
        centre=np.array(parts.centre),
        slopes=np.array(parts.slopes),
        radius=np.array(parts.radius),
        children=np.array(parts.children),
        axis=np.array(parts.axis),
    )
