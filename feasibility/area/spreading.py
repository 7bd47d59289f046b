"""Spreading over cells: from configurations over their centres to tiles that hold.

Level by level: each tile gets a line of places to its middle from a node, a configuration over a
place that is joined to the motion already. The arm follows it in certified steps, and where it
lands the tile is tested. A tile that holds is done, and its middle is a node. Of any other the
halves are looked at next: from its own middle where that was reached, else from where it was tried,
and from the nearest node. On a mesh the faces come first, from each to those that touch it.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from coverable_arrays import Array, Ints, Mask
from feasibility.area.lines import Landed, Lander
from feasibility.area.nodes import HeldTiles, Nodes
from surfaces.cell_tiles import Tiles

LEVELS = 12  # halvings of a cell, or of a face
FACE_TRIES = 3  # of one face, from different sides
COARSE = 4  # halvings up to which tiles are looked at however far they are from all nodes
NEAR = 4.0  # [1] of a tile's diameter: the distance of a node from which it may be reached


def spread_over(lander: Lander, which: Ints, cell: Ints, q: Array) -> HeldTiles:
    """Tiles of some cells that hold.

    Args:
        lander: lands on tiles; receives the nodes.
        which: (m,) these cells, in order.
        cell: (k,) different ones among them; k >= 1.
        q: (k, n) configurations over their centres, all of one motion.
    """
    cut = lander.cut
    begun = lander.settled(lander.add(Nodes(q, cut.centres(cell), np.full(len(q), -1))))
    tiles = cut.of_cells(which)
    if cut.touching is None:
        source, rows = np.full(len(which), -1), np.searchsorted(which, cell)
        source[rows] = begun
        landed = Landed.nowhere(len(source), q.shape[1])
        landed.put(rows, lander.land(tiles.of(rows), begun))
    else:
        source, landed = _over_faces(lander, tiles, begun)
    held = [lander.holding(tiles, landed)]
    for level in range(1, LEVELS + 1):
        rest = ~landed.holds
        if not rest.any() or lander.left <= 0:
            break
        source = np.repeat(landed.node[rest], 2)
        tiles = cut.halves(tiles.of(rest))
        some = _given_nearest(lander, tiles, source, level)
        tiles, source = tiles.of(some), source[some]
        landed = lander.land(tiles, source)
        _once_more(lander, tiles, source, landed)
        held.append(lander.holding(tiles, landed))
    return HeldTiles.join(*held)


def _given_nearest(lander: Lander, tiles: Tiles, source: Ints, level: int) -> Mask:
    """Give tiles without a node the nearest one on their chart; which (k,) have one that is near.

    Nothing gets to a tile far from all nodes but over others, which would have some.
    """
    lost = np.flatnonzero(source < 0)
    near = np.ones(len(source), dtype=bool)
    if len(lost):
        nearest, away = _nearest(lander, tiles.of(lost))
        corners = lander.cut.bounds(tiles.of(lost)).corners[:, :, 0]
        across = np.linalg.norm(corners[:, 0] - corners[:, 2], axis=1)
        source[lost] = nearest
        near[lost] = (nearest >= 0) & ((away <= NEAR * across) | (level <= COARSE))
    return near


def _nearest(lander: Lander, tiles: Tiles) -> tuple[Ints, Array]:
    """The node nearest to the middle of each tile, -1 if it is on another chart; and how far, m."""
    places = lander.nodes.places
    away, nearest = cKDTree(lander.points(places)).query(lander.points(tiles.middles))
    return np.where(places.chart[nearest] == tiles.chart, nearest, -1), away


def _once_more(lander: Lander, tiles: Tiles, source: Ints, landed: Landed) -> None:
    """Try again tiles whose middle was not reached, from the nearest node if that is another."""
    lost = np.flatnonzero(landed.node < 0)
    if not len(lost) or lander.left <= 0:
        return
    nearest, _ = _nearest(lander, tiles.of(lost))
    other = (nearest != source[lost]) & (nearest >= 0)
    lost, nearest = lost[other], nearest[other]
    if len(lost):
        landed.put(lost, lander.land(tiles.of(lost), nearest))


def _over_faces(lander: Lander, tiles: Tiles, begun: Ints) -> tuple[Ints, Landed]:
    """Reach faces from those that touch them, beginning at the cells' centres.

    Returns:
        (F,) the node that each face was tried from last, -1 where from none; and what came of it.
    """
    indptr, touching = lander.cut.touching or (np.zeros(1, np.int64), np.zeros(0, np.int64))
    row_of = np.full(len(indptr) - 1, -1)
    row_of[tiles.chart] = np.arange(len(tiles.chart))
    count = len(tiles.chart)
    source, tries = np.full(count, -1), np.zeros(count, dtype=np.int64)
    landed = Landed.nowhere(count, lander.nodes.q.shape[1])
    rows, origin = row_of[lander.nodes.places.chart[begun]], begun
    while len(rows) and lander.left > 0:
        rows, once = np.unique(rows, return_index=True)
        source[rows] = origin[once]
        tries[rows] += 1
        landed.put(rows, lander.land(tiles.of(rows), source[rows]))
        reached = rows[landed.node[rows] >= 0]
        chart = tiles.chart[reached]
        lengths = indptr[chart + 1] - indptr[chart]
        begins = np.repeat(np.cumsum(lengths) - lengths, lengths)
        within = np.arange(lengths.sum()) - begins
        ahead = row_of[touching[np.repeat(indptr[chart], lengths) + within]]
        origin = np.repeat(landed.node[reached], lengths)
        open_ = (ahead >= 0) & (landed.node[ahead] < 0) & (tries[ahead] < FACE_TRIES)
        rows, origin = ahead[open_], origin[open_]
    return source, landed
