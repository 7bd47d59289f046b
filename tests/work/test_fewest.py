"""The fewest patches: hundreds of small tables against brute force, and real sizes."""

from functools import reduce
from itertools import combinations
from operator import or_

import numpy as np
from samples import sampled, seeds

from feasibility.division.plans import fewest_patches


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


def assert_partition(found, covers):
    """Each cell that can be covered is in one patch, each patch in one row of its own."""
    inside = found.patch >= 0
    assert (inside == covers.any(axis=0)).all()
    sizes = np.bincount(found.patch[inside], minlength=len(found.rows))
    assert len(sizes) == len(found.rows)
    assert sizes.all()
    assert (np.diff(sizes) <= 0).all()
    assert covers[found.rows[found.patch[inside]], np.flatnonzero(inside)].all()
    assert len(set(found.rows.tolist())) == len(found.rows)
    assert found.bound <= len(found.rows)


@sampled("block", seeds(3, all=20))
def test_random_tables_against_brute_force(block):
    rng = np.random.default_rng(block)
    for seed in range(40 * block, 40 * block + 40):
        covers, pairs = random_table(seed)
        n = covers.shape[1]
        found = fewest_patches(covers, pairs)
        assert_partition(found, covers)
        assert len(found.rows) == found.bound == fewest_by_brute_force(covers)
        place, mixed = rng.permutation(n), np.empty_like(covers)
        mixed[:, place] = covers
        other = fewest_patches(mixed[rng.permutation(len(covers))], place[pairs])
        assert len(other.rows) == len(found.rows)


def test_patches_grow_from_the_cells_without_a_choice():
    """Two rows that overlap in the middle of a strip: it is cut once, in the middle."""
    covers = np.zeros((2, 12), dtype=bool)
    covers[0, :9], covers[1, 3:] = True, True
    found = fewest_patches(covers, np.stack([np.arange(11), np.arange(1, 12)], axis=1))
    assert found.patch.tolist() == [0] * 6 + [1] * 6


def test_nothing_covers_nothing():
    for shape in ((0, 0), (0, 4), (3, 0), (3, 4)):
        found = fewest_patches(np.zeros(shape, dtype=bool), np.zeros((0, 2), dtype=np.int64))
        assert (len(found.rows), found.bound, found.patch.tolist()) == (0, 0, [-1] * shape[1])


def test_without_time_there_is_a_gap_and_it_is_honest():
    """A valid partition all the same, and a bound that the optimum keeps."""
    gaps = []
    for seed in (100, 101, 102):
        covers = np.random.default_rng(seed).random((40, 90)) < 0.15
        pairs = np.stack([np.arange(89), np.arange(1, 90)], axis=1)
        hasty, best = fewest_patches(covers, pairs, 0.0), fewest_patches(covers, pairs)
        assert_partition(hasty, covers)
        assert_partition(best, covers)
        assert hasty.bound <= best.bound <= len(best.rows) <= len(hasty.rows)
        gaps.append(len(hasty.rows) - hasty.bound)
    assert any(gaps)
