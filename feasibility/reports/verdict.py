"""A verdict as one JSON object, as text for people, and its motion as a table."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from feasibility.cases import OWN_KEYS, Case
from feasibility.paper import tree_walk
from feasibility.reports.text import filled
from feasibility.results import plain
from feasibility.verdict import Answer, Cause, CauseKind, Evidence, Verdict
from feasibility.version import version
from surfaces import Cells

DETAILS = 3  # cells of one group whose details are told

SENTENCES = {
    Answer.FEASIBLE: "feasible: one continuous motion covers the whole surface.",
    Answer.INFEASIBLE: "infeasible: no single continuous motion covers the whole surface.",
    Answer.UNDECIDED: "undecided: neither a covering motion nor its impossibility was established.",
}
GREEDY_NO = "infeasible: not found by the greedy search, which cannot rule a motion out."
EVIDENCE = {
    Evidence.WITNESS: "a motion that an independent replay accepted, between its waypoints too",
    Evidence.PROOF: "a bound shows that at least one cell cannot be covered",
    Evidence.EXHAUSTED: "the search ran to its end at the stated resolution",
    Evidence.BUDGET: "the search was stopped, or what it found could not be certified",
}
CAUSES = {
    CauseKind.OUT_OF_REACH: "out of reach",
    CauseKind.JOINT_LIMITS: "joint limits",
    CauseKind.ORIENTATION: "orientation (the tool axis cannot come inside the cone)",
    CauseKind.COLLISION: "collision",
    CauseKind.DISCONNECTED: "reachable, but not by the motion that covers the rest",
}


def as_json(verdict: Verdict, before_s: float = 0.0) -> dict[str, Any]:
    """The verdict as the object that `coverable check --json` prints.

    Args:
        verdict: of either method.
        before_s: seconds of imports and files before the check began; they count as loading.
    """
    return {
        "verdict": str(verdict.answer),
        "evidence": str(verdict.evidence),
        "cells": len(verdict.cells),
        "covered": verdict.n_covered,
        "edges": verdict.n_edges,
        "uncovered": [
            {
                "cell": list(verdict.cells.unravel(cause.cell)),
                "cause": str(cause.kind),
                "proved": bool(cause.proved),
                "detail": cause.detail,
            }
            for cause in verdict.causes
        ],
        "certificate": _certificate(verdict),
        "timing": {key: round(value, 6) for key, value in _seconds(verdict, before_s).items()},
        "robot": verdict.robot.name,
        "method": verdict.method,
        "seed": int(verdict.seed),
        "version": version(),
        "message": verdict.message,
    }


def _certificate(verdict: Verdict) -> dict[str, Any] | None:
    """What the replay measured, with angles in degrees; null where it measured nothing."""
    certificate = verdict.certificate
    if certificate is None:
        return None
    return {
        "waypoints": int(certificate.waypoints),
        "max_position_error_m": plain(float(certificate.max_position_error)),
        "max_angle_deg": plain(math.degrees(certificate.max_angle)),
        "min_limit_margin_deg": plain(_turning_margin(verdict)),
    }


def _turning_margin(verdict: Verdict) -> float:
    """Degrees that the turning joints keep from their limits; inf without such limits.

    The certificate's own margin mixes radians and metres where an arm has sliding joints. Limits
    are convex, so the waypoints of the walk decide.
    """
    robot, certificate = verdict.robot, verdict.certificate
    turns = ~robot.prismatic
    if certificate is None or (robot.prismatic.any() and verdict.witness is None):
        return math.inf
    if turns.all() or verdict.witness is None:
        return math.degrees(certificate.min_limit_margin)
    q = verdict.witness.q
    margins = np.minimum(q - robot.lower, robot.upper - q)[:, turns]
    return math.degrees(float(margins.min(initial=np.inf)))


def as_text(verdict: Verdict, case: Case, before_s: float = 0.0) -> str:
    """The verdict for people: the answer first, what it rests on, why cells are missed."""
    head = SENTENCES[verdict.answer]
    if verdict.answer is Answer.INFEASIBLE and verdict.method == "greedy":
        head = GREEDY_NO
    rows = [
        ("case", f"{case.name}  {case.description}".rstrip()),
        ("covered", f"{verdict.n_covered:,} of {len(verdict.cells):,} cells in one motion"),
        ("edges", f"{verdict.n_edges:,} of {len(verdict.cells.pairs):,}"),
        ("evidence", f"{verdict.evidence}: {EVIDENCE[verdict.evidence]}"),
        ("found", verdict.message),
        ("certificate", _certificate_text(verdict)),
        ("time", _time_text(_seconds(verdict, before_s))),
    ]
    lines = [head, "", *(filled(f"  {name:<12}", text) for name, text in rows if text)]
    groups = list(causes_listed(verdict.causes, verdict.cells))
    if groups:
        lines += ["", "Not covered:", *groups]
    hints = _hints(verdict)
    if hints:
        lines += ["", "To try next:", *(f"  {hint}" for hint in hints)]
    return "\n".join(lines)


def _certificate_text(verdict: Verdict) -> str:
    """The certificate in one line."""
    found = _certificate(verdict)
    if found is None or verdict.certificate is None:
        return ""
    parts = [f"{found['waypoints']:,} waypoints"]
    error = verdict.certificate.max_position_error
    allowed = verdict.task.tolerance
    parts.append(
        f"tool point within {1e3 * error:.3g} mm of its surface"
        + (f" (allowed {1e3 * allowed:.3g})" if allowed is not None else "")
    )
    parts.append(
        f"tool axis within {found['max_angle_deg']:.4g} deg (allowed {verdict.task.cone_deg:g})"
    )
    if found["min_limit_margin_deg"] is not None:
        parts.append(f"joints at least {found['min_limit_margin_deg']:.3g} deg from their limits")
    return "; ".join(parts)


def _time_text(seconds: dict[str, float]) -> str:
    """The timing in one line."""
    return (
        f"{seconds['total_s']:.2f} s (loading {seconds['load_s']:.2f}, "
        f"search {seconds['search_s']:.3f}, certificate {seconds['certify_s']:.3f})"
    )


def _seconds(verdict: Verdict, before_s: float) -> dict[str, float]:
    """The four times of a verdict, zero where one was not taken."""
    keys = ("load_s", "search_s", "certify_s", "total_s")
    seconds = {key: float(verdict.timing.get(key, 0.0)) for key in keys}
    return seconds | {key: seconds[key] + before_s for key in ("load_s", "total_s")}


def causes_listed(missed: Iterable[Cause], cells: Cells) -> Iterator[str]:
    """Causes grouped by kind, the largest group first, with the first few details."""
    groups: dict[tuple[CauseKind, bool], list[Cause]] = {}
    for cause in missed:
        groups.setdefault((cause.kind, cause.proved), []).append(cause)
    for (kind, proved), causes in sorted(groups.items(), key=lambda item: -len(item[1])):
        number = len(causes)
        counted = "1 cell" if number == 1 else f"{number:,} cells"
        yield f"  {counted}: {CAUSES[kind]}{', proved' if proved else ''}"
        for cause in causes[:DETAILS]:
            yield f"    {list(cells.unravel(cause.cell))} {cause.detail}".rstrip()
        if number > DETAILS:
            yield f"    ... and {number - DETAILS:,} more (--json lists all)"


def _hints(verdict: Verdict) -> list[str]:
    """What to try next."""
    if verdict.answer is Answer.FEASIBLE:
        stored = verdict.witness is not None or verdict.tree is not None
        walk = ["--witness walk.csv writes the motion"] if stored else []
        more = [
            "coverable path, with the same case, puts the cells in order and times the motion",
            "coverable explain says how much may change before it breaks",
        ]
        whole = verdict.witness is not None and len(verdict.cells)
        return [*walk, "--html view.html shows it", *(more if whole else [])]
    hints = []
    if not verdict.task.cone_deg > 0.0:
        hints.append("--set task.cone_deg=1 leaves a motion some room")
    elif verdict.answer is Answer.UNDECIDED and "time limit" in verdict.message:
        hints.append("--set search.time_limit=... gives the search more time")
    elif verdict.method == "greedy":
        hints.append("--set search.method=complete searches all postures of the arm")
        hints.append("--set search.moves=all lets several joints move at once")
    if verdict.method == "complete" and verdict.answer is Answer.INFEASIBLE:
        hints.append("coverable explain, with the same case, says what would make it feasible")
        if verdict.covered.any():
            hints.append("coverable divide finds the fewest motions that cover what can be covered")
    kinds = {cause.kind for cause in verdict.causes}
    if kinds & {CauseKind.OUT_OF_REACH, CauseKind.JOINT_LIMITS}:
        hints.append("--set 'surface.position=[x, y, z]' moves the surface nearer to the arm")
    if CauseKind.JOINT_LIMITS in kinds:
        hints.append("--set robot.limits=... tries other joint limits (`coverable robots`)")
    if CauseKind.ORIENTATION in kinds and verdict.task.cone_deg > 0.0:
        hints.append(f"--set task.cone_deg=... opens the cone ({verdict.task.cone_deg:g} now)")
    if CauseKind.DISCONNECTED in kinds:
        hints.append(f"{_narrower(verdict)} leaves out what needs a second motion")
    shows = "it" if verdict.covered.all() else "which cells are missed"
    hints.append(f"--html view.html shows {shows}")
    return hints


def _narrower(verdict: Verdict) -> str:
    """How a case says that less is to be covered."""
    kind = verdict.cells.surface.kind
    own = OWN_KEYS.get(kind, ())
    ranges = [f"surface.{key}" for key in ("u_deg", "u", "v_deg", "v") if key in own]
    if ranges:
        return f"a narrower {' or '.join(ranges)}"
    if kind == "piecewise":
        return "a narrower or smaller choice of surface.pieces"
    return "a part of the mesh (surface.box, cut, facing or faces)"


def witness_csv(verdict: Verdict) -> str | None:
    """The covering motion as CSV: `cell`, then one column per joint; None where there is none.

    Floats are written so that they read back as the same numbers. That of a greedy search is its
    tree, which enters the cells and need not pass their centres, see `tree_walk`.
    """
    if verdict.answer is not Answer.FEASIBLE:
        return None
    walk = tree_walk(verdict) if verdict.method == "greedy" else verdict.witness
    if walk is None:
        return None
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["cell", *verdict.robot.joint_names])
    for cell, q in zip(walk.cell.tolist(), walk.q.tolist(), strict=True):
        writer.writerow(["" if cell < 0 else cell, *map(repr, q)])
    return text.getvalue()
