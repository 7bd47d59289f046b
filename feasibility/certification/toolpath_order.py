"""A toolpath is run from its first pose to its last, never back: whether a motion does so."""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.certification.faults import MotionFault
from feasibility.certification.stretches import Samples
from feasibility.verdict import Walk
from surfaces.cells import Cells
from surfaces.places.places import OffsetSurface


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


def curves_of_marks(cells: Cells, marks: Ints) -> Ints | None:
    """(m,) between poses, the curve that a motion is on behind each row, by its marks.

    None where there is a surface, or two marks in a row are those of poses without a curve.
    """
    at = np.flatnonzero(marks >= 0)
    if not cells.surface.bare or len(at) < 2 or at[0] != 0 or at[-1] != len(marks) - 1:
        return None
    start, end = marks[at[:-1]], marks[at[1:]]
    count = len(cells)
    keys = cells.pairs[:, 0] * count + cells.pairs[:, 1]
    row = np.searchsorted(keys, np.minimum(start, end) * count + np.maximum(start, end))
    row = np.minimum(row, len(keys) - 1)
    any_curve = np.full(count, -1)  # to stay over a pose, at the end of any of its curves
    any_curve[cells.pairs.ravel()] = np.repeat(np.arange(len(keys)), 2)
    known = (
        cells.pairs[row] == np.column_stack([np.minimum(start, end), np.maximum(start, end)])
    ).all(axis=1)
    curve = np.where(start == end, any_curve[start], np.where(known, row, -1))
    if (curve < 0).any():
        return None
    return np.append(np.repeat(curve, np.diff(at)), curve[-1])


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
