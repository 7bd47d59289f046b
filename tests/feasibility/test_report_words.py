"""Words of the reports: one cell is not cells, long lists are cut, shares end at one."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from feasibility.placement_bounds import Reach
from feasibility.reconfigure import Reconfiguration
from feasibility.task import Task
from robots import load_robot
from surfaces import sphere


@pytest.mark.parametrize(("n", "most"), list(itertools.product(range(1, 8), (1, 2, 3))))
def test_a_long_move_names_its_largest_parts_and_counts_the_rest(n: int, most: int) -> None:
    rng = np.random.default_rng(10 * n + most)
    end = rng.permutation(np.arange(1, n + 1)) * np.where(rng.random(n) < 0.5, -0.3, 0.3)
    names = tuple(f"j{k}" for k in range(n))
    move = Reconfiguration(names, np.zeros(n, dtype=bool), np.zeros(n), end)
    whole = move.described().split(", ")
    assert [part.split()[0] for part in whole] == [names[k] for k in np.argsort(-np.abs(end))]
    told = move.described(most).split(", ")
    if n <= most + 1:  # naming one joint takes no more room than counting it
        assert told == whole
    else:
        assert told == [*whole[:most], f"{n - most} more"]


def test_a_share_is_never_more_than_all() -> None:
    arm, task = load_robot("ur10"), Task(standoff=0.05, cone_deg=30)
    pose = np.array([[0.4, 0.1, 0.2, 0.0, 0.0, 10.0]])
    for nu, nv in itertools.product(range(2, 14), range(2, 14)):
        cells = sphere(0.2, (10, 170), (0, 300), side="outside").cells(nu, nv)
        reach = Reach.of(arm, cells, task)
        assert reach.within(pose).all()
        assert 1.0 - 1e-12 <= reach.share(pose)[0] <= 1.0
