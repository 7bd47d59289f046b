"""The bounds hold for finite differences of the normal field, and are near what is measured."""

import math

import numpy as np
import pytest

from surfaces import cylinder, hyperboloid, plane, sphere
from surfaces.patches.normal_bounds import CurvatureSlices, normal_bounds


def measured(surface, height, slack, count=20_000, seed=0):
    """Largest |Dm x| and |D^2 m[x, x]| found by central differences at random places."""
    rng = np.random.default_rng(seed)
    u = rng.uniform(*surface.u_range, count)
    v = rng.uniform(*surface.v_range, count)
    h = height + slack * rng.uniform(-1, 1, count)
    points = surface.point(u, v) + h[:, None] * surface.normal(u, v)
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    curvature = surface.bounds(height, slack).curvature
    step = 1e-3 / max(curvature, 1.0)
    ahead = surface.closest(points + step * direction).normal
    here = surface.closest(points).normal
    behind = surface.closest(points - step * direction).normal
    first = np.linalg.norm(ahead - behind, axis=1).max() / (2 * step)
    second = np.linalg.norm(ahead - 2 * here + behind, axis=1).max() / step**2
    return first, second


@pytest.mark.parametrize("share", [(0.0, 0.0), (0.3, 0.05), (-0.3, 0.05), (-0.6, 0.2), (2.0, 0.5)])
def test_bounds_hold_for_finite_differences(patch, share):
    curvature = patch.bounds(0.0).curvature
    radius = 1.0 / curvature if curvature > 0 else 1.0
    height, slack = share[0] * radius, share[1] * radius
    bounds = patch.bounds(height, slack)
    if math.isinf(bounds.curvature):
        assert patch.kind == "hyperboloid"  # bends both ways, so normals meet on either side
        assert math.isinf(bounds.second_derivative)
        return
    first, second = measured(patch, height, slack)
    # Truncation of the differences is of the order of (step * curvature)^2.
    assert first <= bounds.curvature * (1 + 1e-5) + 1e-9
    assert second <= bounds.second_derivative * (1 + 1e-4) + 1e-6


def test_bounds_are_tight_at_one_height(patch):
    bounds = patch.bounds(0.0)
    first, second = measured(patch, 0.0, 0.0)
    assert first >= 0.93 * bounds.curvature
    assert second >= (0.7 if patch.kind == "hyperboloid" else 0.93) * bounds.second_derivative


@pytest.mark.parametrize("height", [-0.3, 0.0, 0.4])
def test_bounds_of_sphere_and_cylinder_are_the_exact_values(height):
    for surface in (sphere(0.5, (10, 90), (0, 90)), cylinder(0.5, (0, 90), (0, 1))):
        bounds = surface.bounds(height, 0.1)
        rho = 0.5 + height - 0.1
        assert bounds.curvature == pytest.approx(1 / rho, rel=1e-11)
        assert bounds.second_derivative == pytest.approx(2 / math.sqrt(3) / rho**2, rel=1e-11)


def test_a_plane_does_not_bend():
    bounds = plane((0, 1), (0, 1)).bounds(-5, 1)
    assert (bounds.curvature, bounds.second_derivative) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("surface", "height", "slack", "folds"),
    [
        (sphere(0.5, (10, 90), (0, 90)), -0.45, 0.04, False),
        (sphere(0.5, (10, 90), (0, 90)), -0.45, 0.05, True),
        (sphere(0.5, (10, 90), (0, 90)), -0.6, 0.01, True),
        (cylinder(0.5, (0, 90), (0, 1)), -0.5, 0.0, True),
        (cylinder(0.5, (0, 90), (0, 1)), 50.0, 1.0, False),
        # Meridian radius at the waist: flare^2 / waist = 0.32, on the outside.
        (hyperboloid(0.5, 0.4, (0, 90), (-0.1, 1)), 0.31, 0.0, False),
        (hyperboloid(0.5, 0.4, (0, 90), (-0.1, 1)), 0.32, 0.0, True),
        (hyperboloid(0.5, 0.4, (0, 90), (-0.1, 1)), 0.30, 0.03, True),
        (hyperboloid(0.5, 0.4, (0, 90), (-0.1, 1)), -0.49, 0.0, False),
        (hyperboloid(0.5, 0.4, (0, 90), (-0.1, 1)), -0.5, 0.0, True),
        # Off the waist the normals from z and -z meet first.
        (hyperboloid(0.5, 0.4, (0, 90), (0.5, 1)), 0.7158, 0.0, False),
        (hyperboloid(0.5, 0.4, (0, 90), (0.5, 1)), 0.7159, 0.0, True),
        (hyperboloid(0.5, 0.4, (0, 90), (-1, -0.5)), 0.7, 0.0159, True),
    ],
)
def test_bounds_are_infinite_exactly_where_the_parallel_surface_folds(
    surface, height, slack, folds
):
    bounds = surface.bounds(height, slack)
    assert math.isinf(bounds.curvature) == folds
    assert math.isinf(bounds.second_derivative) == folds


def test_a_finite_bound_means_that_closest_points_do_not_jump(patch):
    """Just below the least height without a bound, every closest point is still unique."""
    for sign in (-1.0, 1.0):
        low, high = 0.0, 1.0
        while np.isfinite(patch.bounds(sign * high).curvature) and high < 1e3:
            low, high = high, 2 * high
        if high >= 1e3:
            continue
        for _ in range(60):
            middle = (low + high) / 2
            finite = np.isfinite(patch.bounds(sign * middle).curvature)
            low, high = (middle, high) if finite else (low, middle)
        u, v = (np.linspace(*r, 400) for r in (patch.u_range, patch.v_range))
        v = v[1:-1]  # off the seam
        u = u[1:-1]
        for height, jumps in ((0.98 * low, False), (1.02 * low, True)):
            points = patch.point(u, v) + sign * height * patch.normal(u, v)
            closest_point = patch.closest(points)
            same = (
                np.linalg.norm(
                    patch.point(closest_point.u, closest_point.v) - patch.point(u, v), axis=1
                )
                < 1e-6
            )
            assert same.all() != jumps


def test_curvature_slices_hold_the_profile_s_curvatures():
    """Curvatures of the profile by high-order differences of r(z), at random z."""
    horn = hyperboloid(0.7, 0.4, (0, 90), (-0.3, 1.1))
    slices = horn.curvature_slices(0.0)
    rng = np.random.default_rng(5)
    z = rng.uniform(*horn.v_range, 5000)
    grade = 1.75 * math.sqrt(1 + 1.75**2) / 0.7  # slices are equal steps of asinh(grade z)
    edges = np.linspace(*np.arcsinh(grade * np.array(horn.v_range)), len(slices.reach) + 1)
    k = np.searchsorted(edges, np.arcsinh(grade * z)) - 1

    def curvatures(z, step=1e-3):
        samples = [0.7 * np.sqrt(1 + ((z + i * step) / 0.4) ** 2) for i in range(-2, 3)]
        a, b, r, c, d = samples
        slope = (a - 8 * b + 8 * c - d) / (12 * step)
        second = (-a + 16 * b - 30 * r + 16 * c - d) / (12 * step**2)
        length = np.sqrt(1 + slope**2)
        return -second / length**3, 1 / (r * length), length

    meridian, parallel, length = curvatures(z)
    assert (slices.meridian_low[k] <= meridian + 1e-6).all()
    assert (meridian <= slices.meridian_high[k] + 1e-6).all()
    assert (slices.parallel_low[k] <= parallel + 1e-6).all()
    assert (parallel <= slices.parallel_high[k] + 1e-6).all()
    ahead, behind = curvatures(z + 1e-3), curvatures(z - 1e-3)
    for i, slope in ((0, slices.meridian_slope), (1, slices.parallel_slope)):
        found = np.abs(ahead[i] - behind[i]) / 2e-3 / length
        assert (found <= slope[k] * 1.001 + 1e-4).all()
        assert (found >= slope[k] * 0.95 - 0.06 * slope.max()).all()


def test_cubic_bound_is_at_least_the_sampled_maximum_for_random_tensors():
    rng = np.random.default_rng(11)
    direction = rng.normal(size=(40_000, 3))
    a, b, c = (direction / np.linalg.norm(direction, axis=1)[:, None]).T
    for _ in range(200):
        k1, k2, p, q = rng.normal(size=4) * 10.0 ** rng.uniform(-2, 1, 4)
        slices = CurvatureSlices(*(np.array([x]) for x in (k1, k1, k2, k2, abs(p), abs(q), np.inf)))
        cubic = p * a**3 + 3 * q * a * b**2 - 3 * c * (k1**2 * a**2 + k2**2 * b**2)
        bound = normal_bounds(slices, 0.0, 0.0)
        assert np.abs(cubic).max() <= bound.second_derivative
        assert bound.curvature == pytest.approx(max(abs(k1), abs(k2)))


def test_more_slack_never_tightens_a_bound(patch):
    for height in (-0.05, 0.0, 0.05):
        ladder = [patch.bounds(height, slack) for slack in (0.0, 0.001, 0.01, 0.02)]
        curvatures = [bounds.curvature for bounds in ladder]
        seconds = [bounds.second_derivative for bounds in ladder]
        assert curvatures == sorted(curvatures)
        assert seconds == sorted(seconds)


@pytest.mark.parametrize("height", [-0.5, 0.7])
def test_slopes_scale_with_the_parallel_surface(height):
    """With slopes that outweigh the curvatures, they alone count, at that height."""
    k1, k2, steep = -0.8, 0.5, 1e9
    scale1, scale2 = 1 + k1 * height, 1 + k2 * height
    for p, q, expected in [
        (steep, 0.0, steep / scale1**3),
        (0.0, steep, 2 / math.sqrt(3) * steep / (scale2**2 * scale1)),
    ]:
        slices = CurvatureSlices(*(np.array([x]) for x in (k1, k1, k2, k2, p, q, np.inf)))
        assert normal_bounds(slices, height, 0.0).second_derivative == pytest.approx(
            expected, rel=1e-8
        )
