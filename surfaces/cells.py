"""E-cells: a patch cut into a grid of parameter cells, and which of them touch."""

from __future__ import annotations

import operator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from surfaces.neighbours import Neighbours, grid_neighbours
from surfaces.surface import Surface, SurfaceError

if TYPE_CHECKING:
    import networkx as nx

    from surfaces.chart import Chart

_ARRAYS = ("u", "v", "centres", "normals", "areas")


@dataclass(frozen=True, eq=False, repr=False)
class Cells:
    """N = nu x nv cells of one surface, numbered row by row: cell (i, j) is i * nv + j.

    A cell's centre lies at its mid parameters. Cells are values; they pickle. A grid without
    cells (0 x nv) is allowed.
    """

    surface: Surface
    shape: tuple[int, int]
    """(nu, nv)."""
    u: NDArray[np.float64]
    """(N,) first parameter of each centre, rad or m."""
    v: NDArray[np.float64]
    """(N,) second parameter of each centre, rad or m."""
    centres: NDArray[np.float64]
    """(N, 3) m, in the root frame."""
    normals: NDArray[np.float64]
    """(N, 3) outward unit normals at the centres, in the root frame."""
    areas: NDArray[np.float64]
    """(N,) m^2."""

    def __post_init__(self) -> None:
        """Copy and write-protect the arrays."""
        for name in _ARRAYS:
            array = np.array(getattr(self, name), dtype=float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle as a call of the constructor; what is derived is derived again."""
        return (Cells, (self.surface, self.shape, *(getattr(self, name) for name in _ARRAYS)))

    @staticmethod
    def grid(surface: Surface, nu: int, nv: int) -> Cells:
        """Cut `surface` into nu x nv cells of equal parameter steps; see `Surface.cells`.

        Raises:
            SurfaceError: nu or nv is not a whole number >= 0.
        """
        nu, nv = _count("nu", nu), _count("nv", nv)
        u_edges = np.linspace(*surface.u_range, nu + 1)
        v_edges = np.linspace(*surface.v_range, nv + 1)
        areas = surface.area(u_edges[:-1, None], u_edges[1:, None], v_edges[:-1], v_edges[1:])
        u = np.repeat((u_edges[:-1] + u_edges[1:]) / 2.0, nv)
        v = np.tile((v_edges[:-1] + v_edges[1:]) / 2.0, nu)
        return Cells(
            surface,
            (nu, nv),
            u,
            v,
            centres=surface.point(u, v),
            normals=surface.normal(u, v),
            areas=np.broadcast_to(areas, (nu, nv)).reshape(-1),
        )

    def __len__(self) -> int:
        """Number of cells."""
        return self.shape[0] * self.shape[1]

    @cached_property
    def neighbours(self) -> Neighbours:
        """(indptr, indices): each cell's neighbours, clockwise from the upper left one."""
        closed = (self.surface.u_closed, self.surface.v_closed)
        found = grid_neighbours(*self.shape, closed=closed, poles=self.surface.poles)
        for array in found:
            array.flags.writeable = False
        return found

    @cached_property
    def pairs(self) -> NDArray[np.int64]:
        """(M, 2) pairs i < j of cells that touch, each once, sorted."""
        pairs = self.neighbours.pairs
        pairs.flags.writeable = False
        return pairs

    @cached_property
    def chart(self) -> Chart:
        """What compiled loops need of these cells."""
        return self.surface.chart(*self.shape)

    def graph(self) -> nx.Graph:
        """Adjacency as a graph: nodes are flat indices, edges are `pairs`."""
        import networkx as nx

        graph: nx.Graph = nx.Graph()
        graph.add_nodes_from(range(len(self)))
        graph.add_edges_from(self.pairs.tolist())
        return graph

    def index(self, i: int, j: int) -> int:
        """Flat index of the cell in row i (u) and column j (v).

        Raises:
            IndexError: there is no such cell.
        """
        if not (0 <= i < self.shape[0] and 0 <= j < self.shape[1]):
            raise IndexError(f"no cell ({i}, {j}) in a grid of {self.shape[0]} x {self.shape[1]}")
        return int(i * self.shape[1] + j)

    def unravel(self, k: int) -> tuple[int, int]:
        """Row (u) and column (v) of the cell with flat index k.

        Raises:
            IndexError: there is no such cell.
        """
        if not 0 <= k < len(self):
            raise IndexError(f"no cell {k} in a grid of {self.shape[0]} x {self.shape[1]}")
        i, j = divmod(int(k), self.shape[1])
        return i, j

    def outlines(self, samples: int = 8) -> NDArray[np.float64]:
        """Borders of the cells as closed polylines (N, 4 * samples + 1, 3) m, in the root frame.

        Args:
            samples: straight pieces along each of a cell's four sides, >= 1. Every `samples`-th
                point is a corner; the order is (u, v) = (low, low), (low, high), (high, high),
                (high, low).

        Raises:
            SurfaceError: `samples` is not a whole number >= 1.
        """
        if _count("samples", samples) == 0:
            raise SurfaceError("samples must be a whole number >= 1, got 0")
        t = np.arange(samples) / samples
        zero, one = np.zeros(samples), np.ones(samples)
        du = np.concatenate([zero, t, one, 1.0 - t, [0.0]]) - 0.5
        dv = np.concatenate([t, one, 1.0 - t, zero, [0.0]]) - 0.5
        width_u, width_v = (
            (high - low) / max(count, 1)
            for (low, high), count in zip(
                (self.surface.u_range, self.surface.v_range), self.shape, strict=True
            )
        )
        return self.surface.point(
            self.u[:, None] + du * width_u,
            self.v[:, None] + dv * width_v,
        )

    def __repr__(self) -> str:
        """One line: how many cells of what."""
        return f"Cells({self.shape[0]} x {self.shape[1]} of {self.surface!r})"


def _count(name: str, value: Any) -> int:
    """A whole number >= 0, or a clear error."""
    try:
        count = operator.index(value)
    except TypeError:
        count = -1
    if count < 0 or isinstance(value, bool):
        raise SurfaceError(f"{name} must be a whole number >= 0, got {value!r}")
    return count
