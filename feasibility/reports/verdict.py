"""A verdict as one JSON object, as text for people, and its motion as a table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from coverable.errors import counted
from feasibility.cases.case import Case
from feasibility.cases.surface_reading import OWN_KEYS
from feasibility.collisions.asked_bodies import said_of
from feasibility.collisions.words import checked
from feasibility.reports.text_and_tables import (
    causes_json,
    certificate_text,
    left_out_json,
    left_out_text,
    measured_json,
    placement_text,
    seconds,
    seconds_text,
    smooth_json,
    smooth_text,
    summary,
    walk_csv,
)
from feasibility.treated.treated_words import share_words, treated_json, treated_words
from feasibility.verdict import Answer, Cause, CauseKind, Evidence, Verdict, Walk
from feasibility.version import version
from surfaces.cells import Cells

DETAILS = 3  # cells of one group whose details are listed
JSON_HINT = " (--json lists all)"  # of commands, behind what is left out
ENOUGH = 0.99  # [1] share of the area, below which it is said how to treat more
OVERLAPPING = 0.9  # [1] of the footprint: passes that far apart leave nothing between them
PHASES = {"search_s": "search", "certify_s": "certificate"}

SENTENCES = {
    Answer.FEASIBLE: "feasible: one continuous motion covers the whole surface.",
    Answer.INFEASIBLE: "infeasible: no single continuous motion covers the whole surface.",
    Answer.UNDECIDED: "undecided: neither a covering motion nor a proof against one was found.",
}
FEASIBLE_CELLS = "feasible: one continuous motion visits every cell"
EMPTY = "feasible: there are no cells, so there is nothing to cover; the arm was not looked at."
GREEDY_NO = "infeasible: not found by the greedy search, which cannot rule a motion out."
EVIDENCE = {
    Evidence.WITNESS: "a motion that an independent replay accepted, between its waypoints too",
    Evidence.PROOF: "a bound shows that at least one cell cannot be covered",
    Evidence.EXHAUSTED: "the search ran to its end at the stated resolution",
    Evidence.BUDGET: "the search was stopped, or what it found could not be certified",
}
CUT = "cuts through the joint space, which no motion crosses, separate cells from each other"
SHORT = "a motion visits every cell, but it is not shown to treat enough of the area"
CAUSES = {
    CauseKind.OUT_OF_REACH: "out of reach",
    CauseKind.JOINT_LIMITS: "joint limits",
    CauseKind.ORIENTATION: "orientation (the tool cannot be held as required)",
    CauseKind.COLLISION: "collision",
    CauseKind.DISCONNECTED: "reachable, but not by the motion that covers the rest",
}


def as_json(verdict: Verdict, before_s: float = 0.0) -> dict[str, Any]:
    """The verdict as the object that `coverable check --json` prints.

    Args:
        verdict: of either method.
        before_s: seconds of imports and files before the check began; they count as loading.
    """
    q = None if verdict.witness is None else verdict.witness.q
    return {
        "verdict": str(verdict.answer),
        "evidence": str(verdict.evidence),
        "cells": len(verdict.cells),
        "covered": verdict.n_covered,
        "edges": verdict.n_edges,
        "uncovered": causes_json(verdict.causes, verdict.cells),
        "certificate": measured_json(verdict.robot, verdict.certificate, q),
        "collisions": checked(verdict.task.collision),
        "unchecked_links": list(verdict.unchecked_links),
        "pairs_left_out": [left_out_json(one) for one in verdict.pairs_left_out],
        "proof": _proof(verdict),
        "treated": treated_json(verdict.treated),
        **smooth_json(verdict.cells.surface),
        "timing": seconds(verdict.timing, PHASES, before_s),
        "robot": verdict.robot.name,
        "method": verdict.method,
        "seed": int(verdict.seed),
        "version": version(),
        "message": _message(verdict),
    }


def _proof(verdict: Verdict) -> dict[str, Any] | None:
    """The proof as JSON, where there is one."""
    if verdict.proof is None:
        return None
    from feasibility.reports.proof import tree_json

    return tree_json(verdict.proof, verdict.robot, verdict.cells)


def _message(verdict: Verdict) -> str:
    """What was found, and whether the time ran out before the causes were looked into."""
    missed = len(verdict.cells) - verdict.n_covered
    if len(verdict.causes) == missed:
        return verdict.message
    why = "a cell is" if missed == 1 else f"{missed:,} cells are"
    return f"{verdict.message} Why {why} missed was not looked into: the time limit ran out."


def as_text(verdict: Verdict, case: Case, before_s: float = 0.0) -> str:
    """The verdict for people: the answer first, its evidence, why cells are missed.

    The arguments are those of `as_json`, and the case for its name.
    """
    title = ("case", f"{case.name}  {case.description}".rstrip())
    said = said_of(verdict.robot, verdict.task.collision)
    if not len(verdict.cells):
        return "\n".join(summary(EMPTY, [title], said))
    head = _with_share(SENTENCES[verdict.answer], verdict)
    if verdict.answer is Answer.INFEASIBLE and verdict.method == "greedy":
        head = GREEDY_NO
    rows = [
        title,
        *rows_of(verdict),
        ("no shape", ", ".join(verdict.unchecked_links)),
        ("left out", left_out_text(verdict.pairs_left_out)),
        ("time", seconds_text(verdict.timing, PHASES, before_s)),
    ]
    lines = summary(head, rows, said)
    if verdict.proof is not None and verdict.proof.n_cuts > 1:
        lines += ["", "Why no single motion covers every cell:"]
        from feasibility.cut_words import lines as proof_lines

        lines += [f"  {line}" for line in proof_lines(verdict.proof, verdict.robot, verdict.cells)]
    groups = list(causes_listed(verdict.causes, verdict.cells))
    if groups:
        lines += ["", "Not covered:", *groups]
    hints = _hints(verdict, case)
    if hints:
        lines += ["", "To try next:", *(f"  {hint}" for hint in hints)]
    return "\n".join(lines)


def _with_share(sentence: str, verdict: Verdict) -> str:
    """The sentence; with a footprint how much of the area the motion treats, in its place."""
    task, treated = verdict.task, verdict.treated
    if treated is None:
        unknown = task.footprint is not None and verdict.feasible
        return f"{FEASIBLE_CELLS}; what it treats is not measured." if unknown else sentence
    treats = f"treats {share_words(treated)} of the area"
    if not _falls_short(verdict):
        return f"{FEASIBLE_CELLS} and {treats}."
    required = "" if task.coverage is None else f", where {100.0 * task.coverage:g} % is required"
    return f"undecided: one continuous motion visits every cell and {treats}{required}."


def rows_of(verdict: Verdict) -> list[tuple[str, str]]:
    """What every report of a verdict has: names, and a text each that may be empty."""
    return [
        ("covered", f"{verdict.n_covered:,} of {len(verdict.cells):,} cells in one motion"),
        ("edges", f"{verdict.n_edges:,} of {len(verdict.cells.pairs):,}"),
        ("evidence", f"{verdict.evidence}: {_evidence(verdict)}"),
        ("found", _message(verdict)),
        ("certificate", _certificate_text(verdict)),
        ("placement", placement_text(verdict.certificate)),
        ("smoothed", smooth_text(verdict.cells.surface)),
        ("treated", _treated_text(verdict)),
    ]


def _evidence(verdict: Verdict) -> str:
    """What the answer rests on."""
    if verdict.proof is not None and verdict.proof.kind == "cut":
        return CUT
    if _falls_short(verdict):
        return SHORT
    return EVIDENCE[verdict.evidence]


def _falls_short(verdict: Verdict) -> bool:
    """Does a motion that visits every cell treat too little of the area?"""
    return verdict.treated is not None and verdict.answer is Answer.UNDECIDED


def _certificate_text(verdict: Verdict) -> str:
    """The certificate in one line."""
    if verdict.certificate is None:
        return ""
    task, q = verdict.task, None if verdict.witness is None else verdict.witness.q
    return certificate_text(verdict.robot, verdict.certificate, q, task, task.tolerance)


def _treated_text(verdict: Verdict) -> str:
    """What the motion treats."""
    if verdict.treated is not None:
        return treated_words(verdict.treated)
    if verdict.task.footprint is None or not verdict.feasible:
        return ""
    return "not measured: " + (
        "the greedy search's motion need not pass the cells' centres"
        if verdict.method == "greedy"
        else "the time limit ran out"
    )


def causes_listed(missed: Iterable[Cause], cells: Cells, hint: str = JSON_HINT) -> Iterator[str]:
    """Causes grouped by kind, the largest group first, with the first few details."""
    groups: dict[tuple[CauseKind, bool], list[Cause]] = {}
    for cause in missed:
        groups.setdefault((cause.kind, cause.proved), []).append(cause)
    for (kind, proved), causes in sorted(groups.items(), key=lambda item: -len(item[1])):
        yield f"  {counted(len(causes), 'cell')}: {CAUSES[kind]}{', proved' if proved else ''}"
        for cause in causes[:DETAILS]:
            yield f"    {list(cells.unravel(cause.cell))} {cause.detail}".rstrip()
        if len(causes) > DETAILS:
            yield f"    ... and {len(causes) - DETAILS:,} more{hint}"


def _hints(verdict: Verdict, case: Case) -> list[str]:
    """What to try next."""
    if _falls_short(verdict):
        return _treating_more(verdict, case)
    if verdict.answer is Answer.FEASIBLE:
        stored = verdict.witness is not None or verdict.tree is not None
        walk = ["--witness walk.csv writes the motion"] if stored else []
        more = [
            "coverable path, with the same case, puts the cells in order and times the motion",
            "coverable explain finds how far the cone, the limits and the rest can be tightened",
        ]
        replayed = verdict.witness is not None and len(verdict.cells)
        treating = _treating_more(verdict, case)
        return [*treating, *walk, "--html view.html shows it", *(more if replayed else [])]
    hints = []
    if not verdict.task.cone_deg > 0.0:
        hints.append("--set task.cone_deg=1 gives the tool axis a tolerance")
    elif verdict.answer is Answer.UNDECIDED and "time limit" in verdict.message:
        hints.append("--set search.time_limit=... gives the search more time")
    elif verdict.answer is Answer.UNDECIDED and "limit of evaluations" in verdict.message:
        hints.append("--set search.evaluations=... lets the search try more")
    elif verdict.method == "greedy":
        hints.append("--set search.method=complete searches all postures of the arm")
        hints.append("--set search.moves=all lets several joints move at once")
    if verdict.method == "complete" and verdict.answer is Answer.INFEASIBLE:
        hints.append("coverable explain, with the same case, finds what would make it feasible")
        if verdict.covered.any():
            hints.append("coverable divide finds the fewest motions that cover what can be covered")
    kinds = {cause.kind for cause in verdict.causes}
    if kinds & {CauseKind.OUT_OF_REACH, CauseKind.JOINT_LIMITS}:
        hints.append("--set 'surface.position=[x, y, z]' moves the surface nearer to the arm")
    if CauseKind.JOINT_LIMITS in kinds:
        hints.append("--set robot.limits=... tries other joint limits (`coverable robots NAME`)")
    if CauseKind.ORIENTATION in kinds and verdict.task.cone_deg > 0.0:
        hints.append(f"--set task.cone_deg=... opens the cone ({verdict.task.cone_deg:g} now)")
        if verdict.task.roll is not None and verdict.task.roll_deg is not None:
            now = "{:g} to {:g} now".format(*verdict.task.roll_deg)
            hints.append(f"--set 'task.roll_deg=[..., ...]' widens the range of the roll ({now})")
    if CauseKind.DISCONNECTED in kinds:
        hints.append(f"{_narrower(verdict)} leaves out cells that need a second motion")
    shows = "it" if verdict.covered.all() else "which cells are missed"
    hints.append(f"--html view.html shows {shows}")
    return hints


def _treating_more(verdict: Verdict, case: Case) -> list[str]:
    """What would treat more of the area; nothing where enough is treated."""
    task, treated = verdict.task, verdict.treated
    if treated is None or task.disc is None:
        return []
    if treated.lower >= (ENOUGH if task.coverage is None else task.coverage):
        return []
    surface, hints = case.surface, []
    if surface.kind == "piecewise":
        hints.append('cells = "auto" in each of surface.pieces cuts cells as fine as the footprint')
    elif not surface.automatic:
        sized = "" if surface.values.get("cell_size") is None else "--set surface.cell_size= "
        hints.append(f"{sized}--set surface.cells=auto cuts cells as fine as the footprint")
    pitch = f"{OVERLAPPING * task.disc[1]:.2g}"
    hints.append(
        f"coverable path --passes best --pitch {pitch}, with the same case, runs passes that close"
    )
    if task.coverage is None:
        hints.append(f"--set task.coverage={ENOUGH:g} calls nothing feasible that treats less")
    return hints


def _narrower(verdict: Verdict) -> str:
    """The keys of a case that select a part of its surface."""
    kind = verdict.cells.surface.kind
    own = OWN_KEYS.get(kind, ())
    ranges = [f"surface.{key}" for key in ("u_deg", "u", "v_deg", "v") if key in own]
    if ranges:
        return f"a narrower {' or '.join(ranges)}"
    if kind == "piecewise":
        return "a narrower or smaller choice of surface.pieces"
    if kind in ("grid", "poses", "parametric"):
        return {"poses": "a part of the poses", "grid": "a part of the grid"}.get(
            kind, "a narrower u or v"
        )
    return "a part of it (surface.box, cut, facing or faces)"


def witness_json(verdict: Verdict) -> dict[str, Any] | None:
    """The covering motion as JSON values, as `coverable check --json --witness -` has it.

    Returns:
        `joints`, their names; `q`, a row a waypoint, rad or m, unwrapped; `cell`, the flat index of
        the cell whose centre the tool point is at in that row, null between centres. None where
        there is no motion.
    """
    walk = _walk(verdict)
    if walk is None:
        return None
    return {
        "joints": list(verdict.robot.joint_names),
        "q": walk.q.tolist(),
        "cell": [None if cell < 0 else cell for cell in walk.cell.tolist()],
    }


def _walk(verdict: Verdict) -> Walk | None:
    """The covering motion, also of the greedy search; None where there is none."""
    from feasibility.paper.tree_and_graph import tree_walk

    if verdict.answer is not Answer.FEASIBLE:
        return None
    return tree_walk(verdict) if verdict.method == "greedy" else verdict.witness


def as_csv(verdict: Verdict) -> str | None:
    """The covering motion as CSV, see `walk_csv`; None where there is none.

    That of a greedy search follows its tree, which enters the cells but need not pass their
    centres, see `tree_walk`.
    """
    walk = _walk(verdict)
    return None if walk is None else walk_csv(verdict.robot, walk)
