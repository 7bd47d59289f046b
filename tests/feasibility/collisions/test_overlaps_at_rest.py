"""A base inside something is noted: no motion changes it."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from feasibility.collisions import Collision, Obstacle, gather
from feasibility.collisions.outer_bodies import polytopes_of
from feasibility.collisions.overlaps_at_rest import overlap
from robots import load_robot
from surfaces import plane

PLATE = plane((0.4, 0.6), (-0.1, 0.1), position=(0.0, 0.0, 0.3), side="outside")


def notes(name: str, *scene: Obstacle, **asked: object) -> list[str]:
    bodies = gather(load_robot(name), PLATE, Collision(scene=scene, **asked), 0.02)  # type: ignore[arg-type]
    assert bodies is not None
    return [note for note in bodies.notes if "rigid to each other" in note]


@pytest.mark.parametrize(("name", "base"), [("ur5", "base_link"), ("panda", "panda_link0")])
def test_a_base_in_a_block_is_noted(name: str, base: str) -> None:
    block = Obstacle.box("block", (1.0, 1.0, 0.1), (0.0, 0.0, 0.0))  # its top is 50 mm high
    (note,) = notes(name, block, self_=False)  # one hull for each link
    assert note.startswith(f"{base} and block are rigid to each other")
    bodies = gather(load_robot(name), PLATE, Collision(self_=False), 0.02)
    assert bodies is not None
    still = [body for body in bodies.polytopes if body.joint == 0]
    lowest = min(body.vertices[:, 2].min() - body.radius for body in still)
    assert f"overlap by {1e3 * (0.05 - lowest):.1f} mm" in note
    assert not notes(name, block, allow=((base, "block"),))


@pytest.mark.parametrize("name", ["ur5", "panda", "puma560", "kinova", "xarm7"])
def test_a_base_on_its_table_is_not(name: str) -> None:
    floor = -0.7 if name == "puma560" else 0.0  # its frame is at the shoulder
    assert not notes(name, Obstacle.halfspace("floor", (0.0, 0.0, floor)))
    assert not notes(name, Obstacle.box("post", (0.1, 0.1, 1.0), (1.0, 1.0, 0.0)))


def test_overlaps_of_balls_boxes_and_planes_are_theirs() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        turn = tuple(Rotation.random(random_state=rng).as_euler("xyz", degrees=True))
        box = Obstacle.box("b", tuple(rng.uniform(0.1, 0.5, 3)), (0.1, 0.2, 0.3), turn)
        sizes = np.array(box.geometry.size)  # type: ignore[union-attr]
        own = rng.uniform(-0.7, 0.7, 3) * sizes
        place = tuple(box.placement[:3, :3] @ own + box.placement[:3, 3])
        (a,) = polytopes_of(box, 5.0) or ()
        (b,) = polytopes_of(Obstacle.sphere("s", 0.05, place), 5.0) or ()
        past = np.abs(own) - sizes / 2
        depth = 0.05 - (past.max() if past.max() < 0 else np.linalg.norm(np.maximum(past, 0.0)))
        found = overlap(a, b)
        assert found == pytest.approx(overlap(b, a))
        assert depth - 1e-9 <= found <= depth + 0.01
        if past.max() < 0.0:
            assert found == pytest.approx(depth)
