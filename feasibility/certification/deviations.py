"""What a task leaves where the surface is known only so well: less tolerance, and less cone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from feasibility.certification.faults import MotionFault
from feasibility.task import Task
from surfaces.surface import Surface


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
