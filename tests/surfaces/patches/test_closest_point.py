"""The general search for closest points, against the closed forms and against brute force."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from smooth_probes import least_distances

from surfaces import cylinder, hyperboloid, plane, sphere
from surfaces.patches.closest_point import ClosestPointSearch, Jet
from surfaces.patches.patch import EDGE, LocalClosestPoints, SmoothPatch


def sphere_jet(radius, x):
    u, v = x.T
    su, cu, sv, cv = np.sin(u), np.cos(u), np.sin(v), np.cos(v)
    zero = np.zeros_like(u)
    point = np.stack([su * cv, su * sv, cu], 1)
    du, dv = np.stack([cu * cv, cu * sv, -su], 1), np.stack([-su * sv, su * cv, zero], 1)
    duv = np.stack([-cu * sv, cu * cv, zero], 1)
    dvv = np.stack([-su * cv, -su * sv, zero], 1)
    second = np.stack([np.stack([-point, duv], 1), np.stack([duv, dvv], 1)], 1)
    return Jet(radius * point, radius * np.stack([du, dv], 1), radius * second)


def cylinder_jet(radius, x):
    u, v = x.T
    zero, one = np.zeros_like(u), np.ones_like(u)
    out = np.stack([np.cos(u), np.sin(u), zero], 1)
    point = radius * out + np.stack([zero, zero, v], 1)
    du, dv = radius * np.stack([-np.sin(u), np.cos(u), zero], 1), np.stack([zero, zero, one], 1)
    second = np.zeros((len(u), 2, 2, 3))
    second[:, 0, 0] = -radius * out
    return Jet(point, np.stack([du, dv], 1), second)


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Searched(SmoothPatch):
    """A patch that has a closed form, but whose closest points are searched for."""

    kind: ClassVar[str] = "searched"
    units: ClassVar[tuple[str, str]] = ("rad", "rad")
    u_angle: ClassVar[bool] = False
    v_angle: ClassVar[bool] = False
    search: ClosestPointSearch
    jet: object
    sign: float

    def local_point(self, u, v):
        x = np.stack([u, v], -1)
        return self.jet(x.reshape(-1, 2)).point.reshape(*u.shape, 3)

    def local_normal(self, u, v):
        du, dv = np.moveaxis(self.jet(np.stack([u, v], -1).reshape(-1, 2)).first, 1, 0)
        cross = self.sign * np.cross(du, dv)
        return (cross / np.linalg.norm(cross, axis=1, keepdims=True)).reshape(*u.shape, 3)

    def area(self, u0, u1, v0, v1):
        raise NotImplementedError

    def local_closest_points(self, points):
        x = self.search.nearest(points)
        normal = self.local_normal(*x.T)
        away = points - self.local_point(*x.T)
        height = np.einsum("ni,ni->n", away, normal)
        beside = np.linalg.norm(away - height[:, None] * normal, axis=1)
        return LocalClosestPoints(*x.T, height, normal, beside <= EDGE)


def searched(exact, jet, sign=1.0, samples=(40, 50)):
    lines = [
        np.linspace(*ends, count)
        for ends, count in zip((exact.u_range, exact.v_range), samples, strict=True)
    ]
    closed = (exact.u_closed, exact.v_closed)
    search = ClosestPointSearch(lambda x: jet(x).point, jet, lines, closed)
    return Searched(
        exact.rotation, exact.position, exact.side, exact.u_range, exact.v_range, search, jet, sign
    )


POSE = {"position": (0.4, -0.2, 1.0), "rpy_deg": (10, 70, -130)}
PATCHES = {
    "dome": (sphere(1.3, (10, 90), (10, 180), **POSE), sphere_jet, 1.3),
    "belt": (sphere(0.8, (40, 150), (0, 360), **POSE), sphere_jet, 0.8),
    "shell": (cylinder(0.5, (-60, 100), (0, 0.9), **POSE), cylinder_jet, 0.5),
    "pipe": (cylinder(0.5, (90, 450), (-1, 1), **POSE), cylinder_jet, 0.5),
}


@pytest.fixture(params=PATCHES, ids=str)
def both(request):
    exact, jet, radius = PATCHES[request.param]
    return exact, searched(exact, lambda x: jet(radius, x))


def test_closest_points_over_the_patch_are_those_of_the_closed_form(both):
    exact, found = both
    rng = np.random.default_rng(5)
    u, v = rng.uniform(*exact.u_range, 3000), rng.uniform(*exact.v_range, 3000)
    h = rng.uniform(-0.9 * exact.radius, 3.0, 3000)
    points = exact.point(u, v) + h[:, None] * exact.normal(u, v)
    closest_point, expected = found.closest(points), exact.closest(points)
    assert closest_point.inside.all()
    assert np.abs(closest_point.height - expected.height).max() < 1e-13
    assert np.abs(closest_point.u - expected.u).max() < 1e-10
    assert np.abs(closest_point.v - expected.v).max() < 1e-10
    assert np.abs(closest_point.normal - expected.normal).max() < 1e-10


def test_points_anywhere_get_the_nearest_point_of_the_patch(both):
    exact, found = both
    rng = np.random.default_rng(6)
    points = exact.position + rng.normal(scale=exact.radius, size=(12, 3))
    closest_point = found.closest(points)
    placed = found.point(closest_point.u, closest_point.v)
    distance = np.linalg.norm(points - placed, axis=1)
    ranges = tuple(
        (low - 0.5 * closed, high + 0.5 * closed)
        for (low, high), closed in (
            (exact.u_range, exact.u_closed),
            (exact.v_range, exact.v_closed),
        )
    )
    expected = least_distances(found, points, *ranges)
    assert np.abs(distance - expected).max() < 1e-9
    # The normal leads from one in the patch to its point; one on the border is not inside.
    whole = exact.closest(points)
    assert (closest_point.inside == (np.abs(np.abs(closest_point.height) - distance) < 1e-12)).all()
    assert (closest_point.inside >= whole.inside).all()
    assert 0 < closest_point.inside.sum() < len(points)
    assert closest_point.height == pytest.approx(
        np.einsum("ij,ij->i", points - placed, closest_point.normal)
    )


def test_a_point_off_the_border_has_its_closest_point_on_it_and_not_inside():
    exact = cylinder(0.5, (-60, 100), (0.0, 0.9))
    found = searched(exact, lambda x: cylinder_jet(0.5, x))
    closest_point = found.closest(
        [[0.6, 0.0, -0.2], [0.6, 0.0, 0.0], [0.6, 0.0, 1.0], [0.2, -0.6, 0.5]]
    )
    assert closest_point.v == pytest.approx([0.0, 0.0, 0.9, 0.5], abs=1e-15)
    assert closest_point.u == pytest.approx([0.0, 0.0, 0.0, -math.pi / 3], abs=1e-12)
    assert closest_point.height[:3] == pytest.approx([0.1, 0.1, 0.1])
    assert closest_point.inside.tolist() == [False, True, False, False]


def test_coarse_samples_and_a_seam_find_the_same_feet():
    exact = cylinder(0.5, (90, 450), (-1, 1))
    coarse = searched(exact, lambda x: cylinder_jet(0.5, x), samples=(7, 3))
    angle = np.linspace(0, math.tau, 101)
    points = np.column_stack([0.7 * np.cos(angle), 0.7 * np.sin(angle), np.linspace(-1, 1, 101)])
    closest_point = coarse.closest(points)
    assert closest_point.inside.all()
    assert np.abs(np.sin((closest_point.u - angle) / 2)).max() < 1e-12
    assert closest_point.height == pytest.approx(np.full(101, 0.2), abs=1e-14)
    assert (closest_point.u >= exact.u_range[0] - 1e-12).all()
    assert (closest_point.u <= exact.u_range[1] + 1e-12).all()


def test_where_all_points_are_equally_near_one_is_taken():
    exact = sphere(0.8, (40, 150), (0, 360))
    found = searched(exact, lambda x: sphere_jet(0.8, x))
    closest_point = found.closest([[0.0, 0.0, 0.0], [1e-9, 0.0, 0.0]])
    assert closest_point.height == pytest.approx([-0.8, -0.8], abs=2e-9)
    assert np.isfinite(closest_point.u).all()


def wave_jet(x):
    """The plane curve (s, cos 3 s) and its derivatives: valleys of almost one depth."""
    s = x[:, 0]
    point = np.stack([s, np.cos(3 * s)], 1)
    first = np.stack([np.ones_like(s), -3 * np.sin(3 * s)], 1)
    second = np.stack([np.zeros_like(s), -9 * np.cos(3 * s)], 1)
    return Jet(point, first[:, None], second[:, None, None])


def test_the_nearest_of_many_valleys_is_found_on_a_curve_in_the_plane():
    line = np.linspace(-6, 6, 160)
    search = ClosestPointSearch(lambda x: wave_jet(x).point, wave_jet, (line,), (False,))
    rng = np.random.default_rng(8)
    points = np.column_stack([rng.uniform(-7, 7, 150), rng.uniform(-12, 12, 150)])
    found = search.nearest(points)
    distance = np.linalg.norm(search._point(found) - points, axis=1)
    fine = np.linspace(-6, 6, 400_001)
    curve = np.column_stack([fine, np.cos(3 * fine)])
    step = fine[1] - fine[0]
    for point, reached in zip(points, distance, strict=True):
        sampled = np.sqrt(((curve - point) ** 2).sum(1).min())
        # A sample lies within half a step of it, sideways: the distance gains its square.
        assert reached <= sampled + 1e-12
        assert sampled - reached < (3.2 * step) ** 2 * (1 + 10 / max(sampled, 1e-9)) + 1e-12
    ends = found[(found[:, 0] == -6) | (found[:, 0] == 6)]
    assert 0 < len(ends) < 60


@pytest.mark.parametrize(
    "shape",
    [
        sphere(0.5, (0, 180), (0, 360)),
        cylinder(0.5, (0, 360), (-1, 1)),
        hyperboloid(0.5, 0.4, (0, 360), (-1, 1)),
        plane((-1, 1), (-1, 1)),
    ],
    ids=lambda shape: shape.kind,
)
def test_points_that_are_not_finite_have_no_foot_on_closed_forms(shape):
    found = shape.closest([[0, np.inf, 0], [np.nan, 0, 0], [-np.inf, 0, np.inf], [0.4, 0.1, 0.2]])
    assert found.inside.tolist() == [False, False, False, True]
    assert np.isfinite(found.height).tolist() == [False, False, False, True]
    assert np.isnan(found.normal[:3]).all()
