"""Random surfaces of every kind: no place is outside the parts that it lies on.

`tests/campaigns/test_many_surface_parts.py` tries many more.
"""

import numpy as np
import pytest
from part_walks import lost
from random_surfaces import KINDS, random_surface

from coverable_errors import ArgumentError
from surfaces import sphere


@pytest.mark.parametrize("kind", KINDS)
def test_random_surfaces_lie_in_their_parts(kind):
    for seed in range(3):
        rng = np.random.default_rng([seed, *map(ord, kind)])
        surface = random_surface(kind, rng)
        assert not lost(surface, rng), (seed, surface)


@pytest.mark.parametrize("limits", [(0.0, 1.0), (1.0, -1.0), (np.nan, 1.0), (1.0, np.nan)])
def test_limits_that_no_part_keeps_are_refused(limits):
    with pytest.raises(ArgumentError, match="above 0"):
        sphere(1.0, (10, 90), (0, 90)).parts(*limits)
