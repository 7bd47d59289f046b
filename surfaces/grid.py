"""A patch cut into a grid of parameter cells."""

from __future__ import annotations

import operator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from surfaces.cells import Cells
from surfaces.neighbours import Neighbours, grid_neighbours
from surfaces.patch import Patch
from surfaces.surface import SurfaceError

if TYPE_CHECKING:
    from surfaces.chart import Chart


@dataclass(frozen=True, eq=False, repr=False)
class GridCells(Cells):
    """N = nu x nv cells of one patch, numbered row by row: cell (i, j) is i * nv + j.

    A cell's centre lies at its mid parameters. A grid without cells (0 x nv) is allowed.
    """

    surface: Patch
    shape: tuple[int, int]
    u: NDArray[np.float64]
    """(N,) first parameter of each centre, rad or m."""
    v: NDArray[np.float64]
    """(N,) second parameter of each centre, rad or m."""

    @staticmethod
    def cut(surface: Patch, nu: int, nv: int) -> GridCells:
        """Cut `surface` into nu x nv cells of equal parameter steps; see `Patch.cells`.

        Raises:
            SurfaceError: nu or nv is not a whole number >= 0.
        """
        nu, nv = _count("nu", nu), _count("nv", nv)
        u_edges = np.linspace(*surface.u_range, nu + 1)
        v_edges = np.linspace(*surface.v_range, nv + 1)
        areas = surface.area(u_edges[:-1, None], u_edges[1:, None], v_edges[:-1], v_edges[1:])
        u = np.repeat((u_edges[:-1] + u_edges[1:]) / 2.0, nv)
        v = np.tile((v_edges[:-1] + v_edges[1:]) / 2.0, nu)
        return GridCells(
            surface=surface,
            centres=surface.point(u, v),
            normals=surface.normal(u, v),
            areas=np.broadcast_to(areas, (nu, nv)).reshape(-1),
            shape=(nu, nv),
            u=u,
            v=v,
        )

    @cached_property
    def neighbours(self) -> Neighbours:
        """(indptr, indices): each cell's neighbours, clockwise from the upper left one."""
        closed = (self.surface.u_closed, self.surface.v_closed)
        found = grid_neighbours(*self.shape, closed=closed, poles=self.surface.poles)
        for array in found:
            array.flags.writeable = False
        return found

    @property
    def middle(self) -> int:
        """The cell in the middle row and column."""
        return self.index(self.shape[0] // 2, self.shape[1] // 2)

    @cached_property
    def chart(self) -> Chart:
        """What compiled loops of the greedy search need of these cells.

        Raises:
            SurfaceError: the patch is of a kind that they do not know.
        """
        from surfaces.charted import ChartedPatch

        if not isinstance(self.surface, ChartedPatch):
            raise SurfaceError(
                f"{self.surface.kind}: the greedy search works on a sphere, cylinder, hyperboloid "
                'or plane only; use search.method = "complete"'
            )
        return self.surface.chart(*self.shape)

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
