"""What became of a claim, as one JSON object and as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from coverable.arrays import Mask
from coverable.errors import counted
from feasibility.collisions.asked_bodies import said_of
from feasibility.collisions.words import checked, checked_words
from feasibility.demands.treated_words import treated_json, treated_words
from feasibility.reports.objects_and_csv import measured_json, proof_json, smooth_json
from feasibility.reports.text_and_tables import (
    certificate_text,
    placement_text,
    smooth_text,
    summary,
)
from feasibility.verifying import NOT_IN_TIME, Verification
from feasibility.version import version
from surfaces.cells import Cells
from surfaces.toolpaths.pose_surface import PoseSurface

if TYPE_CHECKING:
    from feasibility.cases.case import Case

WORDS = {
    "motion": (
        "the motion covers the whole surface",
        "the motion is refused",
    ),
    "witness": ("the stored motion covers the whole surface", "the stored motion is refused"),
    "tree": (
        "the tree of the greedy search enters every cell, by the paper's definitions",
        "the tree of the greedy search is refused",
    ),
    "proof": (
        "no single continuous motion covers the whole surface",
        "the stored proof is refused",
    ),
}
LATE = "does not hold: not verified in time."


def as_json(found: Verification, notes: Sequence[str] = ()) -> dict[str, Any]:
    """The object that `coverable verify --json` prints.

    Args:
        found: what became of the claim.
        notes: what was not used of the file.
    """
    missed = () if found.reached is None else np.flatnonzero(~found.reached)
    return {
        "verdict": "holds" if found.holds else "does not hold",
        "claim": found.claim,
        "cells": len(found.cells),
        "reached": None if found.reached is None else int(found.reached.sum()),
        "missed": [list(found.cells.unravel(int(k))) for k in missed],
        "refusals": [
            {
                "row": None if fault.row < 0 else fault.row + 1,
                "share": None if fault.row < 0 else float(fault.share),
                "text": fault.text,
            }
            for fault in found.faults
        ],
        "certificate": measured_json(found.robot, found.certificate, found.q),
        "proof": proof_json(found.proof, found.robot, found.cells),
        "boxes": found.boxes if found.proof is not None else None,
        **smooth_json(found.cells.surface),
        "treated": treated_json(found.treated),
        "not_judged": list(found.not_judged),
        "in_time": not found.late,
        "collisions": checked(found.collision),
        "notes": list(notes),
        "robot": found.robot.name,
        "version": version(),
    }


def as_text(found: Verification, case: str, source: str, notes: Sequence[str] = ()) -> str:
    """The same for people.

    Args:
        found: what became of the claim.
        case: what the case is called.
        source: the file that was checked.
        notes: what was not used of it.
    """
    head = "holds" if found.holds else "does not hold"
    rows = [("case", case), (found.claim if found.claim != "tree" else "motion", source)]
    rows += [("but" if not k else "and", str(fault)) for k, fault in enumerate(found.faults)]
    if found.reached is not None:
        rows.append(_reached(found.cells, found.reached))
    rows += [("certificate" if found.holds else "measured", _measured(found))]
    rows.append(("smoothed", smooth_text(found.cells.surface)))
    if found.proof is not None and found.holds:
        rows.append(("checked", counted(found.boxes, "box", "boxes")))
    rows.append(("placement", placement_text(found.certificate)))
    rows.append(("treated", "" if found.treated is None else treated_words(found.treated)))
    rows.append(("not judged", _not_judged(found)))
    rows += [("note", note) for note in notes]
    answer = f"{head}: {WORDS[found.claim][not found.holds]}."
    if found.holds and found.reached is not None and isinstance(found.cells.surface, PoseSurface):
        answer = "holds: the tool is right at every pose, and on its way between them."
    head = LATE if found.late else answer
    return "\n".join(summary(head, rows, said_of(found.robot, found.collision)))


def _reached(cells: Cells, reached: Mask) -> tuple[str, str]:
    """How many cells a motion reaches, or of passes the places at which the tool works."""
    working = cells.surface.working if isinstance(cells.surface, PoseSurface) else None
    if working is None:
        return "cells", f"{int(reached.sum()):,} of {counted(len(cells), 'cell')} reached"
    total = counted(int(working.sum()), "place")
    return "passes", f"{int((reached & working).sum()):,} of {total} along them reached"


def _not_judged(found: Verification) -> str:
    """What the case demands that was not looked at, and why."""
    if not found.not_judged or found.claim == "tree" or found.late:  # the refusal says it
        return ""
    because = "it is refused already"
    if found.claim == "proof":
        because = "what no motion does without it, none does with it"
    return f"{', '.join(found.not_judged)}: {because}"


def late_json(case: Case) -> dict[str, Any]:
    """What `coverable verify --json` prints where the time ran out before there was a problem."""
    refusal = {"row": None, "share": None, "text": _late(case)}
    return {
        "verdict": "does not hold",
        "claim": None,
        "cells": 0,
        "refusals": [refusal],
        **{key: [] for key in ("missed", "not_judged", "collisions", "notes")},
        **dict.fromkeys(("reached", "certificate", "proof", "boxes", "treated")),
        "in_time": False,
        "robot": case.robot.name or str(case.robot.urdf),
        "version": version(),
    }


def late_text(case: Case) -> str:
    """The same for people."""
    return "\n".join(
        summary(LATE, [("case", case.name), ("but", _late(case))], checked_words(None))
    )


def _late(case: Case) -> str:
    """That loading took all of the time."""
    limit = case.search.time_limit
    return NOT_IN_TIME.format(limit) + "; the arm was being loaded and the surface cut into cells"


def _measured(found: Verification) -> str:
    """The figures of a motion in one line; empty where there are none."""
    if found.certificate is None:
        return ""
    # A greedy search without a tolerance in its task has one of its own.
    own = found.claim == "tree" and found.task.tolerance is None
    allowed = None if own else found.task.effective_tolerance
    return certificate_text(found.robot, found.certificate, found.q, found.task, allowed, "row")
