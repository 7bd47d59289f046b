"""Two hundred times what tests/feasibility/runs/test_passes_hold.py tries a few times."""

from __future__ import annotations

import pytest
from foreign_passes import KINDS, drawn
from test_passes_hold import assert_holds

CASES = 200
FOUND = 0.9  # [1] of them that have a motion
HELD: dict[int, bool] = {}


@pytest.mark.parametrize("number", range(CASES))
def test_what_is_called_feasible_is_right_over_the_surface(number: int) -> None:
    found = assert_holds(number)
    print(number, KINDS[number % len(KINDS)], drawn(number).arm, found)
    HELD[number] = found


def test_most_have_a_motion() -> None:
    assert sum(HELD.values()) >= FOUND * len(HELD)
