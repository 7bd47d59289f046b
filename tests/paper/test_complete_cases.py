"""The twelve published cases under the complete search: what is true of them, whatever the seed."""

from __future__ import annotations

import math
import re
from functools import cache

import networkx as nx
import numpy as np
import pytest
from dense_replay import assert_motion, assert_over, assert_witness
from paper_cases import PAPER_CASES

from feasibility import Answer, CauseKind, Evidence, Search, Verdict, check

INFEASIBLE = {"4d": 60, "4f": 6}
"""Cells of the best single component, by an independent analytic computation."""
SEEDS = (0, 1, 2, 3)


@cache
def verdict_of(name: str, seed: int) -> Verdict:
    case = PAPER_CASES[name]
    return check(case.robot(), case.cells(), case.task(), Search(seed=seed))


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("name", PAPER_CASES)
def test_the_truth_is_found(name: str, seed: int) -> None:
    verdict = verdict_of(name, seed)
    if name in INFEASIBLE:
        assert (verdict.answer, verdict.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
        assert verdict.n_covered == INFEASIBLE[name]
        assert len(verdict.causes) == 90 - INFEASIBLE[name]
        assert verdict.witness is None
    else:
        assert (verdict.answer, verdict.evidence) == (Answer.FEASIBLE, Evidence.WITNESS)
        assert verdict.n_covered == 90
        assert verdict.n_edges == 305
        assert verdict.causes == ()


@pytest.mark.parametrize("name", [name for name in PAPER_CASES if name not in INFEASIBLE])
def test_the_witness_holds_at_twenty_points_a_segment(name: str) -> None:
    for seed in SEEDS[:2]:
        assert_witness(verdict_of(name, seed))


@pytest.mark.parametrize("name", INFEASIBLE)
def test_every_seed_covers_and_misses_the_same_cells(name: str) -> None:
    first = verdict_of(name, SEEDS[0])
    for seed in SEEDS[1:]:
        np.testing.assert_array_equal(verdict_of(name, seed).covered, first.covered)


@pytest.mark.parametrize("name", INFEASIBLE)
def test_what_an_infeasible_case_does_cover_is_one_motion(name: str) -> None:
    verdict = verdict_of(name, 0)
    covered = np.flatnonzero(verdict.covered)
    assert nx.is_connected(verdict.graph.subgraph(covered.tolist()))
    assert_over(verdict, covered, np.array([verdict.graph.nodes[int(k)]["q"] for k in covered]))
    for _, _, motion in verdict.graph.edges(data="motion"):
        assert_motion(verdict, motion)


def test_4d_names_the_first_joint_and_has_proofs() -> None:
    """The cylinder's last third is behind the limits -90 .. 10 degrees of joint1.

    Seen from above, the wrist centre is at radius 0.495 and the forearm's plane passes the axis at
    0.1 m, so that joint1 must stand at the wrist's azimuth less asin(0.1 / 0.495), or, reaching
    backwards, less 180 degrees minus that.
    """
    verdict = verdict_of("4d", 0)
    assert [cause.cell for cause in verdict.causes] == list(range(60, 90))
    offset = math.degrees(math.asin(0.1 / 0.495))
    for cause in verdict.causes:
        assert (cause.kind, cause.proved) == (CauseKind.JOINT_LIMITS, True)
        said = re.search(r"joint1 would need (-?[0-9.]+) deg", cause.detail)
        assert said is not None
        azimuth = math.degrees(verdict.cells.u[cause.cell])
        needed = (azimuth - offset, azimuth - 180.0 + offset)
        assert min(abs(float(said[1]) - angle) for angle in needed) < 0.3


def test_4f_is_short_of_its_limits_everywhere_and_proved() -> None:
    verdict = verdict_of("4f", 0)
    assert {cause.kind for cause in verdict.causes} == {CauseKind.JOINT_LIMITS}
    assert all(cause.proved for cause in verdict.causes)
