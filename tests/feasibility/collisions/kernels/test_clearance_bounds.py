"""The compiled bounds against coal, and against what can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from random_bodies import CoalScene, all_pairs, hulls, of_polytopes, serial_arm

from feasibility.collisions import (
    Soup,
    collision_buffer,
    configuration_bounds,
)
from feasibility.collisions.bodies import Pair


@pytest.mark.parametrize("kinds", ["RRRR", "RPRR", "PPRRR"])
def test_bounds_never_exceed_what_coal_measures(kinds: str) -> None:
    """Nor are they less than it by more than rounding, where the bodies are apart."""
    rng = np.random.default_rng(7)
    apart = 0
    for _ in range(4):
        robot = serial_arm(rng, kinds)
        bodies = of_polytopes(hulls(rng, robot.n), all_pairs(robot.n + 1, 0.0))
        buffer, scene = collision_buffer(bodies, robot), CoalScene(robot, bodies)
        for q in rng.uniform(-2.0, 2.0, (40, robot.n)):
            bounds, truth = configuration_bounds(buffer, q), scene.distances(q)
            assert (bounds <= truth + 1e-9).all()
            clear = truth > 1e-6
            assert (bounds[clear] >= truth[clear] - 2e-6).all()
            apart += int(clear.sum())
    assert apart > 500


def test_bounds_to_triangles_agree_with_coal() -> None:
    rng = np.random.default_rng(3)
    for _ in range(4):
        robot = serial_arm(rng, "RRRR")
        corners = rng.normal(size=(60, 1, 3)) * 0.5 + rng.normal(size=(60, 3, 3)) * 0.1
        soup = Soup("surface", corners, 0.001, False)
        pairs = tuple(Pair(f"b{k}", "surface", 0.0) for k in range(1, 5))
        bodies = of_polytopes(hulls(rng, 4), pairs, soup)
        buffer, scene = collision_buffer(bodies, robot), CoalScene(robot, bodies)
        for q in rng.uniform(-2.0, 2.0, (40, robot.n)):
            bounds, truth = configuration_bounds(buffer, q), scene.distances(q)
            clear = truth > 1e-6
            assert (np.abs(bounds - truth)[clear] <= 2e-6).all()
            assert (bounds[~clear] <= 1e-9).all()
