"""A few segments of `make campaign NAME=clearance_attacks`."""

from __future__ import annotations

import pytest
from clearance_attacks import attacked


@pytest.mark.parametrize("name", ["ur5", "PRPRR"])
def test_no_segment_that_is_called_clear_collides(name: str) -> None:
    outcome = attacked(name, 0, 10, 3)
    assert outcome.wrong == 0
    assert outcome.clear > 0
    assert outcome.refused > 0
