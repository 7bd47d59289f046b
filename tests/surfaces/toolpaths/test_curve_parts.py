"""The parts of curves between poses hold all of these curves."""

from __future__ import annotations

import numpy as np
import pytest

from surfaces import SurfaceError, poses


def drawn(seed: int, count: int = 25, **more):
    """A toolpath that wanders and tilts, placed askew."""
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(0.0, 0.05, (count, 3)), axis=0)
    normals = np.array([0.0, 0.0, 2.0]) + rng.normal(0.0, 1.0, (count, 3))
    return poses(points, normals, rpy_deg=(10, -20, 130), position=(1.0, 2.0, 3.0), **more)


@pytest.mark.parametrize("neighbours", ["order", 0.3])
def test_every_place_of_every_curve_is_held(neighbours) -> None:
    cells = drawn(1, neighbours=neighbours)
    parts = cells.surface.parts(1e-3, 0.01)
    finest = np.flatnonzero(parts.children[:, 0] < 0)
    assert parts.radius[finest, 0].max() <= 1e-9
    assert parts.radius[finest, 1].max() <= 0.01
    shares = np.linspace(0.0, 1.0, 23)
    points, normals = cells.trace(cells.pairs, shares)
    places = np.concatenate([points, normals], axis=2).reshape(-1, 6)
    held = np.zeros(len(places), dtype=bool)
    # On a curve x_2 changes nothing; x_1 is where the point is nearest.
    for k in finest.tolist():
        centre, slope = parts.centre[k], parts.slopes[k, 0]
        assert not parts.slopes[k, 1].any()
        x = np.clip((places - centre)[:, :3] @ slope[:3] / (slope[:3] @ slope[:3]), -1.0, 1.0)
        off = places - centre - x[:, None] * slope
        held |= (np.linalg.norm(off[:, :3], axis=1) <= parts.radius[k, 0] + 1e-9) & (
            np.linalg.norm(off[:, 3:], axis=1) <= parts.radius[k, 1] + 1e-9
        )
    assert held.all()


def test_poses_without_bounds_say_so() -> None:
    own = drawn(2, approaches=np.tile([0.0, 0.0, -1.0], (25, 1)))
    with pytest.raises(SurfaceError, match="tool axes of their own have no bounds"):
        own.surface.parts(1e-3, 0.01)
    with pytest.raises(SurfaceError, match="24 curves; bounds are made for 1 to 20"):
        drawn(3).surface.parts(1e-3, 0.01, most=20)
