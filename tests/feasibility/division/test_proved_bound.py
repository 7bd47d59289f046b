"""How many motions it takes at least: proofs that other code accepts, that no division beats."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from cut_verdicts import disconnected_problem

from feasibility import Search, Task
from feasibility.certification import verify_proof
from feasibility.cut_tree import CutTree, Leaf
from feasibility.division import Division, divide
from feasibility.reports.division import as_json, as_text
from robots import load_robot
from surfaces import plane

NUMBERS = {1: 2, 21: 3, 19: 4}
"""Motions that it takes, by the number of a stored problem."""


def leaves(proof: CutTree) -> set[int]:
    return {leaf.cell for leaf in proof.leaves()}


@pytest.fixture(scope="module", params=NUMBERS.items(), ids=str)
def divided(request: pytest.FixtureRequest) -> tuple[Division, int]:
    number, motions = request.param
    return divide(*disconnected_problem(number)), motions


def test_the_bound_is_met_and_its_proofs_are_accepted(divided: tuple[Division, int]) -> None:
    division, motions = divided
    assert len(division.patches) == division.at_least == motions
    assert division.proved_fewest
    case = division.robot, division.cells, division.task
    assert division.proof is not None
    assert not isinstance(division.proof.root, Leaf)
    assert verify_proof(*case, division.proof).accepted
    for apart in division.apart:
        assert verify_proof(*case, apart.proof).accepted
        assert leaves(apart.proof) == {apart.cell, apart.other}


def test_every_pair_of_the_cells_is_proved_apart(divided: tuple[Division, int]) -> None:
    division, motions = divided
    pairs = {(apart.cell, apart.other) for apart in division.apart}
    cells = sorted({cell for pair in pairs for cell in pair})
    assert len(cells) == (motions if motions > 2 else 0)
    assert pairs == set(itertools.combinations(cells, 2))
    patch = division.fewest.patch_of(len(division.cells))
    assert len(set(patch[cells].tolist())) == len(cells)  # no motion found has two of them


def test_text_and_json_say_what_is_proved(divided: tuple[Division, int]) -> None:
    division, motions = divided
    text, told = as_text(division, "x"), as_json(division)
    assert f"at least {motions}, proved" in " ".join(text.split())
    assert f"{motions} motions (no fewer will do, proved)" in text
    assert "Why one motion is not enough:" in text
    assert ("no two can be covered by one motion" in text) == (motions > 2)
    assert told["proved_at_least"] == motions
    assert told["proof"]["kind"] == "cut"
    assert len(told["apart"]) == (motions * (motions - 1) // 2 if motions > 2 else 0)


def test_what_is_not_proved_is_said_of_the_motions_found(monkeypatch) -> None:
    from feasibility.division import proved_bound

    monkeypatch.setattr(proved_bound, "BOXES", 1)
    division = divide(*disconnected_problem(1))
    assert (len(division.patches), division.at_least, division.proof) == (2, 1, None)
    assert "at least 2 among the motions found" in division.message
    assert "proved" not in division.message
    assert not division.proved_fewest


def test_no_more_than_one_motion_is_proved_needed_where_one_does() -> None:
    patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
    division = divide(load_robot("ur5"), patch.cells(3, 3), Task(0.02, 30))
    assert (len(division.patches), division.at_least, division.proof) == (1, 1, None)
    assert as_json(division)["proof"] is None


def test_nothing_is_proved_where_the_time_is_up() -> None:
    division = divide(*disconnected_problem(1), Search(time_limit=1e-6))
    assert not division.ended
    assert division.at_least <= 1
    assert division.proof is None
    assert np.array_equal(division.apart, ())
