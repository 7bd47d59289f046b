"""The fewest stations: hundreds of small tables against brute force."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from feasibility.placement.stations import Stations, fewest_stations


def random_table(seed: int) -> np.ndarray:
    """Up to 8 motions over up to 12 cells."""
    rng = np.random.default_rng([11, seed])
    shape = int(rng.integers(0, 9)), int(rng.integers(0, 13))
    return rng.random(shape) < rng.uniform(0.1, 0.8)


def fewest_by_brute_force(covers: np.ndarray) -> int:
    """Size of the smallest choice of rows that has every cell that any row has."""
    wanted = covers.any(axis=0)
    for count in range(len(covers) + 1):
        for choice in combinations(range(len(covers)), count):
            if (covers[list(choice)].any(axis=0) | ~wanted).all():
                return count
    raise AssertionError("all rows together have everything")


def assert_stations(found: Stations, covers: np.ndarray) -> None:
    """Each cell that can be covered is given to one station, which covers it."""
    wanted = covers.any(axis=0)
    given = np.concatenate([s.cells for s in found.stations] or [np.zeros(0, dtype=np.int64)])
    assert sorted(given.tolist()) == np.flatnonzero(wanted).tolist()
    assert found.left_out.tolist() == np.flatnonzero(~wanted).tolist()
    for station in found.stations:
        assert len(station.cells)
        assert station.covers[station.cells].all()
    sizes = [len(station.cells) for station in found.stations]
    assert sizes == sorted(sizes, reverse=True)


@pytest.mark.parametrize("block", range(10))
def test_random_tables_against_brute_force(block: int) -> None:
    several = 0
    for seed in range(40 * block, 40 * block + 40):
        covers = random_table(seed)
        found = fewest_stations([covers], covers.shape[1])
        assert_stations(found, covers)
        assert all((covers[s.component] == s.covers).all() for s in found.stations)
        assert found.optimal
        assert len(found) == fewest_by_brute_force(covers)
        several += len(found) > 1
    assert several > 5  # most tables are not trivial


def test_placements_give_the_same_as_one_table() -> None:
    """Components of several placements are rows of one table; a motion cannot change placement."""
    for seed in range(100):
        covers = random_table(1000 + seed)
        rng = np.random.default_rng(seed)
        cuts = np.sort(rng.integers(0, len(covers) + 1, 3))
        parts = np.split(np.arange(len(covers)), cuts)
        found = fewest_stations([covers[part] for part in parts], covers.shape[1])
        assert len(found) == fewest_by_brute_force(covers)
        assert_stations(found, covers)
        for station in found.stations:
            assert (covers[parts[station.placement][station.component]] == station.covers).all()


def test_a_failed_trial_covers_nothing() -> None:
    none, whole = np.zeros((0, 0), dtype=bool), np.ones((1, 3), dtype=bool)
    found = fewest_stations([none, whole[:0], whole], 3)
    assert [(s.placement, s.cells.tolist()) for s in found.stations] == [(2, [0, 1, 2])]
    assert len(fewest_stations([], 0)) == 0
    assert fewest_stations([none], 2).left_out.tolist() == [0, 1]


def test_one_motion_that_covers_all_is_one_station() -> None:
    covers = np.eye(50, dtype=bool)
    covers[17] = True
    found = fewest_stations([covers], 50)
    assert [s.component for s in found.stations] == [17]
    assert found.optimal
