"""The fewest patches: hundreds of small tables against brute force, and tables of real sizes."""

from __future__ import annotations

from itertools import combinations
from time import monotonic

import numpy as np
import pytest

from feasibility.division import set_cover, undominated
from feasibility.division.connected_labels import Labels, count_of, fewest_labels, pieces_of
from feasibility.division.partition import Cover, Partition, connected_cover, fewest_patches
from surfaces import plane


def random_table(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Up to 5 components over up to 9 cells, and which of them touch."""
    rng = np.random.default_rng([5, seed])
    n, rows = int(rng.integers(1, 10)), int(rng.integers(1, 6))
    covers = rng.random((rows, n)) < rng.uniform(0.2, 0.9)
    pairs = np.array(list(combinations(range(n), 2)), dtype=np.int64).reshape(-1, 2)
    return covers, pairs[rng.random(len(pairs)) < rng.uniform(0.1, 0.7)]


def bits(cells: np.ndarray) -> int:
    return sum(1 << int(c) for c in np.flatnonzero(cells))


def fewest_by_brute_force(covers: np.ndarray) -> int:
    """Size of the smallest choice of rows that has all that any row has."""
    masks = [bits(row) for row in covers]
    everything = bits(covers.any(axis=0))
    for count in range(len(masks) + 1):
        for choice in combinations(masks, count):
            union = 0
            for mask in choice:
                union |= mask
            if union == everything:
                return count
    raise AssertionError("all rows together have everything")


def connected_by_brute_force(covers: np.ndarray, pairs: np.ndarray) -> int:
    """Fewest blocks of a set partition, each block connected and inside one row.

    Over all subsets: the block of the subset's first cell, and the best partition of the rest.
    """
    n = covers.shape[1]
    touching = [0] * n
    for i, j in pairs.tolist():
        touching[i] |= 1 << j
        touching[j] |= 1 << i
    masks = [bits(row) for row in covers]

    def connected(subset: int) -> bool:
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


def assert_partition(
    found: Partition, covers: np.ndarray, needed: np.ndarray, pairs: np.ndarray
) -> None:
    """Every needed cell that can be covered is in one patch, and each patch in its component."""
    inside = found.patch >= 0
    assert (inside == (needed & covers.any(axis=0))).all()
    assert sorted(set(found.patch[inside].tolist())) == list(range(len(found)))
    assert covers[found.rows[found.patch[inside]], np.flatnonzero(inside)].all()
    sizes = np.bincount(found.patch[inside], minlength=len(found))
    assert (np.diff(sizes) <= 0).all()
    assert found.pieces == count_of(found.patch, pairs)
    assert found.bound <= len(found) <= found.pieces


def assert_cover(cover: Cover, covers: np.ndarray, needed: np.ndarray, pairs: np.ndarray) -> None:
    """Both answers are what they say."""
    for found in (cover.fewest, cover.connected):
        assert_partition(found, covers, needed, pairs)
    assert cover.connected.pieces == len(cover.connected)
    assert len(set(cover.fewest.rows.tolist())) == len(cover.fewest)
    assert (cover.left_out == (needed & ~covers.any(axis=0))).all()
    assert (cover.fewest is cover.connected) == (len(cover.fewest) == len(cover.connected))


@pytest.mark.parametrize("block", range(3))
def test_random_tables_against_brute_force(block: int) -> None:
    """120 tables; in some of them connectedness costs patches, in some it does not."""
    costs = 0
    for seed in range(40 * block, 40 * block + 40):
        covers, pairs = random_table(seed)
        needed = np.ones(covers.shape[1], dtype=bool)
        cover = fewest_patches(covers, needed, pairs)
        assert_cover(cover, covers, needed, pairs)
        assert cover.fewest.optimal
        assert cover.connected.optimal
        assert len(cover.fewest) == fewest_by_brute_force(covers)
        assert len(cover.connected) == connected_by_brute_force(covers, pairs)
        costs += len(cover.connected) > len(cover.fewest)
    assert 0 < costs < 40


@pytest.mark.parametrize("block", range(2))
def test_the_programme_alone_against_brute_force(block: int) -> None:
    """60 tables from the worst start: every cell in a patch of the first row that covers it."""
    better = 0
    for seed in range(1000 + 30 * block, 1030 + 30 * block):
        covers, pairs = random_table(seed)
        covers = covers[:, covers.any(axis=0)]
        n = covers.shape[1]
        pairs = pairs[(pairs < n).all(axis=1)]
        label = np.argmax(covers, axis=0)
        start = Labels(label, count_of(label, pairs), min(n, 1))
        found = fewest_labels(covers, pairs, start, np.inf)
        assert covers[found.label, np.arange(n)].all()
        assert found.pieces == count_of(found.label, pairs) == found.bound
        assert found.pieces == connected_by_brute_force(covers, pairs)
        better += found.pieces < start.pieces
    assert better > 0


def test_the_order_of_components_and_cells_changes_nothing() -> None:
    rng = np.random.default_rng(3)
    for seed in range(15):
        covers, pairs = random_table(2000 + seed)
        n = covers.shape[1]
        everywhere = np.ones(n, dtype=bool)
        one = fewest_patches(covers, everywhere, pairs)
        place = rng.permutation(n)
        mixed = np.empty_like(covers)
        mixed[:, place] = covers
        two = fewest_patches(mixed[rng.permutation(len(covers))], everywhere, place[pairs])
        assert len(one.fewest) == len(two.fewest)
        assert len(one.connected) == len(two.connected)


def test_cells_that_are_not_needed_do_not_count() -> None:
    """As if they were not there; nothing paints them, so they connect nothing either."""
    for seed in range(20):
        covers, pairs = random_table(3000 + seed)
        n = covers.shape[1]
        needed = np.random.default_rng(seed).random(n) < 0.6
        cover = fewest_patches(covers, needed, pairs)
        assert_cover(cover, covers, needed, pairs)
        number = np.cumsum(needed) - 1
        left = number[pairs[needed[pairs].all(axis=1)]]
        assert len(cover.fewest) == fewest_by_brute_force(covers[:, needed])
        assert len(cover.connected) == connected_by_brute_force(covers[:, needed], left)


def grid(nu: int, nv: int) -> np.ndarray:
    """Pairs of cells that share a side (not only a corner)."""
    k = np.arange(nu * nv).reshape(nu, nv)
    return np.vstack(
        [
            np.stack([k[:-1].ravel(), k[1:].ravel()], axis=1),
            np.stack([k[:, :-1].ravel(), k[:, 1:].ravel()], axis=1),
        ]
    )


@pytest.mark.parametrize("half", [1, 2])
def test_two_bars_that_cross(half: int) -> None:
    """Two motions, but three patches: one bar cuts the other."""
    i, j = np.divmod(np.arange(121), 11)
    bars = np.array([abs(i - 5) < half, abs(j - 5) < half])
    everywhere = np.ones(121, dtype=bool)
    cover = fewest_patches(bars, everywhere, grid(11, 11))
    assert_cover(cover, bars, everywhere, grid(11, 11))
    assert (len(cover.fewest), cover.fewest.pieces) == (2, 3)
    assert (len(cover.connected), cover.connected.bound) == (3, 3)
    # Where corners count as touching, wide bars can pass through each other.
    corners = plane((0, 1), (0, 1)).cells(11, 11).pairs
    assert len(fewest_patches(bars, everywhere, corners).connected) == (3 if half == 1 else 2)


def blobs(nu: int, nv: int, count: int, level: float, seed: int) -> np.ndarray:
    """(count, nu * nv) smooth random regions: where a random wave pattern is above a level."""
    rng = np.random.default_rng(seed)
    u, v = np.meshgrid(np.linspace(0, 1, nu), np.linspace(0, 1, nv), indexing="ij")
    waves = np.zeros((count, nu, nv))
    for k in range(count):
        for _ in range(6):
            a, b, phase = rng.normal(0, 4), rng.normal(0, 4), rng.uniform(0, 2 * np.pi)
            waves[k] += np.sin(a * u + b * v + phase)
    return (waves > level).reshape(count, -1)


@pytest.mark.parametrize(("nu", "nv"), [(9, 10), (30, 30), (50, 50)])
@pytest.mark.parametrize(("count", "level"), [(3, -0.5), (12, 0.5), (50, 1.2)])
def test_tables_of_real_sizes_are_solved_to_the_optimum(
    nu: int, nv: int, count: int, level: float
) -> None:
    """90 to 2500 cells, up to 50 components."""
    everywhere = np.ones(nu * nv, dtype=bool)
    pairs = plane((0, 1), (0, 1)).cells(nu, nv).pairs
    for seed in range(3 if nu < 50 else 1):
        covers = blobs(nu, nv, count, level, seed)
        cover = fewest_patches(covers, everywhere, pairs)
        assert_cover(cover, covers, everywhere, pairs)
        assert cover.fewest.optimal
        assert cover.connected.optimal


def test_without_time_there_is_a_gap_and_it_is_honest() -> None:
    """A valid partition all the same, and bounds that the optimum keeps."""
    gaps = 0
    for seed in (0, 2, 3):
        covers = blobs(10, 10, 40, 1.4, 100 + seed)
        everywhere = np.ones(100, dtype=bool)
        hasty = fewest_patches(covers, everywhere, grid(10, 10), time_limit=0.0)
        best = fewest_patches(covers, everywhere, grid(10, 10))
        for cover in (hasty, best):
            assert_cover(cover, covers, everywhere, grid(10, 10))
        for early, final in ((hasty.fewest, best.fewest), (hasty.connected, best.connected)):
            assert final.optimal
            assert early.bound <= len(final) <= len(early)
    # Small ones are solved before anybody looks at the clock.
    for seed in range(3):
        covers, everywhere = blobs(18, 18, 150, 1.5, 100 + seed), np.ones(18 * 18, dtype=bool)
        hasty = fewest_patches(covers, everywhere, grid(18, 18), time_limit=0.0)
        assert_cover(hasty, covers, everywhere, grid(18, 18))
        gaps += hasty.connected.bound < len(hasty.connected)
    assert gaps > 0
    i, j = np.divmod(np.arange(121), 11)
    bars = np.array([abs(i - 5) < 2, abs(j - 5) < 2])
    labels = connected_cover(bars, grid(11, 11), monotonic())
    assert (labels.pieces, labels.bound) == (3, 2)


def test_undominated_sets() -> None:
    """Against the definition; of equal sets the first stays, empty ones go."""
    for seed in range(100):
        covers, _ = random_table(4000 + seed)
        sets = [frozenset(np.flatnonzero(row).tolist()) for row in covers]
        kept = [
            k
            for k, own in enumerate(sets)
            if own and not any(own < other for other in sets) and own not in sets[:k]
        ]
        assert undominated(covers).tolist() == kept


def test_pieces_by_hand() -> None:
    label = np.array([0, 0, 1, 0, -1, -1])
    pairs = np.array([[0, 1], [1, 2], [2, 3], [4, 5]])
    assert pieces_of(label, pairs).tolist() == [0, 0, 1, 2, -1, -1]


@pytest.mark.parametrize("shape", [(0, 0), (0, 4), (3, 0), (3, 4)])
def test_nothing_to_cover(shape: tuple[int, int]) -> None:
    needed = np.ones(shape[1], dtype=bool)
    cover = fewest_patches(np.zeros(shape, dtype=bool), needed, np.zeros((0, 2), dtype=np.int64))
    assert len(cover.fewest) == len(cover.connected) == 0
    assert cover.fewest.optimal
    assert cover.left_out.all()


def test_bad_input() -> None:
    three = np.ones(3, dtype=bool)
    with pytest.raises(ValueError, match=r"got \(2, 4\) and \(3,\)"):
        fewest_patches(np.ones((2, 4), dtype=bool), three, np.zeros((0, 2)))
    with pytest.raises(ValueError, match=r"cells 0 \.\. 2"):
        fewest_patches(np.ones((2, 3), dtype=bool), three, np.array([[0, 3]]))
    with pytest.raises(ValueError, match=r"element 1 .* is in no set"):
        set_cover(np.array([[True, False]]), 1.0)
