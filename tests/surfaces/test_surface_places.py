"""Paths of places over every kind of surface, at every scale: what is said along them holds."""

import numpy as np
import pytest
from bounds import holds
from part_walks import pieces_of
from random_surfaces import random_surface
from samples import sampled, spread
from specimens import EGG, FACETED, SMOOTH, VASE, drawn, quarter_turn, turned

import coverable
from coverable import bspline, ellipsoid, hyperboloid, piecewise, plane, revolution, sphere, torus
from surfaces.places.offset_surfaces import offset_surface
from surfaces.places.places import Places, second_derivative_of_unit

DENSE = np.linspace(0.0, 1.0, 33)


def waves(rows, columns, depth, seed):
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 0.8, columns), indexing="ij")
    return np.stack([x, y, rng.uniform(-depth, depth, x.shape)], axis=-1)


def half_pipe():
    """As NURBS: quadratic, with a knot of full multiplicity."""
    turn, weights = quarter_turn()
    turn = np.concatenate([turn, turn[1:] @ [[0, 1], [-1, 0]]])
    points, weights = turned([(1, 0), (1, 0.6)], [1, 1], turn, np.r_[weights, weights[1:]])
    return bspline(points, (2, 1), ([0, 0, 0, 0.5, 0.5, 1, 1, 1], None), weights)


SURFACES = {
    "plane": SMOOTH["sheet"],
    "sphere": sphere(1.2, (0, 180), (0, 360), position=(1, 2, 3), rpy_deg=(10, 20, 30)),
    "cylinder": coverable.cylinder(0.7, (0, 360), (0.0, 1.0)),
    "hyperboloid": hyperboloid(0.5, 0.2, (0, 360), (-0.6, 0.8)),
    "cone": coverable.cone(0.2, 1.5, (0, 360), (-0.12, 0.5)),
    "torus": torus(0.5, 0.2, (0, 360), (0, 360)),
    "ellipsoid": ellipsoid((1.0, 0.4, 0.6), (0, 180), (0, 360)),
    "vase": SMOOTH["vase"],
    "egg": revolution(EGG, (0, 360)),
    # Not closed, so that paths may run nearly all around, and beside a pole.
    "open sphere": sphere(0.8, (0, 180), (0, 355)),
    "open ellipsoid": ellipsoid((1.0, 0.4, 0.6), (0, 180), (0, 355)),
    "open vase": revolution(VASE, (0, 355)),
    "open egg": revolution(EGG, (0, 355)),
    "open spout": revolution([(0.9, 0.0), (0.96, 0.02), (0.9, 0.05), (0.9, 0.12)], (0, 355)),
    "one span": bspline(waves(3, 3, 0.3, 4), (2, 2)),
    "cubic": bspline(waves(6, 7, 0.08, 1)),
    "quadratic": bspline(waves(5, 6, 0.05, 2), (2, 2)),
    "rational": bspline(
        waves(6, 6, 0.05, 3), weights=np.random.default_rng(3).uniform(0.5, 2.0, (6, 6))
    ),
    "half pipe": half_pipe(),
    "formula": SMOOTH["formula"],
    "poses": drawn(2, tangents=np.random.default_rng(4).normal(size=(25, 3))).surface,
    **FACETED,
}  # fmt: skip


BESIDE = [(name, height) for height in (0.0, -0.05) for name in SURFACES]
HALF = sampled(("named", "height"), spread(BESIDE, len(SURFACES) + 1), indirect=["named"])


@pytest.fixture(scope="module", params=SURFACES)
def named(request):
    return request.param, SURFACES[request.param]


def on_mesh(surface, count, rng):
    """Pairs on one face, on two with an edge in common, and with a vertex at least."""
    faces, edges = surface.mesh.faces, surface.mesh.edges.faces
    face = rng.integers(0, len(faces), count)
    start, end = (rng.dirichlet((0.5, 0.5, 0.5), count)[:, 1:] for _ in range(2))
    near = slice(3 * count // 4, 7 * count // 8)
    end[near] = start[near] + 0.05 * (end[near] - start[near])
    other, across = face.copy(), rng.integers(0, len(edges), count // 2)
    face[: count // 2], other[: count // 2] = edges[across].T
    for k in range(count // 2, 3 * count // 4):
        other[k] = rng.choice(np.flatnonzero((faces == faces[face[k], 0]).any(axis=1)))
    return Places(face, start), Places(other, end)


def pairs(surface, count, rng):
    """Pairs of places near to each other, at many scales."""
    if surface.kind == "mesh":
        return on_mesh(surface, count, rng)
    if surface.kind == "poses":  # on one curve or on two
        x, chart = rng.uniform(0, 1, (2, count, 2)) * [1, 0], rng.integers(0, 24, count)
        return Places(chart, x[0]), Places(np.minimum(chart + rng.integers(0, 2, count), 23), x[1])
    patches = [patch for patch, _ in pieces_of(surface)]
    chart = rng.integers(0, len(patches), count)
    low, high = _limits(patches, chart)
    start = low + rng.uniform(0, 1, (count, 2)) * (high - low)
    reach = 10.0 ** rng.uniform(-4, 0.0, (count, 1))
    end = start + reach * rng.uniform(-1, 1, (count, 2)) * (high - low)
    if surface.kind == "piecewise":  # half of them on two pieces
        half = count // 2
        end[:half] = np.clip(end, low, high)[half - 1 :: -1] if half else end
        other = chart.copy()
        other[:half] = chart[half - 1 :: -1]
        return Places(chart, start), Places(other, np.clip(end, *_limits(patches, other)))
    # At a pole, some around it; and in one coordinate alone, where bounds are reached.
    start[: count // 8, 0] = low[0, 0] + 0.02 * rng.uniform(0, 1, count // 8) * (high - low)[0, 0]
    end[: count // 8, 0] = start[: count // 8, 0] + reach[: count // 8, 0] * (high - low)[0, 0]
    half = slice(0, count // 16)
    end[half, 1] = low[0, 1] + rng.uniform(0, 1, count // 16) * (high - low)[0, 1]
    for axis, some in ((0, slice(count // 2, 5 * count // 8)), (1, slice(5 * count // 8, -20))):
        end[some, axis] = start[some, axis]
    for axis, period in enumerate(surface.periods):
        if period:
            end[:, axis] = low[:, axis] + np.mod(end[:, axis] - low[:, axis], period)
    return Places(chart, start), Places(chart, np.clip(end, low, high))


def _limits(patches, chart):
    return (
        np.array([[patches[k].u_range[e], patches[k].v_range[e]] for k in chart]) for e in (0, 1)
    )


def sagging(offset, one, other):
    """(k, 31, 2) how far points and normals over straight lines in the parameters sag."""
    x = one.x[:, None] + DENSE[:, None] * (other.x - one.x)[:, None]
    dense = Places(np.repeat(one.chart, len(DENSE)), x.reshape(-1, 2))
    found = []
    for values in offset.at(dense)[:2]:
        values = values.reshape(-1, len(DENSE), 3)
        line = values[:, :1] + DENSE[:, None] * (values[:, -1:] - values[:, :1])
        found.append(np.linalg.norm(values - line, axis=2)[:, 1:-1])
    return np.stack(found, axis=2)


@HALF
def test_paths_bend_no_more_than_is_said(named, height):
    name, surface = named
    start, end = pairs(surface, 240, np.random.default_rng(2))
    offset = offset_surface(surface, height)
    path = offset.paths(start, end)
    stated, found, some_known = [], [], np.zeros(len(start.chart), dtype=bool)
    for piece in (0, 2):
        one, other = path.place(piece), path.place(piece + 1)
        off = path.deviations[:, piece, :2]
        known = np.isfinite(off).all(axis=1) & (one.chart >= 0)
        known &= path.share[:, piece + 1] > path.share[:, piece]
        assert (one.chart == other.chart)[known].all()
        stated.append(np.repeat(off[known, None], len(DENSE) - 2, axis=1))
        found.append(sagging(offset, one.of(known), other.of(known)))
        some_known |= known
    stated, found = np.concatenate(stated), np.concatenate(found)
    if name == "poses":
        holds(stated[..., 1], found[..., 1], used=0.95, tiny=2e-10)
    curved = surface.kind not in ("plane", "mesh", "piecewise", "poses")
    for k in (0, 1):
        holds(stated[..., k], found[..., k], used=0.0, tiny=2e-10)
        # Beside the surface the heights count alike on both sides, though one bends less.
        if curved:
            large = stated[..., k] > 1e-5
            share = 0.9 if height == 0.0 or k else 0.5
            holds(stated[large, k], found[large, k], used=share, tiny=2e-10)
    # And what is short is bounded.
    step = np.linalg.norm(end.x - start.x, axis=1)
    short = (start.chart == end.chart) & (step < 0.02)
    assert some_known[short].mean() > 0.9 or name in ("ridge", "can")


def test_normals_along_creases_bend_as_each_term_says():
    """v is the sum of w_c (own_c + t (crease_c - own_c)), t from the weight on the crease."""
    surface, rng = FACETED["ridge"], np.random.default_rng(6)
    face = rng.choice(np.flatnonzero(surface.on_crease.sum(axis=1) == 2), 1000)
    on = surface.on_crease[face]
    ends = []
    for _ in range(2):
        w = rng.dirichlet((1, 1, 1), 1000) * np.where(on, 1.0, 0.03)
        ends.append(w / w.sum(axis=1, keepdims=True))
    level = [(w * on).sum(axis=1) for w in ends]
    own = surface.corner_normals[face]
    turn = surface.crease_normals[face] - own
    (o, p), (g, h) = ([np.einsum("kc,kci->ki", w, part) for w in ends] for part in (own, turn))
    rate = np.abs(level[1] - level[0]) / 0.1
    off, most = np.linalg.norm(h - g, axis=1), np.linalg.norm([g, h], axis=2).max(axis=0)
    slope = np.linalg.norm(p - o, axis=1) + rate * most + off
    share = np.maximum(0.5 * (level[0] + level[1]) - 0.9, 0.0) / 0.1
    middle = np.linalg.norm(0.5 * (o + p + share[:, None] * (g + h)), axis=1)
    least = middle - 0.5 * slope  # |d2/ds2 (g / |g|)| from |g|, |g'| and |g''|
    smooth = (2.0 * rate * off / least + 2.0 / np.sqrt(3.0) * (slope / least) ** 2) / 8.0
    # Over the border of the strip there is a kink: at most 2 M s (1 - s) off, M the slope.
    kinked, low = 0.5 * slope / least, np.minimum(*level)
    start, end = (Places(face, w[:, 1:]) for w in ends)
    found = offset_surface(surface, 0.0).paths(start, end).deviations[:, 2, 1]
    for some, expected in ((low >= 0.9, smooth), ((low < 0.9) & (share > 0.0), kinked)):
        known = some & (least > 0.0)
        assert known.sum() > 20
        np.testing.assert_allclose(found[known], expected[known], rtol=1e-7)
    assert np.isinf(second_derivative_of_unit(np.array([0.0, -1.0]), np.ones(2), np.ones(2))).all()


@HALF
def test_paths_begin_and_end_where_they_should_and_do_not_jump(named, height):
    _, surface = named
    offset = offset_surface(surface, height)
    start, end = pairs(surface, 200, np.random.default_rng(1))
    path = offset.paths(start, end)
    for k, places in ((0, start), (3, end)):
        points, normals, _ = offset.at(places)
        np.testing.assert_allclose(path.points[:, k], points, atol=1e-12)
        np.testing.assert_allclose(path.normals[:, k], normals, atol=1e-12)
    assert (np.diff(path.share, axis=1) >= 0.0).all()
    assert (path.share[:, 0] == 0.0).all()
    assert (path.share[:, 3] == 1.0).all()
    for k in range(4):
        np.testing.assert_allclose(offset.at(path.place(k))[0], path.points[:, k], atol=1e-12)
    known = path.known & (path.share[:, 1] > 0.0)
    if height == 0.0:  # where a path changes sides, it does so at one place
        jumps = np.linalg.norm(path.points[:, 2] - path.points[:, 1], axis=1)
        assert (jumps[known] <= 2e-4).all()
    assert known.any() or surface.kind not in ("mesh", "piecewise")
    # No path is the long way round a seam.
    if surface.kind not in ("mesh", "piecewise", "bspline", "poses"):
        for axis, period in enumerate(surface.periods):
            legs = np.abs(path.x[:, [1, 3], axis] - path.x[:, [0, 2], axis])
            assert not period or (legs <= 0.5 * period + 1e-9).all()


def test_nearest_places_are_no_further_than_samples(named):
    """No place of a sample is nearer to a point beside the offset surface."""
    _, surface = named
    rng = np.random.default_rng(3)
    height = 0.02 * (surface.side_sign if surface.kind == "piecewise" else 1.0)
    offset = offset_surface(surface, height)
    at, _ = pairs(surface, 150, rng)
    point, normal, _ = offset.at(at)
    point = point + 1e-3 * rng.normal(size=point.shape)
    found = offset.nearest(point, point - height * normal, 1e-3)
    away = np.linalg.norm(offset.at(found)[0] - point, axis=1)
    before = np.linalg.norm(offset.at(at)[0] - point, axis=1)
    slack = 1e-4 if surface.kind == "mesh" else 1e-9
    assert (away <= before + slack).mean() > 0.97


def test_a_second_guess_is_taken_where_it_is_nearer_and_only_there():
    """A thin plate: over its far side the closest point of the surface is on the near side."""
    plate = piecewise(
        [plane((0, 1), (0, 1)), plane((0, 1), (0, 1), position=(0, 1, 0.01), rpy_deg=(180, 0, 0))]
    )
    offset = offset_surface(plate, 0.02)  # they face each other: beyond the other one
    places = Places(np.array([0, 1]), np.array([[0.3, 0.4], [0.6, 0.2]]))
    points, normals, _ = offset.at(places)
    found = offset.nearest(points, points - 0.02 * normals, 1e-3)
    np.testing.assert_allclose(offset.at(found)[0], points, atol=1e-9)
    assert found.chart.tolist() == [0, 1]


def test_no_path_is_known_between_faces_and_pieces_that_are_apart():
    """Not over an edge or a vertex, nor over a seam, is there a place that belongs to both."""
    for name in ("bowl", "ridge", "apart"):
        surface = piecewise([plane((k, k + 0.5), (0, 1)) for k in (0, 2)], side="inside")
        surface = FACETED.get(name, surface)
        last = len(surface.mesh.faces) - 1 if name != "apart" else 1
        start, end = (Places(np.array([c]), np.array([[0.3, 0.3]])) for c in (0, last))
        if name == "apart":
            end.x[0, 0] = 2.2
        path = offset_surface(surface, 0.01).paths(start, end)
        assert not path.known.any(), name


def test_places_that_are_none(named):
    _, surface = named
    offset = offset_surface(surface, 0.01)
    points = np.full((2, 3), np.nan)
    places = offset.nearest(points, points, 1e-3)
    assert np.isnan(offset.at(places)[0]).all()
    along = offset.along(places)
    assert along is None if surface.kind != "poses" else np.isnan(along).all()
    path = offset.paths(places, places)
    assert not (path.known.all() and np.isfinite(path.points).all())


def test_paths_beside_a_pole_are_near_it():
    """Nearly straight over it, however far around."""
    offset = offset_surface(sphere(1.0, (0, 80), (0, 360)), 0.05)
    for beside in (1e-2, 1e-3, 1e-4):
        start, end = (Places(np.zeros(1, int), np.array([[beside, v]])) for v in (0.1, 3.1))
        assert offset.paths(start, end).deviations[0, 2, :2].max() < 5.0 * beside


@sampled("name", spread([n for n, s in SURFACES.items() if s.kind != "mesh"], 13))
def test_the_u_direction_turns_as_is_said(name):
    surface = SURFACES[name]
    start, end = pairs(surface, 240, np.random.default_rng(5))
    offset = offset_surface(surface, 0.03, directed=True)
    path = offset.paths(start, end)
    stated = np.concatenate([path.deviations[:, piece, 2] for piece in (0, 2)])
    legs = [[path.place(piece + k) for piece in (0, 2)] for k in (0, 1)]
    start, end = (Places.join(*leg) for leg in legs)
    x = start.x[:, None] + DENSE[:, None] * (end.x - start.x)[:, None]
    ways = offset.at(Places(np.repeat(start.chart, len(DENSE)), x.reshape(-1, 2)))[2]
    ways = ways.reshape(*x.shape[:2], 3)
    stated[np.isnan(ways).any(axis=(1, 2))] = np.inf  # round an edge there is none
    line = ways[:, :1] + DENSE[:, None] * (ways[:, -1:] - ways[:, :1])
    off = np.linalg.norm(np.where(np.isfinite(stated)[:, None, None], ways - line, 0.0), axis=2)
    known = np.isfinite(stated) & (stated > 1e-4)
    holds(stated[:, None], off, used=0.0, tiny=1e-7)
    if surface.kind != "plane" and name not in ("flap", "turned over"):
        holds(stated[known, None], off[known], used=0.9, tiny=1e-7)


def test_joined_pieces_have_those_of_each_and_a_mesh_has_none():
    pieces = [plane((0, 1), (0, 1)), plane((1, 2), (0, 1))]
    joined = piecewise(pieces, rpy_deg=(0, 0, 90)).cells((2, 3))
    np.testing.assert_allclose(joined.tangents, np.tile([0.0, 1.0, 0.0], (12, 1)), atol=1e-9)
    mesh = random_surface("mesh", np.random.default_rng(0))
    assert mesh.cells(5).tangents is None
    places = Places(np.zeros(2, dtype=np.int64), np.full((2, 2), 0.2))
    assert np.isinf(offset_surface(mesh, 0.0, True).paths(places, places).deviations[:, 2, 2]).all()
