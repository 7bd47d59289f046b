"""Random motions, most of them at the edge: what the replay accepts, dense samples confirm.

`make campaign NAME=surface_replay_attacks`. A few of the same seeds run with every test run, in
tests/feasibility/certification/test_replay_attacks.py.
"""

from __future__ import annotations

import pytest
from replay_attacks import SURFACES, attacked

SEEDS = 200


@pytest.mark.parametrize("name", SURFACES)
def test_what_is_accepted_holds(name):
    """Not one accepted motion that leaves tolerance or cone; few refused that keep well inside."""
    outcomes = [attacked(name, seed) for seed in range(SEEDS)]
    accepted = [one for one in outcomes if one.accepted]
    assert len(accepted) > SEEDS // 10
    assert len(outcomes) - len(accepted) > SEEDS // 10
    for one in accepted:
        assert not one.wrong, one
    for one in outcomes:
        assert one.accepted or not one.inside, one
