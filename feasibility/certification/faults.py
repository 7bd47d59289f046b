"""Why a motion is refused: where, and in words; and what is too vague for any to be judged.

Where a surface is known only so well, it leaves less tolerance, and less cone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from feasibility.task import Task
from surfaces.surface import Surface

ROLL_CLOSE = 1e-9  # [1], [rad]: u directions are known by differences to about this


@dataclass(frozen=True, slots=True)
class MotionFault:
    """One reason why a motion is refused, and where it is met."""

    row: int
    """Index of the row, or of the row before; -1 where the whole motion is meant."""
    share: float
    """How far the motion has come from there to the next row, 0..1."""
    text: str

    def __str__(self) -> str:
        """Place and fault; rows are counted from 1."""
        if self.row < 0:
            return self.text
        if self.share == 0.0:
            return f"row {self.row + 1}: {self.text}"
        way = f"row {self.row + 1} to {self.row + 2}, {self.share:.3g} of the way"
        return f"{way}: {self.text}"


class Judged:
    """What a replay found: the motion is accepted unless there are faults."""

    __slots__ = ()

    faults: Sequence[MotionFault]

    @property
    def accepted(self) -> bool:
        """True when every constraint that was judged holds along the whole motion."""
        return not self.faults

    @property
    def refusal(self) -> str:
        """All faults in words; empty when the motion is accepted."""
        return "; ".join(map(str, self.faults))


def less_deviations(task: Task, surface: Surface) -> Task:
    """The task less what the surface may deviate from the one meant."""
    off, leans = surface.deviations
    if not (off or leans):
        return task
    tolerance = task.effective_tolerance - off - task.standoff * leans
    cone_deg = task.cone_deg - _turn_deg(leans)
    return replace(task, tolerance=max(tolerance, 1e-12), cone_deg=max(cone_deg, 0.0))


def _turn_deg(leans: float) -> float:
    """Angle between unit vectors that are so far apart."""
    return float(np.degrees(2.0 * np.arcsin(min(leans / 2.0, 1.0))))


def too_vague(task: Task, surface: Surface) -> list[MotionFault]:
    """Faults of all motions: nothing is left of tolerance or cone, so the best would be wrong."""
    off, leans = surface.deviations
    faults = []
    if off + task.standoff * leans >= task.effective_tolerance:
        known = f"targets on the surface are known to {1e3 * (off + task.standoff * leans):.4g} mm"
        allowed = f"{1e3 * task.effective_tolerance:g} mm are allowed"
        faults.append(MotionFault(-1, 0.0, f"{known} only, {allowed}"))
    if _turn_deg(leans) > task.cone_deg:
        known = f"its normals are known to {_turn_deg(leans):.4g} deg only"
        text = f"{known}, {task.cone_deg:g} deg are allowed"
        faults.append(MotionFault(-1, 0.0, text))
    return faults
