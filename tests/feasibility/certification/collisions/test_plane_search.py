"""Planes between many boxes and a body at once, against what is known of each distance."""

from __future__ import annotations

import numpy as np
import pytest
from capsule_arms import at, planar_arm
from mesh_patches import of_patch
from scipy.optimize import nnls

from feasibility.certification.collisions.descent import Descent, rough_bounds
from feasibility.certification.collisions.pieces import coal_distance
from feasibility.certification.collisions.plane_search import nearest_of
from feasibility.certification.collisions.relative_motion import ArmMotion
from feasibility.certification.collisions.shape_pieces import piece_of, sheet_piece
from feasibility.certification.collisions.trees import TriangleTree
from robots.urdf import Box, Capsule, Cylinder, Sphere
from surfaces import sphere

BODIES = (Box((0.1, 0.06, 0.3)), Sphere(0.05), Capsule(0.03, 0.2), Cylinder(0.04, 0.1))


def dome(count):
    """A quarter of a sphere of radius 1 in 2 count^2 triangles."""
    made = of_patch(sphere(1.0, np.degrees((0.3, 1.5)), (0, 180), "outside"), count, count)
    return made.vertices[made.faces]


def test_the_point_of_a_tetrahedron_nearest_to_the_origin():
    """Against non-negative least squares; flat and thin ones, and the origin inside."""
    rng = np.random.default_rng(0)
    corners = rng.normal(size=(600, 4, 3)) + rng.normal(size=(600, 1, 3))
    corners[::7, 3] = corners[::7, 2]
    corners[::11, 2] = corners[::11, 1]
    corners[::13, 3] = corners[::13, :3].mean(axis=1)
    points, spanned = nearest_of(corners)
    assert (points == 0.0).all(axis=1).any()
    for four, point, three in zip(corners, points, spanned, strict=True):
        weights = nnls(np.vstack([four.T, np.full(4, 1e4)]), np.array([0.0, 0.0, 0.0, 1e4]))[0]
        expected = weights @ four / weights.sum()
        np.testing.assert_allclose(point, expected, atol=1e-6)
        if point.any():  # it is spanned by what is said to span it
            weights = np.linalg.lstsq(np.vstack([three.T, np.ones(3)]), np.append(point, 1.0))[0]
            np.testing.assert_allclose(weights @ three, point, atol=1e-9)


@pytest.mark.parametrize("count", [1, 3, 8, 20])
def test_every_triangle_is_in_its_boxes(count):
    triangles = dome(count)
    tree = TriangleTree(triangles)
    assert set(tree.last) == set(range(len(triangles)))
    of = np.arange(len(tree.last))
    for level in tree.levels[::-1]:
        apart = triangles[tree.last] - level.centres[of][:, None]
        along = np.abs(np.einsum("kci,kai->kca", apart, level.axes[of]))
        if level.triangles is None:
            assert (along <= level.halves[of][:, None] + 1e-12).all()
        else:
            assert (level.triangles[of] == triangles[tree.last]).all()
        assert (np.linalg.norm(apart, axis=2) <= level.balls[of][:, None] + 1e-12).all()
        of = of // 8


@pytest.mark.parametrize("body", BODIES, ids=lambda body: type(body).__name__)
def test_bounds_are_never_above_the_distance_and_seldom_far_below(body):
    """A body that turns and slides inside a dome: coal at samples of each stretch."""
    rng = np.random.default_rng(3)
    robot = planar_arm([0.3, 0.4, 0.1], ["revolute", "revolute", "prismatic"])
    sheet, piece = sheet_piece(dome(20), False), piece_of(body, at(0.05))
    walk = np.cumsum(rng.normal(size=(100, 3)) * [0.08, 0.08, 0.02], axis=0)
    motion = ArmMotion(robot, walk + np.array([0.6, 0.3, 0.2]))
    s = motion.stretches(0, 3, piece.centre, piece.ball)
    shares = np.linspace(0.0, 1.0, 7)
    true = np.empty(len(s.row))
    for row in s.row:
        poses = [motion.pose(0, 3, row, share) for share in shares[:-1]]
        poses += [motion.pose(0, 3, row + 1, 0.0)] if row + 1 < len(walk) else []
        true[row] = min(
            coal_distance(sheet, piece, one.rotations[0], one.points[0])[0] for one in poses
        )
    assert (rough_bounds(sheet.tree, piece, s) <= true + 1e-6).all()
    assert true.min() < 0.03 < 0.1 < true.max()  # or nothing is asked
    for aim in (0.03, 0.05, 0.1):
        descent = Descent(sheet.tree, piece, aim, aim)
        left = set(descent.parted(s).at)
        assert aim <= descent.bound
        near = set(np.flatnonzero(true < aim))
        assert near <= left  # nothing is called clear that is not
        lost = s.delta + s.deviation  # what chords may be off
        assert not {k for k in left - near if true[k] - 2.0 * lost[k] > 1.01 * aim}
