"""Tiles: connected pieces of cells, rectangles of parameters or triangles on a face.

Over a place x with the point f(x) and the outward unit normal n(x), the offset surface at a signed
height h has the point T(x) = f(x) + h n(x). What holds all over a tile rests on how far T and n
are, over all of it, from what is straight between its corners.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints, Mask
from surfaces.cells import Cells
from surfaces.places import OffsetSurface, Places, offset_surface


class Tiles(NamedTuple):
    """k tiles."""

    cell: Ints
    """(k,) the cell that each is a piece of."""
    chart: Ints
    """(k,) patch or face, see `surfaces.places.Places`."""
    corners: Array
    """(k, c, 2) parameters of the corners in order, four of a rectangle or three of a triangle."""

    def of(self, rows: Ints | Mask | slice) -> Tiles:
        """Some of the tiles."""
        return Tiles(self.cell[rows], self.chart[rows], self.corners[rows])

    @staticmethod
    def join(*parts: Tiles) -> Tiles:
        """Tiles one after the other."""
        return Tiles(*(np.concatenate(part) for part in zip(*parts, strict=True)))

    @property
    def middles(self) -> Places:
        """The places in their middles."""
        return Places(self.chart, self.corners.mean(axis=1))


class TileBounds(NamedTuple):
    """What holds the offset points and the normals over each of k tiles.

    Over any place, T and n are within the radii of corners (T_i, n_i) mixed in the same shares.
    """

    corners: Array
    """(k, 4, 2, 3) T_i (m) and n_i; those of a triangle's third corner twice."""
    radii: Array
    """(k, 2) m and 1; inf where nothing is known."""

    def of(self, rows: Ints | Mask | slice) -> TileBounds:
        """Some of them."""
        return TileBounds(*(values[rows] for values in self))


class Lines(NamedTuple):
    """k lines of places, one after the other."""

    places: Places
    """(m,) at the ends of their pieces."""
    first: Ints
    """(k + 1,) where each begins."""


@dataclass(frozen=True, eq=False)
class CellTiles(ABC):
    """The cells of a surface, to be cut into tiles."""

    cells: Cells
    offset: OffsetSurface
    """The offset surface that the bounds are of."""

    @abstractmethod
    def of_cells(self, which: Ints) -> Tiles:
        """Tiles that together are some cells."""

    @abstractmethod
    def halves(self, tiles: Tiles) -> Tiles:
        """(2 k) the halves of each tile, across its longer side; those of tile i are 2i, 2i + 1."""

    @abstractmethod
    def bounds(self, tiles: Tiles) -> TileBounds:
        """Bounds over each tile."""

    @abstractmethod
    def areas(self, tiles: Tiles) -> Array:
        """(k,) m^2, of the surface itself."""

    @abstractmethod
    def centres(self, which: Ints) -> Places:
        """The places of the centres of some cells."""

    @property
    def touching(self) -> tuple[Ints, Ints] | None:
        """(charts + 1,) and (m,): which charts share an edge with each, in CSR form.

        None where each cell is one tile to begin with, with its centre in its middle.
        """
        return None

    def lines(self, start: Places, end: Places, parts: Ints) -> Lines:
        """Lines of places, straight in the parameters of one chart.

        Args:
            start: k places.
            end: k places on the same charts.
            parts: (k,) how many pieces each is to have.
        """
        line, share, first = spaced(parts)
        x = start.x[line] + share[:, None] * (end.x - start.x)[line]
        return Lines(Places(end.chart[line], x), first)


def spaced(parts: Ints) -> tuple[Ints, Array, Ints]:
    """The line of each place, its share of it, and where lines begin, see `Lines`."""
    first = np.concatenate([[0], np.cumsum(parts + 1)])
    line = np.repeat(np.arange(len(parts)), parts + 1)
    return line, (np.arange(first[-1]) - first[line]) / parts[line], first


def offset_of(cells: Cells, height: float) -> OffsetSurface:
    """The offset surface of cells; see `surfaces.places.offset_surface`."""
    return offset_surface(cells.surface, height)
