"""Values that changes name are rounded so that what was found of them holds for what is printed."""

from __future__ import annotations

import math

import pytest

from feasibility.reports import changes
from feasibility.sensitivity import Kind, Quantity

MORE_IS_LESS = (Kind.LOWER, Kind.CLEARANCE, Kind.TOOL_CLEARANCE)


@pytest.mark.parametrize("kind", [Kind.CONE, Kind.UPPER, *MORE_IS_LESS])
@pytest.mark.parametrize("value", [0.1234567, 0.7654321])
def test_feasible_values_allow_more_and_others_less_by_a_digit_at_most(kind, value):
    turns = kind not in (Kind.CLEARANCE, Kind.TOOL_CLEARANCE)
    asked = Quantity(kind, "it", "rad" if turns else "m", 0.0, 1.0, 0.5, True)
    exact, digit = (math.degrees(value), 0.01) if turns else (value, 1e-5)
    for feasible in (True, False):
        more = float(changes.number(asked, value, feasible)) - exact
        more *= -1 if (kind in MORE_IS_LESS) == feasible else 1
        assert 0.0 < more < digit
