"""100 random cases that are feasible only off the exact centres of some cells."""

from functools import partial

import pytest
from draw_by_a_hair import keeps, read_hair
from planted import assert_covers, planted_motion, read_planted
from set_down import built
from tally import Tally, assert_all_feasible, tally

from feasibility import check
from feasibility.verdict import Answer

CASES = read_planted("tolerance_needed")
SEEDS = (0, 1)


@pytest.mark.parametrize("seed", SEEDS)
def test_none_is_called_infeasible(seed):
    assert_all_feasible(tally((case.name, partial(case.setup, seed)) for case in CASES))


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_the_planted_motion_covers(case):
    setup, way, q = planted_motion(case, 4e-3, 0.9)
    assert_covers(setup, way, q, 0.98)


def test_a_hair_is_never_decided_wrongly():
    inside, outside = Tally(), Tally()
    for number, case in enumerate(read_hair()):
        assert keeps(case) == case.feasible
        found = inside if case.feasible else outside
        found.add(f"{number}, {case.share:g}", check(*built(case.tables)))
    print(f"inside\n{inside.table()}\noutside\n{outside.table()}")
    assert inside.named(Answer.INFEASIBLE) == []
    assert outside.named(Answer.FEASIBLE) == []
