"""Poses in place of a surface: their cells, the curves and paths between them, and their bounds."""

from dataclasses import replace

import numpy as np
import pytest
from bad_input import goods
from bounds import holds
from part_walks import survivors
from specimens import TILTED, drawn

from coverable import SurfaceError, poses, read_poses
from surfaces.places.offset_surfaces import offset_surface
from surfaces.places.places import Places

LINE = np.array([[0.4, 0.0, 0.3], [0.4, 0.1, 0.3], [0.4, 0.2, 0.3], [0.4, 0.2, 0.3]])
UP = np.tile([0.0, 0.0, 2.0], (4, 1))
TURNED = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
DENSE = np.linspace(0.0, 1.0, 41)


def test_each_pose_is_a_cell_where_it_is_placed():
    cells = poses(LINE, UP, TURNED, [[3, 0, 1]] * 4, **TILTED)
    turn, at = cells.surface.rotation, np.array(TILTED["position"])
    np.testing.assert_allclose(cells.centres, LINE @ turn.T + at, atol=1e-12)
    np.testing.assert_allclose(cells.normals, np.tile(turn[:, 2], (4, 1)), atol=1e-12)
    np.testing.assert_allclose(cells.approaches, TURNED @ turn.T, atol=1e-12)
    np.testing.assert_allclose(cells.tangents, np.tile(turn[:, 0], (4, 1)), atol=1e-12)
    assert (cells.pairs.tolist(), cells.in_order) == ([[0, 1], [1, 2], [2, 3]], True)
    assert cells.locate(cells.centres[:2] + 0.01).tolist() == [0, 1]
    for some in (cells, poses(LINE, UP, **TILTED)):  # drawn as squares half as wide as a step
        tiles = some.triangles(np.arange(4)).vertices.reshape(4, 4, 3)
        one, other, _ = np.diff(tiles, axis=1).transpose(1, 0, 2)
        np.testing.assert_allclose(tiles.mean(axis=1), cells.centres, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm([one, other], axis=2), 0.05)
        np.testing.assert_allclose(np.cross(cells.normals, one), other, atol=1e-12)
        assert some.tangents is None or np.allclose(one, 0.05 * some.tangents)
        flat = np.diff(some.unrolled().outlines, axis=1)[:, :2]  # y down
        np.testing.assert_allclose(np.linalg.det(flat), -(0.05**2))


def test_poses_of_noether_and_of_clouds(tmp_path):
    good = goods("poses")
    (tmp_path / "a.yaml").write_text(good["noether"])
    (tmp_path / "a.pcd").write_text(good["cloud"])
    head, _, rows = good["cloud"].partition("ascii\n")
    table = np.array([row.split() for row in rows.splitlines()], dtype="<f4")
    (tmp_path / "b.PCD").write_bytes(f"{head}binary\n".encode() + table.tobytes())
    for file, way in (("a.yaml", -1), ("a.pcd", 1), ("b.PCD", 1)):  # a quarter about x
        given = read_poses(tmp_path / file, "mm")
        np.testing.assert_allclose(given.points, [[0.4, 0, 0.3], [0.4, 0.125, 0.3]], atol=1e-15)
        np.testing.assert_allclose(given.normals, [[0, 0, 1], [0, way, 0]], atol=1e-15)
        assert given.tangents is None or np.allclose(given.tangents, [1, 0, 0], 0, 1e-15)


def test_within_a_radius_poses_of_one_side_are_neighbours():
    points = [[0, 0, 0], [0.1, 0, 0], [0.3, 0, 0], [0.1, 0, 0.01]]
    normals = [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0.1, -1]]
    cells = poses(points, normals, neighbours=0.15)
    assert (cells.pairs.tolist(), cells.in_order) == ([[0, 1]], False)


@pytest.mark.parametrize("cells", [poses(LINE, TURNED), drawn(1, neighbours=0.3)], ids=str)
def test_between_poses_points_run_straight_and_normals_along_great_arcs(cells):
    one, other = (cells.pairs[:, end] for end in (0, 1))
    angle = np.arccos(np.clip((cells.normals[one] * cells.normals[other]).sum(axis=1), -1, 1))
    for k, (i, j) in enumerate(cells.pairs):
        points, normals = cells.curves.at(np.full(41, k), DENSE)
        line = cells.centres[i] + DENSE[:, None] * (cells.centres[j] - cells.centres[i])
        np.testing.assert_allclose(points, line, atol=1e-12)
        both = np.sin([(1 - DENSE) * angle[k], DENSE * angle[k]]) / np.sin(angle[k])
        arc = both[0][:, None] * cells.normals[i] + both[1][:, None] * cells.normals[j]
        off = np.linalg.norm(normals - arc, axis=1)
        holds(cells.curves.deviations[k, 1], off, used=0.0)
        # Second differences are bounded by what is stated of the second derivative.
        bend = np.linalg.norm(np.diff(normals, 2, axis=0), axis=1).max() * 40.0**2
        rows = slice(*cells.curves.first[k : k + 2])
        assert 0.9 * angle[k] ** 2 < bend <= 1.0001 * cells.curves.derivative_bounds[rows, 1].max()
    assert cells.curves.deviations[:, 1].max() < 2e-5


def test_places_follow_the_curves_past_crowds_and_tell_turns_on_the_spot_apart():
    cells = poses(LINE, TURNED)
    offset = offset_surface(cells.surface, 0.02)
    targets = LINE + 0.02 * TURNED
    chart, share = np.array([0, 1, 2, 2]), np.array([0.3, 0.7, 0.2, 0.9])
    there = Places(chart, np.column_stack([share, np.zeros(4)]))
    points, directions, _ = offset.at(there)
    ahead = targets[chart] + share[:, None] * (targets[chart + 1] - targets[chart])
    np.testing.assert_allclose(points, ahead, atol=1e-12)
    found = offset.nearest(points, points - 0.02 * directions, 1e-3)
    assert found.chart.tolist() == chart.tolist()
    np.testing.assert_allclose(found.x[:, 0], share, atol=1e-6)
    spot = offset_surface(cells.surface, 0.0)
    points, directions, _ = spot.at(there)
    found = spot.nearest(points, points - spot.least_look * directions, 1e-3)
    np.testing.assert_allclose(found.x[2:, 0], share[2:], atol=1e-9)
    ends = [[x, y, 0] for x in (0, 0.4) for y in range(8)] + [[0.1, 0.05, 0]] * 4
    crowd = poses(ends, [[0, 0, 1]] * 16 + [[0, 0, -1]] * 4, neighbours=0.5).surface
    point = np.array([[0.1, 0.0, 0.0]])
    found = offset_surface(crowd, 0.0).nearest(point, point - [0, 0, 1], 1e-3)
    assert crowd.pairs[found.chart].tolist() == [[0, 8]]
    assert offset_surface(crowd, 0.0).along(found) is None  # they are in no order


@pytest.mark.parametrize("neighbours", ["order", 0.3])
def test_parts_hold_every_place_of_every_curve(neighbours):
    cells = drawn(1, 14, neighbours=neighbours)
    parts = cells.surface.parts(1e-3, 0.01)
    finest = parts.children[:, 0] < 0
    assert (parts.radius[finest] <= [1e-9, 0.01]).all()
    points, normals = (values.reshape(-1, 3) for values in cells.trace(cells.pairs, DENSE))
    wide = replace(parts, radius=parts.radius + 1e-12)  # rounding between two ways to a place
    assert survivors(wide, points, normals).all()
    less = wide.radius * np.where(finest[:, None], [1.0, 0.8], 1.0)
    assert not survivors(replace(parts, radius=less), points, normals).all()


def test_poses_without_bounds_say_so():
    with pytest.raises(SurfaceError, match="24 curves; bounds are made for 1 to 20"):
        drawn(3).surface.parts(1e-3, 0.01, most=20)
