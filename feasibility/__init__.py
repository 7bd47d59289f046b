"""The question: can this arm cover this surface in one continuous motion?

>>> from robots import load_robot
>>> from surfaces import sphere
>>> from feasibility import Task, check
>>> puma = load_robot("puma560", limits="set-1")
>>> dome = sphere(radius=1.0, polar_deg=(10, 90), azimuth_deg=(10, 180), side="inside")
>>> verdict = check(puma, dome.cells(9, 10), Task(standoff=0.005, cone_deg=45))
>>> verdict.feasible, verdict.n_covered, verdict.n_edges
(True, 90, 305)
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from feasibility.search import Search

if TYPE_CHECKING:
    from feasibility.checking import check
    from feasibility.task import Task
    from feasibility.verdict import Answer, Cause, CauseKind, Evidence, Verdict

__all__ = ["Answer", "Cause", "CauseKind", "Evidence", "Search", "Task", "Verdict", "check"]

_HOMES = {
    "Answer": "feasibility.verdict",
    "Cause": "feasibility.verdict",
    "CauseKind": "feasibility.verdict",
    "Evidence": "feasibility.verdict",
    "Task": "feasibility.task",
    "Verdict": "feasibility.verdict",
    "check": "feasibility.checking",
}


def __getattr__(name: str) -> Any:
    """Import the heavier names when they are first used, so that the command line starts fast."""
    if name not in _HOMES:
        raise AttributeError(f"module 'feasibility' has no attribute {name!r}")
    import importlib

    return getattr(importlib.import_module(_HOMES[name]), name)
