"""A verdict as text for people."""

from __future__ import annotations

from typing import TYPE_CHECKING

from feasibility.cases.case import Case
from feasibility.collisions.asked_bodies import said_of
from feasibility.reports.text_and_tables import (
    certificate_text,
    left_out_text,
    message_of,
    placement_text,
    seconds_text,
    smooth_text,
    summary,
)
from feasibility.verdict import Answer, Evidence, Verdict

if TYPE_CHECKING:
    from feasibility.reports.shortfalls import Treating

PHASES = {"search_s": "search", "certify_s": "certificate"}

SENTENCES = {
    Answer.FEASIBLE: "feasible: one continuous motion covers the whole surface.",
    Answer.INFEASIBLE: "infeasible: no single continuous motion covers the whole surface.",
    Answer.UNDECIDED: "undecided: neither a covering motion nor a proof against one was found.",
}
EMPTY = "feasible: there are no cells, so there is nothing to cover; the arm was not looked at."
GREEDY_NO = "infeasible: not found by the greedy search, which cannot rule a motion out."
EVIDENCE = {
    Evidence.WITNESS: "a motion that an independent replay accepted, between its waypoints too",
    Evidence.PROOF: "a bound shows that at least one cell cannot be covered",
    Evidence.EXHAUSTED: "the search ran to its end at the stated resolution",
    Evidence.BUDGET: "the search was stopped, or what it found could not be certified",
}
CUT = "cuts through the joint space, which no motion crosses, separate cells from each other"


def as_text(verdict: Verdict, case: Case, before_s: float = 0.0) -> str:
    """The verdict for people: the answer first, its evidence, why cells are missed.

    Args:
        verdict: of either method.
        case: for its name.
        before_s: seconds of imports and files before the check began; they count as loading.
    """
    title = ("case", f"{case.name}  {case.description}".rstrip())
    said = said_of(verdict.robot, verdict.task.collision)
    if not len(verdict.cells):
        return "\n".join(summary(EMPTY, [title], said))
    treating, head = _treating(verdict), SENTENCES[verdict.answer]
    if treating is not None:
        head = treating.sentence(head)
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
    hints = [] if treating is None else treating.hints(case)
    if verdict.answer is Answer.FEASIBLE:
        hints += _hints(verdict)
    else:
        from feasibility.reports.shortfalls import causes_listed, hints_of

        groups = list(causes_listed(verdict.causes, verdict.cells))
        lines += ["", "Not covered:", *groups] if groups else []
        if treating is None or not treating.falls_short:
            hints = hints_of(verdict)
    if hints:
        lines += ["", "To try next:", *(f"  {hint}" for hint in hints)]
    return "\n".join(lines)


def rows_of(verdict: Verdict) -> list[tuple[str, str]]:
    """Rows of command, notebook and live page: names, and a text each that may be empty."""
    treating = _treating(verdict)
    evidence = _evidence(verdict) if treating is None else treating.evidence(_evidence(verdict))
    return [
        ("covered", f"{verdict.n_covered:,} of {len(verdict.cells):,} cells in one motion"),
        ("edges", f"{verdict.n_edges:,} of {len(verdict.cells.pairs):,}"),
        ("evidence", f"{verdict.evidence}: {evidence}"),
        ("found", message_of(verdict)),
        ("certificate", _certificate_text(verdict)),
        ("placement", placement_text(verdict.certificate)),
        ("smoothed", smooth_text(verdict.cells.surface)),
        ("treated", "" if treating is None else treating.text()),
    ]


def _evidence(verdict: Verdict) -> str:
    """What the answer rests on."""
    if verdict.proof is not None and verdict.proof.kind == "cut":
        return CUT
    return EVIDENCE[verdict.evidence]


def _certificate_text(verdict: Verdict) -> str:
    """The certificate in one line."""
    if verdict.certificate is None:
        return ""
    task, q = verdict.task, None if verdict.witness is None else verdict.witness.q
    return certificate_text(verdict.robot, verdict.certificate, q, task, task.tolerance)


def _treating(verdict: Verdict) -> Treating | None:
    """What is said of the area that a motion treats, where the task has a footprint."""
    if verdict.task.footprint is None:
        return None
    from feasibility.reports.shortfalls import Treating

    return Treating(verdict)


def _hints(verdict: Verdict) -> list[str]:
    """What to do next with a motion."""
    stored = verdict.witness is not None or verdict.tree is not None
    walk = ["--witness walk.csv writes the motion"] if stored else []
    more = [
        "coverable path, with the same case, puts the cells in order and times the motion",
        "coverable explain finds how far the cone, the limits and the rest can be tightened",
    ]
    return [*walk, "--html view.html shows it", *(more if verdict.witness is not None else [])]
