"""Tiles of random surfaces of every kind: whole cells, halves, and what is said all over them."""

import numpy as np
import pytest
from random_surfaces import KINDS, random_surface

from surfaces import plane, poses, sphere
from surfaces.cell_tiles import cell_tiles
from surfaces.places import Places

SLACK = 1e-9  # m, beside coordinates of metres


def cells_of(surface, rng):
    """Some cells of any surface."""
    if surface.kind == "mesh":
        return surface.cells(count=int(rng.integers(1, 9)))
    if surface.kind == "piecewise":
        return surface.cells([tuple(rng.integers(1, 4, 2).tolist()) for _ in surface.pieces])
    return surface.cells(*rng.integers(1, 4, 2).tolist())


def shares_within(corners, rng, count):
    """(count, c) random shares of the corners, as the places of a tile have them."""
    if corners == 3:
        return rng.dirichlet(np.full(3, 0.5), count)
    s, t = rng.beta(0.5, 0.5, (2, count))
    return np.stack([(1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t], axis=1)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_said_of_a_tile_holds_all_over_it(kind):
    known = 0
    for seed in range(3):
        rng = np.random.default_rng([seed, *map(ord, kind)])
        surface = random_surface(kind, rng)
        cells = cells_of(surface, rng)
        cut = cell_tiles(cells, float(rng.normal() * np.sqrt(cells.areas.mean())))
        tiles = cut.of_cells(np.arange(len(cells)))
        total = cut.areas(tiles).sum()
        assert total == pytest.approx(cells.areas.sum(), rel=1e-6)
        for _ in range(int(rng.integers(0, 7))):
            halves = cut.halves(tiles)
            both = cut.areas(halves).reshape(-1, 2).sum(axis=1)
            np.testing.assert_allclose(both, cut.areas(tiles), rtol=1e-6, atol=1e-9 * total)
            tiles = halves.of(rng.permutation(len(halves.cell))[:60])
        bounds = cut.bounds(tiles)
        scale = 1.0 + np.abs(bounds.corners[:, :, 0]).max()
        for _ in range(6):
            shares = shares_within(tiles.corners.shape[1], rng, len(tiles.cell))
            x = np.einsum("kc,kci->ki", shares, tiles.corners)
            points, normals = cut.offset.at(Places(tiles.chart, x))
            mixed = np.einsum("kc,kcpi->kpi", shares, bounds.corners[:, : shares.shape[1]])
            off = np.linalg.norm(np.stack([points, normals], axis=1) - mixed, axis=2)
            assert (off <= bounds.radii + SLACK * scale).all(), (seed, surface)
            known += int(np.isfinite(bounds.radii).all(axis=1).sum())
    assert known > 0


def test_halves_shrink_the_bounds_to_a_quarter():
    cut = cell_tiles(sphere(1.0, (10, 90), (0, 90)).cells(2, 2), -0.1)
    tiles = cut.of_cells(np.arange(4))
    before = cut.bounds(tiles).radii.max(axis=0)
    for _ in range(4):
        tiles = cut.halves(tiles)
    after = cut.bounds(tiles).radii.max(axis=0)
    assert (after < before / 12.0).all()


@pytest.mark.parametrize(("azimuth", "crossed"), [((0, 360), True), ((0, 359), False)])
def test_a_line_takes_the_shorter_way_round(azimuth, crossed):
    cut = cell_tiles(sphere(1.0, (80, 100), azimuth).cells(1, 4), 0.0)
    ends = cut.centres(np.array([0, 3]))
    lines = cut.lines(ends.of(slice(0, 1)), ends.of(slice(1, 2)), np.array([8]))
    points = cut.offset.at(lines.places)[0]
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert length == pytest.approx(np.pi / 2 if crossed else 1.5 * np.pi * 359 / 360, rel=0.02)
    np.testing.assert_allclose(points[[0, -1]], cut.offset.at(ends)[0], atol=1e-12)


def test_lines_over_the_faces_of_a_mesh_stay_on_them():
    rng = np.random.default_rng(3)
    cells = random_surface("mesh", rng).cells(count=4)
    cut = cell_tiles(cells, 0.01)
    indptr, touching = cut.touching
    face = np.flatnonzero(np.diff(indptr))[:20]
    other = touching[indptr[face]]
    tiles = cut.of_cells(np.arange(4))
    row = np.argsort(tiles.chart)
    ends = [tiles.of(row[chart]).middles for chart in (face, other)]
    lines = cut.lines(*ends, np.full(len(face), 3))
    x = lines.places.x
    assert (x >= -1e-12).all()
    assert (x.sum(axis=1) <= 1.0 + 1e-12).all()
    for k in range(len(face)):
        charts = lines.places.chart[lines.first[k] : lines.first[k + 1]]
        assert charts.tolist() == [face[k]] * 4 + [other[k]] * 3


def test_poses_have_no_tiles():
    cells = poses([[0.4, 0, 0], [0.5, 0, 0]], [[0, 0, 1], [0, 0, 1]])
    assert cell_tiles(cells, 0.0) is None
    assert cell_tiles(plane((0, 1), (0, 1)).cells(1, 1), 0.0) is not None
