"""The sheet of a surface: no place of it is further from a triangle than is stated.

`tests/campaigns/test_many_sheets.py` tries many more.
"""

import itertools

import numpy as np
import pytest
from random_surfaces import KINDS, random_surface
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation
from sheet_probes import distances, excess, places

from coverable_errors import ArgumentError
from surfaces import cylinder, plane, sheet_of, sphere


@pytest.mark.parametrize("kind", KINDS)
def test_no_place_is_further_than_stated(kind):
    for seed in range(3):
        assert excess(kind, seed) <= 0.0, seed


@pytest.mark.parametrize("kind", KINDS)
def test_no_place_inside_a_thick_sheet_is_further_than_stated(kind):
    for seed in range(2):
        assert excess(kind, seed, thick=True) <= 0.0, seed


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind not in ("piecewise", "mesh")])
def test_twisted_models_hold_everywhere_and_are_flat_and_convex(kind):
    rng = np.random.default_rng([16, *map(ord, kind)])
    for _ in range(20):
        patch = random_surface(kind, rng)
        ends = np.array([patch.u_range, patch.v_range])
        sides = np.sort(rng.uniform(size=(200, 2, 2)) * 10.0 ** -rng.integers(0, 4), axis=2)
        low, high = np.moveaxis(ends[:, :1] + sides * np.diff(ends), 2, 0)
        if kind == "bspline":  # boxes inside one span
            low, high = patch.part_roots
        model = patch.part_models(low, high)[0]
        if model.twisted is None:
            assert kind in ("plane", "bspline")
            continue
        twist, error, _ = model.twisted()
        assert (error <= model.error * (1.0 + 1e-9) + 1e-15).all()
        share = np.linalg.norm(twist, axis=1) / np.linalg.norm(model.slopes, axis=2).max(axis=1)
        assert (share <= 1.0 + 1e-9).all()
        across = np.linalg.norm(np.cross(twist[:, None], model.slopes), axis=2).min(axis=1)
        assert (across <= 1e-9 * np.linalg.norm(model.slopes, axis=2).prod(axis=1)).all()
        for x in [*itertools.product((-1.0, 0.0, 1.0), repeat=2), *rng.uniform(-1, 1, (20, 2))]:
            at = (low + high) / 2.0 + np.array(x) * (high - low) / 2.0
            place = patch.local_point(*at.T)
            held = model.centre + np.einsum("c,kcd->kd", x, model.slopes) + x[0] * x[1] * twist
            off = np.linalg.norm(place - held, axis=1)
            assert (off <= error * (1.0 + 1e-9) + 1e-13 * np.abs(place).max()).all()


def test_the_deviation_is_used_and_kept():
    for wanted in (1e-3, 2e-4, 1e-5):
        surface = cylinder(0.5, (-60, 60), (0.0, 0.9))
        sheet = sheet_of(surface, wanted, 100_000)
        far = distances(places(surface, np.random.default_rng(1), 500)[0], sheet.triangles)
        assert wanted / 8.0 < far.max() <= sheet.deviation <= wanted


def test_triangles_stay_near_the_surface():
    surface = sphere(1.0, (10, 90), (10, 180))
    sheet = sheet_of(surface, 1e-3)
    height = np.abs(np.linalg.norm(sheet.triangles.reshape(-1, 3), axis=1) - 1.0)
    assert height.max() <= sheet.deviation  # so clearances are no larger than they must be


def test_a_plane_is_two_triangles():
    surface = plane((0.0, 0.6), (0.0, 0.4), position=(0.3, -0.2, 0.5), rpy_deg=(20, 30, 40))
    sheet = sheet_of(surface)
    assert sheet.triangles.shape == (2, 3, 3)
    assert sheet.deviation < 1e-9
    corners = surface.point([0.0, 0.6, 0.6, 0.0], [0.0, 0.0, 0.4, 0.4])
    away = np.linalg.norm(sheet.triangles.reshape(-1, 1, 3) - corners, axis=2)
    assert away.min(axis=1).max() < 1e-8
    assert away.min(axis=0).max() < 1e-8


def test_a_metre_sphere_takes_a_few_thousand():
    sheet = sheet_of(sphere(1.0, (10, 90), (10, 180)))
    assert len(sheet.triangles) < 6_000
    assert sheet.deviation <= 2e-4


def test_too_many_triangles_are_a_larger_stated_deviation():
    ball = sphere(1.0, (0, 180), (0, 360))
    sheet = sheet_of(ball, 1e-6, most=2_000)
    assert len(sheet.triangles) <= 2_000
    assert 1e-6 < sheet.deviation < 0.01


@pytest.mark.parametrize("kind", ["sphere", "bspline", "piecewise", "mesh"])
def test_a_rigid_motion_moves_the_sheet_along(kind):
    rng = np.random.default_rng([3, *map(ord, kind)])
    surface = random_surface(kind, rng)
    turn, shift = Rotation.from_euler("xyz", [0.3, -1.0, 2.0]).as_matrix(), [0.4, -1.0, 2.0]
    still, moved = (sheet_of(each, 1e-2, 600) for each in (surface, surface.moved(turn, shift)))
    carried = still.triangles @ turn.T + shift
    apart, partner = cKDTree(carried.reshape(-1, 9)).query(moved.triangles.reshape(-1, 9))
    assert apart.max() < 1e-9
    assert len(np.unique(partner)) == len(carried)  # the order may be another
    assert moved.deviation == pytest.approx(still.deviation, abs=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_wherever_a_surface_stands_its_own_triangles_are_the_same(kind):
    surface = random_surface(kind, np.random.default_rng([8, *map(ord, kind)]))
    turn, shift = Rotation.from_euler("xyz", [0.3, -1.0, 2.0]).as_matrix(), [0.4, -1.0, 2.0]
    here, there = (
        sheet_of(each, 1e-2, 600, 1e-3) for each in (surface, surface.moved(turn, shift))
    )
    assert np.array_equal(here.own, there.own)
    assert here.deviation == there.deviation
    carried = here.triangles @ turn.T + shift
    assert np.allclose(carried, there.triangles, atol=1e-12)


def test_surfaces_of_other_shapes_have_triangles_of_their_own():
    shapes = [
        plane((0, 1), (0, 1)), plane((0, 1), (0, 2)), plane((0, 1), (0, 1), side="outside"),
        sphere(1.0, (10, 90), (0, 90)), sphere(1.1, (10, 90), (0, 90)),
    ]  # fmt: skip
    sheets = [sheet_of(shape, 1e-2, 600, 1e-3).triangles for shape in shapes]
    for k, one in enumerate(sheets):
        assert not any(np.array_equal(one, other) for other in sheets[:k])


def test_a_mesh_gives_its_own_triangles():
    surface = random_surface("mesh", np.random.default_rng(5))
    sheet = sheet_of(surface)
    own = surface.mesh.vertices[surface.mesh.faces] @ surface.rotation.T + surface.position
    assert sheet.deviation == 0.0
    assert (sheet.triangles == own).all()


def test_thickness_lies_away_from_the_working_side():
    for side, sign in (("outside", -1.0), ("inside", 1.0)):
        sheet = sheet_of(plane((0, 1), (0, 1), side=side), thickness=0.002)
        heights = sign * sheet.triangles[..., 2]
        assert heights.min() == pytest.approx(0.0, abs=1e-12)
        assert heights.max() == pytest.approx(0.002)
        assert sheet.deviation <= 4.1e-4


@pytest.mark.parametrize(
    ("bad", "named"),
    [({"deviation": 0.0}, "deviation"), ({"thickness": -1.0}, "thickness"),
     ({"thickness": np.nan}, "thickness"), ({"most": 1}, "most")],
)  # fmt: skip
def test_numbers_that_make_no_sheet_are_named(bad, named):
    with pytest.raises(ArgumentError, match=named):
        sheet_of(plane((0, 1), (0, 1)), **bad)
