"""E-cells: a surface cut into cells, and which of them touch."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints, Mask, Protected
from coverable.errors import listed
from surfaces.adjacency import Neighbours
from surfaces.cell_curves import CellCurves
from surfaces.surface import Surface

if TYPE_CHECKING:
    import networkx as nx


class CellTriangles(NamedTuple):
    """Triangles to draw."""

    vertices: Array
    """(V, 3) m, in the root frame."""
    faces: Ints
    """(F, 3) counterclockwise seen from outside."""


class Unrolled(NamedTuple):
    """Cells on a flat picture, x to the right and y down."""

    centres: Array
    """(N, 2)"""
    outlines: tuple[Array, ...]
    """N closed polylines (k, 2)."""
    labels: tuple[str, str]
    """Names of x and y with their units."""
    turns: tuple[float, float]
    """How much of x and y is once around, inf where the surface does not close."""


class Finer(NamedTuple):
    """The same surface in finer cells, with the old centres among the new ones."""

    cells: Cells
    same: Ints
    """(N,) the finer cell with the same centre as each of the N cells."""


@dataclass(frozen=True, eq=False, repr=False)
class Cells(Protected, ABC):
    """N cells of one surface, numbered from 0. Cells are values; they pickle."""

    surface: Surface
    centres: Array
    """(N, 3) m, on the surface, in the root frame."""
    normals: Array
    """(N, 3) outward unit normals at the centres, in the root frame."""
    areas: Array
    """(N,) m^2."""
    shape: tuple[int, ...]
    """How cells are counted: (nu, nv) for a grid, (N,) for the cells of a mesh."""

    def __len__(self) -> int:
        """Number of cells."""
        return len(self.centres)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know about the surface and its cells; one sentence each."""
        return self.surface.notes

    @property
    def tangents(self) -> Array | None:
        """(N, 3) unit u directions at the centres, square to the normals, in the root frame.

        None where the surface has no parameters, as a mesh.
        """
        return None

    @property
    def approaches(self) -> Array | None:
        """(N, 3) unit tool axes of the cells' own, in the root frame; None where they have none."""
        return None

    @property
    def in_order(self) -> bool:
        """Whether they have to be visited in their order, never going back: a toolpath."""
        return False

    @property
    @abstractmethod
    def neighbours(self) -> Neighbours:
        """(indptr, indices): each cell's neighbours, clockwise seen from outside."""

    def finer(self, parts: int = 3) -> Finer | None:
        """Every cell cut into `parts` x `parts`, an odd number; None where there is no such cut.

        Cells of a mesh have no such cut: their borders are not at fixed shares of anything.
        """
        return None

    @property
    def middle(self) -> int:
        """A cell near the middle of the surface, where a search may begin.

        Here the one whose centre is nearest to the mean of all, by area.
        """
        mean = np.average(self.centres, axis=0, weights=self.areas)
        return int(np.argmin(np.linalg.norm(self.centres - mean, axis=1)))

    @cached_property
    def pairs(self) -> Ints:
        """(M, 2) pairs i < j of cells that touch, each once, sorted."""
        pairs = self.neighbours.pairs
        pairs.flags.writeable = False
        return pairs

    @cached_property
    def links(self) -> Ints:
        """The row of `pairs` that each entry of the neighbours' `indices` belongs to."""
        return self.neighbours.links  # not write-protected: to kernels that is another type

    def at_height(self, height: float) -> Cells:
        """These cells with the `curves` for targets at a signed height (m).

        They are other ones over inner creases alone, which no target reaches.
        """
        return self

    @property
    @abstractmethod
    def curves(self) -> CellCurves:
        """The smooth curves between the centres of the M `pairs`."""

    @abstractmethod
    def trace(self, pairs: Ints, t: Array) -> tuple[Array, Array]:
        """Curves on the surface from cell centre to cell centre, to which `curves` are fitted.

        Args:
            pairs: (m, 2) rows of `pairs`.
            t: (k,) places on the curve, 0 at the first cell's centre, 1 at the second's.

        Returns:
            Points (m, k, 3) m and outward unit normals (m, k, 3); both continuous in t.
        """

    def closest_along(self, pairs: Ints, points: Array) -> tuple[Array, Array]:
        """The points of the surface closest to points near the curve between two cells.

        Args:
            pairs: (m, 2) rows of `pairs`.
            points: (m, k, 3) m.

        Returns:
            Points (m, k, 3) m and outward unit normals (m, k, 3).
        """
        found = self.surface.closest(points)
        return points - found.height[..., None] * found.normal, found.normal

    def smoothed(self, pairs: Ints) -> Mask:
        """(m,) where `curves` are smoother than the surface; `closest_along` gives the error."""
        return np.full(len(pairs), self.surface.mean_edge_length > 0.0)

    @abstractmethod
    def parallel_curvature(self, height: float) -> Array:
        """(N,) 1/m, the largest curvature of the parallel surface at a signed height (m)."""

    @cached_property
    def max_curvature(self) -> Array:
        """(N,) 1/m, the largest curvature of the surface in each cell, in any direction."""
        return self.parallel_curvature(0.0)

    @property
    def creased(self) -> Mask:
        """(N,) cells with a strip along a crease where the normal turns; only meshes have them."""
        return np.zeros(len(self), dtype=bool)

    def distances(self, pairs: Ints, points: Array) -> tuple[Array, Array]:
        """Distances (k,) m of points from the surface, and outward unit vectors along them (k, 3).

        On a mesh these are measured from the triangles of the two cells and of those that touch
        both, without interpolated normals.

        Args:
            pairs: (k, 2) rows of `pairs`, near whose curve each point lies.
            points: (k, 3) m.
        """
        found = self.surface.closest(points)
        return np.abs(found.height), found.normal

    def crease_distances(self, pairs: Ints, points: Array) -> Array:
        """(k,) m, how far points of the surface are from the crease on whose strip they lie.

        An upper bound; inf off the strips. See `distances` for the arguments.
        """
        return np.full(len(points), np.inf)

    def graph(self) -> nx.Graph:
        """Adjacency as a graph: nodes are flat indices, edges are `pairs`."""
        import networkx as nx

        graph: nx.Graph = nx.Graph()
        graph.add_nodes_from(range(len(self)))
        graph.add_edges_from(self.pairs.tolist())
        return graph

    @abstractmethod
    def locate(self, points: ArrayLike) -> Ints:
        """(k,) the cell that the surface's point nearest to each of `points` (k, 3) m lies in.

        -1 where that point is not on any cell.
        """

    @abstractmethod
    def borders(self, samples: int = 8) -> Array:
        """(k, 2, 3) m, ends of short straight lines that draw the borders of all cells.

        Args:
            samples: straight pieces along each side of a cell where sides are bent, >= 1.
        """

    @abstractmethod
    def triangles(self, which: Ints, samples: int = 8, inset: float = 0.0) -> CellTriangles:
        """Triangles that fill some cells.

        Args:
            which: (k,) flat indices.
            samples: pieces along each side of a cell where sides are bent.
            inset: share of its width that a cell is drawn smaller by.
        """

    @abstractmethod
    def unrolled(self) -> Unrolled:
        """The cells on a plane, for pictures on paper."""

    def seen_from_outside(self, outlines: Iterable[Array]) -> Unrolled:
        """The picture along the mean normal, x right and y down, from N outlines (k, 3) m.

        Of a closed surface, whose mean normal is near zero, along its least extent.
        """
        mean = (self.areas[:, None] * self.normals).sum(axis=0)
        middle = self.centres.mean(axis=0)
        _, _, axes = np.linalg.svd(self.centres - middle)
        up = mean if np.linalg.norm(mean) > 0.1 * self.areas.sum() else axes[-1]
        up = up / np.linalg.norm(up)
        flatter = (axis - (axis @ up) * up for axis in axes[:2])
        right = next(axis for axis in flatter if np.linalg.norm(axis) > 1e-6)
        right = right / np.linalg.norm(right)
        flat = np.column_stack([right, -np.cross(up, right)])
        return Unrolled(
            centres=(self.centres - middle) @ flat,
            outlines=tuple((line - middle) @ flat for line in outlines),
            labels=("along (m)", "across (m)"),
            turns=(np.inf, np.inf),
        )

    @abstractmethod
    def unravel(self, k: int) -> tuple[int, ...]:
        """The cell with flat index k as people count it: (row, column), or (k,) on a mesh.

        Raises:
            IndexError: there is no such cell.
        """

    def named(self, cells: Sequence[int] | Ints, most: int) -> str:
        """At most so many cells as people count them: "[0, 1], [2, 0] and 3 more"."""
        return listed([list(self.unravel(int(k))) for k in cells], most)
