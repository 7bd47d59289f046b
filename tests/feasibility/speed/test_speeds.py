"""Verdicts at a speed, and at a distance from singularities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from speed_oracle import largest

from coverable_errors import ArgumentError
from feasibility import Search, Task, check, verify
from feasibility.cases import load_case
from feasibility.cli.main import main
from feasibility.results import load_result
from feasibility.speed import rate_figures
from robots import load_robot
from surfaces import plane, sphere

UR5 = load_robot("ur5")
PLATE = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0, 0, 0.3))
BALL = sphere(0.25, (10, 45), (150, 210), position=(0.65, 0, 0.1), side="outside")
TASK = Task(standoff=0.02, cone_deg=20)
CASES = {"ur5": (UR5, PLATE.cells(2, 2)), "panda": (load_robot("panda"), BALL.cells(2, 2))}


@pytest.mark.parametrize("name", CASES)
def test_the_verdict_turns_where_timed_motions_do(name):
    robot, cells = CASES[name]
    turn = largest(robot, cells, TASK)
    slower, faster = (check(robot, cells, replace(TASK, speed=f * turn)) for f in (0.98, 1.02))
    assert slower.feasible
    assert slower.certificate.max_speed >= 0.98 * turn
    assert verify(slower).holds
    assert str(faster.answer) == "undecided"
    assert faster.n_covered < len(cells)
    assert all("would need" in cause.detail for cause in faster.causes)
    known = float(faster.message.split("covered at ")[1].split()[0])
    assert known == pytest.approx(turn, rel=0.02)
    found = rate_figures(check(robot, cells, TASK))
    assert found.largest == pytest.approx(turn, rel=0.02)


def test_a_motion_too_fast_for_its_joints_does_not_verify():
    robot, cells = CASES["ur5"]
    verdict = check(robot, cells, TASK)
    most = rate_figures(verdict, more=False).witness.speed
    assert verify(robot, cells, replace(TASK, speed=0.98 * most), verdict.witness.q).holds
    refused = verify(robot, cells, replace(TASK, speed=1.02 * most), verdict.witness.q)
    assert not refused.holds
    assert "would need" in refused.refusal


def test_where_nothing_is_asked_nothing_changes():
    robot, cells = CASES["ur5"]
    plain, fast = check(robot, cells, TASK), check(robot, cells, replace(TASK, speed=0.01))
    assert fast.statistics == plain.statistics
    assert np.array_equal(fast.witness.q, plain.witness.q)
    assert fast.message.startswith(plain.message)
    assert plain.certificate.max_speed is None


def test_singular_values_are_kept_above_what_is_asked():
    robot, cells = CASES["ur5"]
    least = rate_figures(check(robot, cells, TASK), more=False).witness.sigma
    inside = check(robot, cells, replace(TASK, min_manipulability=0.95 * least))
    assert inside.feasible
    assert inside.certificate.min_singular_value >= 0.95 * least
    beyond = check(robot, cells, replace(TASK, min_manipulability=5.0 * least))
    assert str(beyond.answer) == "undecided"
    assert "smallest singular value is" in beyond.message


def test_a_motion_that_never_moves_is_judged_where_it_stands():
    cells = PLATE.cells(1, 1)
    still = check(UR5, cells, replace(TASK, speed=0.2, min_manipulability=1e-3))
    assert len(still.witness.q) == 1
    assert 1e-3 <= still.certificate.min_singular_value < 1.0
    assert "0.2 m/s all along it inside the joints' velocities." in still.message
    beyond = check(UR5, cells, replace(TASK, min_manipulability=0.99))
    assert str(beyond.answer) == "undecided"


def test_bad_questions_are_refused():
    robot, cells = CASES["ur5"]
    with pytest.raises(ArgumentError, match="m/s anywhere"):
        check(robot, cells, replace(TASK, speed=1e4))
    with pytest.raises(ArgumentError, match="complete search"):
        check(robot, cells, replace(TASK, speed=0.1), Search(method="greedy"))
    with pytest.raises(ArgumentError, match="limits no velocity"):
        check(replace(robot, max_velocity=np.nan), cells, replace(TASK, speed=0.1))
    for bad in ({"speed": 0.0}, {"speed": "fast"}, {"min_manipulability": -1.0}):
        with pytest.raises(ArgumentError, match=next(iter(bad))):
            replace(TASK, **bad)


def test_a_case_says_it(tmp_path, capsys):
    asked = ["task.speed=0.25", "task.min_manipulability=0.01", "surface.cells=[2, 2]"]
    case = load_case("paper/4a", asked)
    assert (case.task.speed, case.task.min_manipulability) == (0.25, 0.01)
    settings = [part for setting in asked for part in ("--set", setting)]
    saved = str(tmp_path / "fast.result")
    assert main(["check", "paper/4a", *settings, "--save", saved]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "The tool can have 0.25 m/s all along it" in said
    assert "(required 0.25)" in said
    assert load_result(saved).verdict.certificate.max_speed > 0.25
    assert main(["verify", saved]) == 0
    assert main(["check", "paper/4a", "--set", "task.speed=1e4"]) == 2
    assert "m/s anywhere" in capsys.readouterr().err
