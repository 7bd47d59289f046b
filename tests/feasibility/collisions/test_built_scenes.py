"""Two scenes with a known motion; over 200 of them: `make campaign NAME=collision_scenes`."""

from __future__ import annotations

import pytest
from built_scenes import assert_found, built_scene


@pytest.mark.parametrize(("name", "seed"), [("panda", 1003), ("puma560 on a rail", 1000)])
def test_a_motion_that_exists_is_found_and_right(name: str, seed: int) -> None:
    scene = built_scene(name, seed)
    assert scene is not None
    assert scene.blind_collides
    assert assert_found(scene)
