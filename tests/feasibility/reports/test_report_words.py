"""Words of the reports: one cell is not cells, long lists are cut, shares end at one."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from feasibility import Task
from feasibility.cli.main import main
from feasibility.division import Reconfiguration
from feasibility.placement.reach_bound import Reach
from feasibility.reports.study import groups_of, short
from feasibility.studies import Row, Study
from robots import load_robot
from surfaces import sphere


@pytest.mark.parametrize(("n", "most"), [(1, 1), (3, 2), (4, 2), (7, 3)])
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
    for nu, nv in itertools.product((2, 5, 13), (2, 7, 13)):
        cells = sphere(0.2, (10, 170), (0, 300), side="outside").cells(nu, nv)
        reach = Reach.of(arm, cells, task)
        assert reach.within(pose).all()
        assert 1.0 - 1e-12 <= reach.share(pose)[0] <= 1.0


def test_groups_of_numbers_stand_in_their_order() -> None:
    """Samples come in the order in which they were drawn; words stay as they were given."""
    rng = np.random.default_rng(1)
    depths = (rng.permutation(9) - 4) / 100.0
    arms = ["ur5", "panda", "kinova"]
    points = [{"robot": arm, "z": float(z), "on": bool(z > 0)} for z in depths for arm in arms]
    rows = [Row(point, "done", {}, 0.0) for point in points]
    study = Study("a study", "", (), ("robot", "z", "on"))
    groups = groups_of(study, rows)
    assert list(groups["robot"]) == arms
    assert list(map(float, groups["z"])) == sorted(depths.tolist())
    assert list(groups["on"]) == list(dict.fromkeys("true" if z > 0 else "false" for z in depths))
    for label, by_value in groups.items():
        assert sum(map(len, by_value.values())) == len(rows)
        for value, group in by_value.items():
            assert all(short(row.parameters[label]) == value for row in group)


@pytest.mark.parametrize(("setting", "told"), [("search.seed=0", 0), ("search.time_limit=1e-6", 1)])
def test_more_time_is_advised_where_time_ran_out(setting, told, capsys) -> None:
    assert main(["path", "paper/4d", "--set", setting]) == (3 if told else 1)
    said = " ".join("".join(capsys.readouterr()).split())
    # On a busy machine the time is up before the search begins, which is answered as a table.
    assert said.count("--set search.time_limit=") == told
