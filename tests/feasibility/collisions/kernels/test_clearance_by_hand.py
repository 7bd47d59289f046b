"""Planar arms and balls with known distances; the push; insides of solids; the cache."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from random_arms import planar_arm
from random_bodies import all_pairs, hulls, of_polytopes, serial_arm

from feasibility.collisions import (
    Pair,
    Soup,
    clearance_gradient,
    collision_buffer,
    configuration_bounds,
    nearest,
    segment_clear,
)
from feasibility.collisions.kernels.link_frames import chord_deviation, place_bodies, spread
from feasibility.collisions.kernels.tables import GROUPS, row, views
from robots.shapes import Polytope

LENGTH, RADIUS = 0.3, 0.03  # m, of each link, a capsule along x


def stick(owner: str, joint: int) -> Polytope:
    """A link of the planar arm."""
    return Polytope(owner, joint, np.array([[0.0, 0.0, 0.0], [LENGTH, 0.0, 0.0]]), RADIUS)


def test_an_arm_folds_onto_itself_where_it_should() -> None:
    """Links 1 and 3 of three, q3 = pi / 2: in the plane, the ends of one against the other."""
    robot = planar_arm(3)
    arm = [stick(f"l{k}", k) for k in (1, 3)]
    buffer = collision_buffer(of_polytopes(arm, (Pair("l3", "l1", 0.004),)), robot)
    apart = 0
    for q2 in np.linspace(1.2, 2.3, 12):
        first = np.array([[0.0, 0.0], [LENGTH, 0.0]])
        start = LENGTH * np.array([1.0 + np.cos(q2), np.sin(q2)])
        third = np.array([start, start + LENGTH * np.array([-np.sin(q2), np.cos(q2)])])
        if third[1, 1] <= 0.0:
            continue  # they may cross
        ends = [_from_segment(p, first) for p in third] + [_from_segment(p, third) for p in first]
        bound = configuration_bounds(buffer, np.array([0.3, q2, np.pi / 2]))[0]
        assert bound == pytest.approx(min(ends) - 2 * RADIUS, abs=1e-6)
        apart += 1
    assert apart > 5


def _from_segment(point: np.ndarray, ends: np.ndarray) -> float:
    along = ends[1] - ends[0]
    share = np.clip((point - ends[0]) @ along / (along @ along), 0.0, 1.0)
    return float(np.linalg.norm(point - ends[0] - share * along))


@pytest.mark.parametrize("kind", ["hull", "triangles"])
def test_a_wall_is_met_at_the_angle_known(kind: str) -> None:
    """The tip's ball, at (L cos q, L sin q), and a wall x >= w: cos q = (w - r - c) / L."""
    robot, wall, clearance = planar_arm(1), 0.25, 0.005
    touching = np.arccos((wall - RADIUS - clearance) / LENGTH)
    corners = np.array([[x, y, z] for x in (wall, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
    bodies = [stick("l1", 1)]
    pairs = (Pair("l1", "wall", clearance),)
    if kind == "hull":
        everything = of_polytopes([*bodies, Polytope("wall", 0, corners, 0.0)], pairs)
    else:
        face = corners[:4]
        soup = Soup("wall", np.array([face[:3], face[1:]]), 0.0, False)
        everything = of_polytopes(bodies, pairs, soup)
    buffer = collision_buffer(everything, robot)
    start = np.array([touching + 1e-3])
    assert segment_clear(buffer, start, np.array([touching + 1e-5])) > 0.0
    assert not segment_clear(buffer, start, np.array([touching - 1e-5])) > 0.0
    assert not segment_clear(buffer, start, -start) > 0.0


def test_no_point_moves_further_nor_leaves_its_chord_further_than_bounded() -> None:
    """M and delta of every group, seen from every joint before it, against 20 samples."""
    rng = np.random.default_rng(2)
    worst = {"M": 0.0, "delta": 0.0}
    for kinds in ("RRRR", "RPRR", "PRPR"):
        robot = serial_arm(rng, kinds)
        bodies = of_polytopes(hulls(rng, 4), all_pairs(5, 0.0))
        buffer = collision_buffer(bodies, robot)
        tables = views(buffer)
        for size in (1e-3, 0.03, 0.5):
            for _ in range(3):
                q0 = rng.uniform(-2.0, 2.0, 4)
                q1 = q0 + rng.uniform(-1.0, 1.0, 4) * size
                tables.configurations[:2] = q0, q1
                place_bodies(buffer, np.int64(0))
                place_bodies(buffer, np.int64(1))
                for body in (body for body in bodies.polytopes if body.joint):
                    group = row(buffer, GROUPS, np.int64(body.joint))
                    spread(buffer, group, np.int64(0), np.int64(1))
                    for inner in range(body.joint):
                        most = tables.reach[body.joint, inner]
                        delta = chord_deviation(
                            buffer, group, np.int64(inner), np.int64(0), np.int64(1)
                        )
                        far, off = _moved(robot, body, inner, q0, q1)
                        worst["M"] = max(worst["M"], far / most)
                        worst["delta"] = max(worst["delta"], off / max(delta, 1e-15))
                        assert far <= most + 1e-12
                        assert off <= delta + 1e-12
    assert worst["M"] > 0.8
    assert worst["delta"] > 0.5


def _moved(robot, body, inner, q0, q1):  # type: ignore[no-untyped-def]
    """How far vertices move, seen from a joint, and how far they leave their chords."""
    import pinocchio as pin

    data = robot.model.createData()
    places = []
    for s in np.linspace(0.0, 1.0, 21):
        pin.forwardKinematics(robot.model, data, q0 + s * (q1 - q0))
        pose = data.oMi[inner].inverse() * data.oMi[body.joint]
        places.append(body.vertices @ pose.rotation.T + pose.translation)
    track = np.array(places)
    s = np.linspace(0.0, 1.0, 21)[:, None, None]
    chord = (1.0 - s) * track[0] + s * track[-1]
    length = np.linalg.norm(np.diff(track, axis=0), axis=2).sum(axis=0)
    return length.max(), np.linalg.norm(track - chord, axis=2).max()


def test_the_push_is_the_gradient_of_the_nearest_distance() -> None:
    rng = np.random.default_rng(5)
    checked = 0
    while checked < 10:
        robot = serial_arm(rng, "RPRR")
        bodies = of_polytopes(hulls(rng, 4), (Pair("b4", "b0", 0.0),))
        buffer = collision_buffer(bodies, robot)
        for q in rng.uniform(-1.0, 1.0, (20, 4)):
            here = configuration_bounds(buffer, q)[0]
            if not 0.005 < here < 0.045:
                continue
            step = np.zeros(4)
            assert 0.0 < clearance_gradient(buffer, q, step, 0.01) < 1.0
            assert np.linalg.norm(step) <= 0.01 + 1e-12
            rates = [
                (configuration_bounds(buffer, q + e)[0] - configuration_bounds(buffer, q - e)[0])
                / 2e-5
                for e in 1e-5 * np.eye(4)
            ]
            cosine = rates @ step / np.linalg.norm(rates) / np.linalg.norm(step)
            assert cosine > 0.8  # the push takes a direction good to a tenth of the distance
            checked += 1


def test_nothing_near_pushes_nothing() -> None:
    robot = planar_arm(1)
    wall = Polytope("wall", 0, np.array([[2.0, 0.0, 0.0]]), 0.1)
    buffer = collision_buffer(
        of_polytopes([stick("l1", 1), wall], (Pair("l1", "wall", 0.0),)), robot
    )
    step = np.ones(1)
    assert clearance_gradient(buffer, np.array([0.5]), step, 0.1) == 0.0
    assert step == 1.0


def test_what_is_inside_a_closed_body_collides() -> None:
    """Nothing touches its triangles; of an open body that is all there is to say."""
    import trimesh

    ball = np.array(trimesh.creation.icosphere(2, radius=1.0).triangles)
    robot = planar_arm(1)
    for closed in (True, False):
        soup = Soup("ball", ball, 0.0, closed)
        buffer = collision_buffer(
            of_polytopes([stick("l1", 1)], (Pair("l1", "ball", 0.0),), soup), robot
        )
        for angle in np.linspace(-2.0, 2.0, 9):
            q = np.array([angle])
            assert (segment_clear(buffer, q, q) > 0.0) is not closed
            assert bool(configuration_bounds(buffer, q)[0] < -0.5) is closed
        moved = Soup("ball", ball + np.array([3.0, 0.0, 0.0]), 0.0, closed)
        buffer = collision_buffer(
            of_polytopes([stick("l1", 1)], (Pair("l1", "ball", 0.0),), moved), robot
        )
        assert segment_clear(buffer, q, q) > 0.0


def test_the_nearest_points_are_where_they_are() -> None:
    robot = planar_arm(1)
    ball = Polytope("ball", 0, np.array([[0.0, 1.0, 0.0]]), 0.2)
    buffer = collision_buffer(
        of_polytopes([stick("l1", 1), ball], (Pair("l1", "ball", 0.0),)), robot
    )
    found = nearest(buffer, np.array([np.pi / 2]))
    assert found is not None
    assert found.pair == 0
    assert found.distance == pytest.approx(1.0 - LENGTH - RADIUS - 0.2, abs=1e-9)
    points = sorted([found.point_first[1], found.point_second[1]])
    assert points == pytest.approx([LENGTH + RADIUS, 0.8], abs=1e-6)


def test_another_process_compiles_nothing() -> None:
    """The kernels come from the cache, and the address is of that process."""
    program = """
import numpy as np
from numba.core import event
from test_clear_segments import wall_and_stick
from random_arms import planar_arm
from feasibility.collisions import collision_buffer, segment_clear
class Compiled(event.Listener):
    def on_start(self, about):
        raise SystemExit(f"compiles {about.data}")
    def on_end(self, about):
        pass
event.register("numba:compile", Compiled())
buffer = collision_buffer(wall_and_stick()[0], planar_arm(1))
q = np.array([-1.0])
raise SystemExit(not segment_clear(buffer, q, q) > 0.0)
"""
    q = np.array([-1.0])
    buffer = collision_buffer(of_polytopes([stick("l1", 1)], ()), planar_arm(1))
    assert segment_clear(buffer, q, q) > 0.0  # compiles what was not compiled yet
    done = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, sys.path))},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
