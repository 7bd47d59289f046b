"""Convex bodies around objects and tools hold them, and are no larger than they must be."""

import math

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from scipy.optimize import nnls
from scipy.spatial.transform import Rotation

from feasibility.collisions import (
    Obstacle,
    ToolShape,
    polytopes_of,
    soup_of,
    tool_polytopes,
    tool_solids,
)
from feasibility.collisions.outer_bodies import is_convex
from robots import load_robot
from robots.shapes import Triangles

POSE = {"position": (0.3, -1.2, 0.7), "rpy_deg": (25.0, -40.0, 110.0)}


def distance(point, polytope):
    """m from a point to a polytope: the nearest convex combination, by least squares."""
    heavy = 1e4  # the shares add up to one
    system = np.vstack([polytope.vertices.T, np.full(len(polytope.vertices), heavy)])
    shares, _ = nnls(system, np.append(point, heavy), maxiter=1000)
    shares /= shares.sum()
    return np.linalg.norm(shares @ polytope.vertices - point) - polytope.radius


def on(mesh, obstacle, count=60):
    """Points all over a shape, in the root frame."""
    points, _ = trimesh.sample.sample_surface(mesh, count, seed=3)
    points = np.vstack([points, mesh.vertices[:20]])
    return points @ obstacle.placement[:3, :3].T + obstacle.placement[:3, 3]


SHAPES = [
    (Obstacle.box("a", (0.2, 0.3, 0.4), **POSE), trimesh.creation.box((0.2, 0.3, 0.4)), 0.0),
    (Obstacle.cylinder("a", 0.2, 0.5, **POSE), trimesh.creation.cylinder(0.2, 0.5, 97), 0.01),
    (Obstacle.capsule("a", 0.2, 0.5, **POSE), trimesh.creation.capsule(0.5, 0.2), 0.0),
    (Obstacle.sphere("a", 0.2, POSE["position"]), trimesh.creation.icosphere(3, 0.2), 0.0),
]


@pytest.mark.parametrize(("obstacle", "mesh", "loose"), SHAPES, ids=lambda value: repr(value)[:20])
def test_outer_bodies_hold_their_shape_closely(obstacle, mesh, loose):
    (body,) = polytopes_of(obstacle, 2.0)
    assert (body.owner, body.joint) == ("a", 0)
    assert soup_of(obstacle) is None
    points = on(mesh, obstacle)
    assert max(distance(point, body) for point in points) <= 1e-6
    # In each direction the body ends where the shape does, but for what is stated.
    turned = mesh.vertices @ obstacle.placement[:3, :3].T + obstacle.placement[:3, 3]
    for direction in Rotation.random(40, rng=np.random.default_rng(1)).as_matrix()[:, 0]:
        extra = (body.vertices @ direction).max() + body.radius - (turned @ direction).max()
        assert -1e-9 <= extra <= loose * 0.2 + 0.003  # 3 mm: the balls of trimesh are inner ones


@pytest.mark.parametrize("height", [-5.0, -0.4, 0.0, 0.3, 5.0])
def test_a_half_space_is_as_far_as_its_box_from_all_that_the_arm_reaches(height):
    floor = Obstacle.halfspace("floor", (4.0, -7.0, height), (30.0, -10.0, 20.0))
    reach = 1.3
    (box,) = polytopes_of(floor, reach)
    up = floor.placement[:3, 2]
    rng = np.random.default_rng(2)
    points = rng.normal(size=(60, 3))
    points *= reach * rng.uniform(0.2, 1.0, (60, 1)) / np.linalg.norm(points, axis=1)[:, None]
    for point in points:
        above = max(0.0, up @ (point - floor.placement[:3, 3]))
        assert distance(point, box) == pytest.approx(above, abs=1e-6)


def part_of(mesh):
    return Obstacle("part", Triangles(mesh.vertices, mesh.faces, False), np.eye(4))


def test_convex_meshes_are_one_body_and_others_are_triangles():
    for convex in (trimesh.creation.box((1, 2, 3)), trimesh.creation.icosphere(1, 0.3)):
        obstacle = part_of(convex)
        assert soup_of(obstacle) is None
        (body,) = polytopes_of(obstacle, 1.0)
        assert len(body.vertices) == len(convex.vertices)
    bent = trimesh.creation.box((1, 2, 3)).subdivide()
    bent.vertices[8] *= 0.9
    cube = trimesh.creation.box((1, 1, 1))
    apart = trimesh.util.concatenate([cube, cube.copy().apply_translation((3, 0, 0))])
    hollow = cube.copy()
    hollow.invert()
    hollow = trimesh.util.concatenate([trimesh.creation.box((3, 3, 3)), hollow])
    for other in (bent, apart, hollow, trimesh.creation.torus(0.5, 0.1, 8, 6)):
        obstacle = part_of(other)
        soup = soup_of(obstacle)
        assert polytopes_of(obstacle, 1.0) is None
        assert soup.closed
        assert soup.deviation == 0.0
        assert np.sort(soup.triangles.reshape(-1)) == pytest.approx(
            np.sort(other.triangles.reshape(-1))
        )
    sheet = trimesh.Trimesh(bent.vertices, bent.faces[1:])
    assert not soup_of(part_of(sheet)).closed


def test_a_mesh_of_many_vertices_stays_triangles():
    ball = part_of(trimesh.creation.icosphere(3, 0.3))
    assert not is_convex(ball.geometry)
    assert soup_of(ball).closed


def test_tool_shapes_move_with_the_last_joint():
    robot = load_robot("ur5")
    shape = ToolShape.capsule(0.02, 0.1, position=(0.0, 0.01, -0.05), rpy_deg=(90, 0, 0))
    (solid,), (body,) = tool_solids((shape,), robot), tool_polytopes((shape,), robot)
    assert solid.owner == body.owner == "tool"
    assert solid.joint == body.joint == robot.model.njoints - 1
    data = robot.model.createData()
    q = np.array([0.3, -1.0, 0.8, 0.1, 0.5, -0.2])
    pin.framesForwardKinematics(robot.model, data, q)
    flange = data.oMf[robot.tool_frame_id].homogeneous
    joint = data.oMi[solid.joint].homogeneous
    assert np.allclose(joint @ solid.placement, flange @ shape.placement)
    ends = np.array([[0.0, 0.06, -0.05, 1.0], [0.0, -0.04, -0.05, 1.0]]) @ flange.T
    found = body.vertices @ joint[:3, :3].T + joint[:3, 3]
    assert np.allclose(found, ends[:, :3]) or np.allclose(found, ends[::-1, :3])
    assert body.radius == 0.02
    assert math.isclose(np.linalg.norm(found[0] - found[1]), 0.1)
