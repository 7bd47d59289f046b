"""Paths of places: what is said along them holds at dense samples, for every kind of surface."""

from __future__ import annotations

import numpy as np
import pytest

from surfaces import (
    bspline,
    cone,
    cylinder,
    ellipsoid,
    hyperboloid,
    mesh,
    piecewise,
    plane,
    revolution,
    sphere,
    torus,
)
from surfaces.meshes import TriangleMesh
from surfaces.places import Places, offset_surface

DENSE = np.linspace(0.0, 1.0, 33)


def waves(rows, columns, depth, seed):
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 0.8, columns), indexing="ij")
    return np.stack([x, y, rng.uniform(-depth, depth, x.shape)], axis=-1)


def arc():
    """A quarter of a cylinder as NURBS: quadratic, with a knot of full multiplicity."""
    w = np.sqrt(0.5)
    ring = [(1, 0, 1.0), (1, 1, w), (0, 1, 1.0), (-1, 1, w), (-1, 0, 1.0)]
    points = [[(x, y, z) for z in (0.0, 0.3, 0.6)] for x, y, _ in ring]
    weights = [[w] * 3 for _, _, w in ring]
    return bspline(points, (2, 2), ([0, 0, 0, 0.5, 0.5, 1, 1, 1], [0, 0, 0, 1, 1, 1]), weights)


def ridge(count, turn_deg):
    """Two flat strips of squares that meet at an angle."""
    x = np.linspace(-0.5, 0.5, 2 * count + 1)
    y = np.linspace(0.0, 0.5, count + 1)
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
    tilt = np.radians(turn_deg / 2)
    points = np.stack(
        [grid[..., 0] * np.cos(tilt), grid[..., 1], -np.abs(grid[..., 0]) * np.sin(tilt)], axis=-1
    )
    return _squares(points)


def bowl(count):
    x = np.linspace(-0.4, 0.4, count)
    grid = np.stack(np.meshgrid(x, x, indexing="ij"), axis=-1)
    z = 0.6 * (grid**2).sum(axis=-1) + 0.1 * grid[..., 0] * grid[..., 1]
    return _squares(np.concatenate([grid, z[..., None]], axis=-1))


def _squares(points):
    rows, columns = points.shape[:2]
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    right, up = corner + columns, corner + 1
    faces = np.concatenate(
        [np.column_stack([corner, right, right + 1]), np.column_stack([corner, right + 1, up])]
    )
    return mesh(TriangleMesh(points.reshape(-1, 3), faces))


def box_with_lid():
    """Two planes and a quarter of a cylinder between them, joined smoothly; and a sharp flap."""
    floor = plane((0.0, 1.0), (0.0, 1.0))
    flap = plane((0.0, 1.0), (0.0, 1.0), position=(0, 1, 0), rpy_deg=(50, 0, 0))
    return piecewise([floor, flap])


SURFACES = {
    "plane": lambda: plane((0.0, 1.0), (0.0, 1.0)),
    "sphere": lambda: sphere(1.2, (0, 180), (0, 360), position=(1, 2, 3), rpy_deg=(10, 20, 30)),
    "cylinder": lambda: cylinder(0.7, (0, 360), (0.0, 1.0)),
    "hyperboloid": lambda: hyperboloid(0.5, 0.2, (0, 360), (-0.6, 0.8)),
    "cone": lambda: cone(0.2, 1.5, (0, 360), (-0.12, 0.5)),
    "torus": lambda: torus(0.5, 0.2, (0, 360), (0, 360)),
    "ellipsoid": lambda: ellipsoid((1.0, 0.4, 0.6), (0, 180), (0, 360)),
    "vase": lambda: revolution(
        [(0.3, 0.0), (0.5, 0.2), (0.35, 0.5), (0.4, 0.8), (0.2, 1.0)], (0, 360)
    ),
    "egg": lambda: revolution(
        [(0.0, -0.5), (0.3, -0.3), (0.35, 0.1), (0.2, 0.4), (0.0, 0.5)], (0, 360)
    ),
    "cubic": lambda: bspline(waves(6, 7, 0.08, 1)),
    "quadratic": lambda: bspline(waves(5, 6, 0.05, 2), (2, 2)),
    "weighted": lambda: bspline(
        waves(6, 6, 0.05, 3), (3, 3),
        weights=np.random.default_rng(3).uniform(0.5, 2.0, (6, 6)).tolist(),
    ),
    "arc": arc,
    "bowl": lambda: bowl(14).cells(count=30).surface,
    "ridge": lambda: ridge(4, 70).cells(count=12).surface,
    "folded": box_with_lid,
}  # fmt: skip
MESHES = ("bowl", "ridge")


@pytest.fixture(scope="module", params=sorted(SURFACES))
def named(request):
    return request.param, SURFACES[request.param]()


def random_places(surface, count, rng):
    """Pairs of places near to each other, at many scales."""
    reach = 10.0 ** rng.uniform(-5, -0.7, (count, 1))
    if surface.kind == "mesh":
        face = rng.integers(0, len(surface.mesh.faces), count)
        start, end = (rng.dirichlet((0.5, 0.5, 0.5), count)[:, 1:] for _ in range(2))
        faces, edges = surface.mesh.faces, surface.mesh.edges.faces
        other = face.copy()
        across = rng.integers(0, len(edges), count // 2)
        face[: count // 2], other[: count // 2] = edges[across].T
        some = slice(count // 2, 3 * count // 4)  # faces that may share a vertex only
        vertex = faces[face[some], 0]
        for k, v in zip(range(some.start, some.stop), vertex, strict=True):
            other[k] = rng.choice(np.flatnonzero((faces == v).any(axis=1)))
        return Places(face, start), Places(other, end)
    patches = surface.placed if surface.kind == "piecewise" else (surface,)
    chart = rng.integers(0, len(patches), count)
    low, high = (
        np.array([[patches[k].u_range[e], patches[k].v_range[e]] for k in chart]) for e in (0, 1)
    )
    start = low + rng.uniform(0, 1, (count, 2)) * (high - low)
    if surface.kind == "piecewise":
        return Places(chart, start), Places(chart[::-1].copy(), start[::-1].copy())
    start[: count // 8, 0] = low[0, 0] + 0.02 * rng.uniform(0, 1, count // 8)  # at a pole
    end = start + reach * rng.uniform(-1, 1, (count, 2)) * (high - low)
    half = slice(0, count // 16)
    end[half, 1] = low[0, 1] + rng.uniform(0, 1, count // 16) * (high - low)[0, 1]
    for axis, period in enumerate(surface.periods):
        if period:
            end[:, axis] = low[:, axis] + np.mod(end[:, axis] - low[:, axis], period)
    return Places(chart, start), Places(chart, np.clip(end, low, high))


def sag(values):
    """How far curves (k, dense, 3) are off the straight lines between their ends, over the weight
    s (1 - s) / 2."""
    s = DENSE[1:-1, None]
    line = (1.0 - s) * values[:, :1] + s * values[:, -1:]
    off = np.linalg.norm(values[:, 1:-1] - line, axis=2)
    return (off / (0.5 * s * (1.0 - s))[:, 0]).max(axis=1)


def lines(start, end):
    """(k, dense, 2)"""
    return start[:, None] + DENSE[:, None] * (end - start)[:, None]


def bounded(offset, places, bounds):
    """Places along straight lines (k, dense) do not bend more than they may; the ratios."""
    count = places.x.shape[0]
    flat = Places(np.repeat(places.chart, len(DENSE)), places.x.reshape(-1, 2))
    point, normal = (part.reshape(count, len(DENSE), 3) for part in offset.at(flat))
    known = np.isfinite(bounds).all(axis=1)
    for values, most in ((point, bounds[:, 0]), (normal, bounds[:, 1])):
        assert (sag(values[known]) <= most[known] + 2e-10).all()
    return known, sag(point), sag(normal)


@pytest.mark.parametrize("height", [0.0, -0.05])
def test_straight_paths_bend_no_more_than_is_said(named, height):
    """Points and normals at dense samples of straight lines in the parameters."""
    name, surface = named
    rng = np.random.default_rng(2)
    start, end = random_places(surface, 300, rng)
    offset = offset_surface(surface, height)
    if surface.kind == "mesh":
        most = offset._derivative_bounds(start.chart, start.x, end.x)
        known, _, _ = bounded(offset, Places(start.chart, lines(start.x, end.x)), most)
        assert known.mean() > 0.9 or name == "ridge"
        return
    if surface.kind == "piecewise":
        return
    if surface.kind == "bspline":  # within one part without kinks, as `paths` cuts them
        for axis, at in enumerate(offset._kinks):
            cut = np.unique([*at, surface.net.low[axis], surface.net.high[axis]])
            part = np.clip(np.searchsorted(cut, start.x[:, axis]) - 1, 0, len(cut) - 2)
            end.x[:, axis] = np.clip(
                end.x[:, axis], cut[part] + 1e-12, np.nextafter(cut[part + 1], -9)
            )
    most = offset._derivative_bounds(start.x, end.x)
    known, points, _ = bounded(offset, Places(start.chart, lines(start.x, end.x)), most)
    short = np.linalg.norm(end.x - start.x, axis=1) < (0.002 if name == "weighted" else 0.02)
    assert known[short].mean() > 0.95
    if name != "plane":  # and the bounds are of the right order: not far above what there is
        some = short & known & (points > 1e-8)
        # Control points say little about the third derivatives of a rational spline.
        assert np.median(most[some, 0] / points[some]) < (5e3 if name == "weighted" else 20.0)


@pytest.mark.parametrize("height", [0.0, -0.05])
def test_paths_begin_and_end_where_they_should(named, height):
    _, surface = named
    offset = offset_surface(surface, height)
    start, end = random_places(surface, 200, np.random.default_rng(1))
    path = offset.paths(start, end)
    for k, places in ((0, start), (3, end)):
        points, normals = offset.at(places)
        np.testing.assert_allclose(path.points[:, k], points, atol=1e-12)
        np.testing.assert_allclose(path.normals[:, k], normals, atol=1e-12)
    assert (np.diff(path.share, axis=1) >= 0.0).all()
    assert (path.share[:, 0] == 0.0).all()
    assert (path.share[:, 3] == 1.0).all()
    for k in range(4):
        np.testing.assert_allclose(offset.at(path.place(k))[0], path.points[:, k], atol=1e-12)
    jumps = np.linalg.norm(path.points[:, 2] - path.points[:, 1], axis=1)
    known = np.isfinite(path.derivative_bounds).all(axis=(1, 2)) & (path.share[:, 1] > 0.0)
    if height == 0.0:  # where a path changes sides, it does so at one place
        assert (jumps[known] <= 2e-4).all()
    if surface.kind in ("mesh", "piecewise"):
        assert known.any()


def test_paths_over_a_pole_stay_on_their_piece():
    """What is known of their places, as how the u direction turns, is that of the right piece."""
    ball = sphere(1.0, (0, 80), (0, 360), position=(0.0, 0.0, 2.0))
    surface = piecewise([plane((0.0, 0.3), (0.0, 0.3)), ball])
    offset = offset_surface(surface, 0.05)
    start = Places(np.array([1]), np.array([[0.02, 0.1]]))
    end = Places(np.array([1]), np.array([[0.02, 3.1]]))
    path = offset.paths(start, end)
    assert 0.0 < path.share[0, 1] < 1.0
    np.testing.assert_array_equal(path.chart, [[1, 1, 1, 1]])
    for k in range(4):
        np.testing.assert_allclose(offset.at(path.place(k))[0], path.points[:, k], atol=1e-12)
    assert (offset.tangent_slopes(path.place(0), path.place(1)) > 0.01).all()


def test_nearest_places_are_no_further_than_samples(named):
    """No place of a dense sample is nearer to a point beside the offset surface."""
    _, surface = named
    rng = np.random.default_rng(3)
    height = 0.02
    offset = offset_surface(surface, height)
    at, _ = random_places(surface, 150, rng)
    point, normal = offset.at(at)
    point = point + 1e-3 * rng.normal(size=point.shape)
    found = offset.nearest(point, point - height * normal, 1e-3)
    away = np.linalg.norm(offset.at(found)[0] - point, axis=1)
    before = np.linalg.norm(offset.at(at)[0] - point, axis=1)
    slack = 1e-4 if surface.kind == "mesh" else 1e-9
    assert (away <= before + slack).mean() > 0.97, np.sort(away - before)[-10:]


def test_places_that_are_none(named):
    """NaN in, NaN out."""
    _, surface = named
    offset = offset_surface(surface, 0.01)
    points = np.full((2, 3), np.nan)
    places = offset.nearest(points, points, 1e-3)
    assert np.isnan(offset.at(places)[0]).all()
    path = offset.paths(places, places)
    assert not (np.isfinite(path.derivative_bounds).all() and np.isfinite(path.points).all())
