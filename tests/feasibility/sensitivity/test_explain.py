"""What would make a case feasible, and the margins of a feasible one: held to verdicts."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
import pytest
from paper_cases import PAPER_CASES

from feasibility import Answer, Evidence, Search, Task, Verdict, check
from feasibility.clock import Clock
from feasibility.reports.changes import label, shown
from feasibility.reports.explanation import as_json, as_text
from feasibility.reports.explanation_words import helpful
from feasibility.sensitivity import Explanation, Kind, Quantity, Threshold, explain
from feasibility.sensitivity import explanation as explanations
from feasibility.sensitivity.probes import Prober
from feasibility.sensitivity.quantities import Variant, quantities
from robots import load_robot
from surfaces import cylinder, plane, sphere

PUMA = load_robot("puma560", limits="set-1")
UR5 = load_robot("ur5")
PLATE = plane((0.4, 0.6), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3))
STIFF = PUMA.with_limits({f"joint{k}": (0.0, 0.0) for k in (4, 5, 6)})
"""joint4 to joint6 held: the tool stands along the forearm, and only joints 1 to 3 aim it."""
WALL = plane((-0.2, 0.2), (-0.2, 0.2), "outside", (0.6, 0.1, 0.2), (0.0, 90.0, 0.0))

CASES = {
    "plate": Variant(UR5, PLATE.cells(3, 3), Task(0.02, 30)),
    # begins within reach and ends far outside: nothing helps
    "long plate": Variant(
        UR5,
        plane((0.4, 2.4), (-0.1, 0.1), "outside", (0.0, 0.0, 0.3)).cells(4, 2),
        Task(0.02, 30),
    ),
    "stiff wrist": Variant(STIFF, WALL.cells(3, 3), Task(0.0, 20)),
    "ring": Variant(
        PUMA.with_limits({"joint1": np.radians([-30.0, 20.0])}),
        cylinder(0.6, (-60, 60), (0.2, 0.3)).cells(6, 1),
        Task(0.02, 40),
    ),
    "cheap ur5": Variant(
        UR5,
        plane((0.3, 0.6), (-0.15, 0.15), "outside", (0.0, 0.0, 0.3)).cells(9, 10),
        Task(0.02, 30),
    ),
    "cheap z1": Variant(
        load_robot("z1"),
        plane((0.25, 0.4), (-0.1, 0.1), "outside", (0.0, 0.0, 0.2)).cells(9, 10),
        Task(0.02, 30),
    ),
    "dome": Variant(
        load_robot("panda"),
        sphere(0.25, (10, 50), (150, 230), position=(0.65, 0, 0.1), side="outside").cells(9, 10),
        Task(0.02, 25),
    ),
    # the tool at the plate's place is below the reach; the standoff lifts it
    "deep plate": Variant(
        UR5,
        plane((0.5, 0.6), (-0.05, 0.05), "outside", (0.0, 0.0, -0.75)).cells(2, 2),
        Task(0.01, 40),
    ),
}


@cache
def variant_of(name: str) -> Variant:
    if name in CASES:
        return CASES[name]
    case = PAPER_CASES[name]
    return Variant(case.robot(), case.cells(), case.task())


@cache
def explained(name: str) -> Explanation:
    return explain(*variant_of(name))


def threshold_of(explanation: Explanation, name: str) -> Threshold:
    return next(t for t in explanation.thresholds if t.quantity.name == name)


def verdict_at(variant: Variant, threshold: Threshold, value: float) -> Verdict:
    """The verdict of the case with a quantity at any value, made without `Quantity.applied`."""
    robot, cells, task = variant
    quantity = threshold.quantity
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
    return check(robot, cells, task)


# -- an infeasible case --------------------------------------------------------------------------


def test_4d_names_joint1_and_granting_what_it_needs_is_enough() -> None:
    """The wrist centre's azimuth less asin(0.1 / 0.495) is where joint1 must stand."""
    variant, found = variant_of("4d"), threshold_of(explained("4d"), "joint1 upper limit")
    assert found.feasible is not None
    assert found.other is not None
    needed = np.degrees(variant.cells.u.max()) - math.degrees(math.asin(0.1 / 0.495))
    assert abs(math.degrees(found.feasible.value) - needed) <= 0.2
    assert found.resolution is not None
    assert math.degrees(found.resolution) <= 0.5 + 1e-9
    value = found.feasible.value
    assert verdict_at(variant, found, value).answer is Answer.FEASIBLE
    assert verdict_at(variant, found, value + math.radians(0.1)).answer is Answer.FEASIBLE
    less = verdict_at(variant, found, value - math.radians(0.5))
    assert (less.answer, less.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
    text = " ".join(as_text(explained("4d"), "paper/4d").split())
    limit = f"robot.limits_deg.joint1 (upper) {shown(found.quantity, value, True)} (10 deg now)"
    assert text.startswith(f"paper/4d: infeasible. One change makes it feasible: {limit}.")


def test_4d_drops_the_cells_that_no_motion_covers() -> None:
    dropped = explained("4d").dropped
    assert dropped is not None
    assert dropped.cells.tolist() == list(range(60, 90))
    assert dropped.share == pytest.approx(1 / 3)
    assert dropped.area == pytest.approx(0.5 * math.radians(40) * 0.9)
    assert dropped.waypoints is not None
    assert not dropped.cells.flags.writeable


def test_the_cone_a_stiff_wrist_needs_is_that_of_the_geometry() -> None:
    """Each arm branch tilts the tool over each cell by an angle that a closed formula gives.

    The covering motion keeps to one branch, so alpha is the least over branches of the largest
    over cells.
    """
    variant = variant_of("stiff wrist")
    found = threshold_of(explained("stiff wrist"), "cone")
    assert found.feasible is not None
    assert found.other is not None
    points, approaches, _ = variant.task.targets(variant.cells)
    tilts = np.array([branch_tilts(p, a) for p, a in zip(points, approaches, strict=True)])
    least = tilts.max(axis=0).min()
    assert -0.2 <= math.degrees(found.feasible.value) - least <= 1.0
    assert found.other.value < found.feasible.value
    value = found.feasible.value
    assert verdict_at(variant, found, value + math.radians(0.1)).answer is Answer.FEASIBLE
    less = verdict_at(variant, found, value - math.radians(0.5 + 1.0))
    assert less.answer is not Answer.FEASIBLE
    text = " ".join(as_text(explained("stiff wrist"), "stiff wrist").split())
    assert f"task.cone_deg 20 deg {shown(found.quantity, value, True)}" in text


def branch_tilts(point: np.ndarray, approach: np.ndarray) -> list[float]:
    """Angle (degrees) of the tool along the forearm, for each closed-form branch of joints 1..3."""
    elbow, tilts = math.hypot(0.1, 0.7), []
    radius = math.sqrt(point[0] ** 2 + point[1] ** 2 - 0.1**2)
    for sign in (1.0, -1.0):
        q1 = math.atan2(point[1], point[0]) - math.atan2(0.1, sign * radius)
        far = math.hypot(radius, point[2])
        bend = math.acos((far**2 - 0.7**2 - elbow**2) / (2 * 0.7 * elbow))
        for turn in (bend, -bend):
            q2 = math.atan2(-point[2], sign * radius) - math.atan2(
                elbow * math.sin(turn), 0.7 + elbow * math.cos(turn)
            )
            q = np.array([q1, q2, turn - math.atan2(0.7, 0.1), 0.0, 0.0, 0.0])
            q = np.arctan2(np.sin(q), np.cos(q))
            from dense_replay import tools

            at, axis = tools(PUMA, q[None])
            np.testing.assert_allclose(at[0], point, atol=1e-9)
            tilts.append(math.degrees(math.acos(np.clip(axis[0] @ approach, -1.0, 1.0))))
    return tilts


def test_a_ring_needs_of_joint1_what_its_azimuth_asks_for() -> None:
    """Two limits are in the way: neither alone helps, and one is enough once the other is wide."""
    variant, offset = variant_of("ring"), math.degrees(math.asin(0.1 / 0.58))
    azimuth = np.degrees(variant.cells.u)
    both = explained("ring")
    assert {c.kind for c in both.verdict.causes} == {"joint_limits"}
    for wide, name, needed in (
        ("lower", "joint1 upper limit", azimuth.max() - offset),
        ("upper", "joint1 lower limit", azimuth.min() - offset),
    ):
        limits = np.radians([-120.0, 20.0] if wide == "lower" else [-30.0, 120.0])
        arm = variant.robot.with_limits({"joint1": limits})
        found = threshold_of(explain(arm, variant.cells, variant.task), name)
        assert found.feasible is not None
        # Stretched arms that reach backwards would need more than this, in either direction.
        assert abs(math.degrees(found.feasible.value) - needed) <= 0.3


def test_a_ring_that_a_stop_cuts_in_two_needs_joint1_to_pass_it() -> None:
    """Every cell is reached, forwards or backwards, yet no motion turns from one to the other.

    Forwards joint1 stands at the azimuth less the offset, so the far end of the ring asks for 145
    degrees; backwards, as the mirror image, for the same in the other direction.
    """
    arm = PUMA.with_limits({"joint1": np.radians([-100.0, 100.0])})
    ring = cylinder(0.6, (20, 160), (0.2, 0.3)).cells(8, 1)
    explanation = explain(arm, ring, Task(0.02, 40))
    assert explanation.verdict.evidence is Evidence.PROOF
    assert explanation.verdict.proof is not None
    assert explanation.verdict.proof.kind == "cut"
    needed = np.degrees(ring.u).max() - math.degrees(math.asin(0.1 / 0.58))
    for name, sign in (("joint1 upper limit", 1.0), ("joint1 lower limit", -1.0)):
        found = threshold_of(explanation, name)
        assert found.feasible is not None
        assert abs(sign * math.degrees(found.feasible.value) - needed) <= 0.2
    dropped = explanation.dropped
    assert dropped is not None
    assert dropped.waypoints is not None
    assert len(dropped.cells) == 8 - explanation.verdict.n_covered


def test_a_standoff_that_lifts_the_tool_has_two_ends() -> None:
    variant = variant_of("deep plate")
    found = threshold_of(explained("deep plate"), "larger standoff")
    assert not explained("deep plate").verdict.feasible
    assert found.feasible is not None
    assert found.other is not None
    assert found.span is not None
    assert found.other.value < found.feasible.value <= found.span.feasible.value
    for value in (found.feasible.value, found.span.feasible.value):
        assert verdict_at(variant, found, value).answer is Answer.FEASIBLE
    if found.other.evidence is Evidence.PROOF:
        assert verdict_at(variant, found, found.other.value).answer is not Answer.FEASIBLE


def test_nothing_helps_a_plate_that_leaves_the_room() -> None:
    explanation = explained("long plate")
    for found in explanation.thresholds:
        assert found.feasible is None, found.quantity.name
        assert found.resolution is None
        assert found.other is not None
        assert (found.other.answer, found.other.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
        assert found.quantity.monotone or found.each_proved
    text = as_text(explanation, "long plate")
    assert "Proved infeasible at each value tried: task.standoff" in text
    assert "Not found to help" not in text
    assert "None of the single changes that were tried makes it feasible." in text
    dropped = explanation.dropped
    assert dropped is not None
    missed = np.flatnonzero(~explanation.verdict.covered)
    np.testing.assert_array_equal(dropped.cells, missed)
    assert dropped.share == pytest.approx(len(missed) / 8)
    assert f"{100 * dropped.share:.3g} % of the area" in text


# -- every threshold, on both sides --------------------------------------------------------------


MORE = ["4a", "cheap ur5", "cheap z1", "dome"]  # make campaign NAME=larger_samples


@pytest.mark.parametrize("name", ["plate", "stiff wrist", "deep plate", "4d", "5e"])
def test_what_is_said_of_a_side_is_what_a_verdict_says(name: str) -> None:
    """Feasible sides are feasible, proved ones are not, in cases built from scratch."""
    variant, sides = variant_of(name), 0
    for found in explained(name).thresholds:
        if found.feasible is not None:
            assert found.feasible.evidence is Evidence.WITNESS
            verdict = verdict_at(variant, found, found.feasible.value)
            assert verdict.answer is Answer.FEASIBLE, found.quantity.name
            sides += 1
        if found.other is not None and found.other.evidence is Evidence.PROOF:
            verdict = verdict_at(variant, found, found.other.value)
            assert verdict.answer is not Answer.FEASIBLE, found.quantity.name
            sides += 1
    assert sides >= 12


@pytest.mark.parametrize("name", ["plate", "4a", "5e"])
def test_margins_run_from_the_case_as_it_stands_inwards(name: str) -> None:
    explanation = explained(name)
    assert explanation.verdict.feasible
    assert explanation.dropped is None
    for found in explanation.thresholds:
        quantity = found.quantity
        assert found.feasible is not None
        way = np.sign(quantity.end - quantity.given)
        assert way * (found.feasible.value - quantity.given) >= 0.0
        assert way * (quantity.end - found.feasible.value) >= 0.0
        if found.other is None:
            assert found.feasible.value == quantity.end
        else:
            assert way * (found.other.value - found.feasible.value) > 0.0
            assert not found.other.feasible
            assert found.steps_apart >= 1
        assert found.margin == abs(found.feasible.value - quantity.given)


def test_4a_may_lose_as_much_of_joint1_as_the_azimuth_leaves() -> None:
    """Arm forwards, joint1 stands at the azimuth less an offset; backwards, half a turn further."""
    variant = variant_of("4a")
    radii = np.linalg.norm(variant.task.targets(variant.cells).points[:, :2], axis=1)
    offset = np.degrees(np.arcsin(0.1 / radii))
    azimuth = np.degrees(variant.cells.v)
    lower = threshold_of(explained("4a"), "joint1 lower limit")
    upper = threshold_of(explained("4a"), "joint1 upper limit")
    assert lower.feasible is not None
    assert upper.feasible is not None
    forwards, backwards = azimuth - offset, azimuth - 180.0 + offset
    assert math.degrees(lower.feasible.value) == pytest.approx(forwards.min(), abs=1.0)
    assert math.degrees(upper.feasible.value) == pytest.approx(backwards.max(), abs=1.0)


# -- monotone ------------------------------------------------------------------------------------


def test_a_wider_cone_never_needs_a_wider_joint() -> None:
    robot, cells, task = variant_of("4d")
    needs = []
    for cone_deg in (20, 90):
        found = explain(robot, cells, Task(task.standoff, cone_deg))
        threshold = threshold_of(found, "joint1 upper limit")
        assert threshold.feasible is not None
        needs.append(math.degrees(threshold.feasible.value))
    assert (np.diff(needs) <= 0.5 + 1e-9).all()


def test_a_wider_joint_never_needs_a_wider_cone() -> None:
    needs = []
    for free_deg in (0.0, 15.0):
        limits = {f"joint{k}": np.radians([-free_deg, free_deg]) for k in (4, 5)}
        found = explain(STIFF.with_limits(limits), WALL.cells(3, 3), Task(0.0, 10))
        threshold = threshold_of(found, "cone")
        assert threshold.feasible is not None
        needs.append(math.degrees(threshold.feasible.value))
    assert (np.diff(needs) < 0.0).all()


# -- edges ---------------------------------------------------------------------------------------


def test_no_cells_need_no_explanation() -> None:
    explanation = explain(UR5, PLATE.cells(0, 3), Task(0.02, 30))
    assert explanation.verdict.feasible
    assert explanation.thresholds == ()
    assert explanation.dropped is None
    assert "no cells" in as_text(explanation, "empty")
    assert as_json(explanation, "empty")["thresholds"] == []


def test_out_of_time_is_said_and_nothing_is_claimed() -> None:
    explanation = explain(*variant_of("4d"), Search(time_limit=1e-9))
    assert explanation.verdict.answer is Answer.UNDECIDED
    assert not any(t.feasible is not None for t in explanation.thresholds)
    assert len(explanation.left_out) == 21 - len(explanation.thresholds)
    assert len(explanation.left_out) > 0
    text = " ".join(as_text(explanation, "4d").split())
    assert "undecided" in text
    assert "The time limit ran out" in text
    for name in explanation.left_out:
        assert name in text[text.rindex("unknown") :]
    # Cells that nothing was looked for at are no cells to drop.
    assert "what would have to be dropped is unknown" in text
    assert "have to be dropped." not in text
    assert "makes it feasible" not in text
    assert "None of the single changes" not in text or explanation.thresholds


def test_a_search_that_the_time_limit_cut_says_so() -> None:
    """Not "not found": more time may find it."""
    variant = variant_of("4a")
    prober = Prober(variant, 0, Clock(1e-9).start())
    nothing = np.full((90, 6), np.nan)
    attempt = prober.attempt(prober.arrays, nothing, np.inf, deep=True)
    assert (attempt.answer, attempt.evidence) == (Answer.UNDECIDED, Evidence.BUDGET)
    assert attempt.detail == "unknown, because the time limit ran out"


@pytest.mark.parametrize("cents", [0.0, 0.3, 0.5, 0.7])
def test_a_printed_limit_is_on_the_side_that_was_found(cents: float) -> None:
    """Whoever copies the number gets what the verdict was about, or something easier."""
    value = math.radians(41.7 + cents / 100.0)
    for kind, freer in ((Kind.CONE, 1.0), (Kind.UPPER, 1.0), (Kind.LOWER, -1.0)):
        for sign in (1.0, -1.0):
            quantity = Quantity(kind, "", "rad", 0.0, sign, 0.1, True, 0)
            for feasible, way in ((True, freer), (False, -freer)):
                printed = float(shown(quantity, sign * value, feasible).removesuffix(" deg"))
                off = way * (printed - math.degrees(sign * value))
                assert -1e-9 <= off < 0.01


def test_a_cone_of_zero_is_undecided_and_a_wider_one_is_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of all quantities the cone alone, which is the first one, is looked at here."""
    monkeypatch.setattr(
        explanations, "quantities", lambda variant, widen: quantities(variant, widen)[:1]
    )
    explanation = explain(UR5, PLATE.cells(2, 2), Task(0.02, 0))
    assert explanation.verdict.answer is Answer.UNDECIDED
    found = threshold_of(explanation, "cone")
    assert found.feasible is not None
    assert found.feasible.value > 0.0
    assert verdict_at(variant_of("plate"), found, found.feasible.value).feasible


def test_the_greedy_search_is_refused() -> None:
    with pytest.raises(ValueError, match="method must be 'complete'"):
        explain(*variant_of("plate"), Search(method="greedy"))


def test_the_same_question_gets_the_same_answer() -> None:
    one = as_json(explained("4d"), "4d")
    other = as_json(explain(*variant_of("4d")), "4d")
    for result in (one, other):
        result.pop("seconds")
    assert one == other


@pytest.mark.parametrize("name", ["4a", "4d", "5e", "cheap ur5", "cheap z1", "dome"])
def test_an_explanation_costs_at_most_so_many_evaluations(name: str) -> None:
    """Forty verdicts, cheap as they may be, and what `check` is asked at far sides."""
    explanation = explained(name)
    cost = explanation.verdict.statistics["fk"]
    assert explanation.evaluations + cost <= 40 * cost + 25 * max(6 * cost, 150_000)


def test_progress_counts_the_thresholds_and_may_end_the_work() -> None:
    seen = []

    class Enough(Exception):
        pass

    def report(done: int, total: int | None, text: str) -> None:
        seen.append((done, total))
        if done == 3:
            raise Enough

    with pytest.raises(Enough):
        explain(*variant_of("long plate"), progress=report)
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    assert {total for _, total in seen} <= {None, 21}
    assert (3, 21) in seen


# -- words and numbers ---------------------------------------------------------------------------


def leaves(value: Any) -> Iterator[Any]:
    if isinstance(value, dict):
        for item in value.values():
            yield from leaves(item)
    elif isinstance(value, list):
        for item in value:
            yield from leaves(item)
    else:
        yield value


@pytest.mark.parametrize("name", ["plate", "long plate", "stiff wrist", "deep plate", "4d"])
def test_json_has_plain_numbers_and_the_text_what_helps(name: str) -> None:
    explanation = explained(name)
    result = as_json(explanation, name)
    assert json.loads(json.dumps(result, allow_nan=False)) == result
    assert all(isinstance(leaf, (str, int, float, type(None))) for leaf in leaves(result))
    words = " ".join(as_text(explanation, name).split())
    for found, said in zip(explanation.thresholds, result["thresholds"], strict=True):
        if found in helpful(explanation):
            assert found.feasible is not None
            value = shown(found.quantity, found.feasible.value, True)
            assert f"{label(found.quantity)} " in words
            assert f" {value}" in words
        assert label(found.quantity) in said["sentence"]
        assert said["key"] in label(found.quantity)
        unit = "deg" if found.quantity.unit == "rad" else "m"
        scale = 180.0 / math.pi if unit == "deg" else 1.0
        assert said[f"given_{unit}"] == pytest.approx(scale * found.quantity.given, abs=1e-5)
        for key, side in (("feasible", found.feasible), ("other", found.other)):
            assert (said[key] is None) == (side is None)
            if side is not None:
                assert said[key][f"value_{unit}"] == pytest.approx(scale * side.value, abs=1e-5)
                assert said[key]["verdict"] == str(side.answer)
                assert (said[key]["verdict"] == "feasible") == (key == "feasible")
    assert all(len(line) <= 100 for line in as_text(explanation, name).splitlines())
