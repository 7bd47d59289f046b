"""The keys of approach and roll: read, written again, and refused with a reason."""

from __future__ import annotations

from dataclasses import replace

import pytest
from bad_cases import GOOD

from feasibility.cases import Case, CaseError
from feasibility.problem import Problem
from robots import load_robot
from surfaces import sphere

KEYS = ["task.roll_deg=[-15, 30]", "task.roll_reference=[1, 2, 0]", "task.approach=[0, 0, -2]"]


def test_keys_come_back_as_they_were():
    case = Case.from_toml(GOOD, overrides=KEYS)
    assert case.task.roll_deg == (-15.0, 30.0)
    assert case.task.roll_reference == (1.0, 2.0, 0.0)
    assert case.task.approach == (0.0, 0.0, -2.0)
    assert Case.from_toml(case.to_toml()) == case
    assert case.with_overrides(["task.approach=normal"]).task.approach == "normal"
    free = case.with_overrides([key.partition("=")[0] + "=" for key in KEYS])
    assert free == Case.from_toml(GOOD)


def test_a_reference_that_shows_nothing_is_a_fault_of_the_case():
    case = Case.from_toml(GOOD, overrides=[*KEYS[:1], "task.roll_reference=[0, 0, 1]", *KEYS[2:]])
    with pytest.raises(
        CaseError, match=r"task.roll_reference: the direction is along the approach"
    ):
        case.build()


def test_the_search_keeps_to_a_little_less_of_the_range():
    robot, cells = load_robot("puma560"), sphere(1.0, (10, 90), (10, 180)).cells(2, 2)
    task = replace(Case.from_toml(GOOD).task, roll_deg=(10, 30))
    assert Problem.of(robot, cells, task).narrowed.searched.roll_deg == pytest.approx((11, 29))
    assert "at a roll of 10 to 30 deg" in Problem.of(robot, cells, task).within
