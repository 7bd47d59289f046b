"""Passes in several runs as text and JSON: what each works on, and why it ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from coverable.errors import counted
from feasibility.collisions.asked_bodies import said_of
from feasibility.collisions.words import checked
from feasibility.demands.area import TreatedArea
from feasibility.demands.treated_words import treated_json, treated_words
from feasibility.division.pass_planning import PlannedPasses
from feasibility.division.pass_runs import Interruption, PassRuns
from feasibility.reports.objects_and_csv import certificate_json, smooth_json
from feasibility.reports.text_and_tables import aligned, smooth_text, summary
from feasibility.timing.sampled_trajectory import Trajectory
from feasibility.version import version
from surfaces.passes.parallel import Passes

FEWEST = "no fewer with the configurations found"
LISTED = 3  # gaps that are named


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
        "passes": passes_json(along.passes, treated),
        "runs": [
            {
                "stretches": [1 + stretch for stretch in found.stretches_of(run)],
                "poses": [int(run.visits[0]), int(run.visits[-1])],
                "length_m": run.figures.length,
                "duration_s": trajectory.duration,
                "certificate": certificate_json(run.certificate),
            }
            for run, trajectory in zip(found.runs, timed, strict=True)
        ],
        "cuts": [_cut_json(cut, found) for cut in found.cuts],
        "left_out_m": found.left_out,
        "left_out": [
            {
                "stretches": [1 + stretch for stretch in gap.stretches],
                "length_m": gap.length,
                "cause": gap.cause,
                "proved": gap.proved,
            }
            for gap in found.gaps
        ],
        "refused": list(found.refusals),
        "treated": treated_json(treated),
        **smooth_json(along.passes.surface),
        "collisions": checked(along.task.collision),
        "robot": found.robot.name,
        "version": version(),
    }


def passes_json(passes: Passes, treated: TreatedArea | None) -> dict[str, Any]:
    """How passes are laid out; `treated` is what their motion treats."""
    return {
        "count": passes.count,
        "stretches": len(passes.stretches),
        "by": passes.by,
        "pitch_m": passes.pitch,
        "spacing_m": passes.spacing,
        "widest_m": passes.widest,
        "length_m": passes.length,
        "dropped_m": passes.dropped,
        "beyond_border_m": passes.beyond_border,
        "notes": [*passes.notes, *_stripes(passes, treated)],
    }


def passes_text(passes: Passes, treated: TreatedArea | None) -> str:
    """Passes in words; `treated` is what their motion treats."""
    words = f"{passes.count}, {1e3 * passes.spacing:.4g} mm apart"
    if passes.widest > 1.001 * passes.spacing:
        words += f" ({1e3 * passes.widest:.4g} mm where the surface slopes)"
    if len(passes.stretches) > passes.count:
        words += f", in {len(passes.stretches)} stretches"
    words += f", {passes.length:.4g} m together"
    if passes.dropped > 0.0:
        words += f"; {passes.dropped:.3g} m left out in pieces too short to run"
    return "; ".join([words, *passes.notes, *_stripes(passes, treated)])


def _stripes(passes: Passes, treated: TreatedArea | None) -> tuple[str, ...]:
    """That passes are too far apart for the footprint, where something is measured to be untreated.

    Passes that cross may treat what lies between, and stripes may be too narrow to measure.
    """
    if treated is None or not treated.untreated or passes.widest <= treated.footprint[1]:
        return ()
    across, between = 1e3 * treated.footprint[1], 1e3 * passes.widest
    return (
        f"the passes are up to {between:.4g} mm apart and the footprint is {across:.4g} mm wide: "
        f"stripes up to {between - across:.3g} mm wide are left between them",
    )


def _cut_json(cut: Interruption, found: PassRuns) -> dict[str, Any]:
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
        f"{count} runs with {counted(stops, 'interruption')} work on them."
        if count > 1
        else "one run works on a part of them."
        if count
        else "no part of them can be run."
    )
    rows = [
        ("passes", passes_text(along.passes, treated)),
        ("one motion", along.verdict.message),
        ("runs", f"{count}, {FEWEST}" if count > 1 else str(count) * count),
        ("left out", _left_words(along, found)),
        ("refused", "; ".join(found.refusals)),
        ("smoothed", smooth_text(along.passes.surface)),
        ("treated", "" if treated is None else treated_words(treated)),
    ]
    lines = summary(head, rows, said_of(found.robot, along.task.collision), 14)
    if count:
        lines += ["", *(f"  {line.rstrip()}" for line in aligned(_table(found, timed)))]
    for number, cut in enumerate(found.cuts, start=1):
        lines += ["", f"  run {number} to {number + 1}: {cut.cause}"]
        lines += [f"    move {cut.move.described()}"]
        lines += [f"    {cut.move.refusal}"] * bool(cut.move.refusal)
    return "\n".join(lines)


def _left_words(along: PlannedPasses, found: PassRuns) -> str:
    """How much is left out, where, and why."""
    if not found.gaps:
        return ""
    words = f"{found.left_out:.4g} m of {along.passes.length:.4g} m of passes"
    for gap in found.gaps[:LISTED]:
        why = f" ({gap.cause}{', proved' if gap.proved else ''})" if gap.cause else ""
        words += f"; of {_stretch_words(gap.stretches)}{why}"
    more = len(found.gaps) - LISTED
    return words + (f"; and {counted(more, 'more gap')}" if more > 0 else "")


def _stretch_words(stretches: Sequence[int]) -> str:
    """'stretch 3' or 'stretches 3 to 7'."""
    first, last = 1 + stretches[0], 1 + stretches[-1]
    return f"stretch {first}" if first == last else f"stretches {first} to {last}"


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
