"""Balls inside shapes are inside, and signed distances are never less than they are."""

from __future__ import annotations

import coal
import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from tool_scenes import bracket

from feasibility.certification.collisions import piece_of
from feasibility.certification.collisions.inside import winding
from feasibility.collisions import HalfSpace
from feasibility.roadmap.tool_alone import balls_inside, distance_from
from feasibility.roadmap.tool_alone.balls_inside import balls_in, face_planes
from feasibility.roadmap.tool_alone.distances import distance_from_triangles
from robots.shapes import Triangles, checked_triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere

PRIMITIVES = [Box((0.2, 0.3, 0.05)), Sphere(0.1), Capsule(0.04, 0.2), Cylinder(0.08, 0.1)]
ROUNDING = 1e-9


def mesh_of(body: trimesh.Trimesh) -> Triangles:
    return checked_triangles(body.vertices, body.faces)


BLOCK = mesh_of(trimesh.creation.box((0.2, 0.3, 0.1)))
ROUND = mesh_of(trimesh.creation.icosphere(subdivisions=1, radius=0.1))
MESHES = [BLOCK, ROUND, bracket()]


def holds(shape: object, x: np.ndarray) -> np.ndarray:
    """Which points (k, 3) are in a shape, or on it but for rounding."""
    match shape:
        case Box(size):
            return (np.abs(x) <= 0.5 * np.array(size) + ROUNDING).all(axis=1)
        case Sphere(radius):
            return (x**2).sum(axis=1) <= (radius + ROUNDING) ** 2
        case Capsule(radius, length):
            axis = np.linspace(-0.5, 0.5, 401)[:, None] * [0.0, 0.0, length]
            away = np.linalg.norm(x[:, None] - axis, axis=2).min(axis=1)
            return away <= np.hypot(radius, length / 800) + ROUNDING
        case Cylinder(radius, length):
            aside = np.hypot(x[:, 0], x[:, 1]) <= radius + ROUNDING
            return aside & (np.abs(x[:, 2]) <= 0.5 * length + ROUNDING)
        case HalfSpace():
            return x[:, 2] <= ROUNDING
        case Triangles(vertices, faces):
            return np.array([abs(winding(vertices[faces], one)) > 0.5 for one in x])
    raise TypeError(shape)


def around(rng: np.random.Generator, ball: np.ndarray, count: int = 15) -> np.ndarray:
    """Points of a ball (4,), all but on its border."""
    way = rng.normal(size=(count, 3))
    return ball[:3] + (1.0 - 1e-6) * ball[3] * way / np.linalg.norm(way, axis=1)[:, None]


@pytest.mark.parametrize("shape", [*PRIMITIVES, *MESHES], ids=lambda one: type(one).__name__)
def test_balls_are_inside(shape: object) -> None:
    rng = np.random.default_rng(0)
    balls = balls_inside(shape)
    assert (balls[:, 3] >= 0.0).all()
    assert balls[:, 3].max() > 0.02
    for ball in balls[balls[:, 3] > 0.0]:
        assert holds(shape, around(rng, ball)).all()
    points = balls[balls[:, 3] == 0.0, :3]
    if isinstance(shape, Triangles):
        assert {tuple(point) for point in points} <= {tuple(one) for one in shape.vertices}
    else:
        assert holds(shape, points).all()


@pytest.mark.parametrize(
    "shape", [*PRIMITIVES, HalfSpace(), *MESHES], ids=lambda one: type(one).__name__
)
def test_distances_are_no_less_than_they_are(shape: object) -> None:
    """All of a ball as large as the depth is inside; coal finds the body as near as is said."""
    rng = np.random.default_rng(1)
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = Rotation.random(random_state=2).as_matrix(), (0.3, -0.2, 0.1)
    corners = shape.vertices if isinstance(shape, Triangles) else np.array([[0.15], [-0.15]])
    own = rng.uniform(corners.min(axis=0) - 0.02, corners.max(axis=0) + 0.02, (200, 3))
    points = own @ place[:3, :3].T + place[:3, 3]
    found = distance_from(shape, place)(points)
    inside = found < 0.0
    assert inside.sum() > 5
    for point, distance in zip(own[inside], found[inside], strict=True):
        assert holds(shape, around(rng, np.array([*point, -distance]))).all()
    outside = ~inside & ~holds(shape, own)
    assert outside.sum() > 5
    away = np.array([_by_coal(shape, place, point) for point in points[outside]])
    np.testing.assert_array_less(away - 1e-6, found[outside])
    if not isinstance(shape, Triangles) or shape is BLOCK:  # else some triangles are asked only
        np.testing.assert_allclose(found[outside], away, atol=1e-5)


def _by_coal(shape: object, place: np.ndarray, point: np.ndarray) -> float:
    """m, of a point from a body that it is not in."""
    if isinstance(shape, HalfSpace):
        return float((point - place[:3, 3]) @ place[:3, 2])
    radius = 1e-4
    body, pose = piece_of(shape, place).truth, coal.Transform3s(np.eye(3), point)
    seat = coal.Transform3s(body.placement[:3, :3], body.placement[:3, 3])
    result, request = coal.DistanceResult(), coal.DistanceRequest(True, True)
    ball = coal.Sphere(radius)
    return float(coal.distance(ball, pose, body.geometry, seat, request, result) + radius)


def test_convex_solids_alone_have_planes() -> None:
    for mesh in (BLOCK, ROUND):
        planes = face_planes(mesh)
        assert planes is not None
        assert len(planes) == len(mesh.faces)
    assert face_planes(bracket()) is None
    open_box = Triangles(BLOCK.vertices, BLOCK.faces[2:], False)
    assert face_planes(open_box) is None
    assert len(balls_in(open_box)) == 0
    assert (balls_inside(open_box)[:, 3] == 0.0).all()
    # Turned over, it is the same solid.
    over = face_planes(Triangles(BLOCK.vertices, BLOCK.faces[:, ::-1], True))
    np.testing.assert_allclose(np.sort(over, axis=0), np.sort(face_planes(BLOCK), axis=0))
    # Two triangles back to back are closed and hold nothing.
    flat = Triangles(BLOCK.vertices[:3], np.array([[0, 1, 2], [0, 2, 1]]), True)
    assert face_planes(flat) is None
    assert len(balls_in(flat)) == 0


def test_a_dent_is_no_convex_solid() -> None:
    dented = ROUND.vertices.copy()
    dented[7] *= 0.8
    assert face_planes(Triangles(dented, ROUND.faces, True)) is None


def test_a_sheet_has_distances_and_no_inside() -> None:
    triangles = np.array([[[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0], [0, 1, 0]]])
    distance = distance_from_triangles(triangles.astype(float), 0.001)
    points = np.array([[0.5, 0.5, 0.2], [0.5, 0.5, -0.2], [2.0, 0.5, 0.0], [0.3, 0.3, 0.0]])
    np.testing.assert_allclose(distance(points), [0.201, 0.201, 1.001, 0.001], atol=1e-12)
