"""A few of the random motions of the campaign: what the replay accepts, dense samples confirm."""

from __future__ import annotations

import pytest
from replay_attacks import SURFACES, attacked


@pytest.mark.parametrize("name", SURFACES[:-1])  # the mesh's reader takes its time
def test_what_is_accepted_holds(name):
    outcomes = [attacked(name, seed) for seed in range(1000, 1008)]
    for one in outcomes:
        assert not (one.accepted and one.wrong), one
        assert one.accepted or not one.inside, one
