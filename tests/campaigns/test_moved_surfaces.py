"""Surfaces moved to where they cannot be covered, all of them, are put back by `place`."""

import pytest
from placement_cases import MOVED, assert_put_back


@pytest.mark.parametrize(("name", "seed"), MOVED)
def test_a_surface_moved_away_is_put_back(name, seed):
    assert_put_back(name, seed)
