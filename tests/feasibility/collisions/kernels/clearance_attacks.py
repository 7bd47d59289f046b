"""Random joint segments of arms among boxes and a curved sheet: what is called clear is sampled.

coal measures the same convex bodies and triangles at least every 0.1 degrees.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from random_bodies import CoalScene, all_pairs, hulls, of_polytopes, serial_arm

from feasibility.collisions import (
    Bodies,
    Collision,
    Obstacle,
    Pair,
    Soup,
    collision_buffer,
    gather,
    segment_clear,
)
from robots import Robot, load_robot
from surfaces import sphere

ARMS = ("ur5", "panda", "RRRRR", "RPRRR", "PRPRR")
SIZES = (1e-3, 0.01, 0.05, 0.2, 0.5)  # rad or m, of the step of any joint
FINE = np.deg2rad(0.1)
SLACK = 1e-9  # m


class Outcome(NamedTuple):
    """How many segments there were of each sort."""

    clear: int
    refused: int
    wrong: int
    """Called clear, and nearer than the clearance at a sample."""


def attacked(name: str, seed: int, starts: int, steps: int = 4) -> Outcome:
    """Short walks from random places, each segment from the end of the last clear one."""
    rng = np.random.default_rng(seed)
    robot, bodies = _arm_among_bodies(name, rng)
    extra = {soup.owner: soup.deviation for soup in bodies.soups}
    needs = np.array([pair.clearance + extra.get(pair.second, 0.0) for pair in bodies.pairs])
    buffer, scene = collision_buffer(bodies, robot), CoalScene(robot, bodies)
    low, high = np.maximum(robot.lower, -3.0), np.minimum(robot.upper, 3.0)
    clear = refused = wrong = 0
    for _ in range(starts):
        q, size = rng.uniform(low, high), rng.choice(SIZES)
        for _ in range(steps):
            end = q + rng.uniform(-1.0, 1.0, robot.n) * size
            if not segment_clear(buffer, q, end) > 0.0:
                refused += 1
                continue
            clear += 1
            count = int(np.abs(end - q).max() / FINE) + 2
            rows = q + np.linspace(0.0, 1.0, count)[:, None] * (end - q)
            wrong += any((scene.distances(row) - needs).min() < -SLACK for row in rows)
            q = end
    return Outcome(clear, refused, wrong)


def _arm_among_bodies(name: str, rng: np.random.Generator) -> tuple[Robot, Bodies]:
    """A known arm with its own shapes among boxes and a dome, or a made-up one among walls."""
    if not set(name) <= {"R", "P"}:
        boxes = tuple(
            Obstacle.box(
                f"box{k}",
                tuple(rng.uniform(0.01, 0.4, 3)),
                tuple(rng.uniform(-0.8, 0.8, 3)),
                tuple(rng.uniform(-180.0, 180.0, 3)),
            )
            for k in range(4)
        )
        robot, dome = load_robot(name), sphere(0.3, (0, 70), (0, 300), position=(0.6, 0.0, 0.1))
        bodies = gather(robot, dome, Collision(clearance=0.005, scene=boxes), 0.02)
        assert bodies is not None
        return robot, bodies
    robot, owners = serial_arm(rng, name), len(name) + 1
    walls = rng.normal(size=(8, 1, 3)) * 0.5 + rng.normal(size=(8, 3, 3)) * 0.2
    pairs = (*all_pairs(owners, 0.01), *(Pair(f"b{k}", "wall", 0.0) for k in range(1, owners)))
    return robot, of_polytopes(
        hulls(rng, len(name)), pairs, Soup("wall", walls, 0.002, closed=False)
    )
