"""Many random surfaces of every kind: no place is further from its sheet than is stated."""

import pytest
from random_surfaces import KINDS
from sheet_probes import excess

SURFACES = 100  # of each kind, with and without a thickness


@pytest.mark.parametrize("thick", [False, True])
@pytest.mark.parametrize("kind", KINDS)
def test_many_sheets_are_as_near_as_stated(kind, thick):
    for seed in range(1000, 1000 + SURFACES):
        assert excess(kind, seed, thick, 100) <= 0.0, seed
