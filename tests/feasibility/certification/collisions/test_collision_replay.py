"""Motions among bodies: walls between rows, nudged rows, bent motions, bad input, invariances."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from capsule_arms import at, bodies_of, box_mesh, capsule_links, pair, planar_arm, wall_at
from foreign_scenes import assert_as_the_foreign_judge, random_scene
from scipy.spatial.transform import Rotation

from coverable_errors import ArgumentError
from feasibility.certification import collision_replay
from feasibility.collisions import Bodies, Obstacle, Pair, Soup
from robots.shapes import Solid, Triangles
from robots.urdf import Box, Sphere

LINKS = (0.5, 0.4)


def small_arm():
    return planar_arm(LINKS), capsule_links(LINKS, 0.03)


@pytest.mark.parametrize("thickness", [0.1, 1e-3, 1e-6])
@pytest.mark.parametrize("kind", ["box", "mesh", "sheet"])
def test_a_thin_wall_between_two_rows(kind, thickness):
    """Both rows are clear of it by 0.3 m: only the middle of the way is not."""
    robot, links = small_arm()
    size = (1.0, thickness, 1.0)
    if kind == "sheet":
        corners = np.array([[x, 0, z] for x in (0.3, 1.3) for z in (-0.5, 0.5)], dtype=float)
        soup = Soup("wall", corners[[[0, 1, 2], [1, 3, 2]]], 0.0, False)
        bodies = bodies_of(links, pairs=[pair("link2", "wall")], soups=[soup])
    else:
        shape = Box(size) if kind == "box" else box_mesh(size)
        bodies = bodies_of(links, [Obstacle("wall", shape, at(0.8))], [pair("link2", "wall")])
    through = np.array([[0.6, 0.0], [-0.6, 0.0]])
    for row in through:
        assert collision_replay(robot, bodies, row[None]).accepted
    found = collision_replay(robot, bodies, through)
    assert not found.accepted
    (fault,) = found.faults
    assert fault.row == 0
    assert 0.2 < fault.share < 0.8
    assert "row 1 to 2" in found.refusal
    assert "link2 and wall" in found.refusal


def test_faults_name_pair_place_and_depth_the_nearest_first():
    robot, links = small_arm()
    scene = [wall_at(0.85), Obstacle("ball", Sphere(0.1), at(0.0, 1.0))]
    pairs = [pair("link2", "wall", 0.005), pair("link2", "ball", 0.01)]
    q = np.array([[0.5, 0.0], [0.1, 0.0], [0.5, 0.0], [np.pi / 2, 0.0]])
    found = collision_replay(robot, bodies_of(links, scene, pairs), q)
    assert [fault.pair for fault in found.faults] == [("link2", "wall"), ("link2", "ball")]
    assert found.nearest_pair == ("link2", "wall")
    assert found.faults[0].distance < 0.0
    assert found.min_clearance == found.faults[0].distance
    assert "link2 and wall overlap by" in found.refusal
    assert found.faults[1].distance == pytest.approx(-0.03, abs=0.03)
    near = collision_replay(robot, bodies_of(links, scene, pairs[:1]), q[:1])
    assert near.accepted
    close = bodies_of(links, scene, [pair("link2", "wall", 0.05)])
    (fault,) = collision_replay(robot, close, q[:1]).faults
    gap = 0.85 - 0.9 * np.cos(0.5) - 0.03
    assert fault.distance == pytest.approx(gap, abs=1e-6)
    assert fault.text == f"link2 and wall are {1e3 * gap:.4g} mm apart, 50 mm are needed"


def test_rows_that_deviate_need_more_room():
    """A joint 0.02 rad off the line moves the arm's end 0.9 * 0.02 m: 18 mm and the radius."""
    robot, links = small_arm()
    bodies = bodies_of(links, [wall_at(1.0)], [pair("link2", "wall", 0.05)])
    q = np.array([[0.3, 0.0], [-0.3, 0.0]])
    straight = collision_replay(robot, bodies, q)
    assert straight.accepted
    assert 0.9 * 0.07 <= straight.min_clearance <= 0.07
    assert collision_replay(robot, bodies, q, np.array([[0.02, 0.0]])).accepted
    assert not collision_replay(robot, bodies, q, np.array([[0.03, 0.0]])).accepted
    assert not collision_replay(robot, bodies, q, np.array([[0.0, 0.06]])).accepted


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_no_numbers_are_refused(value):
    robot, links = small_arm()
    bodies = bodies_of(links, [wall_at(2.0)], [pair("link2", "wall")])
    q = np.zeros((3, 2))
    q[1, 0] = value
    found = collision_replay(robot, bodies, q)
    assert found.refusal == "row 2: a joint value is not finite"
    assert not collision_replay(robot, bodies, q[:1], np.zeros((0, 2))).faults
    deviations = np.full((2, 2), value)
    assert not collision_replay(robot, bodies, np.zeros((3, 2)), deviations).accepted


def test_what_cannot_be_judged_is_an_error_with_words():
    robot, links = small_arm()
    good = bodies_of(links, [wall_at(2.0)], [pair("link2", "wall")])
    with pytest.raises(ArgumentError, match=r"shape \(m, 2\)"):
        collision_replay(robot, good, np.zeros((3, 3)))
    with pytest.raises(ArgumentError, match="deviations"):
        collision_replay(robot, good, np.zeros((3, 2)), np.zeros((3, 2)))
    nobody = replace(good, pairs=(pair("link2", "shelf"),))
    with pytest.raises(ArgumentError, match="what has no body: shelf"):
        collision_replay(robot, nobody, np.zeros((3, 2)))
    bad = Triangles(np.full((3, 3), np.nan), np.array([[0, 1, 2]]), False)
    gone = Triangles(np.zeros((3, 3)), np.array([[0, 1, 7]]), False)
    for shape in (bad, gone, Sphere(np.nan), Triangles(np.zeros((0, 3)), np.zeros((0, 3)), False)):
        bodies = replace(good, solids=(Solid("link2", 2, np.eye(4), shape),))
        with pytest.raises(ArgumentError):
            collision_replay(robot, bodies, np.zeros((3, 2)))


def test_nothing_asked_is_nothing_measured():
    robot, links = small_arm()
    found = collision_replay(robot, bodies_of(links), np.zeros((3, 2)))
    assert (found.accepted, found.min_clearance, found.nearest_pair) == (True, None, None)
    some = bodies_of(links, [wall_at(2.0)], [pair("link2", "wall")])
    assert collision_replay(robot, some, np.zeros((0, 2))).accepted
    collision_replay(robot, some, np.zeros((1, 2)))
    assert isinstance(pickle.loads(pickle.dumps(some)), Bodies)


@pytest.mark.parametrize("faces", [1, 2, 12])
def test_flat_and_thin_meshes_crash_nothing(faces):
    """Coal and qhull end the process for a hull of flat points."""
    robot, _ = small_arm()
    box = box_mesh((0.0 if faces < 12 else 1e-9, 0.2, 0.2))
    mesh = Triangles(box.vertices, box.faces[:faces], False)
    solid = Solid("link2", 2, at(0.2), mesh)
    bodies = bodies_of([solid], [wall_at(1.0)], [pair("link2", "wall")])
    assert collision_replay(robot, bodies, np.array([[0.3, 0.0], [-0.3, 0.0]])).accepted
    other = bodies_of([solid], [Obstacle("o", mesh, at(0.8, 0.5))], [pair("link2", "o")])
    assert collision_replay(robot, other, np.array([[-0.3, 0.0], [-0.6, 0.0]])).accepted


@pytest.mark.parametrize(("name", "seed"), [("ur5", 1), ("puma560", 0)])
def test_the_foreign_judge_agrees(name, seed):
    """`tests/campaigns/test_collision_judge.py` asks of many more."""
    robot, bodies, q = random_scene(name, seed, rows=2)
    assert_as_the_foreign_judge(robot, bodies, q, 3.0)


def test_order_and_place_do_not_matter():
    """Shapes and pairs in another order; scene and surface moved with the arm's first joint."""
    robot, bodies, q = random_scene("ur5", 2, rows=4)
    found = collision_replay(robot, bodies, q)
    assert found.accepted
    turned = replace(
        bodies,
        solids=bodies.solids[::-1],
        scene=bodies.scene[::-1],
        pairs=tuple(Pair(p.second, p.first, p.clearance) for p in bodies.pairs[::-1]),
    )
    other = collision_replay(robot, turned, q)
    assert other.accepted
    assert other.min_clearance == found.min_clearance
    assert set(other.nearest_pair) == set(found.nearest_pair)
    # The UR5's first joint turns about z: links from the second on see the same if all turn.
    angle = 0.7
    turn = at(rotation=Rotation.from_euler("z", angle).as_matrix())
    about = turn[:3, :3]
    moved = replace(
        bodies,
        scene=tuple(replace(one, placement=turn @ one.placement) for one in bodies.scene),
        soups=tuple(replace(s, triangles=s.triangles @ about.T) for s in bodies.soups),
        pairs=tuple(p for p in bodies.pairs if "base_link" not in (p.first, p.second)),
    )
    still = replace(bodies, pairs=moved.pairs)
    shifted = q + angle * np.eye(6)[0]
    one, two = collision_replay(robot, still, q), collision_replay(robot, moved, shifted)
    assert one.accepted
    assert two.accepted
    assert one.min_clearance == pytest.approx(two.min_clearance, abs=1e-6)
    assert one.nearest_pair == two.nearest_pair
