"""A patch cut into a grid of parameter cells."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints
from surfaces.adjacency import Neighbours, grid_neighbours
from surfaces.arguments import Checks
from surfaces.at_home import AtHome
from surfaces.cell_curves import CellCurves
from surfaces.cells import Cells, CellTriangles, Finer, Unrolled
from surfaces.curve_fitting import CurveFit
from surfaces.patches.parametric import ParametricSurface
from surfaces.surface import max_principal_curvature

if TYPE_CHECKING:
    from surfaces.patches.closed_form_kernels import PatchKernel


DIFFERENCE = 1e-4  # [1], share of a patch: step of differences
KEPT = 4  # patches whose curves are remembered
MOST = 2_000  # cells: of more the curves take too much memory to be kept


@dataclass(frozen=True, eq=False, repr=False)
class GridCells(Cells):
    """N = nu x nv cells of one patch, numbered row by row: cell (i, j) is i * nv + j.

    A cell's centre lies at its mid parameters. A grid without cells (0 x nv) is allowed.
    """

    surface: ParametricSurface
    shape: tuple[int, int]
    u: Array
    """(N,) first parameter of each centre, rad or m."""
    v: Array
    """(N,) second parameter of each centre, rad or m."""

    @staticmethod
    def cut(surface: ParametricSurface, nu: int, nv: int) -> GridCells:
        """Cut `surface` into nu x nv cells of equal parameter steps; see `Patch.cells`."""
        nu, nv = grid_counts(nu, nv)
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

    def finer(self, parts: int = 3) -> Finer:
        """See `Cells.finer`."""
        nu, nv = self.shape
        i, j = np.divmod(np.arange(len(self)), nv)
        same = (parts * i + parts // 2) * (parts * nv) + parts * j + parts // 2
        return Finer(GridCells.cut(self.surface, parts * nu, parts * nv), same)

    @cached_property
    def tangents(self) -> Array:
        """See `Cells.tangents`."""
        found = self.surface.tangent(self.u, self.v)
        found.flags.writeable = False
        return found

    @cached_property
    def neighbours(self) -> Neighbours:
        """(indptr, indices): each cell's neighbours, clockwise from the upper left one."""
        closed = (self.surface.u_closed, self.surface.v_closed)
        found = grid_neighbours(*self.shape, closed=closed, poles=self.surface.poles)
        for array in found:
            array.flags.writeable = False
        return found

    @cached_property
    def curves(self) -> CellCurves:
        """See `Cells.curves`; fitted at home once for all poses."""
        fitted = _fitted if len(self) <= MOST else _fitted.__wrapped__
        curves = fitted(AtHome(self.surface, self.shape, self.u, self.v))
        return curves.moved(self.surface.rotation, self.surface.position)

    def trace(self, pairs: Ints, t: Array) -> tuple[Array, Array]:
        """See `Cells.trace`: straight in u and v; over a pole, closest to the straight line.

        So the curve stays on a patch which the straight line through space would leave: the edge of
        a dome, the far side of a pipe. A closed parameter runs the shorter way round. Only over a
        pole the straight line is the one that stays.
        """
        surface, u, v = self.surface, self.u, self.v
        i, j = pairs[:, 0], pairs[:, 1]
        du, dv = u[j] - u[i], v[j] - v[i]
        for along, period in zip((du, dv), surface.periods, strict=True):
            if period:
                along -= period * np.round(along / period)
        us, vs = u[i, None] + t * du[:, None], v[i, None] + t * dv[:, None]
        over = np.zeros(len(pairs), dtype=bool)
        for pole, end in zip(surface.poles, surface.u_range, strict=True):
            # Both cells lie in the row at the pole, on different sides of it. (A single row from
            # pole to pole has its straight lines through the middle, far from the surface.)
            if pole and (self.shape[0] > 1 or not all(surface.poles)):
                near = np.abs(u - end) <= 1.01 * np.abs(u - end).min()
                over |= near[i] & near[j] & (np.abs(dv) > 0.5 * math.pi)
        begin, stop = self.centres[i[over], None], self.centres[j[over], None]
        found = surface.closest(begin + t[:, None] * (stop - begin))
        us[over], vs[over] = found.u, found.v
        return surface.point_and_normal(us, vs)

    def parallel_curvature(self, height: float) -> Array:
        """See `Cells.parallel_curvature`: at the centres, by central differences."""
        surface = self.surface
        steps, turns = [], []
        for axis, (low, high) in enumerate((surface.u_range, surface.v_range)):
            shift = np.zeros((2, 1))
            shift[axis] = min(DIFFERENCE, 0.25 / max(self.shape[axis], 1)) * (high - low)
            ahead, behind = np.add((self.u, self.v), shift), np.subtract((self.u, self.v), shift)
            points, normals = surface.point_and_normal(*ahead)
            before, leaning = surface.point_and_normal(*behind)
            turns.append(normals - leaning)
            steps.append(points - before + height * turns[-1])
        return max_principal_curvature(np.stack(steps, axis=1), np.stack(turns, axis=1))

    @property
    def middle(self) -> int:
        """The cell in the middle row and column."""
        return self.index(self.shape[0] // 2, self.shape[1] // 2)

    @cached_property
    def patch_kernel(self) -> PatchKernel | None:
        """What compiled loops need of these cells; None for kinds that they know no formulas of."""
        return self.surface.patch_kernel(*self.shape)

    def index(self, i: int, j: int) -> int:
        """Flat index of the cell in row i (u) and column j (v).

        Raises:
            IndexError: there is no such cell.
        """
        if not (0 <= i < self.shape[0] and 0 <= j < self.shape[1]):
            raise IndexError(f"no cell ({i}, {j}) in a grid of {self.shape[0]} x {self.shape[1]}")
        return int(i * self.shape[1] + j)

    def unravel(self, k: int) -> tuple[int, int]:
        """See `Cells.unravel`: row (u) and column (v)."""
        if not 0 <= k < len(self):
            raise IndexError(f"no cell {k} in a grid of {self.shape[0]} x {self.shape[1]}")
        i, j = divmod(int(k), self.shape[1])
        return i, j

    def outlines(self, samples: int = 8) -> Array:
        """Borders of the cells as closed polylines (N, 4 * samples + 1, 3) m, in the root frame.

        Args:
            samples: straight pieces along each of a cell's four sides, >= 1. Every `samples`-th
                point is a corner; the order is (u, v) = (low, low), (low, high), (high, high),
                (high, low).

        Raises:
            SurfaceError: `samples` is not a whole number >= 1.
        """
        checks = Checks("outlines")
        checks.whole("samples", samples, 1)
        checks.done()
        t = np.arange(samples) / samples
        zero, one = np.zeros(samples), np.ones(samples)
        du = np.concatenate([zero, t, one, 1.0 - t, [0.0]]) - 0.5
        dv = np.concatenate([t, one, 1.0 - t, zero, [0.0]]) - 0.5
        width_u, width_v = self._widths
        u, v = self.u[:, None] + du * width_u, self.v[:, None] + dv * width_v
        return self.surface.point(u, v)

    def borders(self, samples: int = 8) -> Array:
        """See `Cells.borders`."""
        lines = self.outlines(samples)
        return np.stack([lines[:, :-1], lines[:, 1:]], axis=2).reshape(-1, 2, 3)

    def locate(self, points: ArrayLike) -> Ints:
        """See `Cells.locate`."""
        closest_point = self.surface.closest(points)
        return np.where(closest_point.inside, self.at(closest_point.u, closest_point.v), -1)

    def at(self, u: ArrayLike, v: ArrayLike) -> Ints:
        """The cells at some parameters; -1 where these are NaN, or where there are no cells.

        Parameters beyond the ranges count as the nearest ones within.
        """
        u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
        row = _bin(u, self.surface.u_range, self.shape[0])
        column = _bin(v, self.surface.v_range, self.shape[1])
        return np.where((row >= 0) & (column >= 0), row * self.shape[1] + column, -1)

    def triangles(self, which: Ints, samples: int = 8, inset: float = 0.0) -> CellTriangles:
        """See `Cells.triangles`."""
        t = (np.linspace(0.0, 1.0, samples + 1) - 0.5) * (1.0 - inset)
        du, dv = (part.reshape(-1) for part in np.meshgrid(t, t, indexing="ij"))
        width_u, width_v = self._widths
        u = self.u[which, None] + du * width_u
        v = self.v[which, None] + dv * width_v
        i, j = (part.reshape(-1) for part in np.meshgrid(*[np.arange(samples)] * 2, indexing="ij"))
        corner = i * (samples + 1) + j
        right, up = corner + 1, corner + samples + 1
        one = np.concatenate(
            [np.column_stack([corner, right, up + 1]), np.column_stack([corner, up + 1, up])]
        )
        starts = np.arange(len(which)) * (samples + 1) ** 2
        faces = (starts[:, None, None] + one).reshape(-1, 3)
        vertices = self.surface.point(u, v).reshape(-1, 3)
        normals = self.surface.normal(u, v).reshape(-1, 3)
        corners = vertices[faces]
        looks = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        if (looks * normals[faces[:, 0]]).sum() < 0.0:  # counterclockwise seen from outside
            faces = faces[:, ::-1]
        return CellTriangles(vertices, faces)

    def unrolled(self) -> Unrolled:
        """See `Cells.unrolled`: v to the right and u down, as cells are numbered."""
        surface = self.surface
        degrees = [np.degrees(1.0) if unit == "rad" else 1.0 for unit in surface.units]
        words = [{"rad": " (degrees)", "m": " (m)"}.get(unit, "") for unit in surface.units]
        half = 0.5 * np.array(self._widths)[::-1] * degrees[::-1]
        corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]]) * half
        centres = np.column_stack([self.v * degrees[1], self.u * degrees[0]])
        return Unrolled(
            centres=centres,
            outlines=tuple(centres[:, None] + corners),
            labels=(f"v{words[1]}", f"u{words[0]}"),
            turns=(
                np.ptp(surface.v_range) * degrees[1] if surface.v_closed else np.inf,
                np.ptp(surface.u_range) * degrees[0] if surface.u_closed else np.inf,
            ),
        )

    @property
    def _widths(self) -> tuple[float, float]:
        """Width of a cell along u and v, rad or m."""
        surface = self.surface
        return (
            (surface.u_range[1] - surface.u_range[0]) / max(self.shape[0], 1),
            (surface.v_range[1] - surface.v_range[0]) / max(self.shape[1], 1),
        )

    def __repr__(self) -> str:
        """One line: how many cells of what."""
        return f"Cells({self.shape[0]} x {self.shape[1]} of {self.surface!r})"


@lru_cache(maxsize=KEPT)
def _fitted(home: AtHome) -> CellCurves:
    """The curves of a grid of cells, given with its counts, u and v."""
    surface, (shape, u, v) = home.surface, home.more
    centres, normals = surface.point(u, v), surface.normal(u, v)
    cells = GridCells(surface, centres, normals, np.zeros(len(u)), shape, u, v)
    return CurveFit.of(cells).joined()


def _bin(values: Array, limits: tuple[float, float], count: int) -> Ints:
    """Which of `count` equal parts of a range each value falls in; -1 for NaN, and of none."""
    share = (values - limits[0]) / (limits[1] - limits[0])
    part = np.clip(np.floor(share * count), 0, count - 1)
    return np.where(np.isnan(part), -1, part).astype(np.int64)


def grid_counts(nu: Any, nv: Any) -> tuple[int, int]:
    """The numbers of cells along u and v.

    Raises:
        SurfaceError: they are not whole numbers >= 0.
    """
    checks = Checks("grid")
    counts = checks.whole("nu", nu, 0), checks.whole("nv", nv, 0)
    checks.done()
    return counts
