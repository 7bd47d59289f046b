"""Patch: a surface with parameters u and v, in ranges, cut into a grid of cells."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfaces.surface import TURN_TOLERANCE, Surface

if TYPE_CHECKING:
    from surfaces.patches.grid_cells import GridCells


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
    def periods(self) -> tuple[float, float]:
        """Once around in u and in v, rad; 0 where the patch is not closed."""
        return (math.tau if self.u_closed else 0.0, math.tau if self.v_closed else 0.0)

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
