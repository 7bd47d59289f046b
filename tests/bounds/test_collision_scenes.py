"""Motions among many bodies: the judge of collisions beside python-fcl, and what it certifies."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from capsule_arms import at, bodies_of, box_mesh
from foreign_clearances import ForeignScene
from mesh_patches import grid
from referee import closely
from samples import sampled, spread
from scipy.spatial.transform import Rotation

from coverable import Collision, Obstacle, Task, ToolShape, check, load_robot, plane, replay, verify
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.certification.collisions.nearest import nearest_along
from feasibility.collisions.asked_bodies import gather
from feasibility.collisions.problem_bodies import Pair, Soup
from robots.kinematics import Kinematics
from robots.shapes.bodies import HalfSpace
from robots.shapes.links import link_shapes
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere

UR5 = load_robot("ur5")
PLATE = plane((0.4, 0.6), (-0.1, 0.1), position=(0.0, 0.0, 0.3), side="outside")
CELLS = PLATE.cells(2, 2)
TASK = Task(standoff=0.02, cone_deg=30)
EVERY = np.ones(len(CELLS), dtype=bool)


def random_scene(name, seed, rows, step, waves):
    """An arm with its own shapes, three objects, a floor, a wavy sheet; and a random motion."""
    rng, robot = np.random.default_rng(seed), load_robot(name)
    solids, scene = link_shapes(robot).solids, []
    for k in range(3):
        shapes = (Box(tuple(rng.uniform(0.05, 0.4, 3))), Sphere(0.1), Capsule(0.05, 0.3))
        shape = (*shapes, Cylinder(0.08, 0.3), box_mesh((0.3, 0.2, 0.1)))[rng.integers(5)]
        turn = Rotation.from_rotvec(rng.normal(size=3)).as_matrix()
        scene.append(Obstacle(f"object{k}", shape, at(*rng.uniform(-1, 1, 3), turn)))
    scene.append(Obstacle("floor", HalfSpace(), at(z=-0.6)))
    u, v, faces = grid(waves, waves)
    wavy = np.stack([0.5 * u, 0.5 * v, 0.3 * np.sin(2.0 * u) * np.cos(2.5 * v)], axis=1)
    sheet = Soup("surface", (rng.uniform(-1, 1, 3) + wavy)[faces], 0.0003, False)
    joints = {solid.owner: solid.joint for solid in solids}
    moving = [link for link in joints if joints[link] > 1]
    apart = [(a, b) for a, b in combinations(joints, 2) if abs(joints[a] - joints[b]) > 1]
    pairs = [Pair(a, b, 0.002) for a, b in apart]
    pairs += [Pair(link, thing.name, 0.004) for link in moving for thing in scene]
    pairs += [Pair(link, "surface", 0.001) for link in moving]
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    q = np.cumsum(np.vstack([rng.uniform(low, high), step * rng.normal(size=(rows, robot.n))]), 0)
    return robot, bodies_of(solids, scene, pairs, [sheet]), np.clip(q, low, high)


def judged_as_by_fcl(robot, bodies, q, step_deg):
    """Refused are exactly the pairs that fcl finds too near; the certified bound is below fcl's."""
    found, foreign = collision_replay(robot, bodies, q), ForeignScene(robot, bodies)
    rows = closely(q, np.radians(step_deg))
    least = np.min([foreign.distances(row) for row in rows], axis=0)
    refused = {fault.pair for fault in found.faults}
    for pair, distance in zip(bodies.pairs, least, strict=True):
        if distance < pair.clearance - 1e-5:
            assert (pair.first, pair.second) in refused
        elif (pair.first, pair.second) in refused:  # only what samples may have missed by a hair
            assert distance < pair.clearance + 2e-4, (pair, distance)
    if found.accepted:
        assert found.min_clearance <= least.min() + 1e-5
        off = 2.0 * max(soup.deviation for soup in bodies.soups)
        assert found.min_clearance >= 0.6 * (found.measured_clearance - off)


NUMBERS = (*range(32, 133), *range(32))  # in the first other couples were certified as far apart
SCENES = [(name, [500, k]) for k in NUMBERS for name in ("panda", "ur5", "kinova")]
SCENES += [("ur5", 1), ("puma560", 0)]


@sampled(("name", "seed"), spread(SCENES, 2))
def test_the_foreign_judge_agrees(name, seed):
    """The arm itself is often in collision; alone among the objects, both answers occur."""
    robot, bodies, q = random_scene(name, seed, 2, 0.3, 6 if isinstance(seed, int) else 30)
    judged_as_by_fcl(robot, bodies, q, 3.0)
    alone = [one for one in bodies.pairs if one.second in ("surface", "floor")]
    judged_as_by_fcl(robot, replace(bodies, pairs=tuple(alone)), q, 3.0)


def asked(**settings):
    """The task with what has to stay clear, and the bodies that this means."""
    task = replace(TASK, collision=Collision(**settings))
    return task, gather(UR5, PLATE, task.collision, task.standoff)


@pytest.fixture(scope="module")
def walk():
    """A motion over all cells, clear of itself and of the plate by 5 mm."""
    return check(UR5, CELLS, TASK, collision=Collision(clearance=0.005)).witness


@pytest.fixture(scope="module")
def least(walk):
    foreign = ForeignScene(UR5, asked()[1])
    return np.min([foreign.distances(row) for row in closely(walk.q, np.radians(3.0))], axis=0)


def test_more_clearance_than_there_is_is_refused(walk, least):
    """And no search with less of the tolerance is to follow: it would make no room."""
    pair = asked()[1].pairs[int(np.argmin(least))]
    for more, accepted in ((-2e-3, True), (1e-4, False)):
        wanted = ((pair.first, pair.second, float(least.min()) + more),)
        task, _ = asked(clearance=0.0, clearances=wanted)
        found = replay(UR5, CELLS, task, walk, EVERY)
        assert found.accepted is accepted
        assert found.collides is not accepted
        assert not found.narrowly_refused
    assert f"{pair.first} and {pair.second} are" in found.refusal
    assert not verify(UR5, CELLS, task, walk.q).holds


def test_the_foreign_judge_refuses_what_overlaps_where_no_clearance_is_asked(walk):
    """Else it would bear out a motion through an object; the product's judge refuses it too."""
    ball = Obstacle.sphere("ball", 0.1, tuple(Kinematics(UR5).joints(walk.q).points[3, 3]))
    task, bodies = asked(self_=False, surface=False, clearance=0.0, scene=(ball,))
    assert not ForeignScene(UR5, bodies).is_clear(walk.q[3])
    found = replay(UR5, CELLS, task, walk, EVERY)
    assert found.collides
    assert not found.accepted


CENTRES, FLOOR = np.array([[0.5, 0.2, 0.5], [-0.3, 0.6, 0.4]]), -1.5


def test_distances_pairs_and_lines_are_those_of_the_closed_form():
    scene = [Obstacle.sphere(f"ball {k}", 0.05, tuple(c)) for k, c in enumerate(CENTRES)]
    scene.append(Obstacle.halfspace("floor", (0.0, 0.0, FLOOR)))
    # A ball of 3 cm at the tool point, far in front of the flange, and no other pair.
    links = [name for name in UR5.link_names if name.endswith("_link") and name != "ee_link"]
    allow = tuple((link, one.name) for link in links for one in scene)
    asked = Collision(False, False, scene=scene, tool=(ToolShape.sphere(0.03),), allow=allow)
    bodies = gather(UR5, PLATE, asked, 0.02)
    steps = np.random.default_rng(5).normal(0.0, 0.12, (80, UR5.n))
    rows = np.array([0.3, -1.5, 1.5, -1.5, -1.5, 0.0]) + np.cumsum(steps, axis=0)
    found, tips = nearest_along(UR5, bodies, rows), Kinematics(UR5).tools(rows)[0]
    away = np.linalg.norm(tips[:, None] - CENTRES, axis=2) - 0.08
    away = np.column_stack([away, tips[:, 2] - FLOOR - 0.03])
    np.testing.assert_allclose(found.distances, away.min(axis=1), atol=1e-6)
    names = ["ball 0", "ball 1", "floor"]
    nearest = [found.pairs[k].names[1] for k in found.which]
    assert nearest == [names[k] for k in away.argmin(axis=1)]
    assert len(set(nearest)) > 1, "else nothing changes"
    for number, pair in enumerate(found.pairs):
        here = np.flatnonzero(found.which == number)
        assert set(pair.rows) == set(here) | {k + 1 for k in here if k + 1 < len(rows)}
        clear = away[pair.rows, names.index(pair.names[1])]
        lines, at_rows, clear = pair.points[clear > 0], pair.rows[clear > 0], clear[clear > 0]
        length = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)
        np.testing.assert_allclose(length, clear, 0, 1e-6)
        ends = np.linalg.norm(lines - tips[at_rows, None], axis=2).min(axis=1)
        np.testing.assert_allclose(ends, 0.03, atol=1e-5)
    assert nearest_along(UR5, replace(bodies, pairs=()), np.zeros((3, UR5.n))) is None
