"""The twelve published cases under the complete search: what is true of them, whatever the seed."""

from __future__ import annotations

import plain
import pytest
from asked import known, names, verdict_of
from samples import sampled, seeds

from feasibility import Answer, CauseKind, Evidence

COVERED = {"paper 4d": 60, "paper 4f": 6}
"""Cells of the best single component, by an independent analytic computation."""


@sampled
@pytest.mark.parametrize("seed", seeds(2, all=8))
@pytest.mark.parametrize("name", names("paper"))
def test_the_truth_is_found(name, seed):
    verdict = verdict_of(name, seed or None)  # with 0 it is asked elsewhere too
    assert len(verdict.cells.pairs) == 305
    if name in COVERED:
        assert (verdict.answer, verdict.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
        assert known(name) == "infeasible"
        assert verdict.n_covered == COVERED[name]
        assert {cause.kind for cause in verdict.causes} == {CauseKind.JOINT_LIMITS}
        assert all(cause.proved for cause in verdict.causes)
        assert verdict.covered.tolist() == verdict_of(name).covered.tolist()
        return
    assert (verdict.answer, verdict.evidence) == (Answer.FEASIBLE, Evidence.WITNESS)
    assert (verdict.n_covered, verdict.n_edges, verdict.causes) == (90, 305, ())
    assert plain.faults_of(verdict) == []
