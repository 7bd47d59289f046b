"""Why a motion is refused: where, and in words; and what is too vague for any to be judged.

Where a surface is known only so well, it leaves less tolerance, and less cone.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from coverable.arrays import Array, Mask
from coverable.errors import counted
from feasibility.task import Task
from feasibility.verdict import Certificate
from surfaces.cells import Cells
from surfaces.surface import Surface

ROLL_CLOSE = 1e-9  # [1], [rad]: u directions are known by differences to about this


@dataclass(frozen=True, slots=True)
class MotionFault:
    """One reason why a motion is refused, and where it is met."""

    text: str
    row: int = -1
    """Index of the row, or of the row before; -1 where the whole motion is meant."""
    share: float = 0.0
    """How far the motion has come from there to the next row, 0..1."""

    def __str__(self) -> str:
        """Place and fault; rows are counted from 1."""
        if self.row < 0:
            return self.text
        if self.share == 0.0:
            return f"row {self.row + 1}: {self.text}"
        way = f"row {self.row + 1} to {self.row + 2}, {self.share:.3g} of the way"
        return f"{way}: {self.text}"


class Judged:
    """What a judge found: the motion, or the proof, is accepted unless there are faults."""

    __slots__ = ()

    if TYPE_CHECKING:

        @property
        def faults(self) -> Sequence[MotionFault | str]:
            """None when all holds."""

    @property
    def accepted(self) -> bool:
        """True when all that was judged holds: along a whole motion, or every claim of a proof."""
        return not self.faults

    @property
    def refusal(self) -> str:
        """All faults in words; empty when it is accepted."""
        return "; ".join(map(str, self.faults))


@dataclass(frozen=True, eq=False, slots=True)
class Replay(Judged):
    """What the replay of a motion over a surface found."""

    certificate: Certificate
    """Bounds over all of an accepted motion; of a refused one what was measured."""
    faults: tuple[MotionFault, ...] = ()
    """Why the motion is refused, the worst of each kind; none when it is accepted."""
    reached: Mask | None = None
    """(N,) cells that are reached."""
    collides: bool = False
    """Is it refused for bodies that come too near alone?"""

    @property
    def narrowly_refused(self) -> bool:
        """Is the motion refused for numbers that less tolerance and cone in the search may better?

        Neither moves bodies apart.
        """
        measured = math.isfinite(self.certificate.max_position_error)
        return measured and not (self.accepted or self.collides)


def unmeasured(cells: Cells, rows: Array, *faults: MotionFault) -> Replay:
    """Of rows that are no motion over some cells."""
    unknown = Certificate(len(rows) if rows.ndim else 0, math.nan, math.nan, math.nan)
    return Replay(unknown, faults, np.zeros(len(cells), dtype=bool))


def and_others(number: int, noun: str) -> str:
    """' (the worst; wrong at 3 other rows, too)', or nothing."""
    others = counted(number, f"other {noun}")
    return f" (the worst; wrong at {others}, too)" if number > 0 else ""


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
        faults.append(MotionFault(f"{known} only, {allowed}"))
    if _turn_deg(leans) > task.cone_deg:
        known = f"its normals are known to {_turn_deg(leans):.4g} deg only"
        faults.append(MotionFault(f"{known}, {task.cone_deg:g} deg are allowed"))
    return faults
