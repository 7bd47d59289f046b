"""B-spline and NURBS patches: exact quadrics, differences, brute force, and nets refused."""

import math

import numpy as np
import pytest
from scipy.interpolate import BSpline
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
from spline_nets import TURN_KNOTS, full_turn, hood, meridian, quarter_turn, turned

from surfaces import SurfaceError, bspline, cylinder, sphere, torus

RNG = np.random.default_rng(12)
WEIGHTS = RNG.uniform(0.5, 2.0, (6, 7))
KNOTS = ([0, 0, 0, 0, 0.2, 0.7, 1, 1, 1, 1], [-1, -1, -1, 0, 1, 1.4, 2, 3, 3, 3.0])


def nurbs_pipe(**more):
    ring = full_turn()
    points, weights = turned([[0.5, -0.2], [0.5, 0.6]], [1, 1], *ring)
    return bspline(points, (2, 1), (TURN_KNOTS, None), weights, **more)


def nurbs_belt(**more):
    points, weights = turned(*meridian(0.7, -20, 65), *quarter_turn())
    return bspline(points, (2, 2), None, weights, **more)


def nurbs_ring(**more):
    circle, weights = full_turn()
    points, weights = turned(circle * 0.2 + [0.6, 0.0], weights, *full_turn())
    return bspline(points, (2, 2), (TURN_KNOTS, TURN_KNOTS), weights, **more)


PATCHES = {
    "hood": bspline(hood(), **POSE),
    "rational": bspline(hood(), (3, 2), KNOTS, WEIGHTS, side="outside", **POSE),
    "part": bspline(hood(), (2, 4), u=(0.1, 0.85), v=(0.3, 0.9)),
    "facet": bspline([[(0, 0, 0), (0, 1, 0.3)], [(1, 0, 0), (1, 1, 0)]], (1, 1)),
    "pipe": nurbs_pipe(**POSE),
    "belt": nurbs_belt(),
    "ring": nurbs_ring(**POSE),
}


@pytest.fixture(params=PATCHES, ids=str)
def shape(request):
    return PATCHES[request.param]


def inner(shape, count=1500, gap=5e-4):
    """Random parameters away from knots and borders."""
    u, v = random_parameters(shape, count)
    keep = np.ones(count, dtype=bool)
    for axis, x in enumerate((u, v)):
        keep &= np.abs(x[:, None] - shape.net.breaks(axis)).min(axis=1) > gap
    return u[keep], v[keep]


def test_points_are_the_sum_of_basis_functions(shape):
    u, v = random_parameters(shape, 300)
    net = shape.net
    weights = np.ones(net.points.shape[:2]) if net.weights is None else net.weights
    basis = [
        BSpline.design_matrix(x, t, k).toarray()
        for x, t, k in zip((u, v), net.knots, net.degree, strict=True)
    ]
    above = np.einsum("ki,kj,ij,ijx->kx", *basis, weights, net.points)
    below = np.einsum("ki,kj,ij->k", *basis, weights)
    expected = above / below[:, None] @ shape.rotation.T + shape.position
    assert shape.point(u, v) == pytest.approx(expected, abs=1e-14)


def test_normals_are_unit_and_normal_to_finite_differences(shape):
    assert_normals_fit(shape, *inner(shape), step=1e-4, least=1e-8)


def test_derivatives_are_exact(shape):
    u, v = inner(shape)
    x, step = np.column_stack([u, v]), 1e-4
    jet = shape.net.jet(x)
    assert jet.point == pytest.approx(shape.net.point(x), abs=1e-15)
    assert jet.first[:, 0] == pytest.approx(shape.net.tangents(x)[0], abs=1e-13)
    assert jet.first[:, 1] == pytest.approx(shape.net.tangents(x)[1], abs=1e-13)
    size = np.abs(jet.second).max() + np.abs(jet.first).max()
    for axis in (0, 1):
        shift = step * np.eye(2)[axis]

        def difference(f, shift=shift):
            far = f(x + 2 * shift) - f(x - 2 * shift)
            return (8 * (f(x + shift) - f(x - shift)) - far) / (12 * step)

        assert np.abs(difference(shape.net.point) - jet.first[:, axis]).max() < 1e-8 * size
        slope = difference(lambda y: shape.net.jet(y).first)
        assert np.abs(slope - jet.second[:, axis]).max() < 1e-8 * size
    assert np.abs(jet.second[:, 0, 1] - jet.second[:, 1, 0]).max() == 0.0


def test_closest_recovers_parameters_height_and_normal(shape):
    assert_closest_recovers(shape, 0.03, height=2e-14, normal=1e-10, count=1500)


def test_no_point_of_the_patch_is_nearer_than_the_foot(shape):
    rng = np.random.default_rng(3)
    centre = shape.point(*(sum(ends) / 2 for ends in (shape.u_range, shape.v_range)))
    points = centre + rng.normal(scale=0.5, size=(25, 3))
    closest_point = shape.closest(points)
    placed = shape.point(closest_point.u, closest_point.v)
    distance = np.linalg.norm(points - placed, axis=1)
    expected = least_distances(shape, points, shape.u_range, shape.v_range)
    assert np.abs(distance - expected).max() < 1e-9
    leaning = np.abs(np.abs(closest_point.height) - distance) > 1e-12
    assert (closest_point.inside == ~leaning).all()
    assert closest_point.height == pytest.approx(
        np.einsum("ij,ij->i", points - placed, closest_point.normal)
    )
    at_end = [
        ((x == low) | (x == high)) & (not closed)
        for x, (low, high), closed in (
            (closest_point.u, shape.u_range, shape.u_closed),
            (closest_point.v, shape.v_range, shape.v_closed),
        )
    ]
    assert (leaning <= at_end[0] | at_end[1]).all()


def test_area_matches_fine_triangles_and_adds_up(shape):
    total = float(shape.area(*shape.u_range, *shape.v_range))
    breaks = shape.net.breaks(0), shape.net.breaks(1)
    assert total == pytest.approx(extrapolated_area(shape, *breaks, pieces=12), rel=1e-6)
    cells = shape.cells(5, 7)
    assert cells.areas.sum() == pytest.approx(total, rel=1e-10)
    assert float(shape.area(*shape.u_range[::-1], *shape.v_range)) == pytest.approx(-total)


def test_nurbs_pipe_belt_and_ring_are_the_exact_quadrics():
    pairs = (
        (nurbs_pipe(**POSE), cylinder(0.5, (0, 360), (-0.2, 0.6), **POSE)),
        (nurbs_belt(**POSE), sphere(0.7, (25, 110), (0, 90), **POSE)),
        (nurbs_ring(**POSE), torus(0.6, 0.2, (0, 360), (0, 360), **POSE)),
    )
    for patch, exact in pairs:
        u, v = random_parameters(patch, 2000)
        on = exact.closest(patch.point(u, v))
        assert np.abs(on.height).max() < 1e-14
        assert on.inside.all()
        assert np.abs(patch.normal(u, v) - on.normal).max() < 1e-12
        assert float(patch.area(*patch.u_range, *patch.v_range)) == pytest.approx(
            float(exact.area(*exact.u_range, *exact.v_range)), rel=1e-12
        )
        # The closest points of any points, found by search and by closed form.
        w, z = random_parameters(exact, 2000, seed=4)
        height = np.random.default_rng(5).uniform(-0.15, 0.6, (2000, 1))
        points = exact.point(w, z) + height * exact.normal(w, z)
        found, known = patch.closest(points), exact.closest(points)
        assert found.inside.all()
        assert np.abs(found.height - known.height).max() < 1e-12
        assert np.abs(found.normal - known.normal).max() < 1e-12


def test_closed_seams_are_joined_and_kinked_ones_are_not():
    pipe, ring = PATCHES["pipe"], PATCHES["ring"]
    assert (pipe.u_closed, pipe.v_closed) == (True, False)
    assert (ring.u_closed, ring.v_closed) == (True, True)
    assert (np.diff(ring.cells(6, 5).neighbours.indptr) == 8).all()
    assert pipe.point(1.05, 0.3) == pytest.approx(pipe.point(0.05, 0.3), abs=1e-15)
    over = pipe.point(np.array([0.0, 1.0, 0.9999]), 0.5) + 0.1 * pipe.normal(1.0, 0.5)
    assert pipe.closest(over).inside.all()
    # A drop: its ends meet at a point, at an angle.
    drop = np.array([[(0, 0, z), (1, -1, z), (1, 1, z), (0, 0, z)] for z in (0.0, 1.0)])
    kinked = bspline(drop, (1, 3))
    assert not kinked.v_closed
    half = nurbs_pipe(u=(0.0, 0.5))
    assert not half.u_closed


def test_a_part_is_the_whole_within_its_range():
    whole, part = bspline(hood(), (2, 4)), PATCHES["part"]
    u, v = random_parameters(part, 200)
    assert (part.point(u, v) == whole.point(u, v)).all()
    assert (part.normal(u, v) == whole.normal(u, v)).all()
    beyond = whole.point(0.05, 0.5) + 0.01 * whole.normal(0.05, 0.5)
    closest_point = part.closest(beyond)
    assert closest_point.u == 0.1
    assert not closest_point.inside
    assert whole.closest(beyond).inside


def test_weights_of_one_and_default_knots_change_nothing():
    plain = bspline(hood())
    assert same_surface(plain, bspline(hood(), weights=np.ones((6, 7))), 1e-12)
    u, v = [0, 0, 0, 0, 1 / 3, 2 / 3, 1, 1, 1, 1], [0, 0, 0, 0, 0.25, 0.5, 0.75, 1, 1, 1, 1]
    assert same_surface(plain, bspline(hood().tolist(), [3, 3], [u, v]), 1e-14)
    assert same_surface(plain, bspline(hood(), knots=(None, v)), 1e-14)


def test_surfaces_pickle_and_move(shape, motion):
    moved = assert_pickles_and_moves(shape, motion)
    assert moved.net is shape.net
    for array in (shape.net.points, *shape.net.knots):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_a_net_of_many_spans_is_searched_within_its_samples():
    m, n = 150, 120
    points = hood(m, n)
    patch = bspline(points)
    u, v = random_parameters(patch, 400)
    closest_point = patch.closest(patch.point(u, v) - 0.02 * patch.normal(u, v))
    assert np.abs(closest_point.u - u).max() < 1e-11
    assert closest_point.height == pytest.approx(np.full(400, -0.02), abs=1e-14)


def changed(place, value):
    points = hood().tolist()
    i, j = place
    points[i][j] = value
    return points


def folded():
    points = hood()
    points[2, :, 0], points[3, :, 0] = points[3, :, 0].copy() + 0.6, points[2, :, 0].copy() - 0.6
    return points


def kinked():
    ridge = [(0, 0), (1, 0), (2, 0), (3, 1), (4, 2)]
    return np.array([[(x, y, z) for y in (0, 1.0)] for x, z in ridge])


KINK_KNOTS = ([0, 0, 0, 1, 1, 2, 2, 2], None)
POLE = np.array([[(0, 0, 1.0)] * 4, *(hood()[1:4, :4])])
BAD = {
    "not a list": ({"points": "net"}, "points must be a list, got str"),
    "empty": ({"points": []}, "points must be rows"),
    "nothing": (
        {"points": np.zeros((0, 0, 3)), "weights": []},
        "points must have at least 4 rows",
    ),
    "one row": ({"points": hood()[:1]}, "at least 4 rows for the degree 3, got 1"),
    "few columns": ({"points": hood()[:, :2]}, "at least 4 columns for the degree 3, got 2"),
    "ragged": ({"points": [*hood().tolist(), [(0, 0, 0)]]}, r"7 x 3 .* 1 x 3 in row 6"),
    "flat": ({"points": hood()[:, :, :2]}, "got the shape 6 x 7 x 2"),
    "too deep": ({"points": [hood().tolist()]}, "must be"),
    "NaN": ({"points": changed((2, 3), (0, math.nan, 1))}, r"points\[2\]\[3\]\[1\] .* got nan"),
    "a word": ({"points": changed((0, 1), ("x", 0, 1))}, r"points\[0\]\[1\]\[0\] .* got 'x'"),
    "a truth": ({"points": changed((0, 1), (True, 0, 1))}, r"points\[0\]\[1\]\[0\] .* got True"),
    "no point": ({"points": changed((0, 1), None)}, r"points\[0\]\[1\] must be a list"),
    "far": ({"points": hood() * 1e9}, "within 1e\\+06 metres"),
    "a billion": ({"points": np.broadcast_to(1.0, (10_000, 33_334, 3))}, "at most 120,000"),
    "many": ({"points": [[(0, 0, 0)] * 300] * 300}, "at most 120,000 numbers, got"),
    "strings": ({"points": np.full((4, 4, 3), "1")}, "must have 3 axes of numbers"),
    "complex": ({"points": hood().astype(complex)}, "must have 3 axes of numbers"),
    "degree 0": ({"degree": (0, 3)}, "degree must be two whole numbers"),
    "degree 2.5": ({"degree": (2.5, 3)}, "degree must be two whole numbers"),
    "one degree": ({"degree": 3}, "degree must be two whole numbers"),
    "degree 10": ({"degree": (10, 3)}, "in 1 .. 9"),
    "knots short": ({"knots": ([0, 1], None)}, r"knots\[0\] must be 10 numbers"),
    "knots fall": (
        {"knots": ([0, 0, 0, 0, 2, 1, 3, 3, 3, 3], None)},
        r"knots\[0\] must never fall.* at \[5\]",
    ),
    "knots all one": ({"knots": (None, [1] * 11)}, r"knots\[1\] must span a range"),
    "knots NaN": ({"knots": (None, [math.nan] * 11)}, r"knots\[1\]\[0\] .* 11 such entries"),
    "knots apart": (
        {"degree": (3, 2), "knots": (None, [0, 0, 0, 1, 1, 1, 1.5, 2, 2, 2])},
        "knot more than 2 times.*1 is there more often",
    ),
    "knots too close": ({"knots": ([0, 0, 0, 0, 1e-300, 1, 2, 2, 2, 2], None)}, "span a range"),
    "knots not two": ({"knots": [0, 0, 1, 1]}, "knots must be two lists"),
    "knots a word": ({"knots": "xy"}, "knots must be two lists"),
    "weight 0": ({"weights": np.zeros((6, 7))}, r"weights must be > 0 .* at \[0\]\[0\]"),
    "weights apart": ({"weights": np.diag([1e9] * 7)[:6] + 1}, "factor of at most 1e\\+06"),
    "weights wrong": ({"weights": np.ones((7, 6))}, "one number > 0 for each point, 6 x 7"),
    "u beyond": ({"u": (0.5, 1.5)}, r"u must be a pair .* within the knots' range 0 \.\. 1"),
    "v reversed": ({"v": (0.5, 0.2)}, "v must be a pair"),
    "v a word": ({"v": "all"}, "v must be a list"),
    "one point": ({"points": np.ones((4, 4, 3))}, "normal everywhere, but has none near"),
    "on a line": ({"points": hood() * [1, 0, 0]}, "normal everywhere, but has none near"),
    "a pole": ({"points": POLE}, r"none near \(u, v\) = \(0, 0\).*narrower range"),
    "folded": ({"points": folded()}, "must be smooth, but folds over"),
    "kinked": ({"points": kinked(), "degree": (2, 1), "knots": KINK_KNOTS}, "has a kink near"),
    "kinked facets": ({"points": hood(), "degree": (1, 1)}, "has a kink near"),
}


@pytest.mark.parametrize("name", BAD, ids=str)
def test_bad_nets_are_refused_with_the_reason(name):
    arguments, message = BAD[name]
    with pytest.raises(SurfaceError, match=message):
        bspline(**{"points": hood(), **arguments})


def test_a_pole_can_be_left_out():
    patch = bspline(POLE, u=(0.05, 1.0))
    assert np.isfinite(patch.cells(3, 3).areas).all()


def test_all_faults_are_reported_together():
    with pytest.raises(SurfaceError) as caught:
        bspline(hood(), (3, 3), ([3], [4]), -np.ones((6, 7)), u=(1, 0), side="up", position=1)
    for name in ("weights", "knots[0]", "knots[1]", "u must", "side", "position"):
        assert name in str(caught.value)
