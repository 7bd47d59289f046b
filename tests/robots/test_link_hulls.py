"""Convex bodies around shapes: nothing stands out of them, and they stand out by little."""

import numpy as np
import pytest
import trimesh
from bounds import holds
from foreign_clearances import distance_from_hull
from referee import unit
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from robots.shapes.hulls import hull_of, outer_hull, pieces_of
from robots.shapes.solids import checked_triangles
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere

MARGIN = 1e-9  # [m] of the least squares below


def volume(vertices):
    return ConvexHull(vertices).volume


def random_bodies():
    rng = np.random.default_rng(0)
    for k in range(30):
        size = 10.0 ** rng.uniform(-3, 2)
        points = rng.normal(size=(int(rng.integers(4, 900)), 3))
        if k % 3 == 1:  # lenses and needles, whose furthest points are beyond an edge of the hull
            points = unit(points) * 10.0 ** rng.uniform(-2.5, 0, 3)
        if k % 3 == 2:
            points = np.clip(points, -1, 1) * rng.uniform(1e-3, 1, 3)
        yield size * points @ Rotation.random(random_state=k).as_matrix() + rng.normal(size=3)


def test_no_point_stands_out_of_its_hull_and_the_hull_is_close():
    thinned = []
    for points in random_bodies():
        hull = outer_hull(points)
        assert len(hull.vertices) <= 64
        wide = np.ptp(points, axis=0).max()
        outer = points[ConvexHull(points).vertices]
        # A ball of 64 vertices evenly spread has caps of 3 % of its radius.
        assert hull.radius <= (1e-11 * wide if len(outer) <= 64 else 0.04 * wide + 2e-4)
        assert {tuple(v) for v in hull.vertices} <= {tuple(p) for p in points}
        some = np.array(
            [v for v in outer if tuple(v) not in {tuple(x) for x in hull.vertices}] or outer
        )
        off = np.array([distance_from_hull(point, hull.vertices) for point in some])
        holds(hull.radius, off, used=0.0, tiny=MARGIN * max(1, np.ptp(points)))
        if len(outer) > 64:
            thinned.append(off.max() / hull.radius)
    assert max(thinned) > 0.9  # a smaller radius would be wrong


def test_what_is_flat_gets_a_hair():
    rng = np.random.default_rng(3)
    turn = Rotation.random(random_state=4).as_matrix()
    disc = np.column_stack([rng.normal(size=(300, 2)), np.zeros(300)]) @ turn
    line = np.outer(np.linspace(0, 1, 50), [1.0, 2.0, 3.0])
    tiny = 1e-9 * rng.normal(size=(40, 3))
    for points in (disc, line, line[[0, -1]], np.ones((1, 3)), np.ones((9, 3)), tiny, 1e4 * disc):
        hull = outer_hull(points)
        off = max(distance_from_hull(point, hull.vertices) for point in points[:60])
        assert off - hull.radius <= MARGIN * max(1, np.ptp(points))
        # Of a line the corners are two hairs (1e-5 m) away at right angles, of a point three.
        normal = np.linalg.svd(points - points.mean(axis=0), full_matrices=True)[2][-1]
        assert np.ptp(hull.vertices @ normal) <= np.ptp(points @ normal) + 3.5e-5


@pytest.mark.parametrize("shape", [Sphere(0.3), Capsule(0.1, 0.4), Box((0.2, 0.4, 0.6))])
def test_balls_capsules_and_boxes_are_exact(shape):
    """In every direction the hull reaches as far as the shape does."""
    vertices, radius, _ = hull_of(shape)
    for d in unit(np.random.default_rng(5).normal(size=(200, 3))):
        match shape:
            case Sphere(r):
                reach = r
            case Capsule(r, length):
                reach = r + abs(d[2]) * length / 2
            case Box(size):
                reach = np.abs(d) @ size / 2
        assert (vertices @ d).max() + radius == pytest.approx(reach, abs=1e-15)


@pytest.mark.parametrize(("radius", "exact"), [(1e-3, True), (0.03, True), (0.4, False)])
def test_a_cylinder_is_inside_its_prism_and_the_prism_hardly_larger(radius, exact):
    hull = hull_of(Cylinder(radius, 0.5))
    angle = np.linspace(0, 2 * np.pi, 721)
    rim = radius * np.column_stack([np.cos(angle), np.sin(angle)])
    planes = ConvexHull(hull.vertices).equations
    for z in (-0.25, 0.25):
        points = np.column_stack([rim, np.full(len(rim), z)])
        assert (points @ planes[:, :3].T + planes[:, 3]).max() <= 1e-12
    assert set(np.abs(hull.vertices[:, 2])) == {0.25}
    excess = np.linalg.norm(hull.vertices[:, :2], axis=1).max() - radius
    assert excess <= (0.303e-3 if exact else 0.005 * radius)


def bodies(*parts):
    whole = trimesh.util.concatenate(parts)
    return checked_triangles(np.asarray(whole.vertices), np.asarray(whole.faces))


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.0])
def test_every_point_of_a_solid_is_in_one_of_its_pieces(angle):
    turn = trimesh.transformations.rotation_matrix(angle, (1, 2, 3))
    foot, long = trimesh.creation.box((0.1, 0.1, 0.3)), trimesh.creation.box((0.5, 0.1, 0.1))
    foot.apply_translation((0.0, 0.0, 0.1))  # an L, 0.5 m long and 0.3 m to the side
    long.apply_translation((0.2, 0.0, 0.0))
    mesh = bodies(foot.apply_transform(turn), long.apply_transform(turn))
    pieces = pieces_of(mesh)
    assert mesh.closed
    assert 1 < len(pieces) <= 8
    shares = np.random.default_rng(6).random((1000, 3)) - 0.5
    inside = [shares * [0.1, 0.1, 0.3] + [0, 0, 0.1], shares * [0.5, 0.1, 0.1] + [0.2, 0, 0]]
    points = np.concatenate([*(part @ turn[:3, :3].T for part in inside), mesh.vertices])
    free = np.ones(len(points), dtype=bool)
    for piece in pieces:
        planes = ConvexHull(piece.vertices).equations
        free &= (points @ planes[:, :3].T + planes[:, 3]).max(axis=1) > piece.radius + 1e-12
    assert not free.any(), points[free][:3]
    total = sum(volume(piece.vertices) for piece in pieces)
    assert total < 0.85 * volume(mesh.vertices)
    if angle == 0.0:  # along its axes they are its boxes
        assert total == pytest.approx(0.1 * 0.1 * (0.5 + 0.2), rel=0.1)


def test_what_is_convex_stays_in_one_piece():
    made, flat = trimesh.creation, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]
    sheet = trimesh.Trimesh(flat, [[0, 1, 2], [1, 3, 2]])
    for body in (made.box((0.1, 0.2, 0.9)), made.icosphere(3), made.cone(1, 2), sheet):
        assert len(pieces_of(bodies(body))) == 1
