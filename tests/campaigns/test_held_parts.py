"""50 random arms that hold a part under a fixed tool: the answers of the mirrored problem."""

import pytest
from held_parts import held_case

from feasibility import check


@pytest.mark.parametrize("seed", range(50))
def test_a_held_part_is_the_mirrored_problem(seed, tmp_path):
    holding, mirrored, cells, task = held_case(seed, tmp_path)
    one, two = check(holding, cells, task), check(mirrored, cells, task)
    assert (one.answer, one.evidence) == (two.answer, two.evidence)
    assert one.covered.tolist() == two.covered.tolist()
    counts = [verdict.statistics["fk"] for verdict in (one, two)]
    assert max(counts) <= 1.01 * min(counts)
