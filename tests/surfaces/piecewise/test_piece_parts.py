"""Parts of joined patches: one tree over all pieces, with the normals of the joined surface."""

import numpy as np
import pytest
from part_walks import at_parameters, residuals, spread, walk
from smooth_probes import POSE
from spline_nets import hood

from surfaces import bspline, cylinder, ellipsoid, piecewise, plane, sphere

EAST, WEST = (sphere(0.5, (20, 90), ends) for ends in ((0, 180), (180, 360)))
JOINED = {
    "zone": piecewise([EAST, WEST], **POSE),
    "turned": piecewise(
        [plane((0.0, 0.2), (0.0, 0.2)), plane((0.0, 0.2), (0.0, 0.2), rpy_deg=(180, 0, 180))]
    ),
    "can": piecewise(
        [
            cylinder(0.3, (0, 360), (0, 0.5)),
            ellipsoid((0.3, 0.3, 0.1), (0, 90), (0, 360), position=(0, 0, 0.5)),
        ],
        side="outside",
        **POSE,
    ),
    "hood": piecewise([bspline(hood(), u=(0, 0.5)), bspline(hood(), u=(0.5, 1))], **POSE),
    "apart": piecewise([plane((k, k + 0.5), (0.0, 0.2)) for k in range(5)]),
    "one": piecewise([EAST]),
}


@pytest.mark.parametrize("name", JOINED)
def test_every_place_of_every_piece_lies_in_its_parts(name):
    surface = JOINED[name]
    assert any(surface.turned) == (name == "turned")
    parts = surface.parts(2e-3, 0.05, 2000)
    count = len(surface.pieces)
    above = np.full(len(parts), -1)
    inner = np.flatnonzero(parts.children[:, 0] >= 0)
    above[parts.children[inner]] = inner[:, None]
    for k, (piece, sign) in enumerate(zip(surface.placed, surface.signs, strict=True)):
        u, v = spread(piece, 2000)
        _, x = at_parameters(piece, u, v)
        points, normals = piece.point(u, v), sign * piece.normal(u, v)
        used = walk(parts, np.full(len(u), count - 1 + k), x, points, normals)
        assert max(used.points, used.normals) <= 1.0
        over = above[count - 1 + k]
        while over >= 0:
            held = residuals(parts, np.full(len(u), over), 0.0 * x, points, normals)
            assert (held <= parts.radius[over]).all()
            over = above[over]
    finest = parts.children[:, 0] < 0
    assert (parts.radius[finest] <= [2e-3, 0.05]).all() or len(parts) + 2 > 2000


def test_closest_points_lie_in_the_model_of_some_finest_part():
    surface = JOINED["can"]
    parts = surface.parts(2e-3, 0.05, 2000)
    rng = np.random.default_rng(4)
    direction = rng.normal(size=(100, 3))
    found = surface.nearest(surface.position + direction)
    finest = np.flatnonzero(parts.children[:, 0] < 0)
    for place, normal in zip(found.places, found.normals, strict=True):
        slopes = parts.slopes[finest]
        away = np.concatenate([place, normal]) - parts.centre[finest]
        inverse = np.linalg.pinv(slopes[..., :3].transpose(0, 2, 1), rcond=1e-9)
        x = np.clip(np.einsum("kcd,kd->kc", inverse, away[:, :3]), -1.0, 1.0)
        off = residuals(parts, finest, x, place[None], normal[None])
        assert (off <= 1.5 * parts.radius[finest]).all(axis=1).any()
