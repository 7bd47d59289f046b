"""What `explain` says about a cut: how the motion of a changed case gets past it."""

from __future__ import annotations

import math

import numpy as np
from cut_verdicts import ONE_CUT, cut_verdict

from feasibility import Answer, Evidence
from feasibility.cut_words import place_of
from feasibility.reports.explanation import as_json, as_text
from feasibility.sensitivity import Explanation, Finding, Kind, Quantity, Threshold
from feasibility.verdict import Walk


def explanation(walk: Walk | None, proof: bool = True) -> Explanation:
    """One threshold of the cone, made up: feasible by `walk` at 9 degrees."""
    verdict = cut_verdict(ONE_CUT)
    fields = {name.removeprefix("_"): value for name, value in vars(verdict).items()}
    verdict = type(verdict)(**(fields if proof else {**fields, "proof": None}))
    cone = Quantity(Kind.CONE, "cone", "rad", math.radians(3), math.pi, 0.1, True)
    found = Finding(math.radians(9), Answer.FEASIBLE, Evidence.WITNESS, "one motion", witness=walk)
    return Explanation(verdict, (Threshold(cone, found, None),), (), None, 0, 0.0)


def test_a_motion_across_the_cut_opens_it() -> None:
    proof = cut_verdict(ONE_CUT).proof
    assert proof is not None
    q = np.add(np.full((2, 6), proof.root.value), [[-0.1], [0.1]])
    found = explanation(Walk(q, np.array([0, 1])))
    place = place_of(proof.root, found.verdict.robot)
    said = f"the motion then crosses {place}, which no motion can now"
    assert f"task.cone_deg: {said}." in " ".join(as_text(found, "x").split())
    (threshold,) = as_json(found, "x")["thresholds"]
    assert threshold["opens"] == said
    assert threshold["sentence"].endswith(f"{said}.")


def test_a_motion_on_one_side_reaches_the_cell_that_is_lost_there() -> None:
    proof = cut_verdict(ONE_CUT).proof
    assert proof is not None
    q = np.add(np.full((2, 6), proof.root.value), [[0.1], [0.2]])
    found = explanation(Walk(q, np.array([0, 1])))
    cell = list(found.verdict.cells.unravel(proof.root.above.cell))
    assert f"cell {cell} can then be covered above" in as_json(found, "x")["thresholds"][0]["opens"]


def test_nothing_is_said_without_a_cut_or_a_motion() -> None:
    walk = Walk(np.zeros((2, 6)), np.array([0, 1]))
    for found in (explanation(None), explanation(walk, proof=False)):
        assert as_json(found, "x")["thresholds"][0]["opens"] is None
        assert "task.cone_deg:" not in as_text(found, "x")
        assert " then " not in as_text(found, "x")
