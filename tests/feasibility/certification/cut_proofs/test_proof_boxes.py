"""The verifier's bounds: no box around a known place is lost, and no remainder is too small."""

import numpy as np
import pytest
from known_points import confirmed, known, lost
from random_arms import random_arm

from feasibility import Task
from feasibility.certification.cut_proofs import linear_models
from feasibility.certification.cut_proofs.linear_models import derivatives, target_parts
from feasibility.certification.cut_proofs.region import JointRegion
from feasibility.certification.lever_bounds import LeverBounds, lever_bounds, longest_levers
from robots import Kinematics
from surfaces import sphere


@pytest.mark.parametrize("seed", range(4))
def test_no_box_around_a_known_place_is_lost(seed):
    rng = np.random.default_rng(seed)
    for boxes in (1, 40, 150, 150, 150, 150, 150, 150):
        assert not lost(known(rng, boxes)).any()


def test_with_smaller_remainders_some_are_lost(monkeypatch):
    """So the test above can fail."""

    def halved(*values):
        found = lever_bounds(*values)
        return LeverBounds(found.largest, 0.3 * found.second)

    monkeypatch.setattr(linear_models, "lever_bounds", halved)
    rng = np.random.default_rng(0)
    assert sum(lost(known(rng)).sum() for _ in range(20)) > 0


@pytest.mark.parametrize("seed", range(2))
def test_no_region_around_a_known_place_is_said_to_be_empty(seed):
    rng = np.random.default_rng(seed)
    for _ in range(10):
        assert not confirmed(rng, known(rng, 1), 600)


@pytest.mark.parametrize("seed", range(25))
def test_remainders_and_levers_hold_all_over_random_boxes(seed):
    rng = np.random.default_rng(seed)
    robot = random_arm(rng)
    low, high = np.maximum(robot.lower, -4.0), np.minimum(robot.upper, 4.0)
    kinematics = Kinematics(robot)
    cap = longest_levers(robot, low, high)
    half = np.minimum(np.exp(rng.uniform(-5, 1)) * rng.random(robot.n), 0.5 * (high - low))
    centre = rng.uniform(low + half, high - half)
    d = rng.uniform(-1, 1, (300, robot.n))
    d = np.where(rng.random(d.shape) < 0.5, np.sign(d), d) * half
    columns, tool = derivatives(kinematics, centre[None], 1.0)
    moved_columns, moved = derivatives(kinematics, centre + d, 1.0)
    off = moved - tool - np.einsum("mj,jk->mk", d, columns[0])
    for first, caps in ((0, cap), (3, np.ones(robot.n))):
        part = slice(first, first + 3)
        levers = np.linalg.norm(columns[..., part], axis=2)
        bounds = lever_bounds(levers, half[None], robot.prismatic, caps)
        assert (np.linalg.norm(off[:, part], axis=1) <= 0.5 * bounds.second + 1e-12).all()
        turned = ~robot.prismatic
        seen = np.linalg.norm(moved_columns[..., part], axis=2)[:, turned]
        assert (seen <= bounds.largest[:, turned] + 1e-12).all()
        assert (seen <= caps[turned] + 1e-9).all()


def test_targets_are_off_by_what_points_are_and_what_normals_move_them():
    """T = f + d n, so r_T = r_f + d r_n; the approach is off as the normal is."""
    dome = sphere(1.0, (10, 60), (0, 90))
    parts, cells = dome.parts(0.05, 0.05), dome.cells(2, 2)
    for standoff in (0.0, 0.3):
        found = target_parts(parts, cells, Task(standoff, 30))
        assert found.radius[:, 0] == pytest.approx(parts.radius @ [1.0, standoff])
        assert (found.radius[:, 1] == parts.radius[:, 1]).all()
    fixed = target_parts(parts, cells, Task(0.3, 30, approach=(0.0, 0.0, -1.0)))
    assert fixed.radius[:, 0] == pytest.approx(parts.radius @ [1.0, 0.3])
    assert not fixed.radius[:, 1].any()


def test_parts_of_regions_hold_what_is_between_two_values_of_a_sum():
    rng = np.random.default_rng(1)
    for _ in range(200):
        weights = rng.normal(size=3) * (np.arange(3) == rng.integers(3))
        least, most = np.sort(rng.normal(size=2))
        least = -np.inf if rng.random() < 0.2 else least
        whole = JointRegion.box(-np.ones(3), np.ones(3))
        part = whole.within(weights, least, most)
        q = rng.uniform(-1.0, 1.0, (200, 3))
        inside = ((q >= part.low) & (q <= part.high)).all(axis=1)
        sums = q @ weights
        assert (inside == ((sums >= least) & (sums <= most))).all()
