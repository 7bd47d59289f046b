"""E-cells: a surface cut into cells, and which of them touch."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfaces.adjacency import Neighbours
from surfaces.surface import Surface

if TYPE_CHECKING:
    import networkx as nx

    from surfaces.cell_curves import CellCurves


class Triangles(NamedTuple):
    """Triangles to draw."""

    vertices: NDArray[np.float64]
    """(V, 3) m, in the root frame."""
    faces: NDArray[np.int64]
    """(F, 3)"""
    normals: NDArray[np.float64]
    """(V, 3) outward unit normals."""


class Unrolled(NamedTuple):
    """Cells on a flat picture, x to the right and y down."""

    centres: NDArray[np.float64]
    """(N, 2)"""
    outlines: tuple[NDArray[np.float64], ...]
    """N closed polylines (k, 2)."""
    labels: tuple[str, str]
    """Names of x and y with their units."""
    turns: tuple[float, float]
    """How much of x and y is once around, inf where the surface does not close."""


@dataclass(frozen=True, eq=False, repr=False)
class Cells(ABC):
    """N cells of one surface, numbered from 0. Cells are values; they pickle."""

    surface: Surface
    centres: NDArray[np.float64]
    """(N, 3) m, on the surface, in the root frame."""
    normals: NDArray[np.float64]
    """(N, 3) outward unit normals at the centres, in the root frame."""
    areas: NDArray[np.float64]
    """(N,) m^2."""
    shape: tuple[int, ...]
    """How cells are counted: (nu, nv) for a grid, (N,) for the cells of a mesh."""

    def __post_init__(self) -> None:
        """Copy and write-protect the arrays."""
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, np.ndarray):
                array = np.array(value)
                array.flags.writeable = False
                object.__setattr__(self, field.name, array)

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle as a call of the constructor; what is derived is derived again."""
        return (type(self), tuple(getattr(self, field.name) for field in fields(self)))

    def __len__(self) -> int:
        """Number of cells."""
        return len(self.centres)

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know about the surface and its cells; one sentence each."""
        return self.surface.notes

    @property
    @abstractmethod
    def neighbours(self) -> Neighbours:
        """(indptr, indices): each cell's neighbours, clockwise seen from outside."""

    @property
    def middle(self) -> int:
        """A cell near the middle of the surface, where a search may begin.

        Here the one whose centre is nearest to the mean of all, by area.
        """
        mean = np.average(self.centres, axis=0, weights=self.areas)
        return int(np.argmin(np.linalg.norm(self.centres - mean, axis=1)))

    @cached_property
    def pairs(self) -> NDArray[np.int64]:
        """(M, 2) pairs i < j of cells that touch, each once, sorted."""
        pairs = self.neighbours.pairs
        pairs.flags.writeable = False
        return pairs

    @cached_property
    def curves(self) -> CellCurves:
        """The ways between the centres of the M `pairs`, as smooth curves."""
        from surfaces.cell_curves import curves_of

        return curves_of(self)

    @cached_property
    def max_curvature(self) -> NDArray[np.float64]:
        """(N,) 1/m; see `Surface.max_curvature`."""
        return self.surface.max_curvature(self)

    def graph(self) -> nx.Graph:
        """Adjacency as a graph: nodes are flat indices, edges are `pairs`."""
        import networkx as nx

        graph: nx.Graph = nx.Graph()
        graph.add_nodes_from(range(len(self)))
        graph.add_edges_from(self.pairs.tolist())
        return graph

    @abstractmethod
    def locate(self, points: ArrayLike) -> NDArray[np.int64]:
        """(k,) the cell that the surface's point nearest to each of `points` (k, 3) m lies in.

        -1 where that point is not on any cell.
        """

    @abstractmethod
    def borders(self, samples: int = 8) -> NDArray[np.float64]:
        """(k, 2, 3) m, ends of short straight lines that draw the borders of all cells.

        Args:
            samples: straight pieces along each side of a cell where sides are bent, >= 1.
        """

    @abstractmethod
    def triangles(
        self, which: NDArray[np.int64], samples: int = 8, inset: float = 0.0
    ) -> Triangles:
        """Triangles that fill some cells, smooth where the surface bends.

        Args:
            which: (k,) flat indices.
            samples: pieces along each side of a cell where sides are bent.
            inset: share of its width that a cell is drawn smaller by.
        """

    @abstractmethod
    def unrolled(self) -> Unrolled:
        """The cells laid flat, for pictures on paper."""

    @abstractmethod
    def unravel(self, k: int) -> tuple[int, ...]:
        """The cell with flat index k as people count it: (row, column), or (k,) on a mesh.

        Raises:
            IndexError: there is no such cell.
        """
