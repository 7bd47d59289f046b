"""Poses as cells: what is made of them, and what is refused."""

import math

import numpy as np
import pytest

from surfaces import SurfaceError, poses, read_poses, sheet_of
from surfaces.places import Places, offset_surface

LINE = np.array([[0.4, 0.0, 0.3], [0.4, 0.1, 0.3], [0.4, 0.2, 0.3], [0.4, 0.2, 0.3]])
UP = np.tile([0.0, 0.0, 2.0], (4, 1))
TURNED = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
TILTED = {"position": (1.0, 2.0, 3.0), "rpy_deg": (20.0, -30.0, 50.0)}


def test_each_pose_is_a_cell_where_it_is_placed():
    cells = poses(LINE, UP, TURNED, [[3, 0, 1]] * 4, **TILTED)
    turn, at = cells.surface.rotation, np.array(TILTED["position"])
    np.testing.assert_allclose(cells.centres, LINE @ turn.T + at, atol=1e-12)
    np.testing.assert_allclose(cells.normals, np.tile(turn[:, 2], (4, 1)), atol=1e-12)
    np.testing.assert_allclose(cells.approaches, TURNED @ turn.T, atol=1e-12)
    np.testing.assert_allclose(cells.tangents, np.tile(turn[:, 0], (4, 1)), atol=1e-12)
    assert cells.pairs.tolist() == [[0, 1], [1, 2], [2, 3]]
    assert cells.in_order


def test_between_poses_points_run_straight_and_normals_along_great_arcs():
    cells = poses(LINE, TURNED)
    t = np.linspace(0.0, 1.0, 41)
    for k, (i, j) in enumerate(cells.pairs):
        point, normal = cells.curves.at(np.full(41, k), t)
        np.testing.assert_allclose(point, LINE[i] + t[:, None] * (LINE[j] - LINE[i]), atol=1e-12)
        angle = math.acos(TURNED[i] @ TURNED[j])
        both = np.sin([(1 - t) * angle, t * angle]) / np.sin(angle)
        arc = both[0][:, None] * TURNED[i] + both[1][:, None] * TURNED[j]
        off = np.linalg.norm(normal - arc, axis=1).max()
        assert off <= cells.curves.deviations[k, 1] < 2e-5
        # Second differences are bounded by what is stated of the second derivative.
        bend = np.linalg.norm(np.diff(normal, 2, axis=0), axis=1).max() * 40.0**2
        rows = slice(*cells.curves.first[k : k + 2])
        assert 0.9 * angle**2 < bend <= cells.curves.derivative_bounds[rows, 1].max() * 1.0001


def test_within_a_radius_poses_of_one_side_are_neighbours():
    points = [[0, 0, 0], [0.1, 0, 0], [0.3, 0, 0], [0.1, 0, 0.01]]
    normals = [[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0.1, -1]]
    cells = poses(points, normals, neighbours=0.15)
    assert cells.pairs.tolist() == [[0, 1]]
    assert not cells.in_order


def test_places_follow_the_curves_and_tell_turns_on_the_spot_apart():
    cells = poses(LINE, TURNED)
    offset = offset_surface(cells.surface, 0.02)
    targets = LINE + 0.02 * TURNED
    chart, share = np.array([0, 1, 2, 2]), np.array([0.3, 0.7, 0.2, 0.9])
    there = Places(chart, np.column_stack([share, np.zeros(4)]))
    points, directions = offset.at(there)
    ahead = targets[chart] + share[:, None] * (targets[chart + 1] - targets[chart])
    np.testing.assert_allclose(points, ahead, atol=1e-12)
    found = offset.nearest(points, points - 0.02 * directions, 1e-3)
    assert found.chart.tolist() == chart.tolist()
    np.testing.assert_allclose(found.x[:, 0], share, atol=1e-6)
    spot = offset_surface(cells.surface, 0.0)
    points, directions = spot.at(there)
    found = spot.nearest(points, points - spot.least_look * directions, 1e-3)
    np.testing.assert_allclose(found.x[2:, 0], share[2:], atol=1e-9)


def test_paths_of_places_stay_within_their_bounds():
    cells = poses(LINE, TURNED)
    offset = offset_surface(cells.surface, 0.02)
    start = Places(np.array([0, 0, 1]), np.array([[0.2, 0.0], [0.5, 0.0], [0.9, 0.0]]))
    end = Places(np.array([0, 1, 2]), np.array([[0.9, 0.0], [0.4, 0.0], [0.3, 0.0]]))
    paths = offset.paths(start, end)
    assert np.isfinite(paths.derivative_bounds).all()
    for k, piece in ((0, 2), (1, 0), (2, 2)):
        chart = start.chart[k] if piece == 0 or k == 0 else end.chart[k]
        x = {0: 0.55, 1: 0.75, 2: 0.15}[k]
        _, true = offset.at(Places(np.array([chart]), np.array([[x, 0.0]])))
        line = 0.5 * (paths.normals[k, piece] + paths.normals[k, piece + 1])
        assert np.linalg.norm(true[0] - line) <= paths.derivative_bounds[k, piece, 1] / 8.0 + 1e-12
    apart = offset.paths(start.of([0]), Places(np.array([2]), np.array([[0.5, 0.0]])))
    assert np.isinf(apart.derivative_bounds).any()  # none leads two curves further in one step


def test_what_makes_no_poses_is_named_all_at_once():
    with pytest.raises(SurfaceError) as caught:
        poses([[0, 0, 0], [0, 0, 1]], [[0, 0, 1], [0, 0, 0]], tangents=[[1, 0, 0]], neighbours=-1)
    text = str(caught.value)
    for part in ("normals[1] must have a direction", "tangents", "neighbours must be"):
        assert part in text
    cases = [
        (([[0, 0, 0]], [[0, 0, 1]]), "at least 2 poses"),
        ((LINE, -TURNED * [[1], [1], [1], [-1]], TURNED * [[1], [-1], [1], [1]]), ""),
        (([[0, 0, 0], [0, 0, math.nan]], [[0, 0, 1]] * 2), "points[1][2] must be a finite number"),
        (([[0, 0, 0], [0, 0, 1]], [[0, 0, 1], [0, 0, -1]]), "normals[0]"),
        (([[0, 0, 0], [0, 0, 1]], [[0, 0, 1]] * 3), "normals"),
        (([[0, 0, 0], [0, 0, 1]], [[0, 0, 1]] * 2, None, [[0, 0, 1]] * 2), "tangents[0]"),
    ]
    for arguments, words in cases:
        if words:
            with pytest.raises(SurfaceError) as caught:
                poses(*arguments)
            assert words in str(caught.value)
    crowd = np.random.default_rng(0).random((200, 3))
    with pytest.raises(SurfaceError, match="at most 24 neighbours"):
        poses(crowd, np.ones((200, 3)), neighbours=2.0)


def test_there_is_no_sheet_between_poses():
    with pytest.raises(SurfaceError, match="leave collisions with it out"):
        sheet_of(poses(LINE, UP).surface)


def test_a_file_of_poses_is_read_in_its_units(tmp_path):
    file = tmp_path / "path.csv"
    file.write_text("tx,ty,tz,x,y,z,nx,ny,nz\n1,0,0, 400,0,300,0,0,1\n1,0,0,400,100,300,0,0,1\n")
    found = read_poses(file, "mm")
    np.testing.assert_allclose(found.points, LINE[:2], atol=1e-15)
    assert found.approaches is None
    assert poses(**found._asdict()).tangents.tolist() == [[1.0, 0.0, 0.0]] * 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "header"),
        ("x,y,z\n1,2,3\n", "nx, ny, nz"),
        ("x,y,z,nx,ny,nz,ax\n", "ay, az"),
        ("x,y,z,nx,ny,nz,w\n", "'w'"),
        ("x,y,z,nx,ny,nz\n1,2,3,0,0,1\n1,2,3\n1,2,x,0,0,1\n", "line 4 'x' is not a finite"),
        ("x,y,z,nx,ny,nz\n1,2,3\n1,2,nan,0,0,1\n", "line 2 must hold 6 numbers, got 3"),
        ("x,y,z,nx,ny,nz\n" + "0,0,0,0,0,1\n" * 20_001, "more than 20,000"),
    ],
)
def test_a_file_that_is_none_is_refused_with_its_lines(tmp_path, text, words):
    file = tmp_path / "path.csv"
    file.write_text(text)
    with pytest.raises(SurfaceError) as caught:
        read_poses(file)
    assert words in str(caught.value)
    assert "path.csv" in str(caught.value)
