"""Certified area in words and as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from coverable_errors import ArgumentError, counted
from feasibility.clock import Clock, OutOfTime
from feasibility.verdict import Verdict

if TYPE_CHECKING:
    from feasibility.area.certified_area import CertifiedArea

WHOLE = 1.0 - 1e-9  # [1] of a cell's area: what rounding leaves


def measured_area(verdict: Verdict, clock: Clock) -> CertifiedArea | str:
    """The certified area of a verdict, or why there is none; within a command's time limit."""
    try:
        with clock.enforced():
            found: CertifiedArea = verdict.certified_area
            return found
    except ArgumentError as error:
        return str(error)
    except OutOfTime:
        return "the certified area is not known: the time limit ran out"


def area_json(area: CertifiedArea | str) -> dict[str, Any]:
    """What `coverable check --area --json` adds: shares, 0 to 1; null where there is none."""
    if isinstance(area, str):
        return {"certified_area": None, "certified_area_note": area}
    shares, cells = area.shares, area.cells
    partly = np.flatnonzero(shares < WHOLE).tolist()
    return {
        "certified_area": area.share,
        "certified_area_m2": area.area,
        "partly_certified": [
            {"cell": list(cells.unravel(k)), "share": float(shares[k])} for k in partly
        ],
    }


def area_words(area: CertifiedArea | str) -> str:
    """The same in one line."""
    if isinstance(area, str):
        return area
    shares = area.shares
    partly = int(((shares < WHOLE) & (shares > 0.0)).sum())
    words = (
        f"{percent_down(area.share)} of the area ({area.area:.3g} m2, {len(area.areas):,} tiles)"
    )
    if partly:
        words += f"; {counted(partly, 'cell')} in part"
        least = int(np.argmin(np.where(shares > 0.0, shares, np.inf)))
        words += f", the least {list(area.cells.unravel(least))}: {percent_down(shares[least])}"
    none = int((shares == 0.0).sum())
    if none:
        words += f"; {counted(none, 'cell')} not at all"
    if area.exhausted:
        words += f"; not everything was examined within {area.budget:,} evaluations of the arm"
    return words


def percent_down(share: float) -> str:
    """A share in percent, rounded down, so that only all of it is 100.

    Example:
        >>> percent_down(0.99999), percent_down(1.0)
        ('99.9 %', '100.0 %')
    """
    return f"{np.floor(1e3 * (share + 1e-12)) / 10.0:.1f} %"
