"""Cone, torus and ellipsoid: each predicate comes from geometry or from brute force."""

import math

import numpy as np
import pytest
from smooth_probes import (
    POSE,
    assert_closest_recovers,
    assert_normals_fit,
    assert_pickles_and_moves,
    extrapolated_area,
    least_distances,
    random_parameters,
    same_surface,
)

from surfaces import Cells, SurfaceError, cone, ellipsoid, torus

PATCHES = {
    "funnel": cone(0.2, 1.0, angle_deg=(0, 360), height=(-0.1, 0.4), **POSE),
    "spike": cone(0.5, -0.25, angle_deg=(-70, 100), height=(-0.3, 1.5), side="outside"),
    "disc": cone(0.5, 40.0, angle_deg=(200, 300), height=(-0.002, 0.02), **POSE),
    "doughnut": torus(0.5, 0.2, u_deg=(-180, 180), v_deg=(0, 360), side="outside", **POSE),
    "bend": torus(0.8, 0.1, u_deg=(30, 130), v_deg=(100, 280)),
    "egg": ellipsoid((0.5, 0.6, 0.9), polar_deg=(0, 180), azimuth_deg=(10, 370), **POSE),
    "lens": ellipsoid((1.0, 1.0, 0.2), polar_deg=(5, 85), azimuth_deg=(-100, 60), side="outside"),
    "cigar": ellipsoid((2.0, 0.1, 0.1), polar_deg=(20, 160), azimuth_deg=(30, 150), **POSE),
}


def size_of(surface):
    if surface.kind == "cone":
        return max(surface.radius, *(abs(z) for z in surface.v_range))
    return max(surface.lengths)


def whole_ranges(surface):
    """Ranges that hold all closest points near the patch, past the seams on both sides."""
    around = (-1.0, math.tau + 1.0)
    if surface.kind == "cone":
        apex = -surface.radius / surface.slope
        far = 5 * size_of(surface) / math.hypot(1, surface.slope)
        return around, (apex, apex + far) if surface.slope > 0 else (apex - far, apex)
    return (-1.0, math.pi + 1.0) if surface.kind == "ellipsoid" else around, around


@pytest.fixture(params=PATCHES, ids=str)
def shape(request):
    return PATCHES[request.param]


def least_curvature_radius(surface):
    if surface.kind == "cone":
        return min(surface.radius + surface.slope * z for z in surface.v_range)
    if surface.kind == "torus":
        return min(surface.tube, surface.ring - surface.tube)
    return min(surface.semi_axes) ** 2 / max(surface.semi_axes)


def test_points_satisfy_the_implicit_equation(shape):
    u, v = random_parameters(shape, 2000)
    x, y, z = ((shape.point(u, v) - shape.position) @ shape.rotation).T
    if shape.kind == "cone":
        residual = np.hypot(x, y) - shape.radius - shape.slope * z
        turned = np.arctan2(y, x) - u
    elif shape.kind == "torus":
        residual = np.hypot(np.hypot(x, y) - shape.ring, z) - shape.tube
        turned = np.arctan2(y, x) - u
    else:
        a, b, c = shape.semi_axes
        residual = (x / a) ** 2 + (y / b) ** 2 + (z / c) ** 2 - 1
        turned = np.arctan2(y / b, x / a) - v
    assert np.abs(residual).max() < 1e-13
    assert np.abs(np.sin(turned / 2)).max() < 1e-13


def test_normals_are_unit_outward_and_normal_to_finite_differences(shape):
    u, v = random_parameters(shape, 2000)
    n = assert_normals_fit(shape, u, v)
    away = (shape.point(u, v) - shape.position) @ shape.rotation
    if shape.kind == "cone":
        away[:, 2] = 0
    elif shape.kind == "torus":
        away[:, :2] *= 1 - shape.ring / np.linalg.norm(away[:, :2], axis=1, keepdims=True)
    assert np.einsum("ij,ij->i", away, n @ shape.rotation).min() > 0


def test_closest_recovers_parameters_height_and_normal(shape):
    lever = np.sin if shape.kind == "ellipsoid" else np.ones_like
    assert_closest_recovers(shape, 0.45 * least_curvature_radius(shape), lever=lever)


def test_no_point_of_the_whole_surface_is_nearer_than_the_foot(shape):
    rng = np.random.default_rng(3)
    size = size_of(shape)
    points = shape.position + rng.normal(scale=0.6 * size, size=(30, 3))
    points[0] = shape.position + shape.rotation @ [1e-13, 0, 0.1 * size]
    closest_point = shape.closest(points)
    placed = shape.point(closest_point.u, closest_point.v)
    distance = np.linalg.norm(points - placed, axis=1)
    expected = least_distances(shape, points, *whole_ranges(shape))
    assert (distance <= expected + 1e-12).all()
    plain = np.ones(30, dtype=bool)
    if shape.kind == "cone":  # about the apex, valleys are too narrow for grids
        apex = shape.point(0.0, -shape.radius / shape.slope)
        plain = np.linalg.norm(placed - apex, axis=1) > 0.05 * size
    assert plain.sum() > 20
    assert np.abs(distance - expected)[plain].max() < 1e-12 * size
    ordinary = np.abs(np.abs(closest_point.height) - distance) < 1e-12  # not the apex of a cone
    assert ordinary.sum() > 15
    assert ordinary.all() or shape.kind == "cone"
    rebuilt = placed + closest_point.height[:, None] * closest_point.normal
    assert np.abs(rebuilt - points)[ordinary].max() < 1e-12
    assert not closest_point.inside[~ordinary].any()


def test_inside_marks_exactly_the_closest_points_on_the_patch(shape):
    (u0, u1), (v0, v1) = shape.u_range, shape.v_range
    rng = np.random.default_rng(11)
    u = u0 + (u1 - u0) * rng.uniform(-0.3, 1.3, 3000)
    v = v0 + (v1 - v0) * rng.uniform(-0.1, 1.1, 3000)
    if shape.kind == "ellipsoid":
        u = np.clip(u, 0.01, math.pi - 0.01)
    else:
        radius = shape.radius + shape.slope * v if shape.kind == "cone" else np.ones_like(v)
        u, v = u[radius > 0.01], v[radius > 0.01]
    closest_point = shape.closest(shape.point(u, v) + 0.002 * shape.normal(u, v))
    expected = np.ones(len(u), dtype=bool)
    for value, (low, high), angle in (
        (u, shape.u_range, shape.u_angle),
        (v, shape.v_range, shape.v_angle),
    ):
        turned = low + np.mod(value - low, math.tau) if angle else value
        expected &= (turned >= low) & (turned <= high)
    assert (closest_point.inside == expected).all()
    closed = shape.u_closed or shape.v_closed
    assert closed or 0 < expected.sum() < len(u)


def test_area_matches_fine_triangles_and_adds_up(shape):
    total = shape.area(*shape.u_range, *shape.v_range)
    assert total == pytest.approx(extrapolated_area(shape, shape.u_range, shape.v_range), rel=1e-8)
    cells = shape.cells(7, 5)
    assert cells.areas.sum() == pytest.approx(float(total), rel=1e-12)
    assert (cells.areas > 0).all()


def test_ellipsoid_area_is_thomas_closed_form_for_spheroids():
    for a, c in ((1.0, 0.4), (0.3, 1.7), (1.0, 0.001), (1.0, 1e-5), (1e-4, 1.0)):
        made = ellipsoid((a, a, c), polar_deg=(0, 180), azimuth_deg=(0, 360))
        if c < a:
            e = math.sqrt((a - c) * (a + c)) / a
            expected = 2 * math.pi * (a**2 + c**2 / e * math.log((1 + e) * a / c))
        else:
            e = math.sqrt(1 - (a / c) ** 2)
            expected = 2 * math.pi * a**2 * (1 + c / (a * e) * math.asin(e))
        assert float(made.area(*made.u_range, *made.v_range)) == pytest.approx(expected, rel=1e-10)


def test_a_ball_is_an_ellipsoid_and_a_cone_of_slope_zero_is_a_cylinder():
    from surfaces import cylinder, sphere

    ball = ellipsoid((0.7, 0.7, 0.7), (10, 170), (-50, 60), **POSE)
    assert same_surface(sphere(0.7, (10, 170), (-50, 60), **POSE), ball, 1e-13)
    pipe = cone(0.7, 0, (-50, 60), (0, 2), **POSE)
    assert same_surface(cylinder(0.7, (-50, 60), (0, 2), **POSE), pipe, 1e-13)


@pytest.mark.parametrize("axes", [(0.4, 0.9, 0.6), (0.9, 0.6, 0.4), (0.7, 0.3, 0.3), (1, 1, 0.01)])
def test_ellipsoid_closest_points_near_the_planes_where_normals_meet(axes):
    whole = ellipsoid(axes, polar_deg=(0, 180), azimuth_deg=(0, 360))
    rng = np.random.default_rng(2)
    points = rng.uniform(-1, 1, (40, 3)) * axes
    points[np.arange(40), rng.integers(0, 3, 40)] *= np.tile([0.0, 1e-300, 1e-17, 1e-9], 10)
    points[0], points[1] = 0.0, 1e-12
    closest_point = whole.closest(points)
    distance = np.linalg.norm(points - whole.point(closest_point.u, closest_point.v), axis=1)
    expected = least_distances(whole, points, *whole_ranges(whole))
    assert np.abs(distance - expected).max() < 1e-9
    assert np.abs(np.abs(closest_point.height) - distance).max() < 1e-12
    assert closest_point.inside.all()


def test_a_closest_point_of_two_is_taken_on_the_patch():
    for low, high in ((0, 60), (120, 180)):
        half = ellipsoid((1.0, 0.8, 0.3), polar_deg=(low, high), azimuth_deg=(20, 70))
        point = [0.1, 0.1, 0.0]
        closest_point = half.closest(point)
        assert closest_point.inside
        assert half.point(
            closest_point.u, closest_point.v
        ) + closest_point.height * closest_point.normal == pytest.approx(np.array(point), abs=1e-14)
    for kind in (cone(0.4, 0.5, (100, 200), (1, 2)), torus(0.4, 0.1, (100, 200), (140, 200))):
        assert kind.closest([0.0, 0.0, 1.7 if kind.kind == "cone" else 0.0]).inside
    assert torus(0.4, 0.1, (100, 200), (140, 200)).closest([-0.4, 0.0, 0.0]).inside


def test_points_past_the_apex_have_their_closest_point_there_and_outside():
    spike = cone(0.5, -0.5, (0, 360), (0, 0.8))
    closest_point = spike.closest([[0.0, 0.0, 1.5], [0.05, 0.1, 2.0]])
    assert closest_point.v == pytest.approx([1.0, 1.0])
    assert not closest_point.inside.any()


def test_points_that_are_not_finite_have_no_foot(shape):
    closest_point = shape.closest(
        [[np.nan, 0, 0], [0, np.inf, 0], shape.point(shape.u_range[0], 0.1)]
    )
    assert np.isnan(closest_point.height[:2]).all()
    assert np.isnan(closest_point.normal[:2]).all()
    assert np.isfinite(closest_point.height[2])
    assert not closest_point.inside[:2].any()
    assert shape.closest(np.empty((0, 3))).height.shape == (0,)
    assert shape.closest(np.zeros((2, 5, 3))).normal.shape == (2, 5, 3)
    with pytest.raises(ValueError, match="shape"):
        shape.closest([1.0, 2.0])


def test_surfaces_pickle_and_move(shape, motion):
    assert_pickles_and_moves(shape, motion)


def test_seams_and_poles_are_joined():
    ring = torus(0.5, 0.2, (0, 360), (0, 360)).cells(6, 5)
    assert (np.diff(ring.neighbours.indptr) == 8).all()
    egg = ellipsoid((0.5, 0.6, 0.9), (0, 180), (0, 360)).cells(6, 8)
    assert egg.surface.poles == (True, True)
    assert np.diff(egg.neighbours.indptr).min() == 8
    funnel = cone(0.2, 1.0, (0, 360), (0, 0.4)).cells(6, 3)
    assert funnel.index(0, 0) in funnel.neighbours.of(funnel.index(5, 0))
    open_patch = torus(0.5, 0.2, (0, 350), (0, 350)).cells(4, 4)
    assert len(open_patch.pairs) == 42


def test_cells_stand_on_the_surface(shape):
    cells = shape.cells(4, 5)
    assert isinstance(cells, Cells)
    closest_point = shape.closest(cells.centres)
    assert np.abs(closest_point.height).max() < 1e-13
    assert closest_point.inside.all()
    assert closest_point.normal == pytest.approx(cells.normals, abs=1e-11)


BAD = {
    "radius": lambda: cone(0, 1.0, (0, 90), (0, 1)),
    "slope": lambda: cone(1, math.nan, (0, 90), (0, 1)),
    "slope must be a number in": lambda: cone(1, "1", (0, 90), (0, 1)),
    "before the apex at z = 2": lambda: cone(1, -0.5, (0, 90), (0, 2)),
    "apex at z = -1": lambda: cone(1, 1, (0, 90), (-3, -2)),
    "angle_deg must span at most": lambda: cone(1, 1, (0, 361), (0, 1)),
    "tube must be less than ring": lambda: torus(0.2, 0.2, (0, 90), (0, 90)),
    "ring must be a finite": lambda: torus(math.inf, 0.2, (0, 90), (0, 90)),
    "tube must be within a factor of": lambda: torus(1, 1e-8, (0, 90), (0, 90)),
    "v_deg must be a pair": lambda: torus(1, 0.2, (0, 90), (90, 0)),
    "semi_axes must be three": lambda: ellipsoid((1, 2), (0, 90), (0, 90)),
    r"semi_axes\[1\] must be a finite number > 0": lambda: ellipsoid((1, 0, 1), (0, 90), (0, 90)),
    "semi_axes must be within a factor of": lambda: ellipsoid((1, 1, 1e-7), (0, 90), (0, 90)),
    "polar_deg must lie in 0 .. 180": lambda: ellipsoid((1, 1, 1), (-1, 90), (0, 90)),
}


@pytest.mark.parametrize("message", BAD, ids=str)
def test_bad_numbers_are_named(message):
    with pytest.raises(SurfaceError, match=message):
        BAD[message]()


def test_all_faults_are_reported_together():
    with pytest.raises(SurfaceError) as caught:
        torus(-1, None, (0, 400), "x", side="top", position=(1,), rpy_deg=(1, 2, math.nan))
    for name in ("ring", "tube", "u_deg", "v_deg", "side", "position", "rpy_deg"):
        assert name in str(caught.value)
    with pytest.raises(SurfaceError) as caught:
        cone(-1, 1e7, (5, 5), (0, math.inf))
    for name in ("radius", "slope", "angle_deg", "height"):
        assert name in str(caught.value)
