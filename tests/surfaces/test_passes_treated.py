"""The bracket of the treated share: against closed forms, and points drawn by the area."""

import math

import numpy as np
import pytest
from mesh_patches import grid, panel_with_hole
from referee import unit
from samples import sampled, seeds

from coverable import cylinder, plane
from surfaces.passes.tool_lines import ToolLines, visits
from surfaces.passes.treated_share import treated_share
from surfaces.passes.triangulation import working_mesh
from surfaces.passes.welded_triangles import WorkingMesh


def facing(mesh: WorkingMesh) -> np.ndarray:
    return unit(mesh.doubled_areas)


def lines_of(*rows: np.ndarray, normal=(0.0, 0.0, 1.0)) -> ToolLines:
    points = np.concatenate(rows)
    normals = np.broadcast_to(np.asarray(normal, float), points.shape).copy()
    return ToolLines(points, normals, np.repeat(np.arange(len(rows)), [len(row) for row in rows]))


def straight(a, b, step=0.0035) -> np.ndarray:
    count = math.ceil(np.linalg.norm(np.subtract(b, a)) / step) + 1
    return np.linspace(a, b, count)


PLATE = working_mesh(plane((0.0, 0.6), (0.0, 0.4)), 0.007)


def strips():
    rows = [straight((-0.03, y, 0), (0.63, y, 0)) for y in (0.05, 0.15, 0.25, 0.35)]
    return PLATE, lines_of(*rows), 0.02, 4 * 0.04 / 0.4


def stadium():
    line = straight((0.15, 0.2, 0), (0.45, 0.2, 0))
    return PLATE, lines_of(line), 0.05, (2 * 0.05 * 0.3 + math.pi * 0.05**2) / 0.24


def annulus():
    angle = np.linspace(0.0, math.tau, 300)
    ring = np.column_stack([0.3 + 0.1 * np.cos(angle), 0.2 + 0.1 * np.sin(angle), 0 * angle])
    return PLATE, lines_of(ring), 0.02, 4 * math.pi * 0.1 * 0.02 / 0.24


def along_cylinder():
    """The half width of a ball on a cylinder, passes along it: 2 R asin(r / 2R)."""
    surface = cylinder(0.3, (0, 90), (0.0, 0.5))
    angles = np.radians([15.0, 45.0, 75.0])
    out = np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    rows = [straight((*0.3 * way[:2], -0.03), (*0.3 * way[:2], 0.53)) for way in out]
    lines = lines_of(*rows)
    lines = lines._replace(normals=out[lines.stretch])
    truth = 3 * 2 * (2 * 0.3 * math.asin(0.03 / 0.6)) / (0.3 * math.pi / 2)
    return working_mesh(surface, 0.007), lines, 0.03, truth


def beside_and_across_a_hole():
    """Strips less what the hole takes from them: a segment of its circle, and a slice of it."""
    rows = [straight((-0.04, y, 0), (0.64, y, 0)) for y in (0.1, 0.2, 0.35)]
    segment = 0.08**2 * math.acos(0.07 / 0.08) - 0.07 * math.sqrt(0.08**2 - 0.07**2)
    across = 2.0 * (0.03 * math.sqrt(0.08**2 - 0.03**2) + 0.08**2 * math.asin(0.03 / 0.08))
    treated = 3 * 0.06 * 0.6 - segment - across
    share = treated / (0.24 - math.pi * 0.08**2)
    return working_mesh(panel_with_hole(), 0.007), lines_of(*rows), 0.03, share


BENT = (along_cylinder, beside_and_across_a_hole)


@pytest.mark.parametrize("case", [strips, stadium, annulus, *BENT])
def test_the_bracket_holds_the_closed_form(case):
    mesh, lines, radius, truth = case()
    found = treated_share(mesh, facing(mesh), lines, radius)
    bent = 2e-3 * truth if case in BENT else 1e-6  # the mesh's own error
    assert found.lower <= truth + bent
    assert found.upper >= truth - bent
    assert found.upper - found.lower <= 0.005
    assert abs(0.5 * (found.lower + found.upper) - truth) <= 0.005
    # Beside a straight line the distance is linear over a face: of cut faces the share is exact.
    assert case is not strips or found.lower == pytest.approx(truth, abs=2e-5)


@sampled("seed", seeds(2, all=5))
def test_no_face_is_treated_more_or_less_than_is_said_of_it(seed):
    """Large faces that are not cut, about places at random; against points all over each face."""
    rng = np.random.default_rng(seed)
    u, v, faces = grid(12, 8)
    mesh = WorkingMesh(np.column_stack([0.36 * u, 0.24 * v, 0.0 * u]), faces)
    points = np.column_stack([rng.uniform(0.0, [0.36, 0.24], (8, 2)), np.zeros(8)])
    lines = ToolLines(points, np.tile([0.0, 0.0, 1.0], (8, 1)), np.arange(8))
    found = treated_share(mesh, facing(mesh), lines, 0.045, rounds=0)
    a, b = (x.ravel() for x in np.mgrid[0:60, 0:60])
    a, b = (x[a + b < 60] / 60 + 1 / 180 for x in (a, b))
    places = np.stack([1.0 - a - b, a, b], axis=1) @ mesh.corners
    away = np.linalg.norm(places[:, :, None] - points, axis=3).min(axis=2)
    truth = (away <= 0.045).mean(axis=1)
    assert (found.shares <= truth + 0.01).all()
    assert (found.most >= truth - 0.01).all()
    assert ((found.most - truth)[truth > 0.0] < 0.1).any()


def test_the_back_of_a_thin_part_is_not_treated_through_it():
    """A sheet folded to 4 mm, so that its back is joined with its front; a footprint of 40 mm."""
    x, y, _ = PLATE.vertices.T
    folded = np.column_stack([0.3 - abs(x - 0.3), y, np.where(x > 0.3, -0.004, 0.0)])
    both = WorkingMesh(folded, PLATE.faces)
    one = lines_of(straight((0.0, 0.2, 0), (0.28, 0.2, 0)))
    found = treated_share(both, facing(both), one, 0.02)
    front = (0.04 * 0.28 + 0.5 * math.pi * 0.02**2) / both.areas.sum()
    assert (found.lower, found.upper) == pytest.approx((front, front), abs=2e-3)


def test_what_is_not_connected_within_the_ball_is_not_treated():
    """Two flanges that look the same way, 30 mm above one another."""
    shelf = PLATE.vertices + np.array([0.0, 0.0, 0.03])
    both = WorkingMesh(
        np.concatenate([PLATE.vertices, shelf]),
        np.concatenate([PLATE.faces, PLATE.faces + len(shelf)]),
    )
    found = treated_share(both, facing(both), lines_of(straight((0, 0.2, 0), (0.6, 0.2, 0))), 0.05)
    assert found.upper <= 0.5 * 0.25 + 0.005


def test_a_tool_that_may_be_off_treats_less_for_certain_and_more_perhaps():
    """What it does within 10 mm of a line is in the bracket: wobble, or stop short of the ends."""
    mesh, line, radius, _ = stadium()
    found = treated_share(mesh, facing(mesh), line, radius, off=0.01)
    x = np.linspace(0.15, 0.45, 3000)
    wobbling = np.column_stack([x, 0.2 + 0.01 * np.sin(400.0 * x), 0.0 * x])
    for path in (wobbling, straight((0.16, 0.2, 0), (0.44, 0.2, 0))):
        real = treated_share(mesh, facing(mesh), lines_of(path), radius)
        assert found.lower <= real.upper
        assert found.upper >= real.lower
    least, most = ((2 * r * 0.3 + math.pi * r**2) / 0.24 for r in (0.04, 0.06))
    assert (found.lower, found.upper) == pytest.approx((least, most), abs=0.01)
    nothing = treated_share(mesh, facing(mesh), line, radius, off=radius)
    assert (nothing.lower, nothing.upper) == (0.0, 1.0)


def test_a_footprint_far_larger_than_the_surface_is_counted_too():
    """Within reach of everything a path comes by once; at a few pitches, by each of its passes."""
    x = np.linspace(0.0, 0.6, 600)
    rows = [
        np.column_stack([x[:: 1 if k % 2 else -1], np.full(600, 0.02 * k + 0.01), 0.0 * x])
        for k in range(20)
    ]
    points = np.concatenate(rows)
    up = np.tile([0.0, 0.0, 1.0], (len(points), 1))
    line = ToolLines(points, up, np.zeros(len(points), dtype=np.int64))
    places = np.random.default_rng(1).uniform(0.0, [0.6, 0.4, 0.0], (4000, 3))
    for radius in (1.0, 100.0):
        assert (visits(places, -up[:4000], line, radius) == 0).all()  # seen from behind
        assert (visits(places, up[:4000], line, radius) == 1).all()
    inner = np.abs(places - [0.3, 0.2, 0.0]).max(axis=1) < 0.1
    for radius, passes in ((0.03, 3.0), (0.05, 5.0)):
        assert visits(places[inner], up[:4000][inner], line, radius).mean() == pytest.approx(
            passes, rel=0.06
        )
