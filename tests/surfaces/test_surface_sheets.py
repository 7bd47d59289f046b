"""Surfaces as triangles: no place is further from them than is stated."""

import numpy as np
import pytest
from bounds import holds
from part_walks import pieces_of, size_of, spread
from random_surfaces import KINDS, random_surface
from samples import sampled, seeds
from samples import spread as few_of
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from smooth_probes import POSE
from specimens import EXTREME
from triangle_probes import least_distances

from coverable import SurfaceError, plane, poses
from coverable.errors import ArgumentError
from surfaces.sheet import sheet_of

TURN, SHIFT = Rotation.from_euler("xyz", [0.3, -1.0, 2.0]).as_matrix(), [0.4, -1.0, 2.0]


def places(surface, rng, count):
    """Points and outward normals all over a surface, on its borders and corners too."""
    if surface.kind == "mesh":
        face = rng.integers(len(surface.mesh.faces), size=count)
        weights = rng.dirichlet([0.5, 0.5, 0.5], count)
        turned = surface.mesh.face_normals[face] @ surface.rotation.T
        return surface.points_at(face, weights), turned
    found = []
    for piece, sign in pieces_of(surface):
        u, v = spread(piece, count, int(rng.integers(2**31)))
        found.append(np.hstack([piece.point(u, v), sign * piece.normal(u, v)]))
    both = np.concatenate(found)
    return both[:, :3], both[:, 3:]


def distances(surface, wanted, depth, rng, most=600, count=80):
    """How far places in a thick surface are from its sheet, what is stated, and the sheet."""
    sheet = sheet_of(surface, wanted, most, depth)
    points, normals = places(surface, rng, count)
    deep = depth * rng.choice([0.0, 1.0, rng.uniform()], (len(points), 1))
    far = least_distances(sheet.triangles, points - surface.side_sign * deep * normals)
    # Thin triangles lose digits in their distances.
    return far, sheet.deviation + 1e-12 * np.abs(sheet.triangles).max(), sheet


@sampled("seed", seeds(1, all=100))
@sampled(("kind", "thick"), few_of([(k, t) for t in (False, True) for k in KINDS], 12))
def test_no_place_is_further_from_its_sheet_than_stated(kind, thick, seed):
    rng = np.random.default_rng([seed, int(thick), *map(ord, kind)])
    surface = random_surface(kind, rng)
    size = size_of(surface)
    depth = size * 10.0 ** rng.uniform(-3, 0) if thick else 0.0
    wanted = size * 10.0 ** rng.uniform(-4, -1)
    far, stated, _ = distances(surface, wanted, depth, rng, int(rng.integers(2, 600)))
    assert far.max() <= stated, surface


@sampled("name", few_of([*EXTREME], 6))
def test_few_triangles_of_extreme_surfaces_are_as_near_as_stated(name):
    """Where one triangle is far around the axis, or over it; two of them are a convex tile."""
    wanted = 2e-3 * size_of(EXTREME[name])
    for most in (50, 8, 2):
        rng = np.random.default_rng(3)
        far, stated, sheet = distances(EXTREME[name], wanted, 0.0, rng, most, 120)
        assert far.max() <= stated
        tiles, wanted = sheet.own.reshape(-1, 2, 3, 3), max(wanted, sheet.deviation)
        looks = np.cross(tiles[:, :, 1] - tiles[:, :, 0], tiles[:, :, 2] - tiles[:, :, 0])
        assert ((looks[:, 0] * looks[:, 1]).sum(axis=1) >= 0.0).all()


def test_layers_of_a_thick_sheet_leave_no_more_between_them_than_stated():
    """Between two layers of a plane that bends nowhere there is nothing else."""
    surface = plane((0, 1), (0, 1), **POSE)
    rng = np.random.default_rng(1)
    for steps in (1, 2):
        sheet = sheet_of(surface, 0.05 / steps, 2 * (steps + 1), 0.1)
        points, normals = places(surface, rng, 100)
        deep = 0.1 * (np.arange(100) % 41)[:, None] / 40.0
        far = least_distances(sheet.triangles, points - surface.side_sign * deep * normals)
        holds(sheet.deviation, far, used=0.99)


@pytest.mark.parametrize("kind", KINDS)
def test_a_rigid_motion_moves_the_sheet_along(kind):
    surface = random_surface(kind, np.random.default_rng([8, *map(ord, kind)]))
    here, there = (sheet_of(each, 1e-2, 60, 1e-3) for each in (surface, surface.moved(TURN, SHIFT)))
    assert np.array_equal(here.own, there.own)
    assert here.deviation == there.deviation
    carried = here.triangles @ TURN.T + SHIFT
    apart, partner = cKDTree(carried.reshape(-1, 9)).query(there.triangles.reshape(-1, 9))
    assert apart.max() < 1e-9 * max(1.0, np.abs(carried).max())
    assert len(np.unique(partner)) == len(np.unique(carried.reshape(-1, 9), axis=0))


def test_a_mesh_gives_its_own_triangles():
    surface = random_surface("mesh", np.random.default_rng(5))
    sheet = sheet_of(surface)
    own = surface.mesh.vertices[surface.mesh.faces] @ surface.rotation.T + surface.position
    assert sheet.deviation == 0.0
    assert (sheet.triangles == own).all()


@pytest.mark.parametrize(("side", "sign"), [("outside", -1.0), ("inside", 1.0)])
def test_thickness_lies_away_from_the_working_side(side, sign):
    sheet = sheet_of(plane((0, 1), (0, 1), side=side), thickness=0.002)
    heights = sign * sheet.triangles[..., 2]
    assert [heights.min(), heights.max()] == pytest.approx([0.0, 0.002], abs=1e-12)
    assert sheet.deviation <= 4.1e-4


@pytest.mark.parametrize(("bad", "named"), [
    ({"deviation": 0.0}, "deviation"), ({"thickness": -1.0}, "thickness"),
    ({"thickness": np.nan}, "thickness"), ({"most": 1}, "most"),
])  # fmt: skip
def test_numbers_that_make_no_sheet_are_named(bad, named):
    with pytest.raises(ArgumentError, match=named):
        sheet_of(plane((0, 1), (0, 1)), **bad)


def test_between_poses_there_is_no_surface():
    cells = poses([[0.4, 0, 0], [0.5, 0, 0]], [[0, 0, 1], [0, 0, 1]])
    with pytest.raises(SurfaceError, match="leave collisions with it out"):
        sheet_of(cells.surface)
