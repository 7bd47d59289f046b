"""Certified area of the published cases and of random arms, tried at very many places."""

import warnings

import numpy as np
import pytest
import test_certified_area as sample
from landings import random_landings
from random_arms import random_arm
from scipy.spatial.transform import Rotation

from feasibility import Task, check
from feasibility.area import certified_area
from robots import Kinematics
from surfaces import cylinder, plane, sphere

PLACES = 10_000


@pytest.mark.parametrize("name", sample.PAPER)
def test_published_cases(name):
    verdict, area = sample.assert_the_area_is_there(name, PLACES)
    sample.assert_links_are_motions(verdict, area, 40)
    least, fk = area.shares.min(), verdict.statistics["fk"]
    print(f"{name}: {area.share:.5f}, least {least:.4f}, {len(area.areas)} tiles")
    print(f"{area.evaluations} evaluations of the arm; the search took {fk}")


def test_the_annulus_of_a_planar_arm():
    assert sample.assert_the_annulus_is_approached((200_000, 800_000, 2_400_000)) > 0.97


def angles_of(turn):
    """Roll, pitch and yaw in degrees; at the gimbal lock any that do."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return turn.as_euler("xyz", degrees=True).tolist()


def drawn(seed):
    """A random arm, and a small patch that one of its configurations is square to."""
    rng = np.random.default_rng([17, seed])
    robot = random_arm(rng, 4, 8)
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    q = low + (high - low) * rng.uniform(0.2, 0.8, robot.n)
    points, axes = Kinematics(robot).tools(q[None])
    task = Task(standoff=0.01, cone_deg=float(rng.choice([3.0, 10.0, 40.0, 180.0])))
    turn = Rotation.align_vectors(-axes, [[0.0, 0.0, 1.0]])[0]
    size = float(rng.uniform(0.02, 0.15))
    kind = rng.integers(3)
    made = {
        "side": "outside",
        "position": points[0] + 0.01 * axes[0],
        "rpy_deg": angles_of(turn),
    }
    if kind == 0:
        surface = plane((-size, size), (-size, size), **made)
    elif kind == 1:
        made["position"] = points[0] + 0.31 * axes[0]
        surface = sphere(0.3, (0.0, 100.0 * size), (0.0, 360.0), **made)
    else:
        across = turn * Rotation.from_euler("y", -90, degrees=True)
        made["rpy_deg"] = angles_of(across)
        made["position"] = points[0] + 0.41 * axes[0]
        surface = cylinder(0.4, (-100.0 * size, 100.0 * size), (-size, size), **made)
    return check(robot, surface.cells(2, 3), task)


@pytest.mark.parametrize("block", range(12))
def test_random_arms(block):
    certified = 0
    for seed in range(10 * block, 10 * block + 10):
        verdict = drawn(seed)
        area = certified_area(verdict, 60_000)
        if not len(area.areas):
            continue
        found = random_landings(verdict, area, 500, np.random.default_rng(seed))
        assert found.failed == 0, (seed, found)
        sample.assert_links_are_motions(verdict, area, min(4, len(area.areas)))
        certified += area.share > 0.9
    assert certified >= 3
