"""Boxes of joints in which bodies overlap: bounds that hold, and proofs that landings bear out."""

from dataclasses import replace

import numpy as np
import pytest
from capsule_arms import at, bodies_of, box_mesh, pair, planar_arm
from foreign_clearances import ForeignScene
from hard_scenes import behind_a_wall, bracket, within_a_turn
from samples import sampled, seeds, spread
from search_kernels import Motions

from coverable import Answer, CauseKind, Evidence, Obstacle, check
from feasibility.certification.collisions.everywhere import Overlapping
from feasibility.certification.cut_proofs.proof_verification import verify_proof
from feasibility.collisions.asked_bodies import gather
from feasibility.cut_tree import CutTree, Leaf
from robots.kinematics import Kinematics
from robots.shapes.bodies import HalfSpace, Solid
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere

FEW = ("puma560", "puma560 on a rail", "ur5")
X, _, Z = np.eye(3)
ANYWHERE = 1e3  # m, that the tool may be off


def everywhere(robot, bodies, half, q=None, target=None, off=ANYWHERE):
    """Is it confirmed that bodies collide all over a box about q, wherever the tool is there?"""
    q = np.zeros(robot.n) if q is None else np.array(q, float)
    half = np.broadcast_to(half, q.shape)
    target = np.zeros(3) if target is None else np.array(target, float)
    box = (q - half)[None], (q + half)[None], target[None], np.array([off])
    found = Overlapping(robot, bodies).deepest(*box)
    assert (found.ratio[0] < np.inf) == (found.pair[0] >= 0)
    return bool(found.ratio[0] < 1.0)


def slide(axis):
    return planar_arm([0.1], ["prismatic"], [tuple(axis)])


def in_a_wall(solids, depth, clearance=0.0):
    """Link 1 in a half space that ends at x = -depth: it gets out at the other side of that."""
    turn = np.array([[0, 0, -1], [0, 1, 0], [1, 0, 0]], dtype=float)
    wall = Obstacle("wall", HalfSpace(), at(-depth, rotation=turn))
    owner = solids[0].owner
    return bodies_of(solids, [wall], [pair(owner, "wall", clearance)])


def on(joint, shape, *place):
    return Solid(f"link{joint}", joint, at(*place), shape)


@pytest.mark.parametrize("clearance", [0.0, 0.02])
def test_a_slide_gets_a_ball_out_of_a_wall_where_it_does(clearance):
    bodies = in_a_wall([on(1, Sphere(0.1))], 0.2, clearance)
    assert everywhere(slide(X), bodies, 0.299 + clearance)
    assert not everywhere(slide(X), bodies, 0.301 + clearance)
    assert not everywhere(planar_arm([0, 0.1], ["prismatic"] * 2), in_a_wall(
        [on(2, Sphere(0.1))], 0.2), 0.16)  # fmt: skip


@pytest.mark.parametrize(("rest", "place", "way", "depth"), [
    (Sphere(0.1), (0, 0, 0), Z, 0.1), (Box((0.2, 0.3, 0.1)), (0, 0, 0), Z, 0.05),
    (Capsule(0.05, 0.2), (0, 0, 0.12), Z, 0.03), (Capsule(0.05, 0.2), (0, 0, 0), X, 0.05),
    (Cylinder(0.1, 0.1), (0, 0, 0), Z, 0.05), (Cylinder(0.05, 0.4), (0, 0, 0), X, 0.05),
    (HalfSpace(), (0, 0, -0.04), Z, 0.04),
    (box_mesh((0.2, 0.3, 0.1)), (0, 0, 0), Z, 0.05),
])  # fmt: skip
def test_shapes_are_as_deep_as_they_are(rest, place, way, depth):
    """A ball of 2 cm at a place inside a body gets out on the shortest way, and not before."""
    scene = [Obstacle("thing", rest, at(0.3, -0.2, 0.1))]
    ball = on(1, Sphere(0.02), *(np.array([0.3, -0.2, 0.1]) + place))
    bodies = bodies_of([ball], scene, [pair("link1", "thing")])
    assert everywhere(slide(way), bodies, depth + 0.019)
    assert not everywhere(slide(way), bodies, depth + 0.021)
    far = bodies_of([replace(ball, placement=at(0.3, -0.2, 2.0))], scene, bodies.pairs)
    assert not everywhere(slide(Z), far, 1e-3)


@pytest.mark.parametrize(("shape", "ahead"), [
    (Sphere(0.05), 0.05), (Capsule(0.05, 0.2), 0.05), (Cylinder(0.05, 0.2), 0.05),
    (Box((0.1, 0.2, 0.3)), 0.05), (box_mesh((0.1, 0.2, 0.3)), 0.05),
    (bracket(), 0.2),  # it reaches from 0 to 0.2 m along x
])  # fmt: skip
def test_no_body_reaches_further_into_a_wall_than_it_does(shape, ahead):
    """How far ahead a body's deepest point is: most of that counts, and never more."""
    bodies = in_a_wall([on(1, shape)], 0.1)
    assert everywhere(slide(X), bodies, 0.1 + 0.9 * ahead)
    assert not everywhere(slide(X), bodies, 0.1 + ahead + 1e-3)


@pytest.mark.parametrize(("turn", "claimed"), [
    (0.29, True), (0.31, False), (1.0, False), (3.0, False)])  # fmt: skip
def test_a_joint_turns_a_ball_by_its_lever(turn, claimed):
    """A ball at 1 m of the axis, 0.1 m large and 0.2 m deep in a wall along the link."""
    above = np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]], dtype=float)
    wall = Obstacle("wall", HalfSpace(), at(y=-0.2, rotation=above))
    bodies = bodies_of([on(1, Sphere(0.1), 1.0)], [wall], [pair("link1", "wall")])
    assert everywhere(planar_arm([1.0]), bodies, turn) == claimed


def test_of_two_bodies_that_move_only_what_is_between_them_counts():
    """A ball on link 2, 0.5 m from its axis, in a block on link 1, which turns as it likes."""
    solids = [on(1, Box((0.4, 0.4, 0.4)), 1.0), on(2, Sphere(0.1), 0.5)]
    bodies = bodies_of(solids, pairs=[pair("link1", "link2")])
    robot = planar_arm([0.5, 0.5])
    assert everywhere(robot, bodies, (3.0, 0.55))
    assert not everywhere(robot, bodies, (0.0, 0.9))


@pytest.mark.parametrize("behind", [0.0, 0.2])
def test_what_is_near_the_tool_point_is_where_the_target_is(behind):
    """The tool of two links is at T up to `off`, a wall 0.2 m deep there."""
    robot, target = planar_arm([0.5, 0.5]), np.array([0.7, 0.4, 0.0])
    wall = Obstacle("wall", Box((0.4, 9.0, 9.0)), at(target[0] - behind))
    bodies = bodies_of([on(2, Sphere(0.1), 0.5 - behind)], [wall], [pair("link2", "wall")])
    half, room = ((0.3, 0.3), 0.16) if behind else ((2.0, 2.0), 0.3)
    assert everywhere(robot, bodies, half, target=target, off=room - 1e-3)
    assert everywhere(robot, bodies, (1.0, 1.0), target=target, off=0.05) is (behind == 0.0)
    assert behind or not everywhere(robot, bodies, half, target=target, off=room + 1e-3)


def test_a_joint_behind_a_body_moves_the_tool_and_so_the_body():
    """Elbow up and elbow down reach one target, with the elbow 0.2 m from where it was."""
    robot, ball = planar_arm([1.0, 0.1]), [on(1, Sphere(0.05), 1.0)]
    post = Obstacle("post", Sphere(0.05), at(1.0))
    bodies = bodies_of(ball, [post], [pair("link1", "post")])
    asked = {"q": (0.0, np.pi / 2), "target": (1.0, 0.1, 0.0), "off": 1e-4}
    assert not everywhere(robot, bodies, (0.21, 3.2), **asked)
    foreign = ForeignScene(robot, bodies)
    other = 2.0 * np.arctan(0.1)
    assert foreign.distances(np.array([other, -np.pi / 2]))[0] > 0.05
    tip = Kinematics(robot).tools(np.array([[other, -np.pi / 2]]))[0][0]
    np.testing.assert_allclose(tip, [1.0, 0.1, 0.0], atol=1e-12)


@pytest.mark.parametrize("seed", seeds(10, all=100))
def test_all_over_what_is_confirmed_fcl_finds_collisions(seed):
    """Three joints of any kind, a ball or box on each, a body at rest: the largest box claimed."""
    rng, largest = np.random.default_rng(seed), 0.0
    kinds = rng.choice(["revolute", "revolute", "prismatic"], 3).tolist()
    axes = [tuple(np.round(rng.normal(size=3), 3).tolist()) for _ in kinds]
    robot = planar_arm([0.3, 0.3, 0.3], kinds, axes)
    shapes = [Sphere(0.15), Box((0.3, 0.2, 0.25)), Capsule(0.1, 0.2)]
    solids = [on(k, shapes[int(rng.integers(3))], 0.2) for k in (1, 2, 3)]
    q = rng.uniform(-1.5, 1.5, 3)
    place = Kinematics(robot).joints(q[None]).points[0, 3] + rng.uniform(-0.1, 0.1, 3)
    rest = Obstacle("rest", shapes[int(rng.integers(3))], at(*place))
    pairs = [pair("link3", "rest", 0.01), pair("link1", "link3", 0.01)]
    bodies = bodies_of(solids, [rest], pairs)
    share = rng.uniform(0.2, 1.0, 3)
    for half in np.geomspace(1e-2, 3.0, 40):
        largest = half if everywhere(robot, bodies, half * share, q) else largest
    foreign = ForeignScene(robot, bodies)
    away = np.clip(1.3 * rng.uniform(-1, 1, (300, 3)), -1, 1) * share
    for each in q + largest * away:
        assert largest == 0.0 or (foreign.distances(each) < 0.01 + 1e-6).any()


def lands_clear(robot, cells, task, cell, count, rng):
    """Is one of so many configurations over a cell clear, as fcl sees it?"""
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    scene, motions = ForeignScene(robot, bodies), Motions(robot, cells, task)
    for q in rng.uniform(*within_a_turn(robot), (count, robot.n)):
        found = motions.near(cell, q)
        if found is not None and scene.is_clear(found):
            return True
    return False


@sampled("seed", seeds(1, all=10))
@pytest.mark.parametrize("name", spread(FEW, 1))
def test_a_wall_before_a_plate_is_a_proof_that_landings_bear_out(name, seed):
    robot, cells, task = behind_a_wall(name, seed)
    verdict = check(robot, cells, task)
    assert verdict.answer is not Answer.FEASIBLE
    for cause in verdict.causes:
        if cause.proved and cause.kind is CauseKind.COLLISION:
            assert verify_proof(robot, cells, task, CutTree(Leaf(cause.cell))).accepted
            assert not lands_clear(robot, cells, task, cause.cell, 10, np.random.default_rng(seed))
    if (name, seed) == ("puma560", 0):
        assert verdict.evidence is Evidence.PROOF
        assert "wherever the tool is" in verdict.message
        (cause,) = verdict.causes
        assert (cause.proved, cause.kind, bool(cause.pair)) == (True, CauseKind.COLLISION, True)
        without = replace(task, collision=None)
        assert not verify_proof(robot, cells, without, verdict.proof).accepted
