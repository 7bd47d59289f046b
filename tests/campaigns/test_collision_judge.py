"""The judge of collisions against python-fcl: random arms among bodies, and walls of the paper."""

from __future__ import annotations

import numpy as np
import pytest
from foreign_clearances import ForeignScene, samples
from foreign_scenes import assert_as_the_foreign_judge, random_scene

from feasibility import check
from feasibility.cases import load_case
from feasibility.collisions import Collision, gather

SCENES = 25  # of each arm
ARMS = ("ur5", "panda", "kinova", "xarm7", "puma560")


@pytest.mark.parametrize("name", ARMS)
def test_random_scenes_are_judged_alike(name):
    accepted = refused = 0
    for seed in range(SCENES):
        waves = (6, 30)[seed % 2]
        robot, bodies, q = random_scene(name, [500, seed], 4, 0.15, waves)
        found = assert_as_the_foreign_judge(robot, bodies, q, 1.0)
        accepted, refused = accepted + found.accepted, refused + (not found.accepted)
        # The arm itself is often in collision; among the other pairs, both answers are to occur.
        nearer = [one for one in bodies.pairs if one.second in ("surface", "floor")]
        alone = type(bodies)(bodies.solids, (), bodies.soups, bodies.scene, tuple(nearer))
        found = assert_as_the_foreign_judge(robot, alone, q, 1.0)
        accepted, refused = accepted + found.accepted, refused + (not found.accepted)
    print(f"{name}: {accepted} accepted, {refused} refused")
    assert min(accepted, refused) >= SCENES // 5


@pytest.mark.parametrize("name", ["4a", "4c", "4e", "5e"])
def test_motions_within_walls_keep_their_clearance(name):
    case = load_case(f"paper/{name}").build()
    asked = Collision(clearance=0.005)
    verdict = check(case.robot, case.cells, case.task, case.search, collision=asked)
    assert verdict.feasible
    bodies = gather(case.robot, case.cells.surface, verdict.task.collision, case.task.standoff)
    foreign = ForeignScene(case.robot, bodies)
    rows = samples(verdict.witness.q, np.radians(0.25))
    least = np.min([foreign.distances(row) for row in rows], axis=0)
    assert (least >= [one.clearance for one in bodies.pairs]).all()
    certified = verdict.certificate.min_clearance
    print(f"{name}: {1e3 * certified:.2f} mm certified, {1e3 * least.min():.2f} mm at samples")
    assert 0.8 * least.min() <= certified <= least.min() + 1e-6
