"""Cells over which the tool collides in every pose: claimed, confirmed, refuted by no pose.

And the bounds behind it: balls inside shapes, distances, what an erosion leaves, how far poses go.
"""

from __future__ import annotations

from dataclasses import replace

import coal
import numpy as np
import pinocchio as pin
import pytest
import trimesh
from capsule_arms import at
from hard_scenes import ARMS, CELLS, UR5, Over, a_plate, arm, bracket, planted_over, random_over
from random_arms import planar_arm
from samples import sampled, seeds, spread
from scipy.spatial.transform import Rotation

from feasibility import Answer, CauseKind, Evidence, Task, check
from feasibility.certification import verify_proof
from feasibility.certification.collisions import piece_of
from feasibility.certification.tool_alone import never_clear, planes_around
from feasibility.certification.tool_alone.couples import Body, Couple, couples_of
from feasibility.certification.tool_alone.erosion import eroded
from feasibility.collisions import Bodies, Collision, HalfSpace, Obstacle, Pair, Soup, ToolShape
from feasibility.cut_tree import CutTree, Leaf
from feasibility.roadmap.tool_alone import balls_inside, distance_from
from robots.shapes import Solid, Triangles, checked_triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere
from surfaces import cylinder

NOZZLE = ToolShape.cylinder(0.01, 0.1, position=(0.0, 0.0, -0.05))
CRATE = Obstacle.box("crate", (0.4, 0.4, 0.4), position=(0.5, 0.0, 0.3))
TARGET = np.array([0.5, 0.0, 0.32])


def mesh_of(body):
    return checked_triangles(body.vertices, body.faces)


BLOCK = mesh_of(trimesh.creation.box((0.2, 0.3, 0.1)))
ROUND = mesh_of(trimesh.creation.icosphere(subdivisions=1, radius=0.1))
CONE = mesh_of(trimesh.creation.cone(0.1, 0.2, sections=8))
PRIMITIVES = [Box((0.2, 0.3, 0.05)), Sphere(0.1), Capsule(0.04, 0.2), Cylinder(0.08, 0.1)]
MESHES = [BLOCK, ROUND, bracket()]


# scenes


SCENES = [*range(20, 42, 2), *range(1000, 1500)]


@sampled
@pytest.mark.parametrize("seed", SCENES[: len(seeds(11, 511))])
def test_what_is_claimed_is_confirmed_and_no_pose_is_clear(seed):
    scene, rng = random_over(seed), np.random.default_rng(seed)
    claimed, clear = scene.claimed(), scene.clear_pose(30 if seed < 1000 else 2000, rng)
    assert claimed is None or not clear
    if claimed is not None or clear:
        assert scene.confirmed().confirmed == (claimed is not None)


def test_random_scenes_hold_both_answers():
    claims = [random_over(seed).claimed() is not None for seed in SCENES[:11]]
    assert 2 <= sum(claims) <= 9


@sampled
@pytest.mark.parametrize("name", spread(ARMS, 2))
def test_a_cell_with_a_known_pose_is_never_proved(name):
    scenes = [planted_over(name, seed) for seed in seeds(7, all=150)]
    known = [one for one in scenes if one is not None]
    assert len(known) >= 2
    for one in known:
        assert one.claimed() is None
        assert not one.confirmed().confirmed


OVER_A_CELL = [(name, seed) for name in ARMS[::-1] for seed in range(1000, 1004)]


@sampled
@pytest.mark.parametrize(("name", "seed"), spread(OVER_A_CELL, 1))
def test_an_object_over_a_cell_is_a_proof_that_landings_bear_out(name, seed):
    rng, robot = np.random.default_rng([seed, 2]), arm(name)
    cells, task = a_plate(rng, robot)
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
        assert over.confirmed().confirmed
        assert not over.clear_pose(100, rng)


def over(*scene, cone_deg=30.0, tool=NOZZLE, **asked):
    """The tool alone, without the links, among objects."""
    allow = tuple((name, one.name) for name in UR5.link_names for one in scene)
    collision = Collision(False, False, scene=scene, tool=(tool,), allow=allow, **asked)
    return Over.cell(UR5, CELLS, Task(0.02, cone_deg, 0.001, collision=collision))


@pytest.mark.parametrize("gap", [-0.002, 0.002])
@pytest.mark.parametrize("clearance", [0.0, 0.01])
def test_a_ball_beside_a_wall_is_proved_up_to_the_tolerance(gap, clearance):
    """The ball's middle is the tool point: its distance is the same in every pose."""
    far = 0.5 + 0.05 + clearance + gap
    wall = Obstacle.halfspace("wall", position=(far, 0.0, 0.0), rpy_deg=(0.0, -90.0, 0.0))
    scene = over(wall, cone_deg=180.0, tool=ToolShape.sphere(0.05), clearance=clearance)
    claimed = scene.claimed()
    assert (claimed is not None) == (gap < -0.001)
    assert scene.confirmed().confirmed == (gap < -0.001)
    if claimed is not None:
        assert claimed.pairs == (("tool", "wall"),)
        assert claimed.distance == pytest.approx(clearance + gap)


@pytest.mark.parametrize("lean", [12.0, 44.0, 46.0, 60.0])
@pytest.mark.parametrize("turn", [0.0, 45.0])
def test_a_tool_may_lean_as_far_as_the_cone_and_no_further(lean, turn):
    """A ball 0.2 m behind the tool point is out of a slab once the tool leans by 45 degrees."""
    ball = ToolShape.sphere(0.02, position=(0.0, 0.0, -0.2))
    wide = 2.0 * (0.2 * np.sin(np.radians(45.0)) - 0.02)  # free from there, but for the tolerance
    slab = Obstacle.box("slab", (wide, 9.0, 9.0), tuple(TARGET), (0.0, 0.0, turn))
    scene = over(slab, cone_deg=lean, tool=ball)
    assert scene.confirmed().confirmed == (lean < 45.0)
    assert scene.clear_pose(3000, np.random.default_rng(0)) == (lean > 45.0)


@pytest.mark.parametrize("angle", [0, 90, 180, 270])
@pytest.mark.parametrize("wide", [0.006, 0.002])
def test_a_hole_at_the_border_of_the_cone_is_found(angle, wide):
    """A ball of 4 mm, 0.2 m behind the tool point, fits into a hole of 6 mm, and not of 2 mm."""
    turn = Rotation.from_euler("z", angle, True)
    hole, middle = (0.2 * pin.exp3(0.5 * turn.apply(tilt))[:, 2] for tilt in
                    ([0.93, 0.06, 0.0], [0.5, 0.5, 0.0]))  # fmt: skip
    x = middle - hole * (middle @ hole) / (hole @ hole)
    x /= np.linalg.norm(x)
    frame = np.column_stack([x, np.cross(hole / 0.2, x), hole / 0.2])
    blocks = []
    for k, way in ((0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)):
        size, place = np.array([0.8, 0.8, 0.3]), np.zeros(3)
        size[k], place[k] = 0.4, way * (wide + 0.2)
        stands = at(*(TARGET + hole + frame @ place), frame)
        blocks.append(Obstacle(f"block {len(blocks)}", Box(tuple(size.tolist())), stands))
    ball = ToolShape.sphere(0.004, position=(0.0, 0.0, -0.2))
    scene = over(*blocks, cone_deg=np.degrees(0.5), tool=ball)
    assert scene.confirmed().confirmed == (wide < 0.003)


def test_meshes_are_solids_with_dents_or_sheets():
    ell, block = bracket(), mesh_of(trimesh.creation.box((0.1, 0.1, 0.1)))
    solid = Obstacle("part", ell, at(*(TARGET - [0.025, 0.1, 0.05])))
    hollow = Obstacle("part", ell, at(*(TARGET - [0.125, 0.125, 0.05])))
    convex = Obstacle("part", block, at(*TARGET))
    for obstacle, swallows in ((solid, True), (hollow, False), (convex, True)):
        scene = over(obstacle, cone_deg=5.0)
        assert (scene.claimed() is not None) == swallows
        assert scene.clear_pose(100, np.random.default_rng(1)) != swallows
    assert over(convex, cone_deg=5.0).confirmed().confirmed


def test_a_tool_wider_than_a_pipe_is_cut_by_it():
    """A disc of 120 mm in a pipe of 100 mm: the surface itself is in the way."""
    cells = cylinder(0.05, (-170, 170), (-0.2, 0.2), "inside", (0.5, 0.0, 0.3)).cells(1, 1)
    for radius, blocked in ((0.06, True), (0.02, False)):
        disc = ToolShape.cylinder(radius, 0.03, position=(0.0, 0.0, -0.03))
        asked = Collision(False, tool=(disc,), allow=tuple((n, "surface") for n in UR5.link_names))
        scene = Over.cell(UR5, cells, Task(0.01, 2.0, 0.001, collision=asked))
        assert (scene.claimed() is not None) == blocked
        assert scene.confirmed().confirmed == blocked
        assert scene.clear_pose(100, np.random.default_rng(2)) != blocked


def test_what_is_left_out_proves_nothing():
    scene = over(CRATE)
    assert scene.claimed() is not None
    allow = (*scene.task.collision.allow, ("tool", "crate"))
    asked = replace(scene.task.collision, allow=allow)
    other = replace(scene, task=replace(scene.task, collision=asked))
    assert other.claimed() is None
    assert other.confirmed() == (False, 0)


def test_a_crate_that_swallows_the_target_is_a_proof():
    asked = Collision(self_=False, surface=False, scene=(CRATE,), tool=(NOZZLE,))
    task = Task(0.02, 30, 0.001, collision=asked)
    verdict = check(UR5, CELLS, task)
    assert (verdict.answer, verdict.evidence) == (Answer.INFEASIBLE, Evidence.PROOF)
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


# couples of bodies, and poses


TIP, AXIS = np.array([0.3, 0.1, 0.0]), np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("moved", [0.0, 0.01, 0.03])
@pytest.mark.parametrize("wanted", [-0.005, 0.0, 0.02])
@pytest.mark.parametrize("still", ["ball", "half space"])
def test_what_may_be_moved_collides_up_to_what_is_left_of_the_clearance(moved, wanted, still):
    ball = Body(Sphere(0.1), np.eye(4))
    turn = Rotation.from_euler("x", -90, degrees=True).as_matrix()  # its z is y
    rest = Body(Sphere(0.2), np.eye(4)) if still == "ball" else Body(HalfSpace(), at(rotation=turn))
    couple = Couple(ball, rest, wanted, TIP, AXIS)
    edge = (0.3 if still == "ball" else 0.1) + wanted - moved
    for beyond, said in ((3e-5, False), (-3e-5, True)):
        pose = pin.SE3(np.eye(3), np.array([0.0, edge + beyond, 0.0]))
        assert couple.collides(pose, moved) == said


def test_a_ball_that_is_eroded_away_meets_what_it_is_deep_inside():
    """The tool is eroded, or what is at rest, whichever has something left."""
    small, large = Body(Sphere(0.01), np.eye(4)), Body(Box((1.0, 1.0, 1.0)), np.eye(4))
    for couple in (Couple(small, large, 0.0, TIP, AXIS), Couple(large, small, 0.0, TIP, AXIS)):
        for x, said in ((0.0, True), (0.39, True), (0.42, False)):
            assert couple.collides(pin.SE3(np.eye(3), np.array([x, 0.0, 0.0])), 0.1) == said


def test_no_point_of_the_tool_is_further_from_tip_and_axis_than_is_said():
    place = pin.SE3(pin.exp3(np.array([0.3, -0.5, 0.2])), np.array([0.1, 0.2, -0.1]))
    sides = np.array([0.2, 0.06, 0.4])
    body, rest = Body(Box(tuple(sides)), place.homogeneous), Body(Sphere(0.1), np.eye(4))
    couple = Couple(body, rest, 0.0, TIP, AXIS)
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    away = (0.5 * signs * sides) @ place.rotation.T + place.translation - TIP
    assert couple.reach == pytest.approx(np.linalg.norm(away, axis=1).max())
    assert couple.lateral == pytest.approx(np.hypot(away[:, 0], away[:, 1]).max())


def test_of_a_surface_s_triangles_what_they_may_be_off_is_lost():
    triangle = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]], dtype=float)
    tool, soup = Solid("tool", 2, np.eye(4), Sphere(0.1)), Soup("surface", triangle, 0.004, False)
    bodies = Bodies((tool,), (), (soup,), (), (Pair("tool", "surface", 0.01),))
    (couple,) = couples_of(planar_arm(2), bodies, AXIS)
    assert couple.wanted == pytest.approx(0.006)


@pytest.mark.parametrize("gap", [None, *np.linspace(-np.pi, np.pi, 9)])
def test_one_gap_at_any_roll_is_enough(gap):
    """A ball goes round the tool axis, through a wall that leaves out one direction."""
    # The tool axis of the arm is x of the last joint, and the tip 0.3 m along it.
    tool = Solid("tool", 2, at(0.3, 0.0, 0.3), Sphere(0.05))
    turn = pin.exp3(np.array([0.0, 0.0, gap or 0.0]))
    wall = at(*(turn @ [-0.4 if gap is not None else 0.0, 0.0, 0.0]), turn)
    scene = (Obstacle("wall", Box((1.0, 1.0, 0.2)), wall),)
    bodies = Bodies((tool,), (), (), scene, (Pair("tool", "wall", 0.0),))
    asked = planar_arm(2), bodies, 0.0, 1e-3, np.zeros(3), np.array([0.0, 0.0, 1.0])
    assert never_clear(*asked).confirmed == (gap is None)
    assert not never_clear(*asked, most=1).confirmed


# what an erosion leaves has the whole ball around it inside the shape


@pytest.mark.parametrize(
    ("shape", "left"),
    [
        (Box((0.2, 0.3, 0.05)), Box((0.16, 0.26, 0.01))),
        (Sphere(0.1), Sphere(0.08)),
        (Capsule(0.05, 0.2), Capsule(0.03, 0.2)),
        (Cylinder(0.08, 0.1), Cylinder(0.06, 0.06)),
        *((gone, None) for gone in (Box((0.2, 0.3, 0.03)), Sphere(0.02), Capsule(0.01, 1.0))),
        *((gone, None) for gone in (Cylinder(0.1, 0.04), Cylinder(0.01, 1.0))),
    ],
)
def test_primitives_are_eroded_in_closed_form(shape, left):
    found = eroded(shape, 0.02)
    assert type(found) is type(left)
    if left is not None:
        sizes = [np.hstack([getattr(x, name) for name in x.__slots__]) for x in (found, left)]
        np.testing.assert_allclose(*sizes)


@pytest.mark.parametrize("mesh", [BLOCK, ROUND, CONE], ids=["box", "ball", "cone"])
def test_a_convex_mesh_keeps_what_is_deep_enough_and_no_less(mesh):
    found, body = eroded(mesh, 0.02), trimesh.Trimesh(mesh.vertices, mesh.faces)
    faces = list(zip(body.triangles[:, 0], body.face_normals, strict=True))
    depths = [min((a - x) @ normal for a, normal in faces) for x in found.vertices]
    assert 0.02 - 1e-9 <= min(depths) <= 0.02 + 1e-6
    assert eroded(mesh, 0.2) is None


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
    hair = box.subdivide().subdivide()  # with a hole as thin as a hair down to its middle
    corners = hair.vertices.copy()
    corners[np.linalg.norm(corners - [0.0, 0.0, 0.05], axis=1).argmin(), 2] = 0.0
    wrong += [checked_triangles(corners, hair.faces), bracket()]
    for mesh in wrong:
        assert planes_around(mesh) is None
        assert eroded(mesh, 0.001) is None
    assert (balls_inside(wrong[0])[:, 3] == 0.0).all()


# the search's own: balls inside shapes, and distances that are never less than they are


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
    way = rng.normal(size=(count, 3))
    return ball[:3] + (1.0 - 1e-6) * ball[3] * way / np.linalg.norm(way, axis=1)[:, None]


@pytest.mark.parametrize("shape", [*PRIMITIVES, *MESHES], ids=lambda one: type(one).__name__)
def test_balls_are_inside(shape):
    rng, balls = np.random.default_rng(0), balls_inside(shape)
    assert (balls[:, 3] >= 0.0).all()
    assert balls[:, 3].max() > 0.02
    for ball in balls[balls[:, 3] > 0.0]:
        assert inside(shape, around(rng, ball)).all()
    points = balls[balls[:, 3] == 0.0, :3]
    if isinstance(shape, Triangles):
        assert {tuple(point) for point in points} <= {tuple(one) for one in shape.vertices}
    else:
        assert inside(shape, points).all()


@pytest.mark.parametrize(
    "shape", [*PRIMITIVES, HalfSpace(), *MESHES], ids=lambda one: type(one).__name__
)
def test_distances_are_no_less_than_they_are(shape):
    """All of a ball as large as the depth is inside; coal finds the body as near as is said."""
    rng = np.random.default_rng(1)
    place = at(0.3, -0.2, 0.1, Rotation.random(random_state=2).as_matrix())
    corners = shape.vertices if isinstance(shape, Triangles) else np.array([[0.15], [-0.15]])
    own = rng.uniform(corners.min(axis=0) - 0.02, corners.max(axis=0) + 0.02, (150, 3))
    points = own @ place[:3, :3].T + place[:3, 3]
    found = distance_from(shape, place)(points)
    deep, outside = found < 0.0, (found >= 0.0) & ~inside(shape, own)
    assert min(deep.sum(), outside.sum()) >= 3
    for point, distance in zip(own[deep], found[deep], strict=True):
        assert inside(shape, around(rng, np.array([*point, -distance]))).all()
    away = np.array([_by_coal(shape, place, point) for point in points[outside]])
    np.testing.assert_array_less(away - 1e-6, found[outside])
    if not isinstance(shape, Triangles) or shape is BLOCK:  # else some triangles are asked only
        np.testing.assert_allclose(found[outside], away, atol=1e-5)


def _by_coal(shape, place, point):
    """m, of a point from a body that it is not in."""
    if isinstance(shape, HalfSpace):
        return float((point - place[:3, 3]) @ place[:3, 2])
    body, pose = piece_of(shape, place).truth, coal.Transform3s(np.eye(3), point)
    seat = coal.Transform3s(body.placement[:3, :3], body.placement[:3, 3])
    request = coal.DistanceRequest(True, True)
    ball = coal.Sphere(1e-4)
    return coal.distance(ball, pose, body.geometry, seat, request, coal.DistanceResult()) + 1e-4
