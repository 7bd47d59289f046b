"""A segment that is called clear is clear at every sample; what is clear is found to be so."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from random_bodies import CoalScene, all_pairs, hulls, of_polytopes, serial_arm

from feasibility.collisions import (
    Bodies,
    Pair,
    Soup,
    blamed,
    collision_buffer,
    counts,
    segment_clear,
)
from robots.shapes import Polytope

FINE = np.deg2rad(0.1)  # between samples, of the joint that moves most


def samples(q0: np.ndarray, q1: np.ndarray, most: int) -> np.ndarray:
    """Configurations along a segment, both ends included."""
    count = min(int(np.abs(q1 - q0).max() / FINE) + 2, most)
    return q0 + np.linspace(0.0, 1.0, count)[:, None] * (q1 - q0)


@pytest.mark.parametrize("kinds", ["RRRR", "RPRR", "PRPR"])
def test_no_segment_with_a_collision_is_called_clear(kinds: str) -> None:
    rng = np.random.default_rng(11)
    clear = refused = collides = 0
    for _ in range(3):
        robot = serial_arm(rng, kinds)
        walls = rng.normal(size=(8, 1, 3)) * 0.5 + rng.normal(size=(8, 3, 3)) * 0.2
        clearance = 0.01
        pairs = (*all_pairs(5, clearance), *(Pair(f"b{k}", "wall", 0.0) for k in range(1, 5)))
        bodies = of_polytopes(hulls(rng, 4), pairs, Soup("wall", walls, 0.002, False))
        needs = np.array([pair.clearance for pair in pairs])
        needs[-4:] += 0.002
        buffer, scene = collision_buffer(bodies, robot), CoalScene(robot, bodies)
        for size in (1e-3, 0.02, 0.1, 0.5):
            for _ in range(7):
                q = rng.uniform(-2.0, 2.0, 4)
                for _ in range(3):
                    end = q + rng.uniform(-1.0, 1.0, 4) * size
                    margin = segment_clear(buffer, q, end)
                    least = min((scene.distances(s) - needs).min() for s in samples(q, end, 15))
                    if margin > 0.0:
                        assert least >= -1e-9
                        assert margin <= (scene.distances(end) - needs).min() + 1e-7
                        clear += 1
                        q = end
                    else:
                        assert 0 <= blamed(buffer) < len(pairs)
                        refused += 1
                        collides += least < 0.0
    assert clear > 30
    assert collides > 10
    assert refused - collides < 0.1 * (clear + refused)


def wall_and_stick() -> tuple[Bodies, np.ndarray]:
    """A wall 1 mm thick, and a stick on a turning joint that passes through it at 0.5 rad."""
    turned = np.array([[np.cos(0.5), -np.sin(0.5)], [np.sin(0.5), np.cos(0.5)]])
    flat = np.array([[0.2, -5e-4], [1.0, -5e-4], [1.0, 5e-4], [0.2, 5e-4]]) @ turned.T
    wall = np.array([[x, y, z] for x, y in flat for z in (-0.1, 0.1)])
    stick = np.array([[x, y, z] for x in (0.1, 0.5) for y in (-0.01, 0.01) for z in (-0.01, 0.01)])
    bodies = [Polytope("stick", 1, stick, 0.0), Polytope("wall", 0, wall, 0.0)]
    return of_polytopes(bodies, (Pair("stick", "wall", 0.0),)), wall


@pytest.mark.parametrize("kind", ["hull", "triangles"])
def test_a_thin_wall_is_never_jumped(kind: str) -> None:
    from random_arms import planar_arm

    robot = planar_arm(1)
    bodies, wall = wall_and_stick()
    if kind == "triangles":  # one face of it
        corners = wall[[0, 2, 1, 3]]
        soup = Soup("wall", np.array([corners[:3], corners[1:]]), 0.0, False)
        bodies = of_polytopes([bodies.polytopes[0]], bodies.pairs, soup)
    buffer = collision_buffer(bodies, robot)
    through = [(a, b) for a in np.linspace(-2.0, 0.3, 12) for b in np.linspace(0.7, 2.0, 12)]
    for a, b in through:
        start, end = np.array([a]), np.array([b])
        assert segment_clear(buffer, start, start) > 0.0
        assert segment_clear(buffer, end, end) > 0.0
        assert not segment_clear(buffer, start, end) > 0.0
        assert not segment_clear(buffer, end, start) > 0.0
    for a in np.linspace(-2.0, 0.2, 10):
        assert segment_clear(buffer, np.array([a]), np.array([a + 0.2])) > 0.0


def test_no_number_is_never_clear() -> None:
    from random_arms import planar_arm

    bodies, _ = wall_and_stick()
    buffer = collision_buffer(bodies, planar_arm(1))
    good = np.array([-1.0])
    for bad in (np.nan, np.inf, -np.inf):
        assert not segment_clear(buffer, np.array([bad]), np.array([bad])) > 0.0
        assert not segment_clear(buffer, good, np.array([bad])) > 0.0
        assert not segment_clear(buffer, np.array([bad]), good) > 0.0
        assert segment_clear(buffer, good, good) > 0.0


def test_what_is_known_of_a_segment_serves_the_next() -> None:
    """Small steps far from everything take no distance: one subtraction each."""
    from random_arms import planar_arm

    bodies, _ = wall_and_stick()
    buffer = collision_buffer(bodies, planar_arm(1))
    angles = np.linspace(-2.0, -1.0, 201)
    for a, b in pairwise(angles):
        assert segment_clear(buffer, np.array([a]), np.array([b])) > 0.0
    done = counts(buffer)
    assert done.segments == done.items == 200
    assert done.frames == 201
    assert done.by_budget > 190
    assert done.swept <= 10
