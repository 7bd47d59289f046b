"""What would make a case feasible, and the margins of a feasible one, held to `check`."""

import json
import math
import re
from functools import cache

import numpy as np
import puma_oracle
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jobs import case_named, run_coverable
from samples import EVERYTHING, sampled

import coverable
from coverable import Answer, Evidence, Task, check, explain, load_case, load_robot, plane, sphere
from feasibility.sensitivity.probes import last_true
from feasibility.sensitivity.quantities import Kind

PUMA, UR5 = load_robot("puma560", limits="set-1"), load_robot("ur5")
PLATE = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3))
STIFF = PUMA.with_limits({f"joint{k}": (0.0, 0.0) for k in (4, 5, 6)})
"""joint4 to joint6 held: the tool stands along the forearm, and only joints 1 to 3 aim it."""
WALL = plane((-0.2, 0.2), (-0.2, 0.2), "outside", (0.6, 0.1, 0.2), (0.0, 90.0, 0.0))
DEEP = plane((0.5, 0.6), (-0.05, 0.05), "outside", (0.0, 0.0, -0.75))  # the standoff lifts the tool
DOME = sphere(0.25, (10, 50), (150, 230), position=(0.65, 0, 0.1), side="outside")
CASES = {
    "plate": lambda: (UR5, PLATE.cells(2, 2), Task(0.02, 30)),
    "long plate": lambda: case_named("long plate").build()[:3],
    "stiff wrist": lambda: (STIFF, WALL.cells(3, 3), Task(0.0, 20)),
    "deep plate": lambda: (UR5, DEEP.cells(2, 2), Task(0.01, 40)),
    "4a": lambda: load_case("paper/4a", ["surface.cells=[3, 3]"]).build()[:3],
    "4d": lambda: load_case("paper/4d", ["surface.cells=[9, 2]"]).build()[:3],
    "5e": lambda: load_case("paper/5e").build()[:3],
    "dome": lambda: (load_robot("panda"), DOME.cells(9, 10), Task(0.02, 25)),
}


@cache
def given_case(name):
    return CASES[name]()


@cache
def explained(name):
    return explain(*given_case(name))


def threshold_of(explanation, name):
    return next(t for t in explanation.thresholds if t.quantity.name == name)


def case_at(case, quantity, value):
    """The case with a quantity at a value, without the product's own way of changing it."""
    robot, cells, task = case
    if quantity.kind is Kind.CONE:
        task = Task(task.standoff, math.degrees(value), task.tolerance)
    elif quantity.kind is Kind.STANDOFF:
        task = Task(value, task.cone_deg, task.tolerance)
    elif quantity.kind is Kind.SHIFT:
        surface = cells.surface.moved(np.eye(3), value * np.array(quantity.axis))
        cells = surface.cells(*cells.shape)
    else:
        limits = [robot.lower[quantity.joint], robot.upper[quantity.joint]]
        limits[quantity.kind is Kind.UPPER] = value
        robot = robot.with_limits({robot.joint_names[quantity.joint]: limits})
    return robot, cells, task


ASKED = ["plate", "stiff wrist", "4d"] + ["deep plate", "4a", "5e", "dome"] * EVERYTHING


@sampled("name", ASKED)
def test_what_is_said_of_a_side_is_what_a_verdict_says(name):
    """Feasible sides are, with a motion that holds all of the changed case; proved ones are not."""
    case, sides = given_case(name), 0
    every = np.ones(len(case[1]), dtype=bool)
    for found in explained(name).thresholds:
        for side in (found.feasible, found.other):
            if side is None:
                continue
            changed = case_at(case, found.quantity, side.value)
            effort = re.search(r"with (\d+) evaluations", side.detail)  # of what is undecided
            search = coverable.Search(evaluations=int(effort[1])) if effort else None
            verdict = check(*changed, search)
            sides += 1
            if side is found.feasible:
                assert side.evidence is Evidence.WITNESS
                assert coverable.replay(*changed, side.witness, every).accepted
                assert verdict.feasible, found.quantity.name
            else:
                assert not verdict.feasible, found.quantity.name
                assert verdict.answer is side.answer or side.answer is Answer.UNDECIDED
    assert sides >= 12


def test_4d_names_joint1_and_granting_what_it_needs_is_enough():
    """The wrist centre's azimuth less asin(0.1 / 0.495) is where joint1 must stand."""
    case, found = given_case("4d"), threshold_of(explained("4d"), "joint1 upper limit")
    needed = np.degrees(case[1].u.max()) - math.degrees(math.asin(0.1 / 0.495))
    value = found.feasible.value
    assert abs(math.degrees(value) - needed) <= 0.2
    assert math.degrees(found.resolution) <= 0.5 + 1e-9
    less = check(*case_at(case, found.quantity, value - math.radians(0.5)))
    assert (less.answer, less.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
    dropped = explained("4d").dropped  # what no motion covers
    assert dropped.cells.tolist() == list(range(12, 18))
    assert dropped.share == pytest.approx(1 / 3)
    assert dropped.area == pytest.approx(0.5 * math.radians(40) * 0.9)
    rest = np.arange(18) < 12
    assert coverable.replay(*case, dropped.witness, rest).accepted


def test_the_cone_a_stiff_wrist_needs_is_that_of_the_geometry():
    """The covering motion keeps to one branch of the arm: the least of their largest tilts."""
    case, found = given_case("stiff wrist"), threshold_of(explained("stiff wrist"), "cone")
    points, approaches, _ = case[2].targets(case[1])
    needed = puma_oracle.tilts(points, approaches).max(axis=0).min()
    assert -0.2 <= math.degrees(found.feasible.value - needed) <= 1.0
    assert found.other.value < found.feasible.value
    # A wider joint never needs a wider cone.
    limits = {f"joint{k}": np.radians([-15.0, 15.0]) for k in (4, 5)}
    found_wider = explain(STIFF.with_limits(limits), WALL.cells(3, 3), Task(0.0, 10))
    wider = threshold_of(found_wider, "cone")
    assert wider.feasible.value < found.feasible.value


def test_a_standoff_that_lifts_the_tool_helps():
    found = threshold_of(explained("deep plate"), "larger standoff")
    assert not explained("deep plate").verdict.feasible
    assert found.other.value < found.feasible.value
    assert check(*case_at(given_case("deep plate"), found.quantity, found.feasible.value)).feasible


def test_nothing_helps_a_plate_that_leaves_the_room():
    explanation = explained("long plate")
    for found in explanation.thresholds:
        assert found.feasible is None, found.quantity.name
        assert (found.resolution, found.margin) == (None, -1.0)
        assert (found.other.answer, found.other.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
        assert found.quantity.monotone or found.each_proved
    missed = np.flatnonzero(~explanation.verdict.covered)
    np.testing.assert_array_equal(explanation.dropped.cells, missed)
    assert explanation.dropped.share == pytest.approx(len(missed) / 8)
    assert explanation.pair is None


SETS = {
    "named set": ["robot.name=puma560", "robot.limits=set-3", "task.cone_deg=45",
                  "surface.side=inside", "surface.kind=cylinder", "surface.radius=0.5",
                  "surface.u_deg=[0, 40]", "surface.u=", "surface.v=[0, 0.3]",
                  "surface.cells=[5, 2]", "surface.position=", "task.standoff=0.005"],
    "shift": ["surface.u=[-0.1, 0.1]", "surface.cells=[2, 2]", "surface.position=[0.95, 0, 0.2]"],
    # out of reach along the diagonal: no shift along one axis is enough
    "diagonal": ["surface.u=[-0.15, 0.15]", "surface.v=[-0.15, 0.15]", "surface.cells=[2, 2]",
                 "surface.position=[0.8, 0.8, 0.2]"],
    "two joints": ["robot.limits_deg={ shoulder_pan_joint = [-10, 10], elbow_joint = [-10, 10] }",
                   "surface.u=[0.3, 0.6]", "surface.v=[-0.4, 0.4]", "surface.cells=[3, 5]",
                   "surface.position=[0, 0, 0.2]"],
}  # fmt: skip


@pytest.mark.parametrize("name", SETS)
def test_the_change_that_is_named_first_makes_the_case_feasible(name, tmp_path):
    """`check` with the `--set` that is offered says so, and neither change of a pair alone does."""
    case = case_named("plate").with_overrides(SETS[name])
    (tmp_path / "case.toml").write_text(case.to_toml())
    (tmp_path / "motions").mkdir()
    asked = "explain", tmp_path / "case.toml", "--json", "--witness", tmp_path / "motions"
    page = tmp_path / "page.html"
    said = run_coverable(*asked, *(("--html", page) if name == "diagonal" else ()))
    if name == "diagonal":
        assert "Two changes together make it feasible" in page.read_text()
    told = json.loads(said.out)
    assert (said.status, told["verdict"]) == (1, "infeasible")
    sets = told["useful"]["set"]
    assert (told["pair"] is None) == (name not in ("diagonal", "two joints"))
    assert check(*coverable.Case.from_toml(case.to_toml()).with_overrides(sets).build()).feasible
    if told["pair"] is not None:
        assert not any(t["feasible"] for t in told["thresholds"])
        for alone in sets if len(sets) == 2 else ():
            assert not check(*case.with_overrides([alone]).build()).feasible
        motion = tmp_path / "motions" / "pair.csv"
        options = [part for text in sets for part in ("--set", text)]
        assert run_coverable("verify", tmp_path / "case.toml", motion, *options).status == 0


@settings(max_examples=25)
@given(st.integers(1, 60), st.data())
def test_bisection_ends_beside_a_failure_whatever_the_answers(size, data):
    """And at the one place where the answers turn, in as few questions as there have to be."""
    turn = data.draw(st.integers(0, size - 1))
    answers = data.draw(st.lists(st.booleans(), min_size=size + 1, max_size=size + 1))
    for sign in (1, -1):
        asked = []

        def holds(k, asked=asked, sign=sign):
            asked.append(k)
            assert 0 < sign * k < size
            return sign * k <= turn

        assert last_true(holds, 0, sign * size) == (sign * turn, sign * (turn + 1))
        assert len(asked) <= math.ceil(math.log2(size))
        good, bad = last_true(holds, 0, sign * size, least=math.ceil(size / 4))
        assert sign * good <= turn < sign * bad
        assert abs(bad - good) <= math.ceil(size / 4)
    for ends in ((0, size), (size, 0)):
        good, bad = last_true(answers.__getitem__, *ends)
        assert good == ends[0] or answers[good]
        assert bad == ends[1] or not answers[bad]
        assert abs(bad - good) == 1


def test_toolpaths_stay_in_their_order_and_are_not_divided():
    s = np.linspace(0.0, 1.0, 3)
    points = np.column_stack([0.4 + 0.2 * s, 0.1 * np.sin(5.0 * s), 0.2 + 0.0 * s])
    walk = coverable.poses(points, np.tile((0.0, 0.0, 1.0), (3, 1)), side="outside")
    found = explain(UR5, walk, Task(0.01, 10.0))
    assert len(found.thresholds) >= 6
    for threshold in found.thresholds:
        marks = threshold.feasible.witness.cell
        marks = marks[marks >= 0]
        assert np.array_equal(np.unique(marks), np.arange(3))
        assert (np.diff(marks) >= 0).all()
    far = np.column_stack([np.linspace(0.7, 1.1, 3), np.zeros(3), np.full(3, 0.2)])
    walk = coverable.poses(far, np.tile((0.0, 0.0, 1.0), (3, 1)), side="outside")
    found = explain(UR5, walk, Task(0.01, 10.0))
    assert found.verdict.answer is Answer.INFEASIBLE
    assert [t.quantity.axis for t in found.thresholds if t.feasible is not None] == [(-1, 0, 0)]


def test_edges():
    empty = explain(UR5, PLATE.cells(0, 3), Task(0.02, 30))
    assert (empty.verdict.feasible, empty.thresholds, empty.dropped) == (True, (), None)
    with pytest.raises(ValueError, match="method must be 'complete'"):
        explain(*given_case("plate"), coverable.Search(method="greedy"))
    late = explain(*given_case("4d"), coverable.Search(time_limit=1e-9))
    assert late.verdict.answer is Answer.UNDECIDED
    assert not any(t.feasible for t in late.thresholds)
    assert len(late.left_out) == 21 - len(late.thresholds) > 0


def test_where_check_alone_goes_further_than_from_known_motions_it_leads():
    case = load_case("paper/4a")  # with fewer cells known motions go as far
    found = explain(*case.build()[:3], case.search).thresholds
    least = {one.quantity.name: one.feasible.value for one in found}
    assert least["joint1 upper limit"] <= math.radians(30)  # 166 deg without
    assert least["joint5 upper limit"] <= math.radians(-80)  # 46 deg without
