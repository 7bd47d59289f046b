"""The shapes of the library's arms: hulls and pieces hold them, and collide where they do."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest
from foreign_clearances import ForeignScene
from hulls_of_arms import assert_held
from samples import sampled, spread

from feasibility.collisions import Bodies, Pair
from robots import list_robots, load_robot
from robots.shapes import link_pairs, link_shapes
from robots.shapes.sampling import PairSampling, random_configurations

NAMES = [info.name for info in list_robots()]
EXACT = ("ur5", "panda", "kinova", "xarm7", "puma560")


@sampled
@pytest.mark.parametrize("name", spread(NAMES, 2))
def test_an_arm_has_shapes_and_its_hulls_and_pieces_hold_them(name):
    robot = load_robot(name)
    for fineness in ("hulls", "pieces"):
        shapes = link_shapes(robot, fineness)
        assert_held(shapes)
        assert max(len(body.vertices) for body in shapes.polytopes) <= 64
        assert len({body.joint for body in shapes.polytopes}) > robot.n // 2
        assert link_pairs(robot, shapes).checked


@sampled
@pytest.mark.parametrize("name", spread(EXACT[::-1], 1))
def test_bodies_collide_wherever_the_exact_shapes_do(name):
    """By python-fcl, which has the meshes as they are."""
    robot = load_robot(name)
    hulls, pieces = link_shapes(robot), link_shapes(robot, "pieces")
    joint = {body.owner: body.joint for body in hulls.polytopes}
    pairs = [(a, b) for a, b in combinations(joint, 2) if joint[a] != joint[b]]
    q = random_configurations(robot)[:100]
    asked = tuple(Pair(a, b, 0.0) for a, b in pairs)
    foreign = ForeignScene(robot, Bodies(hulls.solids, (), (), (), asked))
    exact = np.array([foreign.distances(row) <= 0.0 for row in q])
    assert exact.any()
    for shapes in (hulls, pieces):
        found = PairSampling(robot, shapes.polytopes).collisions(pairs, q)
        assert not (exact & ~found).any()
