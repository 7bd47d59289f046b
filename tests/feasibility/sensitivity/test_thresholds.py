"""Thresholds: bisection, what is varied and how, and the cheap questions that lead to them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from arm_builds import bare, built, on_a_base
from dense_replay import assert_over, tools
from paper_cases import PAPER_CASES

from feasibility import Task
from feasibility.clock import Clock
from feasibility.roadmap import Ruling, arrays_of
from feasibility.sensitivity import Kind, Quantity, last_true
from feasibility.sensitivity.explanation import apart, other_motions
from feasibility.sensitivity.limited_search import NO_CELL, project_all
from feasibility.sensitivity.probes import LEAST_BOXES, Prober
from feasibility.sensitivity.quantities import Variant, quantities, shifted
from feasibility.sensitivity.threshold_search import ThresholdSearch
from feasibility.sensitivity.warm_start import WarmStart
from feasibility.verdict import Answer, Evidence, Walk
from robots import load_robot
from surfaces import cylinder, plane, sphere

PLATE = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3))
SMALL = Variant(load_robot("ur5"), PLATE.cells(3, 3), Task(standoff=0.02, cone_deg=30))


def paper(name: str) -> Variant:
    case = PAPER_CASES[name]
    return Variant(case.robot(), case.cells(), case.task())


def prober_of(variant: Variant) -> Prober:
    return Prober(variant, 0, Clock())


# -- bisection -----------------------------------------------------------------------------------


@pytest.mark.parametrize("gallop", [False, True])
def test_bisection_finds_every_place_from_both_sides(gallop: bool) -> None:
    for size in range(1, 40):
        for turn in range(size):
            up, down = [0], [0]

            def holds_up(k: int, turn: int = turn, asked: list[int] = up, n: int = size) -> bool:
                assert 0 < k < n
                asked[0] += 1
                return k <= turn

            def holds_down(
                k: int, turn: int = turn, asked: list[int] = down, n: int = size
            ) -> bool:
                assert -n < k < 0
                asked[0] += 1
                return k >= -turn

            assert last_true(holds_up, 0, size, gallop) == turn
            assert last_true(holds_down, 0, -size, gallop) == -turn
            most = (2 if gallop else 1) * math.ceil(math.log2(size)) + 1
            assert max(up[0], down[0]) <= most


def test_bisection_ends_beside_a_failure_whatever_the_answers() -> None:
    rng = np.random.default_rng(0)
    for _ in range(300):
        size = int(rng.integers(2, 60))
        answers = rng.random(size + 1) < 0.7
        for gallop in (False, True):
            for good, bad in ((0, size), (size, 0)):
                k = last_true(answers.__getitem__, good, bad, gallop)
                step = 1 if bad > good else -1
                assert k == good or answers[k]
                assert k + step == bad or not answers[k + step]


def test_galloping_stays_in_the_stretch_it_starts_in() -> None:
    """A gap as wide as the way before it is never jumped."""
    for edge in range(1, 60):
        for size in (200, 500):
            k = last_true(
                {*range(edge + 1), *range(3 * edge + 4, size)}.__contains__, 0, size, True
            )
            assert k == edge


# -- what is varied ------------------------------------------------------------------------------


@pytest.mark.parametrize("widen", [False, True])
def test_values_run_from_the_given_one_to_the_end_in_equal_steps(widen: bool) -> None:
    asked = quantities(paper("4d"), widen)
    assert len(asked) == 1 + 12 + 2 + 6
    assert len({q.name for q in asked}) == len(asked)
    for q in asked:
        values = np.array([q.value(k) for k in range(q.last + 1)])
        assert values[0] == pytest.approx(q.given, abs=1e-12)
        assert values[-1] == q.end
        steps = np.diff(values) * np.sign(q.end - q.given)
        step = math.radians(q.step) if q.unit == "rad" else q.step
        np.testing.assert_allclose(steps[:-1], step, rtol=1e-6)
        assert 0.0 < steps[-1] <= step * (1 + 1e-6)


@pytest.mark.parametrize("widen", [False, True])
def test_a_quantity_changes_itself_and_nothing_else(widen: bool) -> None:
    variant = paper("4d")
    for q in quantities(variant, widen):
        robot, cells, task = q.applied(variant, 3)
        value = q.value(3)
        lower, upper = np.array(variant.robot.lower), np.array(variant.robot.upper)
        expected = variant.task
        shift = np.zeros(3)
        if q.kind is Kind.CONE:
            expected = replace(expected, cone_deg=round(math.degrees(value), 9))
        elif q.kind is Kind.STANDOFF:
            expected = replace(expected, standoff=value)
        elif q.kind is Kind.SHIFT:
            shift = value * np.array(q.axis)
        else:
            (lower if q.kind is Kind.LOWER else upper)[q.joint] = value
            wider = (value < q.given) == (q.kind is Kind.LOWER)
            assert wider == widen
        np.testing.assert_array_equal(robot.lower, lower)
        np.testing.assert_array_equal(robot.upper, upper)
        assert (task.standoff, task.tolerance) == (expected.standoff, expected.tolerance)
        assert task.cone_deg == expected.cone_deg
        np.testing.assert_allclose(cells.centres, variant.cells.centres + shift, atol=1e-12)
        assert q.applied(variant, 0) is variant


def test_a_slide_counts_in_metres(tmp_path: Path) -> None:
    arm = load_robot("puma560")
    rail = on_a_base(bare(arm.urdf or ""), "prismatic", limits=(-0.3, 0.4))
    robot = built(rail, tmp_path, arm)
    (slide,) = np.flatnonzero(robot.prismatic)
    variant = Variant(robot, SMALL.cells, SMALL.task)
    for widen, ends in ((True, (-0.8, 0.9)), (False, (0.399, -0.299))):
        limits = [q for q in quantities(variant, widen) if q.joint == slide]
        assert [q.unit for q in limits] == ["m", "m"]
        assert tuple(q.end for q in limits) == pytest.approx(ends)
        assert limits[1].value(3) == pytest.approx(0.403 if widen else 0.397)


def test_joints_that_turn_freely_have_no_limit_to_vary() -> None:
    kinova = load_robot("kinova")
    named = {
        q.joint
        for q in quantities(Variant(kinova, SMALL.cells, SMALL.task), True)
        if q.kind in (Kind.LOWER, Kind.UPPER)
    }
    assert named == set(np.flatnonzero(np.isfinite(kinova.lower)).tolist())
    assert 0 < len(named) < kinova.n


def test_what_has_no_room_is_left_out() -> None:
    variant = Variant(SMALL.robot, SMALL.cells, Task(standoff=0.0, cone_deg=180))
    names = [q.name for q in quantities(variant, widen=True)]
    assert "cone" not in names
    assert "smaller standoff" not in names
    assert "larger standoff" in names


@pytest.mark.parametrize(
    "surface", [sphere(1.0, (10, 90), (10, 180)), cylinder(0.5, (-60, 60), (0, 0.9))]
)
def test_shifted_cells_are_those_of_the_shifted_surface(surface) -> None:  # type: ignore[no-untyped-def]
    shift = np.array([0.1, -0.2, 0.3])
    moved = shifted(surface.cells(4, 5), shift)
    fresh = surface.moved(np.eye(3), shift).cells(4, 5)
    np.testing.assert_allclose(moved.centres, fresh.centres, atol=1e-12)
    np.testing.assert_allclose(moved.normals, fresh.normals, atol=1e-12)
    np.testing.assert_allclose(moved.areas, fresh.areas, atol=1e-12)
    np.testing.assert_array_equal(moved.pairs, fresh.pairs)
    for name in ("first", "cubics", "derivative_bounds", "deviations"):
        np.testing.assert_allclose(
            getattr(moved.curves, name), getattr(fresh.curves, name), atol=1e-9
        )


# -- cheap questions -----------------------------------------------------------------------------


def test_a_problem_nearby_is_the_one_made_anew() -> None:
    variant = paper("4c")
    prober = prober_of(variant)
    for q in quantities(variant, widen=False):
        found, fresh = prober.arrays_at(q, 7), arrays_of(*q.applied(variant, 7))
        for name, one, other in zip(found._fields, found, fresh, strict=True):
            if name != "chain":
                np.testing.assert_allclose(one, other, atol=1e-9, err_msg=f"{q.name}: {name}")


def quantity(variant: Variant, name: str, widen: bool = False) -> Quantity:
    return next(q for q in quantities(variant, widen) if q.name == name)


@pytest.mark.parametrize(
    "name", ["cone", "joint1 lower limit", "larger standoff", "shift along -y"]
)
def test_followed_configurations_lie_on_the_fibres(name: str) -> None:
    """Pinocchio says where the tool is; the task says where it should be."""
    variant = paper("4c")
    prober = prober_of(variant)
    nowhere = np.full((len(variant.cells), variant.robot.n), np.nan)
    start = other_motions(prober, 24, 1)[0]
    assert not np.isnan(start.q).any()
    q = quantity(variant, name)
    for k in (1, 10, 40):
        cell, found = prober.follow(prober.arrays_at(q, k), start.q)
        assert cell == NO_CELL
        assert_over(q.applied(variant, k), np.arange(len(variant.cells)), found)
    cell, _ = prober.follow(prober.arrays, nowhere)
    assert cell != NO_CELL  # NaN is never taken for a configuration


@pytest.mark.parametrize("name", ["4c", "small"])
def test_over_the_centres_the_cheap_problem_is_the_same(name: str) -> None:
    variant = SMALL if name == "small" else paper(name)
    prober = prober_of(variant)
    for widen in (False, True):
        for q in quantities(variant, widen):
            for k in (0, 5, q.last):
                cheap, fresh = prober.centres_at(q, k), arrays_of(*q.applied(variant, k))
                for field in ("points", "approaches", "lower", "upper", "cone_chord"):
                    np.testing.assert_allclose(
                        getattr(cheap, field), getattr(fresh, field), atol=1e-9, err_msg=q.name
                    )


@pytest.mark.parametrize("name", ["4c", "small"])
def test_warm_starts_reach_as_far_as_they_go_and_no_further(name: str) -> None:
    """At the value reached every cell projects; the cell that is named fails at the next."""
    variant = SMALL if name == "small" else paper(name)
    prober = prober_of(variant)
    start = other_motions(prober, 24, 1)[0]
    named = 0
    for q in quantities(variant, widen=False):
        reached = WarmStart(prober, q, 0, start.q).reach(q.last + 1)
        assert 0 <= reached.k <= q.last
        arrays = prober.arrays_at(q, reached.k)
        if len(variant.cells) <= 40:  # on more cells the search that follows looks at the rest
            cell, found = prober.follow(arrays, reached.q)
            assert cell == NO_CELL
            assert_over(q.applied(variant, reached.k), np.arange(len(variant.cells)), found)
        if reached.cell != NO_CELL:
            named += 1
            beyond = prober.centres_at(q, reached.k + 1)
            one = np.array([reached.cell])
            assert project_all(beyond, prober.work, one, reached.q.copy()) == 0, q.name
        else:
            assert reached.k == q.last
    assert named >= 5


def test_proofs_that_fail_are_asked_for_less_until_one_succeeds() -> None:
    variant = paper("4d")
    prober = prober_of(variant)
    for _ in range(20):
        assert prober.rule(prober.arrays, 89, 2)[0] is Ruling.OPEN
    assert prober.allowance < 1e-3
    before = prober.spent
    assert prober.rule(prober.arrays, 89, 3000)[0] is Ruling.OPEN
    # A box may be looked at up to three times.
    assert LEAST_BOXES <= prober.spent - before <= 3 * LEAST_BOXES
    assert prober.rule(prober.arrays, 60, 3000)[0] is not Ruling.PROVED
    prober.allowance = 0.5
    assert prober.rule(prober.arrays, 60, 3000)[0] is Ruling.PROVED
    assert prober.allowance == 1.0
    assert prober.rule(prober.arrays, 89, 3000)[0] is Ruling.PROVED


def test_a_ruling_brings_a_proof_or_a_configuration() -> None:
    variant = paper("4d")
    prober = prober_of(variant)
    points, approaches, _ = variant.task.targets(variant.cells)
    for cell in (0, 45, 89):
        ruling, q = prober.rule(prober.arrays, cell, 20_000)
        if cell >= 60:
            assert ruling is Ruling.PROVED
            assert q is None
            assert prober.suspects[0] == cell
        else:
            assert q is not None
            point, axis = tools(variant.robot, q[None])
            assert np.linalg.norm(point[0] - points[cell]) <= 1e-3
            assert axis[0] @ approaches[cell] >= math.cos(variant.task.cone) - 1e-9


def test_a_search_without_a_ration_finds_nothing_and_says_so() -> None:
    variant = paper("4a")
    prober = prober_of(variant)
    nothing = np.full((90, 6), np.nan)
    attempt = prober.attempt(prober.arrays, nothing, 10, deep=True)
    assert not attempt.found
    assert (attempt.answer, attempt.evidence) == (Answer.UNDECIDED, Evidence.BUDGET)
    assert prober.spent > 0
    attempt = prober.attempt(prober.arrays, nothing, np.inf, deep=True)
    assert attempt.found


def test_a_motion_that_the_replay_refuses_is_not_feasible() -> None:
    prober = prober_of(SMALL)
    attempt = prober.attempt(prober.arrays, np.full((9, 6), np.nan), np.inf, deep=True)
    assert attempt.walk is not None
    assert prober.confirmed(SMALL, attempt).answer is Answer.FEASIBLE
    q = attempt.walk.q.copy()
    q[len(q) // 2] += 0.05
    bent = replace(attempt, walk=Walk(q, attempt.walk.cell))
    refused = prober.confirmed(SMALL, bent)
    assert (refused.answer, refused.evidence) == (Answer.UNDECIDED, Evidence.BUDGET)
    assert refused.walk is None
    assert "refuses" in refused.detail


def test_motions_from_other_postures_are_motions() -> None:
    variant = paper("4a")
    prober = prober_of(variant)
    attempts = other_motions(prober, 64, 4)
    assert len(attempts) >= 2
    for attempt in attempts:
        assert prober.confirmed(variant, attempt).answer is Answer.FEASIBLE
    first = np.array([attempt.q[0] for attempt in attempts])
    assert np.ptp(first, axis=0).max() > 0.5


def test_rows_far_apart_are_chosen_first() -> None:
    rows = np.array([[0.0], [0.01], [10.0], [4.0], [10.01]])
    assert apart(rows, 3) == [0, 4, 3]
    assert apart(rows, 99) == [0, 4, 3]  # the others are nearly the same
    assert apart(rows[:0], 3) == []


def test_a_wide_margin_is_narrowed_from_where_it_stands() -> None:
    variant = paper("4a")
    prober = prober_of(variant)
    motions = other_motions(prober, 24, 2)
    narrowed = 0
    for name in ("joint5 lower limit", "joint5 upper limit", "shift along +x"):
        search = ThresholdSearch(prober, quantity(variant, name), 2000, 0, motions)
        found = search.tighten()
        search.stop = prober.spent + 100_000
        again = search.tighter(found)
        assert again.feasible is not None
        assert again.other is not None
        assert again.feasible.evidence is Evidence.WITNESS
        assert again.margin >= found.margin
        assert again.steps_apart <= found.steps_apart
        narrowed += again.steps_apart < found.steps_apart
    assert narrowed >= 1
