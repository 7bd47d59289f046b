"""Limits of the roll from question to answer: check, verify, results, path, divide, place."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from feasibility import Answer, CauseKind, Task, check, verify
from feasibility.cases import Case, load_case
from feasibility.certification import replay_over_surface
from feasibility.certification.rolls import reference_axes
from feasibility.division import divide
from feasibility.paths import coverage_path
from feasibility.placement import Pose, Region, place
from feasibility.results import load_result, save_result
from feasibility.roll import roll_of
from feasibility.sensitivity import Kind, explain
from robots import Kinematics, load_robot
from surfaces import plane, sphere

TABLE = plane((0.35, 0.55), (-0.1, 0.1), side="outside", position=(0, 0, 0.2)).cells(3, 3)
FIXED = Task(0.005, 0.5, roll_deg=(-0.5, 0.5), roll_reference=(1, 0, 0))
RANGE = Task(0.005, 20.0, roll_deg=(-15, 15), roll_reference=(1, 0, 0))
CASE = """
robot = { name = "ur5" }
task = { standoff = 0.005, cone_deg = 20, roll_deg = [-15, 15], roll_reference = [1, 0, 0] }
[surface]
kind = "plane"
u = [0.35, 0.55]
v = [-0.1, 0.1]
position = [0, 0, 0.2]
side = "outside"
cells = [3, 3]
"""
HELD = {"wrist_3_joint": np.radians([20.0, 60.0])}
SIDES = {"shoulder_pan_joint": (-1.0, 1.0), "shoulder_lift_joint": (-2.5, -0.5)}
SIDES |= {"elbow_joint": (0.5, 2.5)}
"""Of the UR5: the arm from above, elbow up."""


@cache
def answered(name):
    task = {"fixed": FIXED, "range": RANGE}[name]
    return check(load_robot("ur5"), TABLE, task)


def sampled_rolls(verdict, per_segment=20):
    """(k,) rad, all along a witness over a plane."""
    q = verdict.witness.q
    t = np.arange(per_segment)[:, None] / per_segment
    dense = (q[:-1, None] + t * np.diff(q, axis=0)[:, None]).reshape(-1, q.shape[1])
    _, axes = Kinematics(verdict.robot).tools(dense)
    targets, at = verdict.task.targets(verdict.cells), np.ones((len(dense), 1))
    x = reference_axes(verdict.robot, dense)
    return roll_of(x, axes, at * targets.references[0], at * targets.approaches[0])


@pytest.mark.parametrize("name", ["fixed", "range"])
def test_witnesses_keep_to_the_range_at_every_instant(name):
    verdict = answered(name)
    assert verdict.answer is Answer.FEASIBLE, verdict.message
    most = np.abs(verdict.task.roll.off(sampled_rolls(verdict))).max()
    assert most - 1e-9 <= verdict.certificate.max_roll <= verdict.task.roll.half
    assert verify(verdict).holds


@pytest.mark.parametrize("name", ["fixed", "range"])
def test_witnesses_nudged_out_of_the_range_are_refused_there(name):
    verdict = answered(name)
    q, k = verdict.witness.q.copy(), len(verdict.witness.q) // 2
    q[k, 5] += 2.0 * verdict.task.roll.half
    found = replay_over_surface(verdict.robot, verdict.cells, verdict.task, q)
    assert "the roll is" in found.refusal
    assert {fault.row for fault in found.faults} & {k - 1, k}
    # Only between two rows: a turn that comes back to the same place.
    q = np.repeat(verdict.witness.q, 2, axis=0)
    q[2 * k + 1 :, 5] += 2.0 * np.pi * (-1.0 if q[:, 5].max() > 0.0 else 1.0)
    wide = replace(verdict.robot, lower=verdict.robot.lower - 7, upper=verdict.robot.upper + 7)
    found = replay_over_surface(wide, verdict.cells, verdict.task, q)
    assert [(fault.row, "the roll is" in fault.text) for fault in found.faults] == [(2 * k, True)]


def test_a_cell_that_the_roll_alone_prevents_says_which_could_be_had():
    robot = load_robot("ur5").with_limits(HELD | SIDES)
    verdict = check(robot, TABLE, replace(RANGE, cone_deg=2.0))
    assert verdict.answer is Answer.INFEASIBLE
    assert {cause.kind for cause in verdict.causes} == {CauseKind.ORIENTATION}
    detail = verdict.causes[0].detail
    assert detail.startswith("roll: possible from "), detail
    assert "-15 to 15 deg are allowed" in detail
    words = detail.split()
    low, high = float(words[5]), float(words[7])
    mine = replace(RANGE, cone_deg=2.0, roll_deg=(low - 0.5, high + 0.5))
    alone = TABLE.surface.cells(3, 3)
    assert check(robot, alone, mine).covered[verdict.causes[0].cell]


@pytest.mark.parametrize("size", [0.15, 0.4])
def test_a_square_under_a_tool_that_points_down_and_never_turns(size):
    """The example of roboplan."""
    half = 0.5 * size
    square = plane((0.45 - half, 0.45 + half), (-half, half), side="outside", position=(0, 0, 0.2))
    verdict = check(load_robot("ur5"), square.cells(6, 6), FIXED)
    assert verdict.answer is Answer.FEASIBLE, verdict.message
    assert np.abs(sampled_rolls(verdict, 5)).max() <= FIXED.roll.half
    assert verify(verdict).holds


def test_no_room_at_all_is_a_tenth_of_a_degree():
    still = Task(0.005, 0, roll_deg=(0, 0), roll_reference=(1, 0, 0))
    assert (still.cone_deg, still.roll_deg) == (0.1, (-0.1, 0.1))
    assert replace(still, standoff=0.01).roll_deg == still.roll_deg
    verdict = check(load_robot("ur5"), TABLE, still)
    assert "1 mm and 0.1 deg, at a roll of " in verdict.message
    assert np.abs(sampled_rolls(verdict)).max() <= np.radians(0.1)
    assert verify(verdict).holds
    turned = Task(0.005, 20, roll_deg=(-360, -360))
    assert (turned.cone_deg, turned.roll.half) == (20, pytest.approx(np.radians(0.1)))
    assert Task(0.005, 0).cone_deg == Task(0.005, 0, roll_deg=(0, 5)).cone_deg == 0.0


def test_an_approach_of_its_own_is_kept_over_a_bent_surface():
    cap = sphere(0.3, (10, 40), (0, 60), side="outside", position=(0.4, -0.1, 0.0)).cells(3, 3)
    task = Task(0.01, 3.0, approach=(0.2, 0, -1), roll_deg=(-20, 20), roll_reference=(1, 0, 0))
    verdict = check(load_robot("ur5"), cap, task)
    assert verdict.answer is Answer.FEASIBLE, verdict.message
    points, axes = Kinematics(verdict.robot).tools(verdict.witness.q)
    assert (axes @ [0.2, 0, -1] / np.hypot(0.2, 1.0) >= np.cos(np.radians(3.0)) - 1e-12).all()
    assert np.abs(cap.surface.closest(points).height - 0.01).max() <= 1e-3
    assert verify(verdict).holds
    along_normals = verify(verdict.robot, cap, replace(task, approach=None), verdict.witness.q)
    assert "tool axis tilts" in along_normals.refusal


def test_all_rolls_are_free_roll():
    free, whole = (
        check(load_robot("ur5"), TABLE, replace(RANGE, roll_deg=roll))
        for roll in (None, (-180, 180))
    )
    assert np.array_equal(free.witness.q, whole.witness.q)
    assert free.statistics["fk"] == whole.statistics["fk"]
    assert free.certificate.max_roll is None


def test_reference_and_range_turned_together_are_the_same():
    turn = np.radians(-70.0)
    # About the approach, which is down: seen from above the other way round.
    other = replace(RANGE, roll_reference=(np.cos(turn), np.sin(turn), 0), roll_deg=(-85.0, -55.0))
    targets, mine = other.targets(TABLE), RANGE.targets(TABLE)
    assert np.degrees(roll_of(mine.references[0], mine.approaches[0], targets.references[0],
                              targets.approaches[0])) == pytest.approx(-70.0)  # fmt: skip
    turned = check(load_robot("ur5"), TABLE, other)
    assert turned.feasible
    same = replay_over_surface(turned.robot, TABLE, RANGE, turned.witness.q)
    assert same.accepted, same.refusal


def test_the_papers_dome_within_fifteen_degrees():
    setup = load_case("paper/4a", ["task.roll_deg=[-15, 15]"]).build()
    verdict = check(*setup)
    assert verdict.feasible, verdict.message
    assert verdict.certificate.max_roll <= np.radians(15)
    assert verify(verdict).holds


def test_paths_patches_and_placements_keep_to_it():
    verdict = answered("range")
    half = verdict.task.roll.half
    path = coverage_path(verdict, "columns")
    assert path.certificate.max_roll <= half
    division = divide(verdict.robot, TABLE, RANGE)
    assert [p.certificate.max_roll <= half for p in division.fewest.patches] == [True]
    region = Region.around(Pose.of_surface(TABLE.surface), {"x": (-0.05, 0.05)})
    found = place(verdict.robot, TABLE, FIXED, region, count=2, around=0, keep=1)
    assert found.answer is Answer.FEASIBLE
    assert "at a roll of -0.5 to 0.5 deg" in found.best.message


def test_results_keep_approach_and_roll(tmp_path):
    case = Case.from_toml(CASE)
    saved = load_result(save_result(answered("range"), case, tmp_path / "answer.npz"))
    used = saved.verdict.task.tolerance
    assert saved.verdict.task == replace(RANGE, tolerance=used)
    assert saved.verdict.certificate == answered("range").certificate
    assert verify(saved).holds


def test_explain_narrows_and_widens_the_range():
    found = explain(load_robot("ur5"), TABLE, RANGE)
    (roll,) = (t for t in found.thresholds if t.quantity.kind is Kind.ROLL)
    assert roll.feasible.value < np.radians(5.0)
    narrow = replace(RANGE, roll_deg=tuple(np.degrees([-roll.feasible.value, roll.feasible.value])))
    witness = roll.feasible.witness.q
    assert replay_over_surface(found.verdict.robot, TABLE, narrow, witness).accepted
