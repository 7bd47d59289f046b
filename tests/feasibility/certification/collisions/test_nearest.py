"""The nearest pair along a motion, against distances that have a closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from feasibility.certification.collisions import NearestAlong, nearest_along
from feasibility.collisions import Bodies, Collision, Obstacle, ToolShape, gather
from robots import Kinematics, load_robot
from surfaces import plane

UR5 = load_robot("ur5")
PLATE = plane((0.4, 0.6), (-0.1, 0.1), side="outside")
RADIUS, SMALL = 0.03, 0.05  # m, of the tool's ball and of those of the scene
CENTRES = np.array([[0.5, 0.2, 0.5], [-0.3, 0.6, 0.4]])
FLOOR = -1.5  # m
Array = NDArray[np.float64]


def around(*scene: Obstacle) -> Bodies:
    """A ball at the tool point, far in front of the flange, and no other pair than with it."""
    links = [name for name in UR5.link_names if name.endswith("_link") and name != "ee_link"]
    asked = Collision(
        self_=False,
        surface=False,
        scene=scene,
        tool=(ToolShape.sphere(RADIUS),),
        allow=tuple((link, one.name) for link in links for one in scene),
    )
    found = gather(UR5, PLATE, asked, 0.02)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def walk() -> Array:
    steps = np.random.default_rng(5).normal(0.0, 0.12, (80, UR5.n))
    return np.array([0.3, -1.5, 1.5, -1.5, -1.5, 0.0]) + np.cumsum(steps, axis=0)


@pytest.fixture(scope="module")
def balls(walk: Array) -> NearestAlong:
    scene = [Obstacle.sphere(f"ball {k}", SMALL, tuple(c)) for k, c in enumerate(CENTRES)]
    floor = Obstacle.halfspace("floor", (0.0, 0.0, FLOOR))
    found = nearest_along(UR5, around(*scene, floor), walk)
    assert found is not None
    return found


def expected(walk: Array) -> Array:
    """(m, 3) m, distances of the tool's ball from both balls and the floor."""
    tips, _ = Kinematics(UR5).tools(walk)
    away = np.linalg.norm(tips[:, None] - CENTRES, axis=2) - RADIUS - SMALL
    return np.column_stack([away, tips[:, 2] - FLOOR - RADIUS])


def test_distances_and_pairs_are_those_of_the_closed_form(walk: Array, balls: NearestAlong) -> None:
    away = expected(walk)
    np.testing.assert_allclose(balls.distances, away.min(axis=1), atol=1e-6)
    names = ["ball 0", "ball 1", "floor"]
    nearest = [balls.pairs[k].names[1] for k in balls.which]
    assert nearest == [names[k] for k in away.argmin(axis=1)]
    assert len(set(nearest)) > 1, "else nothing changes"


def test_lines_run_from_ball_to_ball(walk: Array, balls: NearestAlong) -> None:
    tips, _ = Kinematics(UR5).tools(walk)
    away = expected(walk)
    for number, pair in enumerate(balls.pairs):
        here = np.flatnonzero(balls.which == number)
        behind = here + 1
        assert set(pair.rows) == set(here) | set(behind[behind < len(walk)])
        assert (np.diff(pair.rows) > 0).all()
        column = ["ball 0", "ball 1", "floor"].index(pair.names[1])
        clear = away[pair.rows, column] > 0.0
        lines, rows = pair.points[clear], pair.rows[clear]
        lengths = np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1)
        np.testing.assert_allclose(lengths, away[rows, column], atol=1e-6)
        ends = np.linalg.norm(lines - tips[rows, None], axis=2).min(axis=1)
        np.testing.assert_allclose(ends, RADIUS, atol=1e-5)


def test_the_floor_is_met_right_below() -> None:
    bodies = around(Obstacle.halfspace("floor", (0.0, 0.0, FLOOR)))
    q = np.array([[0.3, -1.5, 1.5, -1.5, -1.5, 0.0]])
    found = nearest_along(UR5, bodies, q)
    assert found is not None
    (tip,), _ = Kinematics(UR5).tools(q)
    (line,) = found.pairs[0].points
    down = [tip - [0.0, 0.0, RADIUS], [tip[0], tip[1], FLOOR]]
    np.testing.assert_allclose(sorted(line.tolist()), sorted(np.array(down).tolist()), atol=1e-9)


def test_exact_meshes_count_and_not_their_hulls() -> None:
    """Each row against all pairs, asked one by one."""
    bodies = gather(UR5, PLATE, Collision(), 0.02)
    assert bodies is not None
    steps = np.random.default_rng(6).normal(0.0, 0.05, (12, UR5.n))
    q = np.array([0.3, -1.2, 1.2, -1.5, -1.5, 0.0]) + np.cumsum(steps, axis=0)
    found = nearest_along(UR5, bodies, q)
    assert found is not None
    for row in range(len(q)):
        alone = nearest_along(UR5, bodies, q[row : row + 1])
        assert alone is not None
        assert found.distances[row] == pytest.approx(alone.distances[0], abs=1e-9)
        assert found.pairs[found.which[row]].names == alone.pairs[0].names


def test_without_pairs_nothing_is_near() -> None:
    bodies = replace(around(Obstacle.halfspace("floor")), pairs=())
    assert nearest_along(UR5, bodies, np.zeros((3, UR5.n))) is None
