"""Many random surfaces of every kind: no place is outside the parts that it lies on."""

import numpy as np
import pytest
from part_walks import lost
from random_surfaces import KINDS, random_surface

SURFACES = 300


@pytest.mark.parametrize("kind", KINDS)
def test_many_random_surfaces_lie_in_their_parts(kind):
    for seed in range(1000, 1000 + SURFACES):
        rng = np.random.default_rng([seed, *map(ord, kind)])
        surface = random_surface(kind, rng)
        assert not lost(surface, rng, 5000), (seed, surface)
