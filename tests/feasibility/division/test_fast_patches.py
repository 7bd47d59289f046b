"""Patches at a speed: each walk holds it, and what no fast motion leads to is left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from coverable_errors import CoverableError
from feasibility import Answer, Task, check
from feasibility.certification import replay
from feasibility.certification.rates import replay_rates
from feasibility.division import divide
from feasibility.reports import division as report
from robots import load_robot
from surfaces import plane

UR5 = load_robot("ur5")
CELLS = plane((0.35, 0.65), (-0.2, 0.2), "outside", (0.0, 0.0, 0.1)).cells(6, 8)
TASK = Task(standoff=0.02, cone_deg=20)


@pytest.mark.parametrize(
    ("asked", "whole"),
    [({"speed": 0.8}, True), ({"speed": 1.5}, False), ({"min_manipulability": 0.2}, False)],
)
def test_every_patch_holds_what_is_asked(asked, whole) -> None:
    task = replace(TASK, **asked)
    found = divide(UR5, CELLS, task)
    assert found.whole == whole == (check(UR5, CELLS, task).answer is Answer.FEASIBLE)
    covered = np.zeros(len(CELLS), dtype=bool)
    for patch in found.patches:
        assert patch.accepted
        needed = np.isin(np.arange(len(CELLS)), patch.cells)
        assert replay(UR5, CELLS, task, patch.walk, needed).accepted
        assert not replay_rates(UR5, CELLS, task, patch.walk).refusals
        assert len(patch.cells) > 1
        covered |= needed
    left = {cause.cell: cause.detail for cause in found.left_out}
    assert set(left) == set(np.flatnonzero(~covered).tolist())
    said = "would need" if task.speed else "singular values fall to"
    assert all(said in detail for detail in left.values())
    first, *_ = report.as_text(found, "plate").splitlines()
    assert ("divided: every cell" if whole else "no motion to the other cells") in first


def test_a_speed_beyond_all_joints_is_refused() -> None:
    with pytest.raises(CoverableError, match=r"less than 11\.2 m/s anywhere"):
        divide(UR5, CELLS, replace(TASK, speed=50.0))
