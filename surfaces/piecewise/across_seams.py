"""Which cells of different pieces touch across seams, and the curves between their centres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from coverable.arrays import Array, Ints, Rows
from surfaces.adjacency import grid_neighbours
from surfaces.cells import Cells
from surfaces.curve_fitting import CurveFit
from surfaces.curves_over_corners import Legs, over_corners
from surfaces.piecewise.edges import SMOOTH
from surfaces.piecewise.seams import Border, contacts, sides_of

if TYPE_CHECKING:
    from surfaces.piecewise.joined_patches import JoinedPatches

Counts = Sequence[tuple[int, int]]

JUMP = 3.0  # times the step along the straight line: there closest points jump
MEETING = 6  # steps to where two offset surfaces meet
MARKS = 16  # on each cell's border side; cells that share fewer than one of them do not touch


@dataclass(frozen=True, eq=False, slots=True)
class SeamPairs(Rows):
    """Pairs of cells that touch across a seam, on a stretch of their sides or at a corner."""

    pairs: Ints
    """(m, 2) i < j, each once, sorted."""
    crossings: Array
    """(m, 3) m, in the root frame: the middle of the border they share, or the corner."""
    normals: Array
    """(m, 2, 3) outward unit normals of the pieces of i and of j there."""

    @property
    def creases(self) -> Array:
        """(m,) rad, the angle between both normals."""
        apart = np.linalg.norm(self.normals[:, 0] - self.normals[:, 1], axis=1)
        return 2.0 * np.arcsin(np.clip(0.5 * apart, 0.0, 1.0))

    def between(self, pairs: Ints) -> SeamPairs:
        """Some of the pairs (k, 2), i < j, in the given order."""
        return self.of(np.searchsorted(_keys(self.pairs), _keys(pairs)))


def seam_pairs_of(surface: JoinedPatches, counts: Counts) -> SeamPairs:
    """Find the pairs of cells of different pieces that touch.

    Two cells touch across a seam where their border sides share more than a thirtieth or so of the
    shorter one; and, as in a grid, where they have only a corner in common but also a neighbour.

    Args:
        surface: the pieces, and which of them are joined.
        counts: cells along u and v of each piece.
    """
    first = np.concatenate([[0], np.cumsum([nu * nv for nu, nv in counts])])
    sides = [side for side in sides_of(surface.pieces, surface.gap) if min(counts[side.piece]) > 0]
    pairs, places = _along_sides(surface, counts, first, sides)
    more, corners = _at_corners(surface, counts, first, sides, pairs)
    pairs, places = np.concatenate([pairs, more]), np.concatenate([places, corners])
    order = np.argsort(_keys(pairs))
    pairs, places = pairs[order], places[order]
    return SeamPairs(
        pairs,
        places @ surface.rotation.T + surface.position,
        _normals(surface, first, pairs, places) @ surface.rotation.T,
    )


def _along_sides(
    surface: JoinedPatches, counts: Counts, first: Ints, sides: Sequence[Border]
) -> tuple[Ints, Array]:
    """Pairs that share a stretch of border, and the middle of it, in the surface's own frame."""
    joined = {seam.pieces for seam in surface.seams}
    parts = [counts[side.piece][1 - side.fixed] for side in sides]
    marks = [(np.arange(MARKS * n) + 0.5) / (MARKS * n) for n in parts]
    found: list[Ints] = []
    spots: list[Array] = []
    for contact in contacts(sides, marks, surface.gap):
        one, other = sides[contact.side], sides[contact.other]
        if (min(one.piece, other.piece), max(one.piece, other.piece)) not in joined:
            continue
        here = _cells_at(one, counts, contact.marks // MARKS)
        n = parts[contact.other]
        there = _cells_at(other, counts, np.minimum((contact.there * n).astype(np.int64), n - 1))
        pair = np.column_stack([here + first[one.piece], there + first[other.piece]])
        found.append(np.sort(pair, axis=1))
        spots.append(one.point(marks[contact.side][contact.marks]))
    if not found:
        return np.empty((0, 2), dtype=np.int64), np.empty((0, 3))
    pairs, group, count = np.unique(
        np.concatenate(found), axis=0, return_inverse=True, return_counts=True
    )
    # The mark nearest to the mean of all: it lies on the border, however bent that is.
    spot, group = np.concatenate(spots), group.reshape(-1)
    mean = np.column_stack([np.bincount(group, spot[:, k]) for k in range(3)]) / count[:, None]
    order = np.lexsort((np.linalg.norm(spot - mean[group], axis=1), group))
    return pairs, spot[order[np.searchsorted(group[order], np.arange(len(pairs)))]]


def _at_corners(
    surface: JoinedPatches, counts: Counts, first: Ints, sides: Sequence[Border], touching: Ints
) -> tuple[Ints, Array]:
    """Pairs that share a corner and a neighbour but no border, and the corners."""
    from scipy.sparse import coo_array
    from scipy.spatial import cKDTree

    none = np.empty((0, 2), dtype=np.int64), np.empty((0, 3))
    if len(touching) == 0:
        return none
    spots, cells, pieces = [], [], []
    for side in sides:
        n = counts[side.piece][1 - side.fixed]
        corners = side.point(np.arange(n + 1) / n)
        own = _cells_at(side, counts, np.arange(n)) + first[side.piece]
        spots += [corners[:-1], corners[1:]]
        cells += [own, own]
        pieces.append(np.full(2 * n, side.piece))
    spot, cell, piece = np.concatenate(spots), np.concatenate(cells), np.concatenate(pieces)
    near = cKDTree(spot).query_pairs(surface.gap, output_type="ndarray")
    near = near[piece[near[:, 0]] != piece[near[:, 1]]]
    pairs = np.sort(cell[near], axis=1)
    pairs, once = np.unique(pairs, axis=0, return_index=True)
    spot = spot[near[once, 0]]
    size = int(first[-1])
    own = [
        grid_neighbours(*of, (patch.u_closed, patch.v_closed), patch.poles).pairs + start
        for patch, of, start in zip(surface.pieces, counts, first, strict=False)
    ]
    links = np.concatenate([*own, touching])
    ones = np.ones(len(links))
    graph: Any = coo_array((ones, (links[:, 0], links[:, 1])), shape=(size, size)).tocsr()
    graph = graph + graph.T
    common = np.asarray(graph[pairs[:, 0]].multiply(graph[pairs[:, 1]]).sum(axis=1)).reshape(-1)
    keep = (common > 0) & ~np.isin(_keys(pairs), _keys(touching))
    return pairs[keep], spot[keep]


def _cells_at(side: Border, counts: Counts, along: Ints) -> Ints:
    """Cells of a piece's grid at places counted along one of its borders."""
    nu, nv = counts[side.piece]
    if side.fixed == 0:
        return (nu - 1 if side.upper else 0) * nv + along
    return along * nv + (nv - 1 if side.upper else 0)


def _normals(surface: JoinedPatches, first: Ints, pairs: Ints, places: Array) -> Array:
    """(m, 2, 3) outward unit normals of the pieces of two cells at a place of their seam."""
    pieces = np.searchsorted(first, pairs, side="right") - 1
    normals = np.empty((*pairs.shape, 3))
    for k, patch in enumerate(surface.pieces):
        for end in (0, 1):
            some = np.flatnonzero(pieces[:, end] == k)
            if len(some):
                found = patch.closest(places[some])
                u, v = np.clip(found.u, *patch.u_range), np.clip(found.v, *patch.v_range)
                normals[some, end] = surface.signs[k] * patch.normal(u, v)
    return normals


def _keys(pairs: Ints) -> Ints:
    """One number for each pair, in the order of the pairs."""
    return np.asarray(pairs[:, 0] * np.int64(2**31) + pairs[:, 1])


def curves_across(
    surface: JoinedPatches,
    seam_pairs: SeamPairs,
    start: Array,
    end: Array,
    t: Array,
    pieces: tuple[int, int],
    around: Sequence[int],
) -> tuple[Array, Array]:
    """Points and normals (m, k, 3) at t (k,) between cells of two pieces; see `Cells.trace`.

    Across a smooth seam these are the closest points to the straight line. Across a crease, and
    where closest points jump because the surface is strongly bent between the centres, the line is
    led over the middle of the border that the cells share. At a crease the normal turns all along
    the curve from one piece's to the other's; `CellCurves.deviations` count how far that is off.

    Args:
        surface: the pieces.
        seam_pairs: where the cells of each pair touch.
        start: (m, 3) m, centres of the first cells.
        end: (m, 3) m, centres of the second cells.
        t: (k,) places on the curves.
        pieces: those of the first and of the second cells.
        around: both, and those that touch both.
    """
    start, end = start[:, None], end[:, None]
    lines = start + t[:, None] * (end - start)
    found = surface.nearest(lines, around)
    points, normals = found.places.reshape(lines.shape), found.normals.reshape(lines.shape)
    steps = np.linalg.norm(np.diff(points, axis=1), axis=2)
    even = np.linalg.norm(end - start, axis=2) * np.diff(t)
    over = (seam_pairs.creases > SMOOTH) | (steps > JUMP * even).any(axis=1)
    if over.any():
        points[over], normals[over] = _over_the_border(
            surface, seam_pairs.of(over), start[over], end[over], t, pieces
        )
    return points, normals


def fit_round_edges(
    fit: CurveFit, surface: JoinedPatches, touching: SeamPairs, pieces: Ints
) -> None:
    """Replace rough curves over outer edges by such that turn on the spot there.

    Args:
        fit: the curves.
        surface: the pieces.
        touching: where the cells of each pair that lies across a seam touch.
        pieces: (M, 2) of the cells of each curve.
    """
    for edge, of in surface.creases.edges:
        some = np.flatnonzero((pieces[fit.rough] == of).all(axis=1))
        at = touching.between(fit.cells.pairs[fit.rough[some]])
        on = np.abs(edge.closest(at.crossings).height) <= 2.0 * surface.gap
        curves, at = fit.rough[some[on]], at.of(on)
        off = [surface.nearest(at.crossings, [k]).places - at.crossings for k in of]
        away = np.linalg.norm(off, axis=2).max(axis=0)
        corners = np.broadcast_to(at.crossings[:, None], at.normals.shape)
        ends = np.concatenate([corners, at.normals], axis=2)
        legs = _legs(fit, surface, curves, of, ends, at.crossings, 0.0)
        over_corners(fit, curves, legs, away)


def fit_over_inner(
    fit: CurveFit, surface: JoinedPatches, touching: SeamPairs, pieces: Ints, height: float
) -> None:
    """Replace rough curves over inner creases by such that turn where both offset surfaces meet.

    There the direction that the tool is held in has to be right for both pieces.

    Args:
        fit, surface, touching, pieces: see `fit_round_edges`.
        height: m, signed, of the offset surfaces.
    """
    for of in surface.creases.inner:
        curves = fit.rough[(pieces[fit.rough] == of).all(axis=1)]
        at = touching.between(fit.cells.pairs[curves])
        cosine = (at.normals[:, 0] * at.normals[:, 1]).sum(axis=1, keepdims=True)
        target = at.crossings + height * at.normals.sum(axis=1) / (1.0 + cosine)
        for last in (*[False] * MEETING, True):
            both = [surface.nearest(target, [k]) for k in of]
            normals = np.stack([found.normals for found in both], axis=1)
            if last:
                break
            miss = np.stack([found.height - height for found in both], axis=1)
            target = target - (np.linalg.pinv(normals) @ miss[..., None])[..., 0]
        feet = target[:, None] - height * normals
        off = np.stack([found.places for found in both], axis=1) - feet
        lean = 0.5 * np.linalg.norm(normals[:, 0] - normals[:, 1], axis=1)
        ends = np.concatenate([feet, normals], axis=2)
        legs = _legs(fit, surface, curves, of, ends, target, height)
        taken = over_corners(fit, curves, legs, np.linalg.norm(off, axis=2).max(axis=1))
        fit.leans[curves[taken]] = lean[taken]


def _legs(
    fit: CurveFit,
    surface: JoinedPatches,
    curves: Ints,
    of: tuple[int, int],
    ends: Array,
    target: Array,
    height: float,
) -> Legs:
    """Legs to places of both pieces and on, while the normal turns, over one target.

    Args:
        fit, surface, of: see `fit_over_inner`.
        curves: (k,)
        ends: (k, 2, 6) points (m) and normals of both pieces.
        target: (k, 3) m, at the `height` (m) over both.
    """

    def legs(rows: Ints, first: Array, second: Array) -> list[Array]:
        pairs, found = fit.cells.pairs[curves[rows]], []
        between = ends[rows, :, 3:].mean(axis=1)
        for end, piece in enumerate(of):
            foot, normal = ends[rows, end, :3], ends[rows, end, 3:]
            found.append(_up_to(fit.cells, surface, pairs[:, end], piece, foot, first))
            turned = normal + second[:, None, None] * (between - normal)
            turned /= np.linalg.norm(turned, axis=2, keepdims=True)
            found.append(np.concatenate([target[rows] - height * turned, turned], axis=2))
        return found

    return legs


def _up_to(
    cells: Cells, surface: JoinedPatches, which: Ints, piece: int, corners: Array, share: Array
) -> Array:
    """(k, m, 6) points and normals at shares (k,) of the way from centres to corners (m, 3)."""
    start = cells.centres[which]
    lines = start + share[:, None, None] * (corners - start)
    found = surface.nearest(lines, [piece])
    values = np.column_stack([found.places, found.normals]).reshape(len(share), -1, 6)
    values[..., :3] += share[:, None, None] * (corners - values[-1, :, :3])
    values[0] = np.hstack([start, cells.normals[which]])
    return values


def _over_the_border(
    surface: JoinedPatches,
    seam_pairs: SeamPairs,
    start: Array,
    end: Array,
    t: Array,
    pieces: tuple[int, int],
) -> tuple[Array, Array]:
    """Straight to the border and straight on, each part on its piece."""
    middle = seam_pairs.crossings[:, None]
    before, after = (np.linalg.norm(part - middle, axis=2) for part in (start, end))
    share = before / np.maximum(before + after, 1e-300)
    points, normals = np.empty((2, len(start), len(t), 3))
    between = seam_pairs.normals.mean(axis=1)
    first = t <= share
    for k, (piece, centre, part) in enumerate(
        zip(pieces, (start, end), (first, ~first), strict=True)
    ):
        # 0 at the centre, 1 at the border.
        run, length = (t, share) if k == 0 else (1.0 - t, 1.0 - share)
        along = run / np.maximum(length, 1e-300)
        lines = centre + along[..., None] * (middle - centre)
        found = surface.nearest(lines[part], [piece])
        turn = np.broadcast_to((between - seam_pairs.normals[:, k])[:, None], lines.shape)
        normal = found.normals + along[part][:, None] * turn[part]
        points[part] = found.places
        size = np.linalg.norm(normal, axis=1, keepdims=True)
        normals[part] = normal / np.maximum(size, 1e-300)
    return points, normals
