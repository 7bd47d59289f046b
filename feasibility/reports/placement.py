"""Placements as one JSON object, as text for people, and as a table of all that were tried."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from coverable.arrays import Array
from coverable.errors import at_least, counted
from feasibility.collisions.asked_bodies import said_of
from feasibility.collisions.words import checked
from feasibility.placement.map import PlacementMap
from feasibility.placement.placements import Placements
from feasibility.placement.region import AXES, Pose
from feasibility.placement.stations import StationPlan
from feasibility.placement.trials import Trial
from feasibility.reports.objects_and_csv import csv_text
from feasibility.reports.shortfalls import CAUSES
from feasibility.reports.text_and_tables import aligned, summary
from feasibility.reports.verdict import EVIDENCE
from feasibility.verdict import Answer, CauseKind, Evidence
from feasibility.version import version

SENTENCES = {
    Answer.FEASIBLE: "feasible: the surface can be covered in one motion at the placements below.",
    Answer.INFEASIBLE: "none in the region: no placement there was found to be feasible.",
    Answer.UNDECIDED: "undecided: no placement was shown to be feasible, nor that there is none.",
}
PROVED = "none in the region: no placement there is feasible."
COLUMNS = ("x_m", "y_m", "z_m", *AXES[3:], "tried", "share", "margin_m", "verdict")


def settings_of(pose: Pose) -> list[str]:
    """The values of `--set` that put a case's surface there."""
    position, rpy = (", ".join(repr(v) for v in part) for part in pose)
    return [f"surface.position=[{position}]", f"surface.rpy_deg=[{rpy}]"]


def as_json(
    placements: Placements, plan: StationPlan | None = None, chart: PlacementMap | None = None
) -> dict[str, Any]:
    """Placements as the object that `coverable place --json` prints, with stations and map."""
    best = placements.best
    return {
        "answer": str(placements.answer),
        "evidence": str(placements.evidence),
        "message": placements.message,
        "region": {
            name: list(pair) for name, pair in zip(AXES, placements.region.ranges, strict=True)
        },
        "placements": [_found_json(trial) for trial in placements.found],
        "best": None if best is None else _found_json(best),
        "share": placements.share if _searched(best) else None,
        "collisions": checked(placements.task.collision),
        "cause": None if placements.cause is None else str(placements.cause),
        "causes": dict(placements.causes),
        "stations": None if plan is None else _stations_json(plan),
        "map": None if chart is None else _map_json(chart),
        "statistics": dict(placements.statistics),
        "timing": {key: round(value, 6) for key, value in placements.timing.items()},
        "robot": placements.robot.name,
        "version": version(),
    }


def _found_json(trial: Trial) -> dict[str, Any]:
    """One placement, without its components."""
    return {
        "position": list(trial.pose.position),
        "rpy_deg": list(trial.pose.rpy_deg),
        "tried": _tried(trial),
        "share": trial.share,
        "margin_m": trial.margin,
        "cells": int(trial.result.get("cells", 0)),
        "verdict": str(trial.answer),
        "evidence": str(trial.evidence),
        "message": trial.message,
        "causes": dict(trial.result.get("causes", {})),
    }


def _tried(trial: Trial) -> str:
    """How a placement was tried, in a word."""
    return "failed" if trial.failed else trial.effort


def _stations_json(plan: StationPlan) -> dict[str, Any]:
    """The stations and their cells; cells as flat indices."""
    return {
        "optimal": plan.optimal,
        "at_least": plan.bound,
        "left_out": plan.cells(-1).tolist(),
        "not_judged": list(plan.not_judged),
        "stations": [
            {
                "position": list(trial.pose.position),
                "rpy_deg": list(trial.pose.rpy_deg),
                "cells": plan.cells(k).tolist(),
                "certified": not plan.refusals[k],
            }
            for k, trial in enumerate(plan.trials)
        ],
    }


def _map_json(chart: PlacementMap) -> dict[str, Any]:
    """The map; null where no search was run."""
    return {
        "axes": list(chart.axes),
        "ticks": [ticks.tolist() for ticks in chart.ticks],
        "held": dict(zip(AXES, chart.held.values.tolist(), strict=True)),
        "share": _nulled(chart.share),
        "margin_m": _nulled(chart.margin),
    }


def _nulled(values: Array) -> Any:
    """Nested lists with None in place of NaN."""
    plain = values.astype(object)
    plain[np.isnan(values)] = None
    return plain.tolist()


def as_text(placements: Placements, case: str = "", plan: StationPlan | None = None) -> str:
    """Placements for people: the answer, where the surface can stand, or why it cannot."""
    proved = placements.answer is Answer.INFEASIBLE and placements.evidence == "proof"
    ranges = [
        f"{name.removesuffix('_deg')} {low:g} .. {high:g} {'deg' if name.endswith('_deg') else 'm'}"
        for name, (low, high) in zip(AXES, placements.region.ranges, strict=True)
        if low < high
    ]
    evidence = EVIDENCE[placements.evidence]
    if placements.answer is Answer.INFEASIBLE:
        evidence = (
            "the reach bound, over the whole region"
            if proved
            else "placements sampled over the region and refined; one between them may be feasible"
        )
    why = "no placement was searched"
    if placements.evidence is Evidence.PROOF:
        why = "placements that the reach bound rules out are not searched"
    missed = [(CauseKind(kind), number) for kind, number in placements.causes.items()]
    tried = placements.trials[:1] if not placements.found else ()
    checked = "".join(trial.message for trial in tried)
    rows = [
        ("case", case),
        ("region", ", ".join(ranges)),
        ("evidence", f"{placements.evidence}: {evidence}"),
        ("found", placements.message),
        ("cause", "" if placements.cause is None else CAUSES[placements.cause]),
        ("missed", "; ".join(f"{counted(n, 'cell')}: {CAUSES[k]}" for k, n in missed)),
        ("share", "" if _searched(placements.best) else f"not known: {why}"),
        ("check", "" if checked in placements.message else f"of the best: {checked}"),
        ("time", _time_text(placements)),
    ]
    said = said_of(placements.robot, placements.task.collision)
    lines = summary(PROVED if proved else SENTENCES[placements.answer], rows, said, 10)
    if placements.found:
        lines += ["", *_table(placements.found)]
        put = " ".join(f"--set '{setting}'" for setting in settings_of(placements.found[0].pose))
        lines += ["", f"the best as a case: {put}"]
    elif placements.best is not None and _searched(placements.best):
        lines += ["", "the best of them:", *_table([placements.best])]
    if plan is not None:
        lines += ["", *_stations_text(plan)]
    return "\n".join(lines)


def _time_text(placements: Placements) -> str:
    """Seconds of the search, and of the command, which may do more."""
    command = placements.timing.get("command_s")
    more = "" if command is None else f" ({command:.2f} s with loading, stations, map and view)"
    return f"{placements.timing['total_s']:.2f} s{more}"


def _searched(trial: Trial | None) -> bool:
    """Was a covering motion looked for at a placement? Else its share is unknown, not 0."""
    return trial is not None and not trial.failed


def _table(trials: Sequence[Trial]) -> list[str]:
    """Placements as aligned lines; the margin only where there is one."""
    heads = [f"{name} (m)" for name in AXES[:3]]
    heads += [f"{name.removesuffix('_deg')} (deg)" for name in AXES[3:]] + ["share (%)"]
    feasible = any(trial.feasible for trial in trials)
    rows = [heads + ["margin (mm)"] * feasible]
    for trial in trials:
        row = [f"{v:.3f}" for v in trial.pose.position] + [f"{v:.2f}" for v in trial.pose.rpy_deg]
        row.append(f"{100.0 * trial.share:.1f}")
        rows.append(row + [at_least(1e3 * trial.margin, 3)] * feasible)
    return [f"  {line}" for line in aligned(rows, ">")]


def _stations_text(plan: StationPlan) -> list[str]:
    """The stations, one a line."""
    number = len(plan.trials)
    if number == 0:
        return ["no stations: no motion found covers any cell"]
    proof = f"at least {plan.bound} are needed"
    if plan.optimal:
        proof = "proved to be the fewest among the motions found"
    poses = len({trial.pose for trial in plan.trials})
    where = f", at {counted(poses, 'placement')}" if poses < number else ""
    lines = [f"{counted(number, 'station')}{where} ({proof}):"]
    for k, (trial, refusal) in enumerate(zip(plan.trials, plan.refusals, strict=True)):
        size = len(plan.cells(k))
        cells = f"{size:5d} cell{'' if size == 1 else 's'}"
        position = ", ".join(f"{v:.3f}" for v in trial.pose.position)
        angles = ", ".join(f"{v:.2f}" for v in trial.pose.rpy_deg)
        refused = f" (not certified: {refusal})" if refusal else ""
        lines.append(f"  {cells} at {position} m, {angles} deg{refused}")
    lines += [f"  not judged of them together: {', '.join(plan.not_judged)}"] * bool(
        plan.not_judged
    )
    missed = len(plan.cells(-1))
    nowhere = f"  {missed:5d} cells are covered at no placement that was tried"
    return [*lines, nowhere] if missed else lines


def as_csv(placements: Placements) -> str:
    """All placements tried, the best first; m and degrees."""
    rows: list[tuple[Any, ...]] = [COLUMNS]
    for trial in placements.trials:
        row = _tried(trial), trial.share, trial.margin, trial.answer
        rows.append((*trial.pose.values.tolist(), *row))
    return csv_text(rows)
