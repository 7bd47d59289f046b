"""Thousands of random segments: none that the compiled clearance calls clear collides for coal."""

from __future__ import annotations

import pytest
from clearance_attacks import ARMS, attacked

SCENES = 10  # of each arm
STARTS = 60  # of each scene, four segments from each


@pytest.mark.parametrize("name", ARMS)
def test_no_segment_that_is_called_clear_collides(name: str) -> None:
    outcomes = [attacked(name, seed, STARTS) for seed in range(1000, 1000 + SCENES)]
    clear, refused, wrong = (sum(column) for column in zip(*outcomes, strict=True))
    print(f"{name}: {clear} segments clear, {refused} refused, {wrong} wrong")
    assert wrong == 0
    assert clear > 0.05 * (clear + refused)
    assert refused > 0
