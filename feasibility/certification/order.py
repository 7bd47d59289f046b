"""A toolpath is run from its first pose to its last, never back: whether a motion does so."""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array
from feasibility.certification.faults import MotionFault
from feasibility.certification.stretches import Samples
from feasibility.verdict import Walk
from surfaces import Cells
from surfaces.places import OffsetSurface


def order_of_marks(cells: Cells, walk: Walk) -> str:
    """Why the marks of a walk are not in the order of a toolpath; empty where they are."""
    if not cells.in_order:
        return ""
    marks = walk.cell[walk.cell >= 0]
    steps = np.diff(marks)
    wrong = np.flatnonzero((steps < 0) | (steps > 1))
    if not len(wrong):
        return ""
    before, after = marks[wrong[0] : wrong[0] + 2].tolist()
    how = "back" if after < before else "on"
    return f"the motion goes {how} from pose {before} to pose {after}, out of their order"


def order_of_places(offset: OffsetSurface, samples: Samples, tolerance: float) -> list[MotionFault]:
    """Where a motion goes back along a toolpath by more than the tolerance.

    Args:
        offset: the curves of the toolpath.
        samples: of the motion, as it passes them.
        tolerance: m.
    """
    along = offset.along(samples.places)
    if along is None or not len(along):
        return []
    known = np.nan_to_num(along, nan=-np.inf)
    back: Array = np.maximum.accumulate(known) - along
    worst = int(np.argmax(np.nan_to_num(back)))
    if not back[worst] > tolerance:
        return []
    text = f"the tool goes back along the toolpath, by {1e3 * back[worst]:.4g} mm"
    return [MotionFault(int(samples.row[worst]), float(samples.share[worst]), text)]
