"""What spreading keeps: configurations over places, and the tiles that hold from them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints, Mask
from surfaces.cell_tiles import Tiles
from surfaces.places import Places


class Nodes(NamedTuple):
    """m configurations over places, each joined by a straight segment to the one it came from."""

    q: Array
    """(m, n) rad or m."""
    places: Places
    came: Ints
    """(m,) the node before; -1 where it is one of the motion that all of them are joined to."""

    @staticmethod
    def join(*parts: Nodes) -> Nodes:
        """Nodes one after the other."""
        q, places, came = zip(*parts, strict=True)
        return Nodes(np.concatenate(q), Places.join(*places), np.concatenate(came))

    def back_from(self, ends: Ints) -> tuple[Nodes, Ints]:
        """The nodes on the paths back from some, in order; and the new numbers (m,) of all."""
        wanted = np.zeros(len(self.came), dtype=bool)
        back = np.unique(ends)
        while len(back):
            wanted[back] = True
            back = np.unique(self.came[back])
            back = back[(back >= 0) & ~wanted[back]]
        number = np.cumsum(wanted) - 1
        came = self.came[wanted]
        came = np.where(came < 0, -1, number[came])
        return Nodes(self.q[wanted], self.places.of(wanted), came), number


class HeldTiles(NamedTuple):
    """k tiles that hold."""

    tiles: Tiles
    node: Ints
    """(k,) the configuration over the middle of each."""
    gains: Array
    """(k, n, 3) G of each, see `feasibility.area.kernels.lemma`."""

    @staticmethod
    def join(*parts: HeldTiles) -> HeldTiles:
        """Tiles one after the other."""
        tiles, node, gains = zip(*parts, strict=True)
        return HeldTiles(Tiles.join(*tiles), np.concatenate(node), np.concatenate(gains))

    def of(self, rows: Mask) -> HeldTiles:
        """Some of the tiles."""
        return HeldTiles(self.tiles.of(rows), self.node[rows], self.gains[rows])
