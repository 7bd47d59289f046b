"""The fewest patches and stations: hundreds of small tables against brute force, and real sizes."""

from __future__ import annotations

from functools import reduce
from itertools import combinations
from operator import or_

import numpy as np
import pytest
from samples import sampled, seeds

from feasibility.division.connected_labels import count_of
from feasibility.division.partition import fewest_patches
from feasibility.placement.stations import fewest_stations


def random_table(seed):
    """Up to 5 components over up to 9 cells, and which of them touch."""
    rng = np.random.default_rng([5, seed])
    n, rows = int(rng.integers(1, 10)), int(rng.integers(1, 6))
    covers = rng.random((rows, n)) < rng.uniform(0.2, 0.9)
    pairs = np.array(list(combinations(range(n), 2)), dtype=np.int64).reshape(-1, 2)
    return covers, pairs[rng.random(len(pairs)) < rng.uniform(0.1, 0.7)]


def bits(cells):
    return sum(1 << int(c) for c in np.flatnonzero(cells))


def fewest_by_brute_force(covers):
    """Size of the smallest choice of rows that has all that any row has."""
    masks, everything = [bits(row) for row in covers], bits(covers.any(axis=0))
    for count in range(len(masks) + 1):
        for choice in combinations(masks, count):
            if reduce(or_, choice, 0) == everything:
                return count
    raise AssertionError("all rows together have everything")


def connected_by_brute_force(covers, pairs):
    """Fewest blocks of a set partition, each block connected and inside one row.

    Over all subsets: the block of the subset's first cell, and the best partition of the rest.
    """
    n = covers.shape[1]
    touching = [0] * n
    for i, j in pairs.tolist():
        touching[i] |= 1 << j
        touching[j] |= 1 << i
    masks = [bits(row) for row in covers]

    def connected(subset):
        reached = subset & -subset
        while True:
            more = reached
            for c in range(n):
                if reached >> c & 1:
                    more |= touching[c] & subset
            if more == reached:
                return reached == subset
            reached = more

    everything = bits(covers.any(axis=0))
    subsets = [s for s in range(1, 1 << n) if s & everything == s]
    blocks = {s for s in subsets if any(s & m == s for m in masks) and connected(s)}
    best = {0: 0}
    for subset in subsets:
        first = subset & -subset
        rest = part = subset ^ first
        best[subset] = n + 1
        while True:
            if part | first in blocks:
                best[subset] = min(best[subset], 1 + best[rest ^ part])
            if part == 0:
                break
            part = (part - 1) & rest
    return best[everything]


def assert_cover(cover, covers, needed, pairs):
    """Each needed cell that can be covered is in one patch, each patch in one row; both plans."""
    for found in (cover.fewest, cover.connected):
        inside = found.patch >= 0
        assert (inside == (needed & covers.any(axis=0))).all()
        assert sorted(set(found.patch[inside].tolist())) == list(range(len(found)))
        assert covers[found.rows[found.patch[inside]], np.flatnonzero(inside)].all()
        assert found.pieces == count_of(found.patch, pairs)
        assert found.bound <= len(found) <= found.pieces
    assert cover.connected.pieces == len(cover.connected)
    assert len(set(cover.fewest.rows.tolist())) == len(cover.fewest)
    assert (cover.left_out == (needed & ~covers.any(axis=0))).all()
    assert (cover.fewest is cover.connected) == (len(cover.fewest) == len(cover.connected))


@sampled
@pytest.mark.parametrize("block", seeds(3, all=20))
def test_random_tables_against_brute_force(block):
    """In some of them connectedness costs patches, in some it does not; the order is no matter."""
    costs, rng = 0, np.random.default_rng(block)
    for seed in range(40 * block, 40 * block + 40):
        covers, pairs = random_table(seed)
        n = covers.shape[1]
        needed = rng.random(n) < 0.6 if seed % 4 == 0 else np.ones(n, dtype=bool)
        cover = fewest_patches(covers, needed, pairs)
        assert_cover(cover, covers, needed, pairs)
        assert cover.fewest.optimal
        assert cover.connected.optimal
        # Cells that are not needed are as if they were not there: they connect nothing.
        left = (np.cumsum(needed) - 1)[pairs[needed[pairs].all(axis=1)]]
        assert len(cover.fewest) == fewest_by_brute_force(covers[:, needed])
        assert len(cover.connected) == connected_by_brute_force(covers[:, needed], left)
        costs += len(cover.connected) > len(cover.fewest)
        place, mixed = rng.permutation(n), np.empty_like(covers)
        mixed[:, place] = covers
        again = np.empty_like(needed)
        again[place] = needed
        two = fewest_patches(mixed[rng.permutation(len(covers))], again, place[pairs])
        assert len(two.fewest) == len(cover.fewest)
        assert len(two.connected) == len(cover.connected)
    assert 0 < costs < 40


@pytest.mark.parametrize("seed", range(25))
def test_stations_against_brute_force(seed):
    """Each cell is given to one station, which covers it; motions of several placements."""
    rng = np.random.default_rng([6, seed])
    covers = rng.random((rng.integers(1, 9), rng.integers(1, 13))) < rng.uniform(0.1, 0.9)
    parts = np.split(np.arange(len(covers)), np.sort(rng.integers(0, len(covers) + 1, 3)))
    found = fewest_stations([covers[part] for part in parts], covers.shape[1])
    assert found.optimal
    assert len(found) == fewest_by_brute_force(covers)
    wanted = covers.any(axis=0)
    given = [cell for station in found.stations for cell in station.cells.tolist()]
    assert sorted(given) == np.flatnonzero(wanted).tolist()
    assert found.left_out.tolist() == np.flatnonzero(~wanted).tolist()
    for station in found.stations:
        assert len(station.cells)
        assert station.covers[station.cells].all()
        assert (covers[parts[station.placement][station.component]] == station.covers).all()
    sizes = [len(station.cells) for station in found.stations]
    assert sizes == sorted(sizes, reverse=True)


def test_nothing_covers_nothing():
    none, whole = np.zeros((0, 0), dtype=bool), np.ones((1, 3), dtype=bool)
    found = fewest_stations([none, whole[:0], whole], 3)
    assert [(s.placement, s.cells.tolist()) for s in found.stations] == [(2, [0, 1, 2])]
    assert len(fewest_stations([], 0)) == 0
    assert fewest_stations([none], 2).left_out.tolist() == [0, 1]
    for shape in ((0, 0), (0, 4), (3, 0), (3, 4)):
        needed = np.ones(shape[1], dtype=bool)
        cover = fewest_patches(
            np.zeros(shape, dtype=bool), needed, np.zeros((0, 2), dtype=np.int64)
        )
        assert len(cover.fewest) == len(cover.connected) == 0
        assert cover.fewest.optimal
        assert cover.left_out.all()


def grid(nu, nv):
    """Pairs of cells that share a side (not only a corner)."""
    k = np.arange(nu * nv).reshape(nu, nv)
    down = np.stack([k[:-1].ravel(), k[1:].ravel()], axis=1)
    return np.vstack([down, np.stack([k[:, :-1].ravel(), k[:, 1:].ravel()], axis=1)])


def blobs(nu, nv, count, level, seed):
    """(count, nu * nv) smooth random regions: where a random wave pattern is above a level."""
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(np.linspace(0, 1, nu), np.linspace(0, 1, nv), indexing="ij")
    waves = np.zeros((count, nu, nv))
    for k in range(count):
        for _ in range(6):
            a, b, phase = rng.normal(0, 4), rng.normal(0, 4), rng.uniform(0, 2 * np.pi)
            waves[k] += np.sin(a * u + b * v + phase)
    return (waves > level).reshape(count, -1)


def test_without_time_there_is_a_gap_and_it_is_honest():
    """A valid partition all the same, and bounds that the optimum keeps."""
    for seed in (0, 2):
        covers, everywhere = blobs(10, 10, 40, 1.4, 100 + seed), np.ones(100, dtype=bool)
        hasty = fewest_patches(covers, everywhere, grid(10, 10), time_limit=0.0)
        best = fewest_patches(covers, everywhere, grid(10, 10))
        for cover in (hasty, best):
            assert_cover(cover, covers, everywhere, grid(10, 10))
        for early, final in ((hasty.fewest, best.fewest), (hasty.connected, best.connected)):
            assert final.optimal
            assert early.bound <= len(final) <= len(early)
    # Small ones are solved before anybody looks at the clock.
    everywhere = np.ones(18 * 18, dtype=bool)
    gaps = [
        fewest_patches(blobs(18, 18, 150, 1.5, seed), everywhere, grid(18, 18), time_limit=0.0)
        for seed in (100, 101, 102)
    ]
    assert any(one.connected.bound < len(one.connected) for one in gaps)
