"""Random arms among bodies, judged by python-fcl at samples."""

from __future__ import annotations

import numpy as np
from capsule_arms import at, bodies_of, box_mesh
from foreign_clearances import ForeignScene, samples
from mesh_patches import grid
from scipy.spatial.transform import Rotation

from feasibility.certification import collision_replay
from feasibility.collisions import HalfSpace, Obstacle, Pair, Soup
from robots import load_robot
from robots.shapes import link_shapes
from robots.urdf import Box, Capsule, Cylinder, Sphere


def random_scene(name, seed, rows=6, step=0.3, waves=6):
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
    triangles = (rng.uniform(-1, 1, 3) + wavy)[faces]
    joints = {solid.owner: solid.joint for solid in solids}
    links = list(joints)
    pairs = [
        Pair(a, b, 0.002)
        for k, a in enumerate(links)
        for b in links[k + 1 :]
        if abs(joints[a] - joints[b]) > 1
    ]
    moving = [link for link in links if joints[link] > 1]
    pairs += [Pair(link, thing.name, 0.004) for link in moving for thing in scene]
    pairs += [Pair(link, "surface", 0.001) for link in moving]
    sheet = Soup("surface", triangles, 0.0003, False)
    low = np.maximum(robot.lower, -3.0)
    high = np.minimum(robot.upper, 3.0)
    q = np.cumsum(np.vstack([rng.uniform(low, high), step * rng.normal(size=(rows, robot.n))]), 0)
    return robot, bodies_of(solids, scene, pairs, [sheet]), np.clip(q, low, high)


def assert_as_the_foreign_judge(robot, bodies, q, step_deg):
    """Refused are exactly the pairs that fcl finds too near; the certified bound is below fcl's."""
    found, foreign = collision_replay(robot, bodies, q), ForeignScene(robot, bodies)
    distances = np.array([foreign.distances(row) for row in samples(q, np.radians(step_deg))])
    clearances = np.array([one.clearance for one in bodies.pairs])
    least = distances.min(axis=0)
    too_near = {
        (one.first, one.second)
        for one, bad in zip(bodies.pairs, least < clearances - 1e-5, strict=True)
        if bad
    }
    refused = {fault.pair for fault in found.faults}
    assert too_near <= refused
    slack = {(one.first, one.second): d for one, d in zip(bodies.pairs, least, strict=True)}
    room = {(one.first, one.second): one.clearance for one in bodies.pairs}
    for names in refused - too_near:  # only what samples may have missed by a hair
        assert slack[names] < room[names] + 2e-4, (names, slack[names])
    if found.accepted:
        assert found.min_clearance <= least.min() + 1e-5
    return found
