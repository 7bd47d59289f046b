"""Cells that another motion covers: proved where a cut keeps it from the best one."""

from __future__ import annotations

import re

import numpy as np
import pytest
from cut_verdicts import ONE_CUT, TWO_CUTS, cut_verdict, explored

from feasibility.cut_tree import Cut, CutTree, Leaf
from feasibility.roadmap.causes import disconnected
from feasibility.roadmap.graph import NODES, root_of
from feasibility.verdict import CauseKind


@pytest.mark.parametrize("number", [ONE_CUT, TWO_CUTS])
def test_what_a_cut_parts_is_proved_and_named(number: int) -> None:
    verdict = cut_verdict(number)
    apart = [c for c in verdict.causes if c.kind is CauseKind.DISCONNECTED]
    assert len(apart) == len(verdict.causes) > 0
    for cause in apart:
        assert cause.proved
        assert re.search(
            r"nowhere (on the surface|in that part of the joint space) can joint\d be -?[\d.]+ deg,"
            r" and the best motion is (below|above)$",
            cause.detail,
        )


@pytest.mark.parametrize("number", [ONE_CUT, TWO_CUTS])
def test_all_of_a_component_is_on_the_way_of_its_posture(number: int) -> None:
    """Every node of the roadmap, not one alone."""
    proof, exploration = cut_verdict(number).proof, explored(number)[0]
    assert proof is not None
    roadmap = exploration.roadmap
    for root in exploration.roots():
        path = proof.path_to(exploration.posture(root))
        for node in range(int(roadmap.counters[NODES])):
            if root_of(roadmap, roadmap.component[node]) == root:
                assert proof.path_to(roadmap.q[node]) == path


def test_what_no_cut_parts_is_not_called_proved() -> None:
    """A tree whose cut lies beyond every component, made up: it parts none of them."""
    exploration = explored(ONE_CUT)[0]
    beyond = CutTree(Cut((1.0, 0, 0, 0, 0, 0), -50.0, Leaf(0), Leaf(1)))
    missed = np.flatnonzero(~exploration.covered & exploration.reached)
    assert len(missed)
    for cell in missed.tolist():
        cause = disconnected(exploration, cell, beyond)
        assert cause == disconnected(exploration, cell)
        assert not cause.proved
