"""How much is drawn at random: a little in `make test`, everything in `make campaign`."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

EVERYTHING = False  # said by --samples=all, before tests are collected


def seeds(few: int, all: int) -> Sequence[int]:
    """Seeds to draw from, as in `@sampled("seed", seeds(4, all=200))`."""
    return range(all if EVERYTHING else few)


def spread(items: Sequence, few: int) -> Sequence:
    """All of these in a campaign, else a few of them, evenly spread."""
    if EVERYTHING or few >= len(items):
        return items
    return [items[k] for k in np.linspace(0, len(items) - 1, few).astype(int)]


def sampled(names: Any, values: Sequence, **more: Any) -> Any:
    """`pytest.mark.parametrize` of a test of which a campaign runs more."""
    return lambda test: pytest.mark.sampled(pytest.mark.parametrize(names, values, **more)(test))
