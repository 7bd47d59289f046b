"""A verdict as one JSON object, and its motion as a table."""

from __future__ import annotations

from typing import Any

from feasibility.collisions.words import checked
from feasibility.reports.objects_and_csv import (
    causes_json,
    left_out_json,
    measured_json,
    proof_json,
    smooth_json,
    walk_csv,
)
from feasibility.reports.text_and_tables import message_of, seconds
from feasibility.verdict import Answer, Verdict, Walk
from feasibility.version import version

PHASES = ("search_s", "certify_s")


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
        "proof": proof_json(verdict.proof, verdict.robot, verdict.cells),
        "treated": _treated(verdict),
        **smooth_json(verdict.cells.surface),
        "timing": seconds(verdict.timing, PHASES, before_s),
        "robot": verdict.robot.name,
        "method": verdict.method,
        "seed": int(verdict.seed),
        "version": version(),
        "message": message_of(verdict),
    }


def _treated(verdict: Verdict) -> dict[str, Any] | None:
    """What the motion treats, where that was measured."""
    if verdict.treated is None:
        return None
    from feasibility.demands.treated_words import treated_json

    return treated_json(verdict.treated)


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


def motion_text(verdict: Verdict, ending: str = ".csv") -> str | None:
    """The covering motion as CSV, see `walk_csv`, or .compas, see `as_compas`; None without one.

    That of a greedy search follows its tree, which enters the cells but need not pass their
    centres, see `tree_walk`.
    """
    walk = _walk(verdict)
    if walk is None or ending.lower() != ".compas":
        return None if walk is None else walk_csv(verdict.robot, walk)
    from feasibility.results.compas_json import as_compas

    return as_compas(verdict.robot, walk)
