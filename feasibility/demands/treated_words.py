"""The treated share in words, and what a demanded coverage makes of an answer."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from coverable.errors import listed
from feasibility.task import Task
from feasibility.verdict import Answer, Decision, Evidence

if TYPE_CHECKING:
    from feasibility.demands.area import TreatedArea, UntreatedRegion


LISTED = 3  # regions that are named


def share_words(found: TreatedArea) -> str:
    """The bracket, rounded so that it still holds.

    The lower end is rounded down and the upper end up.
    """
    low = int(found.lower * 1e4) / 100.0
    high = min(100.0, -int(-found.upper * 1e4 // 1) / 100.0)
    return f"{low:.2f} %" if low == high else f"{low:.2f} to {high:.2f} %"


def treated_json(found: TreatedArea | None) -> dict[str, Any] | None:
    """The share, and the untreated regions, as an object; None where nothing was measured."""
    if found is None:
        return None
    return {
        "lower": found.lower,
        "upper": found.upper,
        "twice": found.twice,
        "area_m2": found.area,
        "footprint_m": list(found.footprint),
        "untreated": [
            {"centre": each.centre.tolist(), "area_m2": each.area} for each in found.untreated
        ],
        "notes": list(found.notes),
    }


def treated_words(found: TreatedArea) -> str:
    """The share, how much of it twice, what is left out, in one text."""
    along, across = (1e3 * axis for axis in found.footprint)
    size = f"{along:,.6g} mm" if along == across else f"{along:,.6g} x {across:,.6g} mm"
    words = (
        f"{share_words(found)} of {found.area:.4g} m2 by a footprint of {size}, "
        f"{100.0 * found.twice:.1f} % more than once"
    )
    regions = found.untreated
    if regions:
        words += f"; untreated: {listed([_region_words(each) for each in regions], LISTED)}"
    return "; ".join([words, *found.notes])


def _region_words(region: UntreatedRegion) -> str:
    """Where a region is, and how large."""
    x, y, z = (1e3 * region.centre).tolist()
    area = 1e6 * region.area
    size = f"{1e-2 * area:.3g} cm2" if area >= 100.0 else f"{area:.2g} mm2"
    return f"{size} at ({x:.0f}, {y:.0f}, {z:.0f}) mm"


NOT_MEASURED = "No motion along which the treated area could be measured is known."


def with_coverage(decision: Decision, task: Task, found: TreatedArea | None) -> Decision:
    """A feasible answer remains only where enough of the area is treated for certain.

    Nothing follows from one motion that treats too little: another may treat more. And a cell
    whose centre cannot be reached may be treated from beside it. So a coverage that falls short
    makes the answer undecided, never infeasible; what is proved of the cells stays proved.
    """
    if task.coverage is None or decision.answer is not Answer.FEASIBLE:
        return decision
    short = shortfall(task, found)
    if short or found is None:
        message = f"{decision.message} {short[0].upper()}{short[1:]}"
        return Decision(Answer.UNDECIDED, Evidence.BUDGET, message)
    words = f"It treats {share_words(found)} of the area; {100.0 * task.coverage:g} % is required."
    return decision._replace(message=f"{decision.message} {words}")


def shortfall(task: Task, found: TreatedArea | None) -> str:
    """What is missing of the coverage that a task requires; empty where nothing is."""
    if task.coverage is None or (found is not None and found.lower >= task.coverage):
        return ""
    if found is None:
        return NOT_MEASURED
    return (
        f"it treats {share_words(found)} of the area, and {100.0 * task.coverage:g} % is required: "
        + ("more splitting may show it." if found.upper >= task.coverage else "that is too little.")
        + ' Finer cells, such as surface.cells = "auto", or passes that are closer treat more.'
    )
