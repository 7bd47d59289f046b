"""Many hostile scenes: each object has its sentence, and what is taken can be used."""

import pytest
from hostile_scenes import MAKERS, try_scene

from robots import load_robot

SCENES = 100  # of each kind of object


@pytest.mark.parametrize("first", MAKERS)
def test_many_hostile_scenes_have_their_sentences(first, tmp_path):
    robot = load_robot("ur5")
    for seed in range(1000, 1000 + SCENES):
        try_scene(seed, tmp_path, first, robot)
