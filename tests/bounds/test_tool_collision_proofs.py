"""Cells over which the tool collides in every pose: proved, and refuted by no pose."""

from dataclasses import replace

import hard_scenes
import numpy as np
import pinocchio as pin
import pytest
import trimesh
from capsule_arms import at
from hard_scenes import ARMS, CELLS, NOZZLE, UR5, Over, bracket, over
from random_arms import planar_arm
from referee import unit
from samples import sampled, seeds, spread

import coverable
from coverable import CauseKind, Collision, Evidence, Obstacle, Task, ToolShape, check, cylinder
from feasibility.certification.collisions.depths import Balls, depths, planes_around, points_inside
from feasibility.certification.collisions.every_pose import never_clear
from feasibility.certification.cut_proofs.proof_verification import verify_proof
from feasibility.collisions.problem_bodies import Bodies, Pair
from feasibility.cut_tree import CutTree, Leaf
from robots.shapes.bodies import Solid, Triangles
from robots.shapes.solids import checked_triangles
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere

CRATE = Obstacle.box("crate", (0.4, 0.4, 0.4), position=(0.5, 0.0, 0.3))
TARGET = np.array([0.5, 0.0, 0.32])


def mesh_of(body):
    return checked_triangles(body.vertices, body.faces)


BLOCK = mesh_of(trimesh.creation.box((0.2, 0.3, 0.1)))
ROUND = mesh_of(trimesh.creation.icosphere(subdivisions=1, radius=0.1))
PRIMITIVES = [Box((0.2, 0.3, 0.05)), Sphere(0.1), Capsule(0.04, 0.2), Cylinder(0.08, 0.1)]
MESHES = [BLOCK, ROUND, bracket()]


SCENES = [*range(20, 42, 2), *range(1000, 1500)]


@sampled("seed", SCENES[: len(seeds(11, 511))])
def test_no_pose_is_clear_where_it_is_proved(seed):
    scene, rng = hard_scenes.random_over(seed), np.random.default_rng(seed)
    assert not (scene.proved().confirmed and scene.clear_pose(30 if seed < 1000 else 2000, rng))


def test_random_scenes_hold_both_answers():
    assert 2 <= sum([hard_scenes.random_over(seed).proved().confirmed for seed in SCENES[:11]]) <= 9


@sampled("name", spread(ARMS, 2))
def test_a_cell_with_a_known_pose_is_never_proved(name):
    scenes = [hard_scenes.planted_over(name, seed) for seed in seeds(7, all=150)]
    known = [one for one in scenes if one is not None]
    assert len(known) >= 2
    for one in known:
        assert not one.proved().confirmed


OVER_A_CELL = [(name, seed) for name in ARMS[::-1] for seed in range(1000, 1004)]


@sampled(("name", "seed"), spread(OVER_A_CELL, 1))
def test_an_object_over_a_cell_is_a_proof_that_landings_bear_out(name, seed):
    rng, robot = np.random.default_rng([seed, 2]), hard_scenes.arm(name)
    cells, task = hard_scenes.a_plate(rng, robot)
    cell = int(rng.integers(len(cells)))
    place = task.targets(cells).points[cell] + rng.uniform(-0.02, 0.02, 3)
    thing = Obstacle.box("thing", rng.uniform(0.1, 0.2, 3).tolist(), place)
    task = replace(task, collision=Collision(clearance=0.005, scene=(thing,)))
    verdict = check(robot, cells, task)
    assert verdict.evidence is Evidence.PROOF
    assert verify_proof(robot, cells, task, verdict.proof).accepted
    proved = [one for one in verdict.causes if one.proved and one.kind is CauseKind.COLLISION]
    assert cell in [one.cell for one in proved]
    for one in proved:
        over = Over.cell(robot, cells, task, one.cell)
        assert over.proved(100_000).confirmed
        assert not over.clear_pose(100, rng)


@pytest.mark.parametrize("gap", [-0.002, 0.002])
@pytest.mark.parametrize("clearance", [0.0, 0.01])
def test_a_ball_beside_a_wall_is_proved_up_to_the_tolerance(gap, clearance):
    """The ball's middle is the tool point: its distance is the same in every pose."""
    far = 0.5 + 0.05 + clearance + gap
    wall = Obstacle.halfspace("wall", position=(far, 0.0, 0.0), rpy_deg=(0.0, -90.0, 0.0))
    scene = over(wall, cone_deg=180.0, tool=ToolShape.sphere(0.05), clearance=clearance)
    found = scene.proved()
    assert found.confirmed == (gap < -0.001)
    if found.confirmed:
        assert found.pairs == (("tool", "wall"),)
        assert found.distance == pytest.approx(clearance + gap, abs=1e-6)


@pytest.mark.parametrize("lean", [12.0, 44.0, 46.0, 60.0])
@pytest.mark.parametrize("turn", [0.0, 45.0])
def test_a_tool_may_lean_as_far_as_the_cone_and_no_further(lean, turn):
    """A ball 0.2 m behind the tool point is out of a slab once the tool leans by 45 degrees."""
    ball = ToolShape.sphere(0.02, position=(0.0, 0.0, -0.2))
    wide = 2.0 * (0.2 * np.sin(np.radians(45.0)) - 0.02)  # free from there, but for the tolerance
    slab = Obstacle.box("slab", (wide, 9.0, 9.0), tuple(TARGET), (0.0, 0.0, turn))
    scene = over(slab, cone_deg=lean, tool=ball)
    assert scene.proved(100_000).confirmed == (lean < 45.0)
    assert scene.clear_pose(3000, np.random.default_rng(0)) == (lean > 45.0)


def test_meshes_are_solids_with_dents_or_sheets():
    ell, block = bracket(), mesh_of(trimesh.creation.box((0.1, 0.1, 0.1)))
    solid = Obstacle("part", ell, at(*(TARGET - [0.025, 0.1, 0.05])))
    hollow = Obstacle("part", ell, at(*(TARGET - [0.125, 0.125, 0.05])))
    convex = Obstacle("part", block, at(*TARGET))
    for obstacle, swallows in ((solid, True), (hollow, False), (convex, True)):
        scene = over(obstacle, cone_deg=5.0)
        assert scene.proved().confirmed == swallows
        assert scene.clear_pose(100, np.random.default_rng(1)) != swallows


def test_a_tool_wider_than_a_pipe_is_cut_by_it():
    """A disc of 120 mm in a pipe of 100 mm: the surface itself is in the way."""
    cells = cylinder(0.05, (-170, 170), (-0.1, 0.1), "inside", (0.5, 0.0, 0.3)).cells(1, 1)
    for radius, blocked in ((0.06, True), (0.02, False)):
        disc = ToolShape.cylinder(radius, 0.03, position=(0.0, 0.0, -0.03))
        asked = Collision(False, tool=(disc,), allow=tuple((n, "surface") for n in UR5.link_names))
        scene = Over.cell(UR5, cells, Task(0.01, 2.0, 0.001, collision=asked))
        assert scene.proved().confirmed == blocked
        assert scene.clear_pose(100, np.random.default_rng(2)) != blocked


def test_what_is_left_out_proves_nothing():
    scene = over(CRATE)
    assert scene.proved().confirmed
    allow = (*scene.task.collision.allow, ("tool", "crate"))
    asked = replace(scene.task.collision, allow=allow)
    other = replace(scene, task=replace(scene.task, collision=asked))
    assert other.proved()[:2] == (False, 0)


def test_a_crate_that_swallows_the_target_is_a_proof():
    asked = Collision(self_=False, surface=False, scene=(CRATE,), tool=(NOZZLE,))
    task = Task(0.02, 30, 0.001, collision=asked)
    verdict = check(UR5, CELLS, task)
    assert (verdict.answer, verdict.evidence) == (coverable.Answer.INFEASIBLE, Evidence.PROOF)
    assert verdict.proof.kind == "cell"
    assert "the tool collides there in every pose" in verdict.message
    (cause,) = verdict.causes
    assert (cause.kind, cause.proved) == (CauseKind.COLLISION, True)
    assert "crate" in cause.pair
    assert cause.clearance < -0.05
    assert verify_proof(UR5, CELLS, task, verdict.proof).accepted
    # The same leaf is refused where the crate is not there, or far enough.
    for scene in ((), (replace(CRATE, placement=at(0.5, 0.0, 1.5)),)):
        freed = replace(task, collision=replace(asked, scene=scene))
        assert not verify_proof(UR5, CELLS, freed, CutTree(Leaf(0))).accepted


@pytest.mark.parametrize(("radius", "edge"), [(0.05, 0.1), (0.001, 0.2989995)])
@pytest.mark.parametrize("gap", [None, *np.linspace(-3.0, 3.1, 9)])
def test_one_gap_at_any_roll_is_enough(gap, radius, edge):
    """A ball goes round the tool axis, through a wall that leaves out one direction.

    The smaller one is clear over a fifth of a degree, and more boxes wait than fit in a batch.
    """
    # The tool axis of the arm is x of the last joint, and the tip 0.3 m along it.
    tool = Solid("tool", 2, at(0.3, 0.0, 0.3), Sphere(radius))
    turn = pin.exp3(np.array([0.0, 0.0, gap or 0.0]))
    wall = at(*(turn @ [edge - 0.5 if gap is not None else 0.0, 0.0, 0.0]), turn)
    scene = (Solid("wall", 0, wall, Box((1.0, 1.0, 0.5 * radius))),)
    bodies = Bodies((tool,), (), (), scene, (Pair("tool", "wall", 0.0),))
    asked = planar_arm(2), bodies, 0.0, 1e-4 * radius, np.zeros(3), np.array([0.0, 0.0, 1.0])
    assert never_clear(*asked).confirmed == (gap is None)
    assert not never_clear(*asked, most=1).confirmed


def test_open_hollow_dented_and_doubled_meshes_are_told_from_solids():
    """Each by one thing alone: a missing triangle, what is inside, a dent, or the volume."""
    box = trimesh.creation.box((0.2, 0.3, 0.1))
    planes = planes_around(Triangles(box.vertices, box.faces, True))
    # Not even by rounding do they hold what is not in the box.
    assert (box.vertices @ planes[:, :3].T + planes[:, 3]).max(axis=1).min() > 0.0
    # A triangle at the corner that volumes are seen from adds nothing to the volume.
    beside = [k for k, face in enumerate(box.faces) if k and box.faces[0, 0] in face]
    wrong = [Triangles(box.vertices, np.delete(box.faces, k, 0), False) for k in beside]
    inside = trimesh.creation.box((0.1, 0.1, 0.05))
    both = np.vstack([inside.faces, inside.faces[:, ::-1]]) + len(box.vertices)
    corners = np.vstack([box.vertices, inside.vertices])
    wrong.append(Triangles(corners, np.vstack([box.faces, both]), True))
    wrong.append(Triangles(box.vertices, np.vstack([box.faces, box.faces[:, ::-1]]), True))
    top, n = int(box.face_normals[:, 2].argmax()), len(box.vertices)
    at = box.vertices[box.faces[top]]  # of a hole as thin as a hair, half through
    middle = at.mean(axis=0)
    corners = np.vstack([box.vertices, middle + 1e-3 * (at - middle), middle - [0.0, 0.0, 0.05]])
    sides = [(x, y, n + k, n + (k + 1) % 3) for k, (x, y) in enumerate(
        zip(box.faces[top], np.roll(box.faces[top], -1), strict=True))]  # fmt: skip
    hole = [f for x, y, p, q in sides for f in ([x, y, p], [y, q, p], [p, q, n + 3])]
    hair = checked_triangles(corners, np.vstack([np.delete(box.faces, top, 0), hole]))
    assert hair.closed
    wrong += [hair, bracket()]
    for mesh in wrong:
        assert planes_around(mesh) is None
        assert depths(mesh, np.zeros(3)) == -np.inf
    assert (points_inside(wrong[0])[1] == 0.0).all()


def inside(shape, x):
    """Which points (k, 3) are in a shape, or on it but for rounding."""
    if isinstance(shape, Triangles):
        return trimesh.Trimesh(shape.vertices, shape.faces).contains(x)
    match shape:
        case Box(size):
            return (np.abs(x) <= 0.5 * np.array(size) + 1e-9).all(axis=1)
        case Sphere(radius):
            return np.linalg.norm(x, axis=1) <= radius + 1e-9
        case Capsule(radius, length):
            past = np.maximum(np.abs(x[:, 2]) - 0.5 * length, 0.0)
            return np.hypot(np.hypot(x[:, 0], x[:, 1]), past) <= radius + 1e-9
        case Cylinder(radius, length):
            aside = np.hypot(x[:, 0], x[:, 1]) <= radius + 1e-9
            return aside & (np.abs(x[:, 2]) <= 0.5 * length + 1e-9)
    return x[:, 2] <= 1e-9  # a half space


def around(rng, ball, count=15):
    """Points of a ball (4,), all but on its border."""
    return ball[:3] + (1.0 - 1e-6) * ball[3] * unit(rng.normal(size=(count, 3)))


@pytest.mark.parametrize("shape", [*PRIMITIVES, *MESHES], ids=lambda one: type(one).__name__)
def test_balls_around_points_are_inside(shape):
    rng, (points, deep) = np.random.default_rng(0), points_inside(shape)
    assert (deep >= 0.0).all()
    assert deep.max() > 0.02
    balls = rng.permutation(np.column_stack([points, deep])[deep > 0.0])[:20]
    assert inside(shape, np.concatenate([around(rng, ball) for ball in balls])).all()
    if isinstance(shape, Triangles):
        away = trimesh.Trimesh(shape.vertices, shape.faces).nearest.on_surface(points[deep == 0.0])
        assert away[1].max() < 1e-9
    else:
        assert inside(shape, points).all()


def test_a_place_is_as_deep_in_balls_as_in_the_best_of_them():
    balls = Balls(np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]]), np.array([0.05, 0.2]))
    found = depths(balls, np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [-0.3, 0.0, 0.0]]))
    np.testing.assert_allclose(found, [0.1, 0.2, -0.2])
