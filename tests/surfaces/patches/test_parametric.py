"""Every kind of surface under the same tests; each predicate comes from geometry."""

import math
import pickle

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from surfaces import Surface, SurfaceError, cylinder, hyperboloid, plane, sphere


def tangents(surface, u, v, step=1e-6):
    du = (surface.point(u + step, v) - surface.point(u - step, v)) / (2 * step)
    dv = (surface.point(u, v + step) - surface.point(u, v - step)) / (2 * step)
    return du, dv


def local(surface, points):
    return (points - surface.position) @ surface.rotation


def test_points_satisfy_the_implicit_equation(patch, samples):
    x, y, z = local(patch, samples.closest_point).T
    if patch.kind == "sphere":
        residual = np.sqrt(x**2 + y**2 + z**2) - patch.radius
    elif patch.kind == "cylinder":
        residual = np.sqrt(x**2 + y**2) - patch.radius
    elif patch.kind == "hyperboloid":
        residual = np.sqrt(x**2 + y**2) - patch.waist * np.sqrt(1 + (z / patch.flare) ** 2)
    else:
        residual = z
    assert np.abs(residual).max() < 2e-15 * (1 + np.abs(samples.closest_point).max())


def test_parameters_mean_what_the_case_file_says(patch, samples):
    x, y, z = local(patch, samples.closest_point).T
    if patch.kind == "plane":
        expected = [x - samples.u, y - samples.v]
    else:
        angle = samples.v if patch.kind == "sphere" else samples.u
        turned = np.hypot(x, y) * np.array([np.cos(angle), np.sin(angle)]) - [x, y]
        other = (
            np.arctan2(np.hypot(x, y), z) - samples.u if patch.kind == "sphere" else z - samples.v
        )
        expected = [*turned, other]
    assert np.abs(expected).max() < 1e-13


def test_normals_are_unit_outward_and_normal_to_finite_differences(patch, samples):
    du, dv = tangents(patch, samples.u, samples.v)
    n = samples.normal
    assert np.abs(np.linalg.norm(n, axis=1) - 1).max() < 1e-14
    for tangent in (du, dv):
        assert np.abs(np.einsum("ij,ij->i", tangent, n)).max() < 1e-8
    if patch.kind == "plane":
        assert n == pytest.approx(np.broadcast_to(patch.rotation[:, 2], n.shape), abs=1e-15)
    else:
        away = local(patch, samples.closest_point) * [1, 1, patch.kind == "sphere"]
        assert np.einsum("ij,ij->i", away, n @ patch.rotation).min() > 0


def test_closest_recovers_parameters_height_and_normal(patch, samples):
    closest_point = patch.closest(samples.point)
    assert closest_point.u == pytest.approx(samples.u, abs=2e-13)
    assert np.abs(closest_point.height - samples.height).max() < 5e-15 * (
        1 + np.abs(samples.point).max()
    )
    assert closest_point.normal == pytest.approx(samples.normal, abs=2e-13)
    assert closest_point.inside.all()
    # The azimuth is worth as much as the distance from the polar axis.
    lever = np.sin(samples.u) if patch.kind == "sphere" else 1.0
    assert np.abs((closest_point.v - samples.v) * lever).max() < 2e-13


def test_any_point_is_closest_point_plus_height_along_normal_and_no_patch_point_is_nearer(
    patch, samples
):
    rng = np.random.default_rng(1)
    size = np.ptp(samples.closest_point, axis=0).max()
    points = np.concatenate([
        samples.closest_point[:300] + rng.normal(scale=size, size=(300, 3)),
        patch.position + np.linspace(-2 * size, 2 * size, 41)[:, None] * patch.rotation[:, 2],
    ])  # fmt: skip
    closest_point = patch.closest(points)
    rebuilt = (
        patch.point(closest_point.u, closest_point.v)
        + closest_point.height[:, None] * closest_point.normal
    )
    assert rebuilt == pytest.approx(points, abs=1e-13 * (1 + np.abs(points).max()))
    assert closest_point.normal == pytest.approx(
        patch.normal(closest_point.u, closest_point.v), abs=1e-13
    )
    distance = np.linalg.norm(points[:, None] - samples.closest_point[None], axis=2).min(axis=1)
    assert (np.abs(closest_point.height) <= distance + 1e-12).all()


@pytest.mark.parametrize("kind", [cylinder, sphere, hyperboloid])
def test_points_without_a_unique_closest_point_get_one_on_the_patch(kind):
    made = {
        cylinder: lambda: cylinder(0.4, (100, 200), (1, 2)),
        sphere: lambda: sphere(0.4, (30, 60), (100, 200)),
        hyperboloid: lambda: hyperboloid(0.4, 1.0, (100, 200), (0.3, 0.8)),
    }[kind]()
    point = [0, 0, 0] if kind is sphere else [0, 0, 1.5 if kind is cylinder else 0.5]
    closest_point = made.closest(point)
    assert closest_point.inside
    assert made.point(
        closest_point.u, closest_point.v
    ) + closest_point.height * closest_point.normal == pytest.approx(np.array(point), abs=1e-15)


def test_a_closest_point_at_the_pole_lies_on_an_open_patch_that_reaches_it():
    quarter = sphere(0.7, (0, 90), (100, 190), position=(0.1, 0.2, 0.3), rpy_deg=(10, 20, 30))
    over = quarter.point(0.0, np.linspace(0, 6, 20)) + 0.2 * quarter.normal(0.0, 0.0)
    closest_point = quarter.closest(over)
    assert closest_point.inside.all()
    assert np.abs(closest_point.u).max() < 1e-15


def test_hyperboloid_closest_point_is_exact_far_off_and_near_the_focal_curve():
    horn = hyperboloid(0.5, 0.4, (0, 360), (-5, 5))
    rng = np.random.default_rng(3)
    z = np.concatenate([rng.uniform(-5, 5, 3000), [0.0, 1e-300, -1e-12]])
    rho = np.concatenate([10.0 ** rng.uniform(-14, 2, 3000), [0.0, 0.0, 0.3]])
    closest_point = horn.closest(np.column_stack([rho, np.zeros_like(z), z]))
    assert np.isfinite(closest_point.height).all()
    tangent = np.column_stack(
        [closest_point.normal[:, 2], np.zeros_like(z), -closest_point.normal[:, 0]]
    )
    away = np.column_stack([rho, np.zeros_like(z), z]) - horn.point(
        closest_point.u, closest_point.v
    )
    along = np.abs(np.einsum("ij,ij->i", away, tangent))
    assert (along < 1e-14 * (1 + rho + np.abs(z))).all()
    assert (closest_point.v * z >= 0).all()


def test_inside_marks_exactly_the_closest_points_on_the_patch():
    horn = hyperboloid(0.5, 0.5, angle_deg=(120, 240), height=(0.1, 0.5))
    u, v = np.meshgrid(np.radians(np.arange(0.5, 360)), np.linspace(-0.5, 1, 301), indexing="ij")
    closest_point = horn.closest(horn.point(u, v) - 0.01 * horn.normal(u, v))
    expected = (u > math.radians(120)) & (u < math.radians(240))
    expected &= (v > 0.1 - 1e-12) & (v < 0.5 + 1e-12)
    assert (closest_point.inside == expected).all()


def test_area_is_the_integral_of_the_tangents_cross_product(patch):
    nodes, weights = np.polynomial.legendre.leggauss(60)
    (u0, u1), (v0, v1) = patch.u_range, patch.v_range
    u = u0 + (u1 - u0) * (nodes[:, None] + 1) / 2
    v = v0 + (v1 - v0) * (nodes[None, :] + 1) / 2
    du, dv = tangents(patch, *np.broadcast_arrays(u, v))
    density = np.linalg.norm(np.cross(du, dv), axis=-1)
    integral = weights @ density @ weights * (u1 - u0) * (v1 - v0) / 4
    assert patch.area(u0, u1, v0, v1) == pytest.approx(integral, rel=1e-8)


@pytest.mark.parametrize(
    ("surface", "area"),
    [
        (sphere(0.3, (0, 180), (0, 360)), 4 * math.pi * 0.09),
        (sphere(2.0, (0, 60), (0, 360)), 2 * math.pi * 2.0 * 1.0),  # cap of height 1
        (cylinder(0.5, (0, 360), (1, 4)), 2 * math.pi * 0.5 * 3),
        (plane((0, 0.6), (0, 0.4)), 0.24),
        # s = 1: 2 pi * (g + asinh(sqrt(2)) / sqrt(2)) / 2 with g = sqrt(3)
        (
            hyperboloid(1.0, 1.0, (0, 360), (0, 1)),
            math.pi * (math.sqrt(3) + math.asinh(math.sqrt(2)) / math.sqrt(2)),
        ),
        (
            hyperboloid(0.5, 5e5, (0, 360), (0, 2)),
            2 * math.pi * (1 + 2 / 3 * 4e-12),
        ),  # nearly a cylinder
    ],
)
def test_area_of_known_patches(surface, area):
    assert surface.area(*surface.u_range, *surface.v_range) == pytest.approx(area, rel=1e-14)


def test_a_rigid_motion_moves_everything_and_changes_no_number(patch, samples, motion):
    rotation, translation = motion
    moved = patch.moved(rotation, translation)
    assert moved.point(samples.u, samples.v) == pytest.approx(
        samples.closest_point @ rotation.T + translation, abs=1e-14
    )
    assert moved.normal(samples.u, samples.v) == pytest.approx(
        samples.normal @ rotation.T, abs=1e-14
    )
    before = patch.closest(samples.point)
    after = moved.closest(samples.point @ rotation.T + translation)
    assert after.height == pytest.approx(before.height, abs=1e-13)
    assert after.u == pytest.approx(before.u, abs=1e-12)
    assert (after.inside == before.inside).all()
    assert (moved.side, moved.kind) == (patch.side, patch.kind)
    assert moved.bounds(0.01, 0.001) == patch.bounds(0.01, 0.001)


@pytest.mark.parametrize("rpy", [(0, 0, 0), (90, 0, 0), (10, -80, 200), (-170, 90, 33)])
def test_rpy_turns_about_fixed_axes_in_the_order_x_y_z(rpy):
    made = plane((0, 1), (0, 1), rpy_deg=rpy)
    expected = Rotation.from_euler("xyz", rpy, degrees=True).as_matrix()  # extrinsic
    assert made.rotation == pytest.approx(expected, abs=1e-15)


def test_side_sign_leads_to_the_working_side():
    ball = sphere(1.0, (10, 90), (10, 180), side="inside")
    assert ball.side_sign == -1.0
    assert np.linalg.norm(ball.point(1, 1) + ball.side_sign * 0.1 * ball.normal(1, 1)) < 0.91
    assert sphere(1.0, (10, 90), (10, 180), side="outside").side_sign == 1.0


def test_full_turns_are_closed_and_nothing_else_is(patch):
    turn = 2 * math.pi - 1e-9
    wide_u, wide_v = (high - low >= turn for low, high in (patch.u_range, patch.v_range))
    assert patch.u_closed == (patch.kind in ("cylinder", "hyperboloid") and wide_u)
    assert patch.v_closed == (patch.kind == "sphere" and wide_v)
    assert patch.poles == (
        patch.v_closed and patch.u_range[0] == 0,
        patch.v_closed and abs(patch.u_range[1] - math.pi) < 1e-12,
    )


def test_a_plane_seven_metres_wide_is_no_full_turn():
    assert not plane((0, 7), (0, 2 * math.pi)).u_closed
    assert not plane((0, 7), (0, 2 * math.pi)).v_closed


def test_surfaces_pickle_and_stay_protected(patch, samples):
    copy = pickle.loads(pickle.dumps(patch))
    assert type(copy) is type(patch)
    assert (copy.point(samples.u, samples.v) == samples.closest_point).all()
    assert (copy.side, copy.u_range, copy.v_range) == (patch.side, patch.u_range, patch.v_range)
    for surface in (patch, copy):
        with pytest.raises(ValueError, match="read-only"):
            surface.position[0] = 1.0
        with pytest.raises(AttributeError):
            surface.side = "outside"


def test_shapes_broadcast(patch):
    u = np.linspace(*patch.u_range, 5)[:, None]
    v = np.linspace(*patch.v_range, 4)
    points = patch.point(u, v)
    assert points.shape == patch.normal(u, v).shape == (5, 4, 3)
    closest_point = patch.closest(points)
    assert (
        closest_point.u.shape == closest_point.height.shape == closest_point.inside.shape == (5, 4)
    )
    assert closest_point.normal.shape == (5, 4, 3)
    assert patch.closest(np.empty((0, 3))).u.shape == (0,)
    assert patch.closest(points[2, 1]).height.shape == ()
    with pytest.raises(ValueError, match=r"\(\.\.\., 3\)"):
        patch.closest([1.0, 2.0])


GOOD = {
    sphere: {"radius": 1, "polar_deg": (10, 90), "azimuth_deg": (10, 180)},
    cylinder: {"radius": 1, "angle_deg": (10, 90), "height": (0, 1)},
    hyperboloid: {"waist": 1, "flare": 2, "angle_deg": (10, 90), "height": (0, 1)},
    plane: {"width": (0, 1), "length": (0, 1)},
}
NAN, INF = math.nan, math.inf


@pytest.mark.parametrize(
    ("make", "bad", "message"),
    [
        (sphere, {"radius": 0}, r"radius must be a finite number > 0 \(metres\), got 0"),
        (sphere, {"radius": -2.0}, "radius must be"),
        (sphere, {"radius": NAN}, "radius must be"),
        (sphere, {"radius": INF}, "radius must be"),
        (sphere, {"radius": "1"}, "radius must be"),
        (sphere, {"radius": True}, "radius must be"),
        (sphere, {"radius": 10**400}, "radius must be"),
        (sphere, {"polar_deg": (-1, 90)}, r"polar_deg must lie in 0 \.\. 180"),
        (sphere, {"polar_deg": (0, 181)}, r"polar_deg must lie in 0 \.\. 180"),
        (sphere, {"polar_deg": (90, 90)}, "polar_deg must be .* low < high"),
        (sphere, {"polar_deg": (90, 10)}, "polar_deg must be .* low < high"),
        (sphere, {"polar_deg": (0, NAN)}, "polar_deg must be .* finite"),
        (sphere, {"azimuth_deg": (0, 361)}, "azimuth_deg must span at most a full turn"),
        (sphere, {"azimuth_deg": (0,)}, "azimuth_deg must be a pair"),
        (sphere, {"azimuth_deg": "ab"}, "azimuth_deg must be a pair"),
        (sphere, {"azimuth_deg": 90}, "azimuth_deg must be a pair"),
        (sphere, {"azimuth_deg": (0, None)}, "azimuth_deg must be a pair"),
        (sphere, {"side": "top"}, "side must be 'inside' or 'outside', got 'top'"),
        (sphere, {"position": (0, 0)}, "position must be three finite numbers"),
        (sphere, {"position": (0, 0, INF)}, "position must be three finite numbers"),
        (sphere, {"rpy_deg": (0, NAN, 0)}, "rpy_deg must be three finite numbers"),
        (cylinder, {"radius": 0}, "cylinder: radius"),
        (cylinder, {"angle_deg": (-200, 200)}, "full turn of 360 degrees.*spans 400"),
        (cylinder, {"height": (1, 0)}, r"height must be .* low < high \(metres\)"),
        (hyperboloid, {"waist": 0}, "hyperboloid: waist"),
        (hyperboloid, {"flare": -1}, "flare must be"),
        (
            hyperboloid,
            {"flare": 1e9},
            r"flare must be within a factor of 1e\+06 of .*waist.*cylinder",
        ),
        (hyperboloid, {"waist": 1e9, "flare": 1e-9}, "flare must be within a factor"),
        (hyperboloid, {"angle_deg": (0, 0)}, "angle_deg must be"),
        (hyperboloid, {"height": (0, INF)}, "height must be"),
        (plane, {"width": (0, 0)}, "plane: width"),
        (plane, {"length": (1, 0)}, "length must be"),
    ],
)
def test_bad_numbers_are_refused_by_name(make, bad, message):
    assert isinstance(make(**GOOD[make]), Surface)
    with pytest.raises(SurfaceError, match=message):
        make(**{**GOOD[make], **bad})


def test_all_faults_are_reported_together():
    with pytest.raises(SurfaceError) as caught:
        sphere(-1, (90, 10), (0, 400), side="up", position=(0,), rpy_deg=(NAN, 0, 0))  # type: ignore[arg-type]
    for name in ("radius", "polar_deg", "azimuth_deg", "side", "position", "rpy_deg"):
        assert f"{name} must" in str(caught.value)
