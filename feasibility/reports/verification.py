"""What became of a claim, as one JSON object and as text."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from coverable_errors import counted
from feasibility.collisions import checked, said_of
from feasibility.reports.parts import (
    certificate_text,
    measured_json,
    summary,
)
from feasibility.reports.proof import proof_json
from feasibility.verifying import Verification
from feasibility.version import version

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
        "collisions": checked(found.task.collision),
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
        reached = f"{int(found.reached.sum()):,} of {counted(len(found.cells), 'cell')} reached"
        rows.append(("cells", reached))
    rows += [("certificate" if found.holds else "measured", _measured(found))]
    if found.proof is not None and found.holds:
        rows.append(("checked", counted(found.boxes, "box", "boxes")))
    rows += [("note", note) for note in notes]
    answer = f"{head}: {WORDS[found.claim][not found.holds]}."
    return "\n".join(summary(answer, rows, said_of(found.robot, found.task.collision)))


def _measured(found: Verification) -> str:
    """The figures of a motion in one line; empty where there are none."""
    if found.certificate is None:
        return ""
    # A greedy search without a tolerance in its task has one of its own.
    own = found.claim == "tree" and found.task.tolerance is None
    allowed = None if own else found.task.effective_tolerance
    return certificate_text(found.robot, found.certificate, found.q, found.task, allowed, "row")
