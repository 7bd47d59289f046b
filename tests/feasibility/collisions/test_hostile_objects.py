"""Hostile scenes, a sample: each object has its sentence, and what is taken can be used.

`tests/campaigns/test_hostile_scenes.py` tries many more.
"""

import pytest
from hostile_scenes import MAKERS, try_scene

from robots import load_robot


@pytest.mark.parametrize("first", MAKERS)
def test_hostile_scenes_have_their_sentences(first, tmp_path):
    for seed in range(5):
        try_scene(seed, tmp_path, first, load_robot("ur5"))
