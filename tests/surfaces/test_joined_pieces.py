"""Patches joined along seams: cut up they are the patch; creases, gaps and turns are told."""

import itertools
import math

import numpy as np
import pytest
from smooth_probes import least_distances
from specimens import hood, quarter_turn, turned

from coverable import SurfaceError, bspline, cone, cylinder, piecewise, plane, sphere

# A patch, the patches that it is cut into, and how its cells are cut.
WHOLE = {
    "hood": (bspline(hood()), [bspline(hood(), u=(0, 0.5)), bspline(hood(), u=(0.5, 1))], (4, 3)),
    "hood across": (
        bspline(hood()), [bspline(hood(), v=(0, 0.5)), bspline(hood(), v=(0.5, 1))], (3, 4),
    ),
    "pipe": (
        cylinder(0.3, (0, 360), (0, 0.5)),
        [cylinder(0.3, ends, (0, 0.5)) for ends in ((0, 180), (180, 360))], (8, 3),
    ),
    "zone": (
        sphere(0.5, (20, 150), (0, 360)),
        [sphere(0.5, (20, 150), ends) for ends in ((-90, 90), (90, 270))], (5, 12),
    ),
    "four corners": (
        plane((0, 1), (0, 1)),
        [plane(u, v) for u in ((0, 0.5), (0.5, 1)) for v in ((0, 0.5), (0.5, 1))], (6, 8),
    ),
}  # fmt: skip


def strip(half_turns, count=4):
    pieces = []
    for k in range(count):
        share = np.linspace(k, k + 1, 4)[:, None] / count
        angle, twist = math.tau * share, math.pi * half_turns * share
        out = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
        across = np.cos(twist)[..., None] * out + np.sin(twist)[..., None] * [0.0, 0.0, 1.0]
        pieces.append(bspline(out + np.linspace(-0.2, 0.2, 4)[:, None] * across))
    return pieces


@pytest.fixture(scope="module", params=WHOLE)
def alike(request):
    one, pieces, shape = WHOLE[request.param]
    names = ("u_range", "v_range")
    counts = [
        tuple(round(n * np.ptp(getattr(piece, name)) / np.ptp(getattr(one, name)))
              for n, name in zip(shape, names, strict=True))
        for piece in pieces
    ]  # fmt: skip
    return one.cells(*shape), piecewise(pieces).cells(counts)


def names(cells):
    return [tuple(np.round(centre, 9) + 0.0) for centre in cells.centres]


def test_a_patch_in_pieces_has_the_cells_and_neighbours_of_the_whole(alike):
    whole, parts = alike
    number = {name: k for k, name in enumerate(names(whole))}
    mine = [number[name] for name in names(parts)]
    assert sorted(mine) == list(range(len(whole)))
    assert parts.surface.notes == ()
    assert parts.areas.sum() == pytest.approx(whole.areas.sum(), rel=1e-9)
    for k in range(len(parts)):  # clockwise, from whichever neighbour on
        ours = [mine[other] for other in parts.neighbours.of(k)]
        theirs = whole.neighbours.of(mine[k]).tolist()
        turn = ours.index(theirs[0])
        assert ours[turn:] + ours[:turn] == theirs


def test_its_curves_and_closest_points_are_those_of_the_whole(alike):
    whole, parts = alike
    pair = np.repeat(np.arange(len(parts.curves)), 11)
    points, normals = parts.curves.at(pair, np.tile(np.linspace(0, 1, 11), len(parts.curves)))
    assert parts.curves.deviations.max() < 1e-5
    for surface in (whole.surface, parts.surface):
        on = surface.closest(points)
        assert on.inside.all()
        assert (np.abs(on.height) <= parts.curves.deviations[pair, 0] + 1e-12).all()
        apart = np.linalg.norm(normals - on.normal, axis=1)
        assert (apart <= parts.curves.deviations[pair, 1] + 1e-9).all()
    rng = np.random.default_rng(3)
    ends = whole.centres.min(axis=0) - 0.1, whole.centres.max(axis=0) + 0.1
    over = parts.seam_pairs.crossings + 0.01 * parts.seam_pairs.normals[:, 0]
    points = np.concatenate([rng.uniform(*ends, (200, 3)), over])
    one, other = whole.surface.closest(points), parts.surface.closest(points)
    some = one.inside
    assert (some == other.inside).all()
    assert some[200:].all()
    assert np.abs(one.height[some] - other.height[some]).max() < 1e-9
    clear = some & (np.linalg.norm(points, axis=1) > 1e-3)  # of the middle of a ball
    assert np.abs(one.normal[clear] - other.normal[clear]).max() < 1e-5
    here, there = whole.locate(points), parts.locate(points)
    assert ((here >= 0) == (there >= 0)).all()
    off = np.linalg.norm(whole.centres[here[some]] - parts.centres[there[some]], axis=1) > 1e-9
    assert not off[: some[:200].sum()].any()  # on borders alone two cells may be right


def test_heights_are_distances_to_the_nearest_piece():
    """By a search without slopes over every piece; at an outer crease to the crease itself."""
    can = cylinder(0.2, (-90, 90), (0, 0.4))
    lid = cone(0.2, -0.5, (-90, 90), (0, 0.2), position=(0, 0, 0.4))
    surface = piecewise([can, lid])
    assert "crease of up to 26.6 degrees" in surface.notes[0]
    assert repr(can).startswith("cylinder(0.2, u_deg=(-90, 90), v=(0, 0.4), side=")
    points = np.random.default_rng(4).uniform((0.1, -0.1, 0.3), (0.4, 0.1, 0.5), (40, 3))
    found = surface.closest(points)
    assert found.inside.all()
    away = [least_distances(p, points, p.u_range, p.v_range) for p in surface.pieces]
    assert np.abs(found.height) == pytest.approx(np.min(away, axis=0), abs=1e-12)
    x, y, z = points.T
    outside = np.hypot(x, y) > 0.2 - 0.5 * np.maximum(0.0, z - 0.4)
    assert np.array_equal(found.height > 0, outside)


def test_long_sides_against_short_ones():
    """One plate beside two: neighbours by shared borders, brute force over intervals."""
    surface = piecewise(
        [plane((0, 0.5), (0, 1.0)), plane((0.5, 1), (0, 0.37)), plane((0.5, 1), (0.37, 1.0))]
    )
    counts = [(2, 5), (2, 3), (3, 4)]
    cells = surface.cells(counts)
    assert (surface.notes, len(surface.seams)) == ((), 3)
    assert all(cells.index(*cells.unravel(k)) == k for k in range(len(cells)))
    middles = [line[:-1].mean(axis=0) for line in cells.unrolled().outlines]
    np.testing.assert_allclose(middles, cells.unrolled().centres, atol=1e-9)
    assert repr(cells).startswith("Cells(2 x 5 + 2 x 3 + 3 x 4 of piecewise(plane, plane, plane, s")
    for wrong in (lambda: cells.unravel(len(cells)), lambda: cells.index(-1, 0, 0)):
        with pytest.raises(IndexError):
            wrong()
    edges = [np.linspace(0, 1, 6), np.linspace(0, 0.37, 4), np.linspace(0.37, 1, 5)]
    expected = set()
    for other, j in itertools.product((1, 2), range(5)):
        for k in range(counts[other][1]):
            ends = edges[0][j : j + 2], edges[other][k : k + 2]
            shared = min(e[1] for e in ends) - max(e[0] for e in ends)
            assert not 0.0 < shared < 0.02  # so that no pair is a matter of taste
            if shared > 0.0:
                expected.add((cells.index(0, 1, j), cells.index(other, 0, k)))
    across = {tuple(pair) for pair in cells.seam_pairs.pairs.tolist() if cells.piece[pair[0]] == 0}
    assert across == expected
    assert cells.curves.deviations.max() < 1e-6


def test_pieces_that_meet_in_a_point_are_not_joined():
    surface = piecewise([plane((0, 1), (0, 1)), plane((1, 2), (1, 2))])
    assert (surface.seams, surface.groups) == ((), ((0,), (1,)))
    assert "touch nowhere (0; 1)" in surface.notes[0]
    assert len(surface.cells((3, 3)).seam_pairs.pairs) == 0


@pytest.mark.parametrize(("apart", "joined"), [(0.0, True), (0.9e-4, True), (1.1e-4, False)])
def test_borders_join_within_the_gap(apart, joined):
    pieces = [plane((0, 1), (0, 1)), plane((1 + apart, 2), (0, 1))]
    cells = piecewise(pieces).cells((3, 3))
    assert len(cells.surface.seams) == joined
    assert len(cells.seam_pairs.pairs) == (7 if joined else 0)
    middles, _ = cells.curves.at(np.arange(len(cells.pairs)), np.full(len(cells.pairs), 0.5))
    on = cells.surface.closest(middles)
    assert on.inside.all()
    assert np.abs(on.height).max() <= apart
    assert len(piecewise(pieces, gap=2e-4).seams) == 1


@pytest.mark.parametrize("order", [*itertools.permutations(range(4))][::5], ids=str)
def test_pieces_are_turned_to_one_outside(order):
    """A chain with two of four upside down, in any order: all as the first defines."""

    def inward(turn):
        """A quarter as an exact spline whose normal points to the axis."""
        way, weights = quarter_turn()
        net = turned([[0.3, 0.0], [0.3, 0.5]], [1, 1], way[::-1], weights[::-1])
        return bspline(net[0], (2, 1), weights=net[1], rpy_deg=(0, 0, turn))

    def outward(turn):
        return cylinder(0.3, (turn, turn + 90), (0, 0.5))

    pieces = [outward(0), inward(90), outward(180), inward(270)]
    surface = piecewise([pieces[k] for k in order])
    cells = surface.cells((4, 4))
    away = (cells.normals * cells.centres * (1, 1, 0)).sum(axis=1)
    assert ((away > 0) == (order[0] % 2 == 0)).all()
    assert [k % 2 != order[0] % 2 for k in order] == list(surface.turned)
    assert sum("turned over" in note for note in surface.notes) == 2


def test_a_twisted_ring_is_refused_and_an_untwisted_one_is_not():
    ring = piecewise(strip(0))
    assert (len(ring.seams), ring.turned) == (4, (False,) * 4)
    for pieces in (strip(1), strip(1)[::-1]):
        with pytest.raises(SurfaceError, match="Moebius"):
            piecewise(pieces)
    assert len(piecewise(strip(1)[:-1]).seams) == 2
    assert len(piecewise(strip(2)).seams) == 4


def test_seams_of_full_turns():
    stacked = piecewise(
        [cylinder(0.3, (0, 360), (0, 0.4)),
         cylinder(0.3, (-77, 283), (0, 0.4), position=(0, 0, 0.4))]
    )  # fmt: skip
    cells = stacked.cells((9, 3))
    met = np.bincount(cells.seam_pairs.pairs.ravel(), minlength=len(cells))
    assert (stacked.notes, sorted(set(met.tolist())), (met > 0).sum()) == ((), [0, 2], 18)
    assert cells.curves.deviations.max() < 1e-5
