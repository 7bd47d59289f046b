"""Causes: each missed cell has one, and the figures in it are those of the geometry."""

from __future__ import annotations

import math
import re

import numpy as np
from dense_replay import tools

from feasibility import CauseKind, Evidence, Search, Task, Verdict, check
from robots import load_robot
from surfaces import cylinder, plane, sphere

PUMA = load_robot("puma560", limits="set-1")
ELBOW = math.hypot(0.1, 0.7)  # [m] from elbow to wrist centre
REACH = math.hypot(0.7 + ELBOW, 0.1)  # [m] from the first joint's origin to the wrist centre


def kinds(verdict: Verdict) -> set[CauseKind]:
    return {cause.kind for cause in verdict.causes}


def number(pattern: str, text: str) -> float:
    found = re.search(pattern, text)
    assert found is not None, text
    return float(found[1])


def test_out_of_reach_says_by_how_much() -> None:
    for beyond in (0.05, 0.4, 2.0):
        dome = sphere(REACH + beyond, (60, 110), (-30, 60))
        verdict = check(PUMA, dome.cells(2, 3), Task(0.0, 90))
        assert kinds(verdict) == {CauseKind.OUT_OF_REACH}
        for cause in verdict.causes:
            assert cause.proved
            short = number(r"([0-9.]+) mm short", cause.detail)
            assert abs(short - 1e3 * beyond) <= 0.05 * 1e3 * beyond + 1.0


def test_a_joint_limit_says_which_joint_and_where_it_would_have_to_be() -> None:
    """A ring about the first axis, in front: joint1 has to follow the azimuth."""
    ring = cylinder(0.6, (-60, 60), (0.2, 0.3))
    arm = PUMA.with_limits({"joint1": np.radians([-30.0, 20.0])})
    verdict = check(arm, ring.cells(12, 1), Task(0.02, 40))
    assert kinds(verdict) == {CauseKind.JOINT_LIMITS}
    offset = math.degrees(math.asin(0.1 / 0.58))
    azimuth = np.degrees(verdict.cells.u)
    within = (azimuth - offset >= -30.0) & (azimuth - offset <= 20.0)
    np.testing.assert_array_equal(verdict.covered, within)
    for cause in verdict.causes:
        assert cause.proved
        needed = number(r"joint1 would need (-?[0-9.]+) deg", cause.detail)
        stop = number(r"it stops at (-?[0-9.]+) deg", cause.detail)
        assert abs(needed - (azimuth[cause.cell] - offset)) < 0.3
        assert stop == (-30.0 if needed < 0 else 20.0)


def test_orientation_says_the_smallest_angle_that_could_be_had() -> None:
    """joint4 and joint5 held: the tool stands along the forearm, and only joints 1 to 3 aim it."""
    arm = PUMA.with_limits({"joint4": (0.0, 0.0), "joint5": (0.0, 0.0), "joint6": (0.0, 0.0)})
    wall = plane((-0.2, 0.2), (-0.2, 0.2), "outside", (0.6, 0.1, 0.2), (0.0, 90.0, 0.0))
    verdict = check(arm, wall.cells(3, 3), Task(0.0, 20))
    assert kinds(verdict) == {CauseKind.ORIENTATION}
    points, approaches, _ = verdict.task.targets(verdict.cells)
    for cause in verdict.causes:
        reported = number(r"tilts ([0-9.]+) deg", cause.detail)
        best = smallest_angle(points[cause.cell], approaches[cause.cell])
        assert best - 0.1 <= reported <= best + 1.5  # found by bisection, from random starts
        assert reported > 20.0


def smallest_angle(point: np.ndarray, approach: np.ndarray) -> float:
    """Over the closed-form arm branches, tool along the forearm, degrees."""
    best = 180.0
    radius = math.sqrt(point[0] ** 2 + point[1] ** 2 - 0.1**2)
    for sign in (1.0, -1.0):
        q1 = math.atan2(point[1], point[0]) - math.atan2(0.1, sign * radius)
        far = math.hypot(radius, point[2])
        bend = (far**2 - 0.7**2 - ELBOW**2) / (2 * 0.7 * ELBOW)
        for turn in (math.acos(bend), -math.acos(bend)):
            # In the plane of the arm, angles are counted downwards from the horizontal.
            q2 = math.atan2(-point[2], sign * radius) - math.atan2(
                ELBOW * math.sin(turn), 0.7 + ELBOW * math.cos(turn)
            )
            q = np.array([q1, q2, turn - math.atan2(0.7, 0.1), 0.0, 0.0, 0.0])
            points, axes = tools(PUMA, q[None])
            np.testing.assert_allclose(points[0], point, atol=1e-9)
            best = min(best, math.degrees(math.acos(np.clip(axes[0] @ approach, -1.0, 1.0))))
    return best


def test_a_stop_in_the_middle_disconnects() -> None:
    """joint1 free of one gap: both sides of a ring are reached, by two motions."""
    ring = cylinder(0.6, (-180, 180), (0.2, 0.3))
    arm = PUMA.with_limits(
        {
            "joint1": np.radians([-100.0, 100.0]),
            "joint3": np.radians([-180.0, math.degrees(-math.atan2(0.7, 0.1))]),
        }
    )
    verdict = check(arm, ring.cells(16, 1), Task(0.02, 40))
    assert not verdict.feasible
    apart = [cause for cause in verdict.causes if cause.kind is CauseKind.DISCONNECTED]
    reached = {int(k) for component in verdict.components for k in component}
    assert {cause.cell for cause in apart} == reached - set(np.flatnonzero(verdict.covered))
    assert not any(cause.proved for cause in apart)
    for cause in apart:
        size = int(number(r"covers (\d+) of 16", cause.detail))
        holding = [c for c in verdict.components if cause.cell in c.tolist()]
        assert size == max(len(component) for component in holding)


def test_causes_are_made_once_and_in_order() -> None:
    plate = plane((0.4, 2.4), (-0.2, 0.2), "outside", (0.0, 0.0, 0.2))
    verdict = check(PUMA, plate.cells(6, 2), Task(0.01, 40))
    assert verdict.evidence is Evidence.PROOF
    assert verdict.causes is verdict.causes
    cells = [cause.cell for cause in verdict.causes]
    assert cells == np.flatnonzero(~verdict.covered).tolist()
    for cause in verdict.causes:
        assert cause.detail
        assert "nan" not in cause.detail
        assert "inf" not in cause.detail


def test_a_search_that_was_stopped_reports_no_false_cause() -> None:
    """Every cell of this plate can be covered: no cause may name a constraint."""
    plate = plane((0.3, 0.6), (-0.2, 0.2), position=(0, 0, 0.2), side="outside")
    task = Task(0.02, 45)
    assert check(PUMA, plate.cells(3, 4), task).feasible
    stopped = check(PUMA, plate.cells(3, 4), task, Search(time_limit=1e-9))
    assert stopped.evidence is Evidence.BUDGET
    assert len(stopped.causes) == int((~stopped.covered).sum()) > 0
    assert kinds(stopped) == {CauseKind.DISCONNECTED}
    assert not any(cause.proved for cause in stopped.causes)
    assert all("has a configuration there" in cause.detail for cause in stopped.causes)
