"""Piecewise surfaces: seams by geometry, one outside, closest points, cells and curves."""

from __future__ import annotations

import itertools
import math
import pickle

import numpy as np
import pytest
from smooth_probes import POSE, assert_curves_lie_on, least_distances
from spline_nets import hood, quarter_turn, turned

from surfaces import Piecewise, SurfaceError, bspline, cone, cylinder, piecewise, plane, sphere


def split_hood(*cuts, **pose):
    """The hood in pieces along u."""
    ends = [0.0, *cuts, 1.0]
    return piecewise([bspline(hood(), u=pair) for pair in itertools.pairwise(ends)], **pose)


def strip(half_turns, count=6):
    """A ring of splines that twists by some half turns."""
    pieces = []
    for k in range(count):
        share = np.linspace(k, k + 1, 4)[:, None] / count
        angle, twist = math.tau * share, math.pi * half_turns * share
        out = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
        up = np.array([0.0, 0.0, 1.0])
        across = np.cos(twist)[..., None] * out + np.sin(twist)[..., None] * up
        pieces.append(bspline(out + np.linspace(-0.2, 0.2, 4)[:, None] * across))
    return pieces


def corner(*angles_deg, **more):
    """A plate and others hinged to its side at x = 0, turned about y by angles."""
    plates = [plane((-0.2, 0.0), (0.0, 0.2), rpy_deg=(0.0, angle, 0.0)) for angle in angles_deg]
    return piecewise([plane((0.0, 0.2), (0.0, 0.2)), *plates], **more)


def keyed(cells, pairs):
    """Pairs by the rounded centres of their cells, whatever the numbers."""
    name = [tuple(np.round(centre, 9) + 0.0) for centre in cells.centres]
    return {frozenset((name[i], name[j])) for i, j in pairs.tolist()}


WHOLE = {
    "hood": (bspline(hood()), [bspline(hood(), u=(0, 0.5)), bspline(hood(), u=(0.5, 1))], (6, 7)),
    "hood across": (
        bspline(hood()),
        [bspline(hood(), v=(0, 0.5)), bspline(hood(), v=(0.5, 1))],
        (7, 6),
    ),
    "pipe": (
        cylinder(0.3, (0, 360), (0, 0.5)),
        [cylinder(0.3, (0, 180), (0, 0.5)), cylinder(0.3, (180, 360), (0, 0.5))],
        (8, 3),
    ),
    "zone": (
        sphere(0.5, (20, 150), (0, 360)),
        [sphere(0.5, (20, 150), ends) for ends in ((-90, 90), (90, 270))],
        (5, 12),
    ),
    "four corners": (
        plane((0, 1), (0, 1)),
        [plane(u, v) for u in ((0, 0.5), (0.5, 1)) for v in ((0, 0.5), (0.5, 1))],
        (6, 8),
    ),
}


def cut_alike(name):
    """The cells of one patch, and those of its pieces."""
    one, pieces, shape = WHOLE[name]
    span = [np.ptp(getattr(one, part)) for part in ("u_range", "v_range")]
    counts = [
        tuple(
            round(n * np.ptp(getattr(piece, part)) / width)
            for n, part, width in zip(shape, ("u_range", "v_range"), span, strict=True)
        )
        for piece in pieces
    ]
    return one.cells(*shape), piecewise(pieces).cells(counts)


@pytest.mark.parametrize("name", WHOLE, ids=str)
def test_a_patch_in_pieces_has_the_cells_and_neighbours_of_the_whole(name):
    whole, parts = cut_alike(name)
    assert len(whole) == len(parts)
    assert parts.surface.notes == ()
    assert keyed(whole, whole.pairs) == keyed(parts, parts.pairs)
    assert parts.areas.sum() == pytest.approx(whole.areas.sum(), rel=1e-9)
    # Clockwise, from whichever neighbour on.
    name_of = [tuple(np.round(centre, 9) + 0.0) for centre in parts.centres]
    number = {tuple(np.round(centre, 9) + 0.0): k for k, centre in enumerate(whole.centres)}
    for k in range(len(parts)):
        mine = [number[name_of[other]] for other in parts.neighbours.of(k)]
        theirs = whole.neighbours.of(number[name_of[k]]).tolist()
        turn = mine.index(theirs[0])
        assert mine[turn:] + mine[:turn] == theirs


@pytest.mark.parametrize("name", WHOLE, ids=str)
def test_the_curves_of_pieces_run_on_the_joined_surface(name):
    whole, parts = cut_alike(name)
    for surface in (whole.surface, parts.surface):
        ends = assert_curves_lie_on(surface, parts.curves, 23)
    assert parts.curves.deviations.max() < 1e-5
    assert ends[:, 0] == pytest.approx(parts.centres[parts.pairs[:, 0]], abs=1e-12)
    assert ends[:, -1] == pytest.approx(parts.centres[parts.pairs[:, 1]], abs=1e-12)


@pytest.mark.parametrize("name", WHOLE, ids=str)
def test_closest_points_are_those_of_one_patch(name):
    whole, parts = cut_alike(name)
    rng = np.random.default_rng(3)
    low, high = whole.centres.min(axis=0) - 0.1, whole.centres.max(axis=0) + 0.1
    points = rng.uniform(low, high, (600, 3))
    points = np.concatenate(
        [points, parts.seam_pairs.crossings + 0.01 * parts.seam_pairs.normals[:, 0]]
    )
    one, other = whole.surface.closest(points), parts.surface.closest(points)
    assert (one.inside == other.inside).all()
    some = one.inside
    assert some[600:].all()
    assert np.abs(one.height[some] - other.height[some]).max() < 1e-9
    # Points in the middle of a ball have many nearest places.
    clear = some & (np.linalg.norm(points, axis=1) > 1e-3)
    assert np.abs(one.normal[clear] - other.normal[clear]).max() < 1e-5
    here, there = whole.locate(points), parts.locate(points)
    assert ((here >= 0) == (there >= 0)).all()
    edges = np.linalg.norm(whole.centres[here[some]] - parts.centres[there[some]], axis=1) > 1e-9
    # Only on borders may two cells be right.
    assert edges[: some[:600].sum()].sum() == 0


def test_heights_are_distances_to_the_nearest_piece():
    """By a search without slopes over every piece; at an outer crease to the crease itself."""
    surface = piecewise(
        [
            cylinder(0.2, (-90, 90), (0, 0.4)),
            cone(0.2, -0.5, angle_deg=(-90, 90), height=(0, 0.2), position=(0, 0, 0.4)),
        ]
    )
    assert "crease of up to 26.6 degrees" in surface.notes[0]
    rng = np.random.default_rng(4)
    points = rng.uniform((0.1, -0.1, 0.3), (0.4, 0.1, 0.5), (40, 3))
    closest_point = surface.closest(points)
    assert closest_point.inside.all()
    away = [least_distances(p, points, p.u_range, p.v_range) for p in surface.pieces]
    assert np.abs(closest_point.height) == pytest.approx(np.min(away, axis=0), abs=1e-12)
    x, y, z = points.T
    outside = np.hypot(x, y) > 0.2 - 0.5 * np.maximum(0.0, z - 0.4)
    assert np.array_equal(closest_point.height > 0, outside)


def test_long_sides_against_short_ones():
    """One plate beside two: neighbours by shared borders, brute force over intervals."""
    surface = piecewise(
        [plane((0, 0.5), (0, 1.0)), plane((0.5, 1), (0, 0.37)), plane((0.5, 1), (0.37, 1.0))]
    )
    counts = [(2, 5), (2, 3), (3, 4)]
    cells = surface.cells(counts)
    assert surface.notes == ()
    assert len(surface.seams) == 3
    edges = [np.linspace(0, 1, 6), np.linspace(0, 0.37, 4), np.linspace(0.37, 1, 5)]
    rows = {0: 1, 1: 0, 2: 0}  # the row at x = 0.5
    expected = set()
    for other in (1, 2):
        for j in range(5):
            for k in range(counts[other][1]):
                shared = min(edges[0][j + 1], edges[other][k + 1]) - max(
                    edges[0][j], edges[other][k]
                )
                assert not 0.0 < shared < 0.02  # so that no pair is a matter of taste
                if shared > 0.0:
                    expected.add((cells.index(0, rows[0], j), cells.index(other, rows[other], k)))
    across = {tuple(pair) for pair in cells.seam_pairs.pairs.tolist() if cells.piece[pair[0]] == 0}
    assert across == expected
    assert cells.curves.deviations.max() < 1e-6


def test_pieces_that_meet_in_a_point_are_not_joined():
    surface = piecewise([plane((0, 1), (0, 1)), plane((1, 2), (1, 2))])
    assert surface.seams == ()
    assert surface.groups == ((0,), (1,))
    assert "touch nowhere (0; 1)" in surface.notes[0]
    assert len(surface.cells((3, 3)).seam_pairs.pairs) == 0


@pytest.mark.parametrize(("apart", "joined"), [(0.0, True), (0.9e-4, True), (1.1e-4, False)])
def test_borders_join_within_the_gap(apart, joined):
    surface = piecewise([plane((0, 1), (0, 1)), plane((1 + apart, 2), (0, 1))])
    assert len(surface.seams) == joined
    cells = surface.cells((3, 3))
    assert len(cells.seam_pairs.pairs) == (7 if joined else 0)
    closest_point, _ = cells.curves.at(np.arange(len(cells.pairs)), np.full(len(cells.pairs), 0.5))
    on = surface.closest(closest_point)
    assert on.inside.all()
    assert np.abs(on.height).max() <= apart
    wide = piecewise([plane((0, 1), (0, 1)), plane((1 + apart, 2), (0, 1))], gap=2e-4)
    assert len(wide.seams) == 1


@pytest.mark.parametrize("order", list(itertools.permutations(range(4))), ids=str)
def test_pieces_are_turned_to_one_outside(order):
    """A chain with two of four upside down, in every order: all as the first defines."""
    quarter = [(90 * k, 90 * k + 90) for k in range(4)]
    round_pieces = [cylinder(0.3, ends, (0, 0.5)) for ends in quarter]

    def inward(ends):
        """The same quarter as an exact spline whose normal points to the axis."""
        turn, weights = quarter_turn()
        points, net_weights = turned([[0.3, 0.0], [0.3, 0.5]], [1, 1], turn[::-1], weights[::-1])
        return bspline(points, (2, 1), weights=net_weights, rpy_deg=(0, 0, ends[0]))

    pieces = [round_pieces[0], inward(quarter[1]), round_pieces[2], inward(quarter[3])]
    surface = piecewise([pieces[k] for k in order])
    cells = surface.cells((4, 4))
    outward = (cells.normals * cells.centres * (1, 1, 0)).sum(axis=1)
    first_is_round = order[0] % 2 == 0
    assert ((outward > 0) == first_is_round).all()
    assert [k % 2 != order[0] % 2 for k in order] == list(surface.turned)
    assert sum("turned over" in note for note in surface.notes) == 2


def test_a_twisted_ring_is_refused_and_an_untwisted_one_is_not():
    ring = piecewise(strip(0))
    assert len(ring.seams) == 6
    assert ring.turned == (False,) * 6
    with pytest.raises(SurfaceError, match="Moebius"):
        piecewise(strip(1))
    with pytest.raises(SurfaceError, match="Moebius"):
        piecewise(list(reversed(strip(1))))
    assert len(piecewise(strip(1)[:-1]).seams) == 4
    assert len(piecewise(strip(2)).seams) == 6


@pytest.mark.parametrize("angle", [-90.0, -30.0, 5.0, 60.0, 120.0])
def test_a_crease_is_told_with_its_angle(angle):
    surface = corner(angle)
    assert len(surface.notes) == 1
    assert f"crease of up to {abs(angle):g} degrees" in surface.notes[0]
    cells = surface.cells((3, 4))
    assert cells.seam_pairs.creases == pytest.approx(math.radians(abs(angle)), abs=1e-9)
    # Curves across it deviate by at least half of the angle, those along it by nothing.
    deviations = cells.curves.deviations[:, 1]
    across = cells.piece[cells.pairs[:, 0]] != cells.piece[cells.pairs[:, 1]]
    assert (deviations[across] >= 2.0 * math.sin(0.25 * math.radians(abs(angle)))).all()
    assert deviations[~across].max() < 1e-12
    # And their deviations hold against the surface's own closest points.
    pair = np.repeat(np.arange(len(cells.pairs)), 23)
    closest_point, normal = cells.curves.at(pair, np.tile(np.linspace(0, 1, 23), len(cells.pairs)))
    on = surface.closest(closest_point)
    assert on.inside.all()
    assert (np.abs(on.height) <= cells.curves.deviations[pair, 0] + 1e-12).all()
    assert (np.linalg.norm(normal - on.normal, axis=1) <= deviations[pair] + 1e-12).all()


def test_three_pieces_on_one_seam_are_refused():
    with pytest.raises(SurfaceError, match=r"pieces\[0\], pieces\[1\], pieces\[2\] share one seam"):
        corner(40.0, 90.0)


@pytest.mark.parametrize("name", WHOLE, ids=str)
def test_pieces_on_each_other_are_refused(name):
    """The same patch twice, and pieces beside the whole."""
    whole, pieces, _ = WHOLE[name]
    for some in ([whole, whole], [*pieces, pieces[0]], [pieces[1], whole]):
        with pytest.raises(SurfaceError, match="lie on each other"):
            piecewise(some)


def test_pieces_that_overlap_by_a_tenth_are_refused():
    with pytest.raises(SurfaceError, match=r"pieces\[1\] and pieces\[2\] lie on each other"):
        piecewise([plane((0, 1), (0, 1)), plane((1, 2), (0, 1)), plane((1.9, 3), (0, 1))])


def test_a_full_turn_stacked_on_a_full_turn():
    """Closed borders that begin at different angles."""
    surface = piecewise(
        [
            cylinder(0.3, (0, 360), (0, 0.4)),
            cylinder(0.3, (-77, 283), (0, 0.4), position=(0, 0, 0.4)),
        ]
    )
    assert surface.notes == ()
    cells = surface.cells((9, 3))
    met = np.bincount(cells.seam_pairs.pairs.ravel(), minlength=len(cells))
    assert sorted(set(met.tolist())) == [0, 2]
    assert (met > 0).sum() == 18
    assert cells.curves.deviations.max() < 1e-5


def test_a_pipe_of_two_shells_is_crossed_at_both_seams():
    """One cell is half around: nearest places of the line between centres are nowhere."""
    shells = [cylinder(0.3, ends, (0, 0.4)) for ends in ((0, 180), (180, 360))]
    surface = piecewise(shells)
    assert len(surface.seams) == 2
    cells = surface.cells((1, 2))
    assert cells.curves.deviations.max() < 1e-3
    closest_point, _ = cells.curves.at(np.arange(len(cells.pairs)), np.full(len(cells.pairs), 0.5))
    assert np.hypot(closest_point[:, 0], closest_point[:, 1]) == pytest.approx(0.3, abs=1e-3)


def test_a_rigid_motion_moves_everything_along():
    rest = split_hood(0.45, side="outside")
    placed = split_hood(0.45, side="outside", **POSE)
    moved = rest.moved(placed.rotation, placed.position)
    here = rest.cells([(4, 7), (5, 7)])
    for there in (placed.cells([(4, 7), (5, 7)]), moved.cells([(4, 7), (5, 7)])):
        turn, shift = placed.rotation, placed.position
        assert (here.pairs == there.pairs).all()
        assert (here.neighbours.indices == there.neighbours.indices).all()
        assert here.centres @ turn.T + shift == pytest.approx(there.centres, abs=1e-12)
        assert here.normals @ turn.T == pytest.approx(there.normals, abs=1e-12)
        assert here.seam_pairs.crossings @ turn.T + shift == pytest.approx(
            there.seam_pairs.crossings, abs=1e-12
        )
        assert here.curves.derivative_bounds == pytest.approx(
            there.curves.derivative_bounds, abs=1e-7
        )


def test_cells_and_surface_survive_pickling():
    surface = corner(30.0, side="outside", **POSE)
    cells = pickle.loads(pickle.dumps(surface.cells((2, 3))))
    assert isinstance(cells.surface, Piecewise)
    assert cells.surface.notes == surface.notes
    assert cells.surface.side == "outside"
    assert cells.centres == pytest.approx(surface.cells((2, 3)).centres, abs=0.0)
    for array in (cells.centres, cells.surface.position, cells.neighbours.indices):
        assert not array.flags.writeable


def test_cells_count_piece_by_piece():
    cells = split_hood(0.3).cells([(2, 3), (4, 5)])
    assert cells.shape == (26,)
    assert [cells.unravel(k) for k in (0, 5, 6, 25)] == [
        (0, 0, 0), (0, 1, 2), (1, 0, 0), (1, 3, 4)
    ]  # fmt: skip
    assert all(cells.index(*cells.unravel(k)) == k for k in range(26))
    for bad in (-1, 26):
        with pytest.raises(IndexError):
            cells.unravel(bad)
    with pytest.raises(IndexError):
        cells.index(2, 0, 0)
    assert (cells.locate(cells.centres + 0.01 * cells.normals) == np.arange(26)).all()
    assert (cells.locate([[9.0, 9.0, 9.0], [np.nan] * 3, [0, np.inf, 0]]) == -1).all()


def test_what_is_drawn_lies_on_the_pieces():
    cells = corner(30.0).cells([(2, 3), (1, 2)])
    assert cells.surface.turned == (False, False)
    which = np.array([7, 0, 6, 3])
    drawn = cells.triangles(which, samples=2, inset=0.1)
    corners = drawn.vertices[drawn.faces]
    double = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = 0.5 * np.linalg.norm(double, axis=1).reshape(4, 8).sum(axis=1)
    assert areas == pytest.approx(0.81 * cells.areas[which], rel=1e-9)
    middles = corners.reshape(4, 8, 3, 3).mean(axis=(1, 2))
    assert (cells.locate(middles) == which).all()
    owner = np.repeat(which, 9)
    assert drawn.normals == pytest.approx(cells.normals[owner], abs=1e-12)
    ends = cells.borders(3)
    assert ends.shape == (8 * 12, 2, 3)
    assert np.abs(cells.surface.closest(ends).height).max() < 1e-9
    flat = cells.unrolled()
    assert flat.centres.shape == (8, 2)
    for centre, line in zip(flat.centres, flat.outlines, strict=True):
        assert line.mean(axis=0) == pytest.approx(centre, abs=0.05)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"pieces": []}, ["pieces must be a list of 1 to 200 patches", "0 of them"]),
        ({"pieces": None}, ["pieces must be a list", "NoneType"]),
        ({"pieces": plane((0, 1), (0, 1))}, ["pieces must be a list", "Plane"]),
        (
            {"pieces": [3, plane((0, 1), (0, 1)), "x"], "side": np.array([1, 2])},
            ["pieces[0]", "int", "pieces[2]", "str", "side must be"],
        ),
        (
            {"pieces": [plane((0, 1), (0, 1))], "gap": -1, "position": (1, 2)},
            ["gap must be a finite number > 0", "position must be three finite numbers"],
        ),
        ({"pieces": [plane((0, 1), (0, 1))], "gap": 0.1}, ["a fiftieth of the shortest border"]),
        ({"pieces": [plane((0, 1), (0, 1))] * 201}, ["201 of them"]),
    ],
)
def test_wrong_arguments_are_all_named(arguments, words):
    with pytest.raises(SurfaceError) as caught:
        piecewise(**arguments)
    for word in words:
        assert word in str(caught.value)


@pytest.mark.parametrize(
    "counts", [3, "ab", (1, 2, 3), [(1, 2)], [(1, 2), (3,)], [(1, 2), (3, -1)], [(1, 2), (3, True)]]
)
def test_wrong_counts_are_refused(counts):
    with pytest.raises(SurfaceError, match="whole numbers"):
        split_hood(0.5).cells(counts)


def test_one_piece_and_pieces_without_cells():
    alone = piecewise([plane((0, 1), (0, 1))]).cells((3, 3))
    assert len(alone.pairs) == 20
    assert alone.curves.deviations.max() < 1e-12
    some = split_hood(0.5).cells([(0, 3), (2, 3)])
    assert len(some) == 6
    assert len(some.seam_pairs.pairs) == 0
    assert len(piecewise([plane((0, 1), (0, 1))]).cells((0, 3))) == 0
