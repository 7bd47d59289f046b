"""Verdicts with roll limited: a UR5 whose tool points down at a square (roboplan's example)."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from dense_replay import tools
from planted_rolls import planted_roll

from coverable import load_case
from feasibility import Task, check
from feasibility.roll import projected, roll_of
from robots import load_robot
from surfaces import plane

WRIST = "wrist_3_joint"


def square(size, cone_deg, roll_deg=None, reference=(1, 0, 0), wrist=None):
    """UR5, a square of `size` m at x = 0.45, z = 0.2, 6 x 6 cells, standoff 5 mm."""
    robot, half = load_robot("ur5"), 0.5 * size
    if wrist is not None:
        robot = robot.with_limits({WRIST: tuple(np.radians(wrist))})
    cells = plane(
        (0.45 - half, 0.45 + half), (-half, half), position=(0, 0, 0.2), side="outside"
    ).cells(6, 6)
    return robot, cells, Task(0.005, cone_deg, roll_deg=roll_deg, roll_reference=reference)


def fk(verdict):
    return int(verdict.statistics["fk"])


def largest_off(verdict):
    """rad, how far roll is off the middle along a witness, at 10 places a segment, by Pinocchio."""
    robot, cells, task = verdict.robot, verdict.cells, verdict.task
    turned = replace(robot, approach_axis=robot.reference_axis, reference_axis=robot.approach_axis)
    q, s = verdict.witness.q, np.arange(10)[:, None] / 10.0
    q = np.vstack([a + s * (b - a) for a, b in pairwise(q)])
    (points, axes), (_, x) = tools(robot, q), tools(turned, q)
    near = cells.surface.closest(points)
    b = -cells.surface.side_sign * near.normal
    reference = task.fixed_reference(cells)
    if reference is None:
        reference = cells.surface.tangent(near.u, near.v)
    t, _ = projected(np.broadcast_to(reference, b.shape), b)
    return float(np.abs(task.roll.off(roll_of(x, axes, t, b))).max())


@pytest.mark.parametrize(
    ("size", "cone_deg", "half_deg"), [(0.15, 0.57, 0.57), (0.4, 20.0, 15.0), (0.4, 0.57, 0.57)]
)
def test_a_case_with_room_costs_no_more_than_twice_the_free_one(size, cone_deg, half_deg):
    """Down to an orientation that is fixed but for half a degree."""
    free = check(*square(size, cone_deg, None))
    limited = check(*square(size, cone_deg, (-half_deg, half_deg)))
    assert free.feasible
    assert limited.feasible
    assert fk(limited) <= 2 * fk(free)
    assert largest_off(limited) <= np.radians(half_deg)


def test_a_range_of_a_full_turn_is_free():
    """To the last evaluation of the arm."""
    free, whole = (check(*square(0.15, 20.0, roll)) for roll in (None, (-170.0, 190.0)))
    assert fk(free) == fk(whole)
    np.testing.assert_array_equal(free.witness.q, whole.witness.q)


@pytest.mark.parametrize("name", ["puma560", "ur5"])
def test_planted_motions_are_found(name):
    """As the campaign `planted_rolls`: limits end 1 to 10 deg beyond a motion that never turns."""
    rng = np.random.default_rng(len(name))
    for _ in range(2):
        assert check(*planted_roll(name, rng)).feasible


@pytest.mark.parametrize("turn", [30.0, -110.0, 180.0])
def test_reference_and_range_turn_together(turn):
    """Roll is measured about the approach direction, here -z."""
    one = check(*square(0.15, 10.0, (-20.0, 5.0)))
    angle = np.radians(-turn)
    reference = (float(np.cos(angle)), float(np.sin(angle)), 0.0)
    other = check(*square(0.15, 10.0, (-20.0 - turn, 5.0 - turn), reference))
    assert one.feasible
    assert other.feasible
    assert fk(one) == fk(other)
    np.testing.assert_allclose(one.witness.q, other.witness.q, atol=1e-6)


def test_a_stop_of_the_wrist_is_felt_where_roll_is_limited():
    """The last joint within 60 to 120 deg: free roll turns round it, 15 deg do, half a degree not.

    The last is a cut proof that knows where the tool's reference axis may point.
    """
    assert check(*square(0.4, 0.57, None, wrist=(60, 120))).feasible
    assert check(*square(0.4, 20.0, (-15, 15), wrist=(60, 120))).feasible
    fixed = check(*square(0.4, 0.57, (-0.57, 0.57), wrist=(60, 120)))
    assert not fixed.feasible
    assert fixed.evidence == "proof"
    assert int(fixed.covered.sum()) == 30


@pytest.mark.parametrize(
    "limits",
    [
        {"roll_deg": (-15, 15), "roll_reference": (0, 0, 1)},
        {"roll_deg": (-3, 3)},
        {"roll_deg": (80, 100), "roll_reference": (0, 0, 1)},
    ],
    ids=["up", "u", "across"],
)
def test_over_a_dome_the_reference_turns(limits):
    """4a, with up to twice the evaluations of free roll; about the u direction too."""
    given = load_case("paper/4a").build()
    verdict = check(given.robot, given.cells, replace(given.task, **limits))
    assert verdict.feasible
    assert fk(verdict) <= 2 * 5952
    assert largest_off(verdict) <= verdict.task.roll.half
