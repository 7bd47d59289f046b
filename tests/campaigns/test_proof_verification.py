"""The verifier of cut trees at length: 10^5 boxes around known places, every stored tree."""

import numpy as np
import pytest
from known_points import confirmed, known, lost
from proof_cases import stored, stored_case

from feasibility.certification import verify_proof


@pytest.mark.parametrize("seed", range(100, 120))
def test_no_box_around_a_known_place_is_lost(seed):
    rng = np.random.default_rng(seed)
    for boxes in rng.choice([1, 20, 150], 90):
        assert not lost(known(rng, boxes)).any()


@pytest.mark.parametrize("seed", range(200, 210))
def test_no_region_around_a_known_place_is_said_to_be_empty(seed):
    rng = np.random.default_rng(seed)
    for _ in range(20):
        assert not confirmed(rng, known(rng, 1), 1500)


@pytest.mark.parametrize("index", range(len(stored())))
def test_stored_trees_are_accepted(index):
    check = verify_proof(*stored_case(index))
    assert check.accepted, check.refusal
