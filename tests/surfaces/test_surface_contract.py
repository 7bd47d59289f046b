"""One contract for every kind of surface: geometry against formulas and brute force.

Each property is written once and asked of all specimens (`tests/shared/shapes/specimens.py`). A
new kind is one row there, and one in `random_surfaces.py`; the referee needs its formula, too.
"""

import math
import pickle

import numpy as np
import pytest
from plain import surface_of
from referee import Form
from samples import sampled, spread
from smooth_probes import extrapolated_area, least_distances, random_parameters, same_surface
from specimens import ALL, CLOSED, POLES, SMOOTH, cells_of, hood

from coverable import bspline, cone, cylinder, ellipsoid, hyperboloid, plane, poses, sphere, torus
from surfaces.patches.normal_bounds import bounds_of
from surfaces.patches.patch import ClosedFormPatch

TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
SHIFT = np.array([0.3, -0.2, 0.1])
NETS = ("bspline", "revolution", "parametric")  # kinds whose closest points are searched for


@pytest.fixture(params=SMOOTH, ids=str)
def smooth(request):
    return SMOOTH[request.param]


def form_of(surface):
    if surface.kind != "parametric":
        return surface_of(surface)
    return Form(
        "", (), surface.u_range, surface.v_range, True, surface.position, surface.rotation,
        lambda u, v: np.stack([u, v, 0.3 * np.sin(2 * u) * v], -1),
    )  # fmt: skip


def reach(surface):
    """m, within which every point has one closest point."""
    cells = surface.cells(20, 20)
    bent = float(np.max(cells.parallel_curvature(0.0)))
    found = min(0.2 / max(bent, 1e-9), 0.1 * float(np.ptp(cells.centres, axis=0).max()))
    if isinstance(surface, ClosedFormPatch):
        while math.isinf(bounds_of(surface, 0.0, found).curvature):
            found /= 1.2
    return found


def test_points_normals_and_u_directions_are_those_of_the_formula(smooth):
    """The referee's, who writes formulas once more and knows nothing of the product's."""
    u, v = random_parameters(smooth)
    form = form_of(smooth)
    assert form is not None, "its formula goes into tests/shared/referee.py, its name into plain.py"
    expected, at, n = form.at(u, v), smooth.point(u, v), smooth.normal(u, v)
    fitted, net = smooth.kind == "parametric", smooth.kind in ("bspline", "parametric")
    off = np.linalg.norm(expected.points - at, axis=1)
    assert off.max() <= 9e-7 if fitted else 6e-15 * (1 + np.abs(at).max())
    assert np.abs(np.linalg.norm(n, axis=1) - 1.0).max() < 1e-14
    lean = np.linalg.norm(expected.normals - n, axis=1)
    assert np.quantile(lean, 0.98) < (1e-5 if fitted else 1e-8 if net else 1e-11)
    assert lean.max() < (1e-5 if net else 1e-11)  # near knots differences are worse
    both = smooth.point_and_normal(u, v)
    assert np.abs(both[0] - at).max() < 1e-14 * (1 + np.abs(at).max())
    assert np.abs(both[1] - n).max() < 1e-14
    cells = smooth.cells(3, 4)
    np.testing.assert_allclose(cells.tangents, form.at(cells.u, cells.v).along, atol=1e-5)


def test_shapes_broadcast(smooth):
    u, v = np.linspace(*smooth.u_range, 5)[:, None], np.linspace(*smooth.v_range, 4)
    points = smooth.point(u, v)
    found = smooth.closest(points)
    assert points.shape == smooth.normal(u, v).shape == found.normal.shape == (5, 4, 3)
    assert found.u.shape == found.height.shape == found.inside.shape == (5, 4)
    assert smooth.closest(np.empty((0, 3))).u.shape == (0,)
    assert smooth.closest(points[2, 1]).height.shape == ()
    with pytest.raises(ValueError, match=r"\(\.\.\., 3\)"):
        smooth.closest([1.0, 2.0])


def test_closest_finds_back_where_points_were_put(smooth):
    u, v = random_parameters(smooth)
    h = np.random.default_rng(1).uniform(-1, 1, len(u)) * reach(smooth)
    n, foot = smooth.normal(u, v), smooth.point(u, v)
    found = smooth.closest(foot + h[:, None] * n)
    assert found.inside.all()
    assert np.abs(found.height - h).max() < 2e-14 * (1 + np.abs(foot).max())
    assert np.abs(found.normal - n).max() < 1e-10
    assert np.abs(smooth.point(found.u, found.v) - foot).max() < 1e-11
    for x, (low, high) in ((found.u, smooth.u_range), (found.v, smooth.v_range)):
        assert x.min() > low - 1e-9
        assert x.max() < high + 1e-9


@sampled("smooth", spread([*SMOOTH], 13), indirect=True)
def test_no_place_is_nearer_than_the_closest(smooth):
    """By a search without slopes over the patch; a closed form may find places beyond it."""
    rng = np.random.default_rng(3)
    at = smooth.point(*random_parameters(smooth, 8))
    size = float(np.ptp(smooth.point(*random_parameters(smooth)), axis=0).max())
    above = smooth.position + np.outer([0.11, 0.4], smooth.rotation[:, 2] * size)
    points = np.concatenate([at + rng.normal(scale=0.4 * size, size=(8, 3)), above])
    found = smooth.closest(points)
    foot = smooth.point(found.u, found.v)
    away = np.linalg.norm(points - foot, axis=1)
    least = least_distances(smooth, points, smooth.u_range, smooth.v_range, 61)
    assert (away <= least + 1e-9 * (1 + size)).all()
    assert np.abs(away - least)[found.inside].max(initial=0.0) < 1e-9 * (1 + size)
    if smooth.kind in ("bspline", "parametric"):
        assert np.abs(away - least).max() < 1e-9 * (1 + size)
    # The height is along the normal there; inside, the normal leads to the point.
    along = np.einsum("ij,ij->i", points - foot, found.normal)
    ordinary = np.abs(np.abs(found.height) - away) < 1e-11 * (1 + away)
    assert ordinary[found.inside].all()
    assert np.abs(along - found.height)[ordinary].max() < 1e-11 * (1 + size)


def test_inside_is_on_the_patch_and_nowhere_else(smooth):
    if smooth.kind in NETS:
        return  # nothing is known beyond their ranges
    (u0, u1), (v0, v1) = smooth.u_range, smooth.v_range
    rng = np.random.default_rng(11)
    u = u0 + (u1 - u0) * rng.uniform(-0.3, 1.3, 1500)
    v = v0 + (v1 - v0) * rng.uniform(-0.1, 1.1, 1500)
    if smooth.u_polar:
        u = np.clip(u, 0.01, math.pi - 0.01)
    if smooth.kind == "cone":
        wide = smooth.radius + smooth.slope * v > 0.01
        u, v = u[wide], v[wide]
    found = smooth.closest(smooth.point(u, v) + 0.002 * smooth.normal(u, v))
    expected = np.ones(len(u), dtype=bool)
    for value, (low, high), angle in ((u, smooth.u_range, smooth.u_angle),
                                      (v, smooth.v_range, smooth.v_angle)):  # fmt: skip
        turned = low + np.mod(value - low, math.tau) if angle else value
        expected &= (turned >= low) & (turned <= high)
    assert (found.inside == expected).all()
    whole = smooth.u_closed or smooth.v_closed
    assert whole or 0 < expected.sum() < len(u)


@pytest.mark.parametrize("name", [*ALL, "poses"])
def test_points_that_are_not_finite_have_no_closest_one(name):
    if name == "poses":
        cells = poses([[0.4, 0, 0], [0.5, 0, 0]], [[0, 0, 1], [0, 0, 1]])
    else:
        cells = cells_of(ALL[name], 2, 3)
    wrong = [[np.nan, 0, 0], [0, np.inf, 0], [0, 0, -np.inf], [np.inf, np.nan, -np.inf]]
    found = cells.surface.closest([*wrong, cells.centres[0]])
    assert found.inside.tolist() == [False] * 4 + [True]
    assert np.isfinite(found.height).tolist() == [False] * 4 + [True]
    assert np.isnan(found.normal[:4]).all()
    assert (cells.locate(wrong) == -1).all()


EQUALLY_NEAR = {
    "centre": (sphere(0.4, (30, 60), (100, 200)), (0, 0, 0)),
    "axis": (cylinder(0.4, (100, 200), (1, 2)), (0, 0, 1.5)),
    "axis of a waist": (hyperboloid(0.4, 1.0, (100, 200), (0.3, 0.8)), (0, 0, 0.5)),
    "axis of a cone": (cone(0.4, 0.5, (100, 200), (1, 2)), (0, 0, 1.7)),
    "middle of a ring": (torus(0.4, 0.1, (100, 200), (140, 200)), (0, 0, 0)),
    "in a tube": (torus(0.4, 0.1, (100, 200), (140, 200)), (-0.4, 0, 0)),
    "above the middle": (ellipsoid((1.0, 0.8, 0.3), (0, 60), (20, 70)), (0.1, 0.1, 0)),
    "below the middle": (ellipsoid((1.0, 0.8, 0.3), (120, 180), (20, 70)), (0.1, 0.1, 0)),
    "over a pole": (sphere(0.7, (0, 90), (100, 190)), (0, 0, 0.9)),
    "belt": (sphere(0.7, (40, 150), (0, 360)), (1e-9, 0, 0)),
}


@pytest.mark.parametrize("name", EQUALLY_NEAR)
def test_of_many_closest_points_one_on_the_patch_is_taken(name):
    surface, point = EQUALLY_NEAR[name]
    found = surface.closest(point)
    assert found.inside
    there = surface.point(found.u, found.v) + found.height * found.normal
    assert there == pytest.approx(np.array(point, float), abs=2e-9)


@pytest.mark.parametrize("axes", [(0.4, 0.9, 0.6), (0.9, 0.6, 0.4), (0.7, 0.3, 0.3), (1, 1, 0.01)])
def test_closest_points_of_ellipsoids_near_the_planes_where_normals_meet(axes):
    whole = ellipsoid(axes, (0, 180), (0, 360))
    rng = np.random.default_rng(2)
    points = rng.uniform(-1, 1, (15, 3)) * axes
    points[np.arange(15), rng.integers(0, 3, 15)] *= np.tile([0.0, 1e-300, 1e-17, 1e-9, 0.1], 3)
    points[0], points[1] = 0.0, 1e-12
    found = whole.closest(points)
    away = np.linalg.norm(points - whole.point(found.u, found.v), axis=1)
    least = least_distances(whole, points, (-1.0, math.pi + 1.0), (-1.0, math.tau + 1.0))
    assert (away <= least + 1e-12).all()
    assert (least - away).max() < 1e-6
    assert np.abs(np.abs(found.height) - away).max() < 1e-12
    assert found.inside.all()


def test_closest_points_of_a_waist_far_off_and_near_its_focal_curve():
    horn = hyperboloid(0.5, 0.4, (0, 360), (-5, 5))
    rng = np.random.default_rng(3)
    z = np.concatenate([rng.uniform(-5, 5, 2000), [0.0, 1e-300, -1e-12]])
    rho = np.concatenate([10.0 ** rng.uniform(-14, 2, 2000), [0.0, 0.0, 0.3]])
    points = np.column_stack([rho, np.zeros_like(z), z])
    found = horn.closest(points)
    tangent = np.stack([found.normal[:, 2], np.zeros_like(z), -found.normal[:, 0]], axis=1)
    along = np.einsum("ij,ij->i", points - horn.point(found.u, found.v), tangent)
    assert (np.abs(along) < 1e-14 * (1 + rho + np.abs(z))).all()
    assert (found.v * z >= 0).all()


def test_beyond_the_apex_of_a_cone_the_apex_is_closest_and_not_inside():
    found = cone(0.5, -0.5, (0, 360), (0, 0.8)).closest([[0.0, 0.0, 1.5], [0.05, 0.1, 2.0]])
    assert found.v == pytest.approx([1.0, 1.0])
    assert not found.inside.any()


def test_areas_are_those_of_fine_triangles_and_add_up(smooth):
    total = float(smooth.area(*smooth.u_range, *smooth.v_range))
    cells = smooth.cells(7, 5)
    assert (cells.areas > 0).all()
    assert cells.areas.sum() == pytest.approx(total, rel=1e-10)
    assert float(smooth.area(*smooth.u_range[::-1], *smooth.v_range)) == pytest.approx(-total)
    fine = extrapolated_area(smooth, 40)
    assert total == pytest.approx(fine, rel=2e-5 if smooth.kind in NETS else 1e-7)


@pytest.mark.parametrize("name", ALL)
def test_seams_and_poles(name):
    surface = ALL[name]
    if name in SMOOTH:
        closed = CLOSED.get(name, "")
        assert (surface.u_closed, surface.v_closed) == ("u" in closed, "v" in closed)
        assert surface.poles == POLES.get(name, (False, False))
    assert surface.side_sign == {"inside": -1.0, "outside": 1.0}[surface.side]
    assert not plane((0, 7), (0, 2 * math.pi)).v_closed  # 2 pi metres are no turn


@pytest.mark.parametrize("name", ALL)
def test_moved_and_pickled_surfaces_are_the_same(name):
    surface = ALL[name]
    copy, moved = pickle.loads(pickle.dumps(surface)), surface.moved(TURN, SHIFT)
    assert (type(moved), moved.side, copy.side) == (type(surface), surface.side, surface.side)
    points = cells_of(surface, 3, 3).centres + 0.01
    here, there = surface.closest(points), moved.closest(points @ TURN.T + SHIFT)
    again = copy.closest(points)
    assert there.height == pytest.approx(here.height, abs=1e-10)
    assert there.normal == pytest.approx(here.normal @ TURN.T, abs=1e-8)
    assert (again.height == here.height).all()
    assert again.inside.tolist() == here.inside.tolist() == there.inside.tolist()
    for one in (surface, copy, moved):
        with pytest.raises(ValueError, match="read-only"):
            one.position[0] = 1.0
        with pytest.raises(AttributeError):
            one.side = "top"
    if isinstance(surface, ClosedFormPatch):
        assert bounds_of(moved, 0.01) == bounds_of(surface, 0.01)


def test_a_part_of_a_spline_is_the_whole_within_its_range_and_weights_of_one_change_nothing():
    net = SMOOTH["hood"].net.points
    whole, part = bspline(net, (2, 4)), bspline(net, (2, 4), u=(0.1, 0.85), v=(0.3, 0.9))
    u, v = random_parameters(part, 200)
    assert (part.point(u, v) == whole.point(u, v)).all()
    assert (part.normal(u, v) == whole.normal(u, v)).all()
    many = bspline(hood(90, 4))  # so many spans that each is looked at in fewer places
    assert np.abs(many.closest(many.point(u, v)).u - u).max() < 1e-9
    beyond = whole.point(0.05, 0.5) + 0.01 * whole.normal(0.05, 0.5)
    found = part.closest(beyond)
    assert (found.u, bool(found.inside), bool(whole.closest(beyond).inside)) == (0.1, False, True)
    assert same_surface(bspline(net), bspline(net, weights=np.ones((6, 7))), 1e-12)
