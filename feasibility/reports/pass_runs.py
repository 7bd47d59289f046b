"""Passes in several runs as text and JSON: what each works on, and why it ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from feasibility.collisions import checked
from feasibility.reports.parts import aligned, certificate_json, clearance_json, summary
from feasibility.reports.path import passes_json, passes_text
from feasibility.runs import Cut, PassRuns, PlannedPasses
from feasibility.timing import Trajectory
from feasibility.treated import TreatedArea, treated_json, treated_words
from feasibility.version import version

FEWEST = "no fewer with the configurations found"


def as_json(
    along: PlannedPasses,
    found: PassRuns,
    timed: Sequence[Trajectory],
    treated: TreatedArea | None,
) -> dict[str, Any]:
    """The object that `coverable path --passes --json` prints where there are several runs.

    Args:
        along: the passes, and the verdict on one motion along all of them.
        found: the runs.
        timed: their trajectories.
        treated: what all runs together treat.
    """
    return {
        "verdict": str(along.verdict.answer),
        "evidence": str(along.verdict.evidence),
        "message": along.verdict.message,
        "passes": passes_json(along.passes),
        "runs": [
            {
                "stretches": [1 + stretch for stretch in found.stretches_of(run)],
                "poses": [int(run.visits[0]), int(run.visits[-1])],
                "length_m": run.figures.length,
                "duration_s": trajectory.duration,
                "certificate": certificate_json(run.certificate) | clearance_json(run.certificate),
            }
            for run, trajectory in zip(found.runs, timed, strict=True)
        ],
        "cuts": [_cut_json(cut, found) for cut in found.cuts],
        "left_out_m": found.left_out,
        "refused": list(found.refusals),
        "treated": treated_json(treated),
        "collisions": checked(along.task.collision),
        "robot": found.robot.name,
        "version": version(),
    }


def _cut_json(cut: Cut, found: PassRuns) -> dict[str, Any]:
    """One interruption."""
    return {
        "stretch": None if cut.stretch < 0 else 1 + cut.stretch,
        "along_m": cut.along,
        "poses": [cut.pose, cut.next_pose],
        "cause": cut.cause,
        "joints": list(found.robot.joint_names),
        "waypoints": cut.move.waypoints.tolist(),
        "clear": not cut.move.refusal,
        "refusal": cut.move.refusal,
    }


def as_text(
    along: PlannedPasses,
    found: PassRuns,
    timed: Sequence[Trajectory],
    treated: TreatedArea | None,
) -> str:
    """The runs for people; the arguments are those of `as_json`."""
    count = len(found.runs)
    stops = max(count - 1, 0)
    head = f"{along.verdict.answer}: no single motion along these passes is known; "
    head += (
        f"{count} runs with {stops} interruption{'' if stops == 1 else 's'} work on them."
        if count > 1
        else "one run works on a part of them."
        if count
        else "no part of them can be run."
    )
    left = f"{found.left_out:.4g} m of {along.passes.length:.4g} m of passes"
    rows = [
        ("passes", passes_text(along.passes)),
        ("one motion", along.verdict.message),
        ("runs", f"{count}, {FEWEST}" if count else ""),
        ("left out", left if found.left_out > 0.0 else ""),
        ("refused", "; ".join(found.refusals)),
        ("treated", "" if treated is None else treated_words(treated)),
    ]
    lines = summary(head, rows, along.task.collision, 14)
    if count:
        lines += ["", *(f"  {line.rstrip()}" for line in aligned(_table(found, timed)))]
    for number, cut in enumerate(found.cuts, start=1):
        lines += ["", f"  run {number} to {number + 1}: {cut.cause}"]
        lines += [f"    move {cut.move.described()}"]
        lines += [f"    {cut.move.refusal}"] * bool(cut.move.refusal)
    return "\n".join(lines)


def _table(found: PassRuns, timed: Sequence[Trajectory]) -> list[list[str]]:
    """A row a run."""
    rows = [["run", "stretches", "length", "time", "axis within"]]
    for number, (run, trajectory) in enumerate(zip(found.runs, timed, strict=True), start=1):
        own = [1 + stretch for stretch in found.stretches_of(run)]
        which = f"{own[0]} to {own[-1]}" if len(own) > 1 else ", ".join(map(str, own))
        angle = math.degrees(run.certificate.max_angle)
        rows.append(
            [str(number), which, f"{run.figures.length:.4g} m", f"{trajectory.duration:.4g} s",
             f"{angle:.3g} deg"]
        )  # fmt: skip
    return rows
