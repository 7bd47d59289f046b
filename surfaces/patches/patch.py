"""Patch: a surface with parameters u and v, in ranges, cut into a grid of cells."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfaces.surface import TURN_TOLERANCE, Surface, sharpest_turn

if TYPE_CHECKING:
    from surfaces.cells import Cells
    from surfaces.patches.grid_cells import GridCells

DIFFERENCE = 1e-4  # [1], share of a patch: step of differences


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Patch(Surface):
    """A patch (u, v) -> point of a smooth surface."""

    units: ClassVar[tuple[str, str]]
    """'rad' or 'm' or '', of u and of v."""
    u_angle: ClassVar[bool]
    """True where u is an angle about an axis, so that u and u + 2 pi are one place."""
    v_angle: ClassVar[bool]

    u_range: tuple[float, float]
    """rad or m."""
    v_range: tuple[float, float]
    """rad or m."""

    @property
    def u_closed(self) -> bool:
        """True where u runs through a full turn, so that its two ends are joined."""
        return self.u_angle and self.u_range[1] - self.u_range[0] >= math.tau - TURN_TOLERANCE

    @property
    def v_closed(self) -> bool:
        """True where v runs through a full turn, so that its two ends are joined."""
        return self.v_angle and self.v_range[1] - self.v_range[0] >= math.tau - TURN_TOLERANCE

    @property
    def poles(self) -> tuple[bool, bool]:
        """Whether the rows of lowest and of highest u close around a pole of the patch."""
        return (False, False)

    @property
    def lengths(self) -> tuple[float, ...]:
        """The lengths (m) that fix the surface in its own frame, for its `repr`."""
        return ()

    @abstractmethod
    def local_point(self, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (..., 3) m in the surface's own frame, from parameters of one shape."""

    @abstractmethod
    def local_normal(self, u: NDArray[np.float64], v: NDArray[np.float64]) -> NDArray[np.float64]:
        """Outward unit normals (..., 3) in the surface's own frame."""

    @abstractmethod
    def area(
        self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike
    ) -> NDArray[np.float64]:
        """Area (m^2) of the part u0..u1 by v0..v1; exact, vectorised."""

    def point(self, u: ArrayLike, v: ArrayLike) -> NDArray[np.float64]:
        """Points (..., 3) m of the surface in the root frame."""
        u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
        return self.local_point(u, v) @ self.rotation.T + self.position

    def normal(self, u: ArrayLike, v: ArrayLike) -> NDArray[np.float64]:
        """Outward unit normals (..., 3) in the root frame.

        Outward is away from the centre or axis of a sphere, cylinder or hyperboloid, and +z of
        the own frame of a plane.
        """
        u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
        return self.local_normal(u, v) @ self.rotation.T

    def trace(
        self, cells: Cells, pairs: NDArray[np.int64], t: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """See `Surface.trace`: straight in u and v, and over a pole the chord's feet.

        So the way stays on a patch which the straight line through space would leave: the rim of
        a dome, the far side of a pipe. A closed parameter runs the shorter way round. Only over a
        pole the chord is the one that stays.
        """
        u, v = cells.u, cells.v  # type: ignore[attr-defined]  # of a grid
        i, j = pairs[:, 0], pairs[:, 1]
        du, dv = u[j] - u[i], v[j] - v[i]
        if self.u_closed:
            du -= math.tau * np.round(du / math.tau)
        if self.v_closed:
            dv -= math.tau * np.round(dv / math.tau)
        us, vs = u[i, None] + t * du[:, None], v[i, None] + t * dv[:, None]
        over = np.zeros(len(pairs), dtype=bool)
        for pole, end in zip(self.poles, self.u_range, strict=True):
            # Both cells lie in the row at the pole, on different sides of it. (One row from pole to
            # pole has its chords through the middle, whose feet are nowhere.)
            if pole and (cells.shape[0] > 1 or not all(self.poles)):
                near = np.abs(u - end) <= 1.01 * np.abs(u - end).min()
                over |= near[i] & near[j] & (np.abs(dv) > 0.5 * math.pi)
        us[over], vs[over] = _over_a_pole(self, cells, pairs[over], t)
        return self.point(us, vs), self.normal(us, vs)

    def max_curvature(self, cells: Cells, height: float = 0.0) -> NDArray[np.float64]:
        """See `Surface.max_curvature`: the larger principal curvature, by central differences."""
        places = cells.u, cells.v  # type: ignore[attr-defined]  # of a grid
        slopes, turns = [], []
        for axis, (low, high) in enumerate((self.u_range, self.v_range)):
            step = np.zeros((2, 1))
            step[axis] = min(DIFFERENCE, 0.25 / max(cells.shape[axis], 1)) * (high - low)
            ahead, behind = np.add(places, step), np.subtract(places, step)
            turns.append(self.normal(*ahead) - self.normal(*behind))
            slopes.append(self.point(*ahead) - self.point(*behind) + height * turns[-1])
        return sharpest_turn(np.stack(slopes, axis=1), np.stack(turns, axis=1))

    def cells(self, nu: int, nv: int) -> GridCells:
        """Cut the patch into nu x nv E-cells of equal parameter steps.

        Raises:
            SurfaceError: nu or nv is not a whole number >= 0.

        Example:
            >>> from surfaces import sphere
            >>> cells = sphere(1.0, polar_deg=(10, 90), azimuth_deg=(10, 180)).cells(9, 10)
            >>> len(cells), len(cells.pairs)
            (90, 305)
        """
        from surfaces.patches.grid_cells import GridCells

        return GridCells.cut(self, nu, nv)

    def __repr__(self) -> str:
        """One line: the kind, its lengths, ranges (degrees or metres), side and position."""
        lengths = ", ".join(f"{length:g}" for length in self.lengths)
        ranges = []
        for name, (low, high) in (("u", self.u_range), ("v", self.v_range)):
            if self.units["uv".index(name)] == "rad":
                ranges.append(f"{name}_deg=({math.degrees(low):g}, {math.degrees(high):g})")
            else:
                ranges.append(f"{name}=({low:g}, {high:g})")
        parts = [lengths, *ranges, f"side={self.side!r}", f"position={self.position.tolist()}"]
        return f"{self.kind}({', '.join(part for part in parts if part)})"


def _over_a_pole(
    patch: Patch, cells: Cells, pairs: NDArray[np.int64], t: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Parameters (m, k) of the feet of straight lines between centres."""
    start, end = cells.centres[pairs[:, 0], None], cells.centres[pairs[:, 1], None]
    closest_point = patch.closest(start + t[:, None] * (end - start))
    return closest_point.u, closest_point.v
