"""The fewest interruptions against all choices, and against reaching as far as one can."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from feasibility.runs import Stations, fewest_runs


def drawn(rng, stations: int, classes: int, share: float) -> Stations:
    """A node over some stations for each class, joined with the next one where both are there."""
    there = rng.random((stations, classes)) < share
    number = np.full((stations, classes), -1)
    number[there] = np.arange(there.sum())
    steps = [
        (number[i, a], number[i + 1, b], 0, 1)
        for i in range(stations - 1)
        for a in range(classes)
        for b in range(classes)
        if there[i, a] and there[i + 1, b] and (rng.random() < (0.8 if a == b else 0.15))
    ]
    steps = [(x, y, k + 1, 1) for k, (x, y, _, _) in enumerate(steps)]
    inside = rng.random(stations - 1) < 0.8
    pieces = np.where(inside, rng.integers(1, 4, stations - 1), 0).astype(float)
    over = np.repeat(np.arange(stations), there.sum(axis=1))
    return Stations(over, np.array(steps, dtype=np.int64).reshape(-1, 4), pieces, inside)


def measured(stations: Stations, found) -> tuple[float, int]:
    """Undone length and runs, with everything about the runs checked."""
    edges = {int(number): (int(x), int(y)) for x, y, number, _ in stations.steps}
    done = np.zeros(len(stations.pieces), dtype=bool)
    last = -1
    for run in found:
        assert [edges[number] for number in run.route] == list(itertools.pairwise(run.nodes))
        first, end = (int(stations.over[run.nodes[k]]) for k in (0, -1))
        assert last <= first < end
        assert not done[first:end].any()
        done[first:end], last = True, end
    return float(stations.pieces[~done].sum()), len(found)


def by_force(stations: Stations) -> tuple[float, int]:
    """The best of all choices of pieces that are worked on, each run as far as sets of nodes go."""
    count = len(stations.pieces)
    after: dict[int, set[int]] = {}
    for x, y, _, _ in stations.steps.tolist():
        after.setdefault(x, set()).add(y)
    over = [set(np.flatnonzero(stations.over == i).tolist()) for i in range(count + 1)]
    best = (np.inf, 0)
    for worked in itertools.product((False, True), repeat=count):
        runs, possible, here = 0, True, set[int]()
        for i, on in enumerate(worked):
            if not on:
                here = set()
                continue
            ahead = {y for x in here for y in after.get(x, ())}
            if not ahead:
                ahead, runs = {y for x in over[i] for y in after.get(x, ())}, runs + 1
            possible, here = possible and bool(ahead), ahead
        undone = float(stations.pieces[~np.array(worked)].sum())
        if possible and (undone, runs) < best:
            best = undone, runs
    return best


@pytest.mark.parametrize("share", [0.4, 0.7, 0.95])
def test_no_choice_leaves_less_or_has_fewer_runs(share: float) -> None:
    rng = np.random.default_rng(int(100 * share))
    several = 0
    for _ in range(60):
        stations = drawn(rng, int(rng.integers(2, 9)), int(rng.integers(1, 4)), share)
        found = measured(stations, fewest_runs(stations))
        assert found == by_force(stations)
        several += found[1] > 1
    assert several > 5


def test_classes_that_last_are_run_as_far_as_any_reaches() -> None:
    """Intervals of stations, one a class: the greedy cover by the furthest reach is the best."""
    rng = np.random.default_rng(8)
    for _ in range(40):
        stations, classes = 60, 12
        low = np.concatenate([[0], rng.integers(0, stations - 1, classes - 1)])
        high = np.minimum(low + rng.integers(4, 30, classes), stations - 1)
        over, steps = list[int](), list[tuple[int, int, int, int]]()
        for a, b in zip(low.tolist(), high.tolist(), strict=True):
            first = len(over)
            over += range(a, b + 1)
            steps += [(first + k, first + k + 1, len(steps) + k + 1, 1) for k in range(b - a)]
        ones = np.ones(stations - 1)
        asked = Stations(np.array(over), np.array(steps), ones, ones > 0)
        here, runs, undone = 0, 0, 0.0
        while here < stations - 1:
            reach = max((b for a, b in zip(low, high, strict=True) if a <= here < b), default=-1)
            if reach < 0:
                here, undone = here + 1, undone + 1.0
            else:
                here, runs = int(reach), runs + 1
        assert measured(asked, fewest_runs(asked)) == (undone, runs)


def test_cuts_are_made_between_passes_where_they_can_be() -> None:
    """Two classes overlap over six stations; the turn between two passes is one of the pieces."""
    over = np.concatenate([np.arange(0, 8), np.arange(2, 10)])
    steps = [(k, k + 1, k + 1, 1) for k in range(7)]
    steps += [(8 + k, 9 + k, 20 + k, 1) for k in range(7)]
    inside = np.ones(9, dtype=bool)
    inside[4] = False
    found = fewest_runs(Stations(over, np.array(steps), np.where(inside, 0.01, 0.0), inside))
    assert [int(over[run.nodes[-1]]) for run in found] == [4, 9]
    assert int(over[found[1].nodes[0]]) in (4, 5)
