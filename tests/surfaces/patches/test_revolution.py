"""Surfaces of revolution: the profile, what it sweeps, and profiles that are refused."""

import math
from itertools import pairwise

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
)

from surfaces import SurfaceError, cone, revolution
from surfaces.patches.profile import Profile

VASE = [(0.2, 0.0), (0.35, 0.2), (0.15, 0.5), (0.25, 0.7)]
BOWL = [(0.0, -0.4), (0.2, -0.35), (0.4, -0.1), (0.45, 0.1)]
ARC = np.radians(np.linspace(-90, 90, 41))
BALL = np.column_stack([np.cos(ARC), np.sin(ARC)])
BALL[[0, -1], 0] = 0.0

PATCHES = {
    "vase": revolution(VASE, angle_deg=(0, 360), **POSE),
    "bowl": revolution(BOWL, angle_deg=(-180, 180), side="outside", **POSE),
    "shield": revolution(BOWL[::-1], angle_deg=(20, 130)),
    "ball": revolution(BALL, angle_deg=(100, 460), **POSE),
    "tube": revolution([(0.5, 0.0), (0.4, 1.0)], angle_deg=(-50, 50)),
}


@pytest.fixture(params=PATCHES, ids=str)
def shape(request):
    return PATCHES[request.param]


def outward(surface, u):
    """Away from the axis where u runs down, as the points are listed upwards."""
    return -surface.profile.at(u, 1)[:, 1]


def test_the_profile_goes_through_its_points_and_is_twice_differentiable(shape):
    profile = shape.profile
    assert profile.at(profile.knots) == pytest.approx(profile.points, abs=1e-15)
    chords = np.linalg.norm(np.diff(profile.points, axis=0), axis=1)
    assert np.diff(profile.knots) == pytest.approx(chords)
    inner = profile.knots[1:-1]
    for order in (0, 1, 2):
        before = profile.at(inner - 1e-9, order)
        assert profile.at(inner + 1e-9, order) == pytest.approx(before, abs=1e-6)
    for pole, end in zip(profile.poles, (0.0, profile.length), strict=True):
        if pole:
            assert profile.at(np.array(end), 1)[1] == pytest.approx(0.0, abs=1e-14)
            assert profile.at(np.array(end), 2)[0] == pytest.approx(0.0, abs=1e-12)


def test_the_right_of_a_list_walked_upwards_is_away_from_the_axis():
    up, down = (revolution(points, (0, 360)) for points in (VASE, VASE[::-1]))
    assert up.point(0.0, 0.0) == pytest.approx(np.array([0.25, 0.0, 0.7]))
    assert up.closest([1.0, 0.0, 0.2]).height > 0.5
    assert down.closest([1.0, 0.0, 0.2]).height < -0.5
    assert up.lengths == (0.2, 0.0, 0.25, 0.7)


def test_points_are_the_profile_turned(shape):
    u, v = random_parameters(shape, 500)
    x, y, z = ((shape.point(u, v) - shape.position) @ shape.rotation).T
    r, height = shape.profile.at(u).T
    assert np.hypot(x, y) == pytest.approx(r, abs=1e-14)
    assert z == pytest.approx(height, abs=1e-14)
    assert np.abs(np.sin((np.arctan2(y, x) - v) / 2)).max() < 1e-12


def test_normals_are_unit_and_normal_to_finite_differences(shape):
    u, v = random_parameters(shape, 2000)
    step = 1e-5
    u = np.clip(u, 3 * step, shape.profile.length - 3 * step)
    knots = shape.profile.knots
    u = u[np.abs(u[:, None] - knots).min(1) > 3 * step]
    v = v[: len(u)]
    n = assert_normals_fit(shape, u, v, step)
    away = (shape.point(u, v) - shape.position) @ shape.rotation * [1, 1, 0]
    assert (np.einsum("ij,ij->i", away, n @ shape.rotation) * outward(shape, u) >= 0).all()


def test_closest_recovers_parameters_height_and_normal(shape):
    assert_closest_recovers(
        shape, 0.03, normal=1e-10, parameter=1e-12, lever=lambda u: shape.profile.at(u)[:, 0]
    )


def test_no_point_of_the_whole_turn_is_nearer_than_the_foot(shape):
    rng = np.random.default_rng(3)
    points = shape.position + rng.normal(scale=0.5, size=(12, 3))
    closest_point = shape.closest(points)
    placed = shape.point(closest_point.u, closest_point.v)
    distance = np.linalg.norm(points - placed, axis=1)
    ranges = shape.u_range, (-1.0, math.tau + 1.0)
    expected = least_distances(shape, points, *ranges)
    assert np.abs(distance - expected).max() < 1e-9
    leaning = np.abs(np.abs(closest_point.height) - distance) > 1e-12
    assert not closest_point.inside[leaning].any()
    at_end = (closest_point.u == 0.0) | (closest_point.u == shape.profile.length)
    assert (leaning <= at_end).all()


def test_poles_have_a_normal_along_the_axis_and_join_their_row():
    bowl = PATCHES["bowl"]
    assert bowl.poles == (False, True)
    assert PATCHES["ball"].poles == (True, True)
    assert PATCHES["shield"].poles == (False, False)
    down = bowl.normal(bowl.profile.length, np.linspace(-3, 3, 7))
    assert down == pytest.approx(np.tile(-bowl.rotation[:, 2], (7, 1)), abs=1e-14)
    closest_point = PATCHES["shield"].closest([0.0, 0.0, -0.5])  # on the axis every azimuth is one
    assert closest_point.inside
    assert closest_point.height == pytest.approx(
        -0.1
    )  # listed downwards: outward is towards the axis
    cells = bowl.cells(4, 8)
    assert np.diff(cells.neighbours.indptr)[-8:].min() == 8
    closest_point = bowl.closest(cells.centres)
    assert closest_point.inside.all()
    assert np.abs(closest_point.height).max() < 1e-14


def test_area_matches_fine_triangles(shape):
    total = float(shape.area(*shape.u_range, *shape.v_range))
    expected = extrapolated_area(shape, shape.profile.knots, shape.v_range, pieces=24)
    assert total == pytest.approx(expected, rel=1e-6)
    cells = shape.cells(9, 4)
    assert cells.areas.sum() == pytest.approx(total, rel=1e-10)
    # Pappus: the area is the turn times the first moment of the curve, summed by another rule.
    s = np.unique(
        np.concatenate([np.linspace(a, b, 2001) for a, b in pairwise(shape.profile.knots)])
    )
    middle = (s[1:] + s[:-1]) / 2
    f = [shape.profile.at(x)[:, 0] * np.linalg.norm(shape.profile.at(x, 1), axis=1)
         for x in (s[:-1], middle, s[1:])]  # fmt: skip
    simpson = (np.diff(s) * (f[0] + 4 * f[1] + f[2])).sum() / 6
    turn = shape.v_range[1] - shape.v_range[0]
    assert total == pytest.approx(turn * simpson, rel=1e-10)


def test_two_points_make_a_cone_and_many_a_ball():
    tube, u = PATCHES["tube"], np.linspace(0, 1, 11)
    exact = cone(0.5, -0.1, angle_deg=(-50, 50), height=(0, 1))
    points = exact.point(0.3, u) + 0.1 * exact.normal(0.3, u)
    a, b = tube.closest(points), exact.closest(points)
    assert a.height == pytest.approx(b.height, abs=1e-14)
    assert a.normal == pytest.approx(b.normal, abs=1e-14)
    assert float(tube.area(*tube.u_range, *tube.v_range)) == pytest.approx(
        float(exact.area(*exact.u_range, *exact.v_range)), rel=1e-13
    )
    ball = PATCHES["ball"]
    u, v = random_parameters(ball, 1000)
    away = ball.point(u, v) - ball.position
    assert np.linalg.norm(away, axis=1) == pytest.approx(np.ones(1000), abs=1e-6)
    assert ball.normal(u, v) == pytest.approx(away, abs=1e-4)


def test_surfaces_pickle_and_move(shape, motion):
    assert_pickles_and_moves(shape, motion)
    with pytest.raises(ValueError, match="read-only"):
        shape.profile.points[0, 0] = 1.0


def test_crossings_are_found_wherever_the_chords_cross():
    rng = np.random.default_rng(4)
    crossed = 0
    for _ in range(60):
        points = rng.uniform(0.3, 1.3, (5, 2))
        profile = Profile(points)
        s = np.linspace(0, profile.length, 400)
        curve = profile.at(s)
        a, b = curve[:-1], curve[1:]

        def turn(p, q, r):
            one, two = q - p, r - p
            return one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0]

        first, second = turn(a[:, None], b[:, None], a), turn(a[:, None], b[:, None], b)
        sides = np.sign(first) != np.sign(second)
        apart = np.abs(np.subtract.outer(np.arange(399), np.arange(399))) > 1
        crosses = bool((sides & sides.T & apart).any())
        said = any("cross itself" in fault.fault for fault in profile.faults())
        stands = any(
            "turn back" in fault.fault or "axis" in fault.message for fault in profile.faults()
        )
        crossed += crosses
        assert said == crosses or stands
    assert 10 < crossed < 55


BAD = {
    "two points at least": ([(1, 0)], "must hold points"),
    "no points": ([], "profile must be points"),
    "not pairs": ([(1, 0, 0), (1, 1, 0)], "got the shape 2 x 3"),
    "ragged": ([(1, 0), (1,)], "rows of one length"),
    "a word": ("vase", "profile must be a list"),
    "NaN": ([(1, 0), (math.nan, 1), (1, 2)], r"profile\[1\]\[0\] must be a finite number"),
    "a word within": ([(1, 0), (1, "x")], r"profile\[1\]\[1\] must be a finite number, got 'x'"),
    "through the axis": ([(1, 0), (-0.5, 1), (1, 2)], r"profile\[1\] must keep clear of the axis"),
    "on the axis within": ([(1, 0), (0, 1), (1, 2)], r"profile\[1\] must keep clear"),
    "dips below between": ([(1, 0), (0.01, 0.1), (0.01, 1.0), (1, 1.1)], "reaches r = -"),
    "twice": ([(1, 0), (1, 0), (1, 1)], r"profile\[1\] is the point before it"),
    "closed": ([(1, 0), (2, 0), (2, 1), (1, 0)], "must not end where it begins"),
    "crossing": ([(1, 0), (2, 1), (2, 0), (1, 1)], "must not cross itself"),
    "back and forth": ([(1, 0), (1, 1), (1, 0.5)], "turn back on itself"),
    "along the axis": ([(0, 0), (0, 1)], "axis|turn back"),
    "too many": (np.ones((1001, 2)), "at most 2,000 numbers"),
    "a billion": (np.broadcast_to(1.0, (500_000_000, 2)), "at most 2,000 numbers"),
    "huge": ([(1e300, 0), (1e300, 1e300)], "within"),
}


@pytest.mark.parametrize("name", BAD, ids=str)
def test_bad_profiles_are_refused_with_the_reason(name):
    profile, message = BAD[name]
    with pytest.raises(SurfaceError, match=message):
        revolution(profile, angle_deg=(0, 90))


def test_all_faults_are_reported_together():
    with pytest.raises(SurfaceError) as caught:
        revolution([(1, 0), (math.inf, 1)], (0, 400), side=1, position="x", rpy_deg=None)
    for name in ("profile", "angle_deg", "side", "position", "rpy_deg"):
        assert name in str(caught.value)
