"""Saved results keep [collision] and replay it; damaged ones are refused."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from feasibility import Verdict, check, verify
from feasibility.cases import Case
from feasibility.results import load_result, save_result
from feasibility.verdict import Walk

TEXT = """
    robot = {{ name = "ur5" }}
    surface.kind = "plane"
    surface.u = [0.4, 0.6]
    surface.v = [-0.1, 0.1]
    surface.cells = [2, 2]
    surface.position = [0, 0, 0.3]
    surface.side = "outside"
    task = {{ standoff = 0.02, cone_deg = 30 }}
    [collision]
    clearance = {clearance}
    [[collision.scene]]
    name = "box"
    kind = "box"
    size = [0.1, 0.1, 0.6]
    position = {place}
"""


def case_of(clearance: float = 0.005, place: str = "[0.75, 0, 0.3]") -> Case:
    return Case.from_toml(TEXT.format(clearance=clearance, place=place), name="box")


@cache
def verdict() -> Verdict:
    return check(*case_of().build())


def test_a_result_says_of_collisions_what_its_verdict_did(tmp_path: Path) -> None:
    found = load_result(save_result(verdict(), case_of(), tmp_path / "kept.npz"))
    assert found.verdict.certificate == verdict().certificate
    assert found.verdict.certificate is not None
    assert found.verdict.certificate.nearest_pair is not None
    assert found.verdict.pairs_left_out == verdict().pairs_left_out
    assert len(found.verdict.pairs_left_out) > 0
    checked = verify(found)
    assert checked.holds
    assert checked.certificate is not None
    assert checked.certificate.min_clearance is not None
    assert checked.certificate.min_clearance >= 0.0


@pytest.mark.parametrize(
    ("other", "names"),
    [
        (case_of(place="[0.5, 0, 0.6]"), "box"),  # the object stands in the way of the arm now
        (case_of(clearance=0.5), "are needed"),
    ],
    ids=["object moved", "clearance raised"],
)
def test_a_result_whose_case_was_changed_does_not_hold(
    other: Case, names: str, tmp_path: Path
) -> None:
    found = verify(load_result(save_result(verdict(), other, tmp_path / "changed.npz")))
    assert not found.holds
    assert names in found.refusal


def test_a_witness_nudged_into_an_object_does_not_hold(tmp_path: Path) -> None:
    walk = verdict().witness
    assert walk is not None
    into = np.insert(walk.q, 1, walk.q[0], axis=0)
    into[1, :3] = [0.0, -0.6, 0.6]  # stretched out towards the box
    cell = np.insert(walk.cell, 1, -1)
    nudged = Walk(q=np.insert(into, 2, walk.q[0], axis=0), cell=np.insert(cell, 2, -1))
    damaged = replace(verdict(), witness=nudged)
    found = verify(load_result(save_result(damaged, case_of(), tmp_path / "nudged.npz")))
    assert not found.holds
    assert "and box overlap" in found.refusal
