"""Passes keep their distance on the surface, go round holes, and run in the order they say."""

import math
from itertools import pairwise, product

import numpy as np
import pytest
from approved import refused
from mesh_patches import grid, panel_with_hole
from pygeodesic import geodesic
from samples import sampled, spread

from coverable import cylinder, mesh, parallel_passes, piecewise, plane, sphere
from surfaces.meshes.triangle_mesh import TriangleMesh
from surfaces.passes import triangulation
from surfaces.passes.toolpath import pass_route

HALF = math.pi / 2
SURFACES = {
    "plate": plane((0.0, 0.6), (0.0, 0.4), position=(0.3, -0.2, 0.5), rpy_deg=(20, -35, 50)),
    "arch": cylinder(0.3, (10, 100), (0, 0.5), position=(0.1, 0.2, 0.3), rpy_deg=(15, 25, 35)),
    "cap": sphere(0.4, (60, 120), (-35, 35), rpy_deg=(5, 10, 15)),
}
PLATE, ARCH, CAP = SURFACES.values()


def unrolled(name, points):
    """Points (k, 3) on the plate or the arch, laid flat; on the cap as they are."""
    surface = SURFACES[name]
    own = (points - surface.position) @ surface.rotation
    if name == "arch":
        return np.column_stack([0.3 * np.arctan2(own[:, 1], own[:, 0]), own[:, 2]])
    return own


def away(name, points, line):
    """(k,) m on the surface, from points (k, 3) to the nearest place of a line (m, 3)."""
    a, b = unrolled(name, points), unrolled(name, line)
    if name == "cap":  # great circles to the line's many points
        chords = np.linalg.norm(a[:, None] - b[None], axis=2).min(axis=1)
        return 2.0 * 0.4 * np.arcsin(0.5 * chords / 0.4)
    start, piece = b[:-1], np.diff(b, axis=0)
    share = ((a[:, None] - start) * piece).sum(axis=2) / (piece**2).sum(axis=1)
    nearest = start + np.clip(share, 0.0, 1.0)[:, :, None] * piece
    return np.linalg.norm(a[:, None] - nearest, axis=2).min(axis=1)


def by_level(found):
    assert sorted({each.level for each in found.stretches}) == list(range(found.count))
    return [[e for e in found.stretches if e.level == level] for level in range(found.count)]


def inwards(found):
    """Each stretch beside those of the next pass towards the first one."""
    levels, middle = by_level(found), (found.count - 1) / 2
    for level, row in enumerate(levels):
        inner = level + (1 if level < middle - 0.5 else -1 if level > middle + 0.5 else 0)
        if inner != level:
            yield from ((each, levels[inner]) for each in row)


@sampled(("name", "direction"), spread([*product(SURFACES, (0.0, HALF, 0.4))], 5))
def test_the_pitch_holds_on_the_surface(name, direction):
    """From each outer pass to its inner neighbour, towards the first pass, within 2 %."""
    found = parallel_passes(SURFACES[name], 0.04, direction, step=0.004)
    assert found.spacing <= 0.04
    checked = 0
    for each, (other, *_) in inwards(found):
        distances = away(name, each.points, other.points)
        # Beside the end of the inner pass there is none of it to be away from.
        ends = [away(name, each.points, other.points[some]) for some in ([0, 1], [-2, -1])]
        beside = distances < 0.9999 * np.minimum(*ends)
        assert np.abs(distances[beside] / found.spacing - 1.0).max() <= 0.02
        checked += int(beside.sum())
    assert checked > 250


@pytest.mark.parametrize("by", ["planes", "distance"])
def test_planes_say_how_far_apart_they_are_where_a_surface_slopes(by):
    """On a cylinder, planes a pitch apart are R (asin((k + 1) P / R) - asin(k P / R)) apart."""
    found = parallel_passes(ARCH, 0.03, HALF, by=by, step=0.01)
    assert (found.widest == found.spacing) == (by == "distance")
    flat = [unrolled("arch", row[0].points)[5, 0] for row in by_level(found)]
    gaps = np.abs(np.diff(flat))
    assert gaps.max() <= found.widest * 1.001
    if by == "planes":
        at = -0.3 * math.sin(math.pi / 4) + (np.arange(found.count) + 0.5) * found.spacing
        assert np.allclose(np.sort(gaps), np.sort(np.diff(0.3 * np.arcsin(at / 0.3))), rtol=5e-3)
        assert gaps.max() > 1.2 * found.spacing


def test_lines_of_constant_parameters():
    surface = sphere(0.4, (50, 90), (0, 60))
    found = parallel_passes(surface, 0.03, HALF, by="parameters")
    for each in found.stretches:
        assert np.ptp(surface.closest(each.points).u) < 1e-4
    assert found.widest == pytest.approx(found.spacing, rel=1e-3)  # parallels are evenly apart
    meridians = parallel_passes(surface, 0.03, 0.0, by="parameters")
    assert meridians.spacing <= 0.03  # where they are widest apart, at the equator
    (note,) = parallel_passes(PLATE, 0.05, HALF / 2, by="parameters").notes
    assert "45 deg from the requested direction" in note  # along u or v alone
    assert not parallel_passes(PLATE, 0.05, HALF, by="parameters").notes


def test_a_hole_parts_passes_and_leaves_them_straight():
    found = parallel_passes(panel_with_hole(0.02), 0.045)
    assert found.count == math.ceil(0.4 / 0.045)
    assert any("1 hole" in note for note in found.notes)
    for level, row in enumerate(by_level(found)):
        height = 0.4 * (level + 0.5) / found.count
        chord = 2.0 * math.sqrt(max(0.08**2 - (height - 0.2) ** 2, 0.0))
        y = np.concatenate([each.points[:, 1] for each in row])
        assert np.abs(y - height).max() <= 0.02 * found.spacing
        assert len(row) == (2 if chord > 0.0 else 1)
        assert sum(each.length for each in row) == pytest.approx(0.6 - chord, abs=2e-3)
        for each in row:
            assert np.linalg.norm(each.points[:, :2] - [0.3, 0.2], axis=1).min() >= 0.08 - 2e-4
    fewer = parallel_passes(panel_with_hole(0.04), 0.13, shortest=0.25)  # it parts two of four
    assert fewer.dropped == pytest.approx(2 * (0.6 - 2.0 * math.sqrt(0.08**2 - 0.05**2)), abs=5e-3)


def test_every_other_pass_is_turned_round_unless_it_is_one_way():
    for one_way in (False, True):
        found = parallel_passes(PLATE, 0.05, one_way=one_way)
        own = [(each.points @ PLATE.rotation)[[0, -1], 0] for each in found.stretches]
        forward = [bool(ends[1] > ends[0]) for ends in own]
        assert len(set(forward)) == (1 if one_way else 2)
        assert all(a != b for a, b in pairwise(forward)) != one_way


def test_overrun_goes_straight_on_beyond_the_border():
    found = parallel_passes(ARCH, 0.05, HALF, overrun=0.04)
    for each in found.stretches:
        on = np.flatnonzero(each.on_surface)
        assert (np.diff(on) == 1).all()  # the overrun is at both ends
        assert on[0] == len(each.points) - 1 - on[-1] > 0
        own = (each.points - ARCH.position) @ ARCH.rotation
        assert own[:, 2].min() == pytest.approx(-0.04, abs=1e-6)
        assert own[:, 2].max() == pytest.approx(0.54, abs=1e-6)
        assert np.allclose(np.linalg.norm(own[:, :2], axis=1), 0.3, atol=1e-6)
        assert np.allclose(np.linalg.norm(each.normals, axis=1), 1.0)
    assert pass_route(parallel_passes(PLATE, 0.05, overrun=0.04)).places.lifts == 0


def test_round_a_tube_and_along_it():
    tube = cylinder(0.1, (0, 360), (0, 0.3))
    rings = parallel_passes(tube, 0.02, 0.0)
    assert rings.count == 15
    assert all(each.closed for each in rings.stretches)
    assert all(np.array_equal(each.points[0], each.points[-1]) for each in rings.stretches)
    along = parallel_passes(tube, 0.02, HALF)
    assert along.count == len(along.stretches) == math.ceil(math.tau * 0.1 / 0.02 - 0.01)
    angle = np.sort([math.atan2(*each.points[3, 1::-1]) % math.tau for each in along.stretches])
    assert np.allclose(np.diff(angle) * 0.1, along.spacing, rtol=0.02)


@pytest.mark.parametrize("cut", [0.1, 0.15])  # a vertex just beside another
def test_pieces_are_sewn_along_their_seam(cut):
    """Two flat plates and a quarter of a cylinder that go over into one another, cut apart."""
    flat = [plane((-0.3, 0.0), v, position=(0, 0, 0.2)) for v in ((0.0, cut), (cut, 0.4))]
    bend = cylinder(0.2, (0, 90), (-0.4, 0.0), side="outside", rpy_deg=(90, 0, 0))
    surface = piecewise([*flat, bend], side="outside")
    found, length = parallel_passes(surface, 0.03, (1.0, 0.0, 0.0)), 0.3 + 0.1 * math.pi
    assert found.count == math.ceil(0.4 / 0.03)
    for each in found.stretches:
        assert each.length == pytest.approx(length, rel=1e-3)
        assert np.ptp(each.points[:, 1]) <= 0.02 * found.spacing
    assert parallel_passes(surface, 0.03, (0.0, 1.0, 0.0)).count == math.ceil(length / 0.03)


def test_over_many_triangles_distances_are_taken_on_a_copy(monkeypatch):
    """The passes lie on the surface itself, and keep their pitch within 2 %."""
    monkeypatch.setattr(triangulation, "MOST_EXACT", 10_000)
    monkeypatch.setattr(triangulation, "COPIED", 6_000)
    rng = np.random.default_rng(0)
    u, v = np.meshgrid(np.linspace(0.2, 1.7, 90), np.linspace(0.0, 0.5, 75), indexing="ij")
    for values, step in ((u, 1.5 / 90), (v, 0.5 / 75)):
        values[1:-1, 1:-1] += rng.uniform(-0.2, 0.2, (88, 73)) * step
    points = 0.3 * np.stack([np.cos(u), np.sin(u), v / 0.3], axis=-1).reshape(-1, 3)
    own = points @ ARCH.rotation.T + ARCH.position
    fine = mesh(TriangleMesh(own, grid(89, 74)[2]), side="outside")
    found = parallel_passes(fine, 0.05, 0.5, step=0.01)
    assert any("a copy of" in note for note in found.notes)
    for each, inner in inwards(found):
        assert np.abs(fine.closest(each.points).height).max() <= 1e-7
        lines = [away("arch", each.points, other.points) for other in inner]
        assert np.abs(np.min(lines, axis=0) / found.spacing - 1.0).max() <= 0.02


@pytest.mark.parametrize("source", [7, 2**32 - 1])
def test_vertices_that_distances_do_not_reach_take_theirs_from_neighbours(source, monkeypatch):
    """Rounding may lose vertices; pygeodesic names any source of them, or fails over its number."""
    rng, measured = np.random.default_rng(5), geodesic.PyGeodesicAlgorithmExact.geodesicDistances
    fails = [OverflowError] * (source >= 2**31)

    class Forgetful(geodesic.PyGeodesicAlgorithmExact):
        def geodesicDistances(self, sources, targets):
            if fails:
                raise fails.pop()
            found, nearest = measured(self, sources, targets)
            lost = rng.choice(np.flatnonzero(found > 0.02), len(found) // 25, replace=False)
            found[lost], nearest[lost] = np.inf, min(source, 10**9)
            return found, nearest

    monkeypatch.setattr(geodesic, "PyGeodesicAlgorithmExact", Forgetful)
    found = parallel_passes(panel_with_hole(0.02), 0.05, 0.0, step=0.004)
    assert any("the exact distance did not reach" in note for note in found.notes)
    assert found.spacing <= found.widest <= 1.02 * found.spacing
    for each in found.stretches:
        height = 0.4 * (each.level + 0.5) / found.count
        assert np.abs(each.points[:, 1] - height).max() <= 0.02 * found.spacing


def test_bad_input_is_named(approved):
    u, v, faces = grid(4, 4)
    points = np.column_stack([u, v, np.zeros_like(u)])
    both = np.concatenate([points, points + np.array([2.0, 0.0, 0.0])])
    apart = mesh(TriangleMesh(both, np.concatenate([faces, faces + len(points)])))
    asked = [
        (PLATE, {"pitch": 0.0}), (PLATE, {"pitch": math.nan, "overrun": -1.0}),
        (PLATE, {"pitch": 0.03, "direction": PLATE.rotation[:, 2]}),
        (PLATE, {"pitch": 0.03, "direction": math.inf}),
        (PLATE, {"pitch": 0.03, "direction": (1.0, 0.0)}), (PLATE, {"pitch": 0.03, "by": "heat"}),
        (PLATE, {"pitch": 1e-6}), (apart, {"pitch": 0.2}),
        (panel_with_hole(0.05), {"pitch": 0.05, "by": "parameters"}),
    ]  # fmt: skip
    said = [refused(parallel_passes, surface, **arguments) for surface, arguments in asked]
    approved("passes refused", "\n".join(said))
    assert parallel_passes(apart, 0.2, by="planes").length > 8.0  # the remedy that is named
