"""Surface: a parametrised patch with a pose and a working side, and what can be asked of it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfaces.bounds import CurvatureSlices, NormalBounds, normal_bounds

if TYPE_CHECKING:
    from surfaces.cells import Cells
    from surfaces.chart import Chart

Side = Literal["inside", "outside"]
TURN_TOLERANCE = 1e-9  # [rad]: a range this close to a full turn is one


class SurfaceError(ValueError):
    """A surface that cannot be built as asked: what was wrong, where, and what would do."""


@dataclass(frozen=True, eq=False, slots=True)
class Foot:
    """The points of a surface nearest to given points; every array has the points' leading shape.

    The foot lies on the whole surface that the patch is cut from; `inside` tells whether it lies
    on the patch.
    """

    u: NDArray[np.float64]
    """First parameter, rad or m; an angle is wrapped into the patch's range where it can be."""
    v: NDArray[np.float64]
    """Second parameter, likewise."""
    height: NDArray[np.float64]
    """m, signed distance along the outward normal: point = foot + height * normal."""
    normal: NDArray[np.float64]
    """(..., 3) outward unit normal at the foot."""
    inside: NDArray[np.bool_]
    """True where the foot's parameters lie in the patch's ranges (to 1e-9 rad or m)."""


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Surface(ABC):
    """A patch (u, v) -> point of a smooth surface, placed in the frame of the URDF's root link.

    All methods are vectorised over parameters or points, and speak the root frame. Surfaces are
    values: they pickle and are never changed in place. `surfaces.sphere` and its fellows build
    them from checked numbers.
    """

    kind: ClassVar[str]
    units: ClassVar[tuple[str, str]]
    """'rad' or 'm', of u and of v."""
    u_angle: ClassVar[bool]
    """True where u is an angle about an axis, so that u and u + 2 pi are one place."""
    v_angle: ClassVar[bool]
    code: ClassVar[int]
    """What `surfaces.chart` dispatches on."""

    rotation: NDArray[np.float64]
    """(3, 3) axes of the surface's own frame, as columns, in the root frame."""
    position: NDArray[np.float64]
    """(3,) m, origin of the surface's own frame in the root frame."""
    side: Side
    """'inside': the tool works at -d along the outward normal; 'outside': at +d."""
    u_range: tuple[float, float]
    """rad or m."""
    v_range: tuple[float, float]
    """rad or m."""

    def __post_init__(self) -> None:
        """Copy and write-protect the pose."""
        for name in ("rotation", "position"):
            array = np.array(getattr(self, name), dtype=float)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle as a call of the constructor, which protects the arrays again."""
        return (type(self), tuple(getattr(self, field.name) for field in fields(self)))

    @property
    def side_sign(self) -> float:
        """-1.0 inside, +1.0 outside: target = point + side_sign * standoff * normal."""
        return -1.0 if self.side == "inside" else 1.0

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
    @abstractmethod
    def shape(self) -> tuple[float, ...]:
        """The lengths (m) that fix the surface in its own frame, as `surfaces.chart` wants them."""

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

    @abstractmethod
    def curvature_slices(self, margin: float) -> CurvatureSlices:
        """Bounds on the curvatures of the patch, widened by `margin` where it has open ends."""

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

    def closest(self, points: ArrayLike) -> Foot:
        """The feet of `points` (..., 3) m on the surface; see `Foot`.

        Where several points are equally near (centre of a sphere, axis of a cylinder), one of
        them is taken, on the patch if there is one.

        Raises:
            ValueError: `points` does not end in an axis of length 3.
        """
        from surfaces.chart import feet

        points = np.asarray(points, dtype=float)
        if points.shape[-1:] != (3,):
            raise ValueError(f"points must have shape (..., 3), got {points.shape}")
        shape = points.shape[:-1]
        values, inside = feet(self.chart(), np.array(points.reshape(-1, 3)))
        return Foot(
            u=values[:, 0].reshape(shape),
            v=values[:, 1].reshape(shape),
            height=values[:, 2].reshape(shape),
            normal=values[:, 3:].reshape(*shape, 3),
            inside=inside.reshape(shape),
        )

    def chart(self, nu: int = 1, nv: int = 1) -> Chart:
        """What compiled loops need of the surface, cut into nu x nv cells."""
        from surfaces.chart import Chart

        return Chart(
            code=self.code,
            shape=(*map(float, self.shape), 0.0, 0.0)[:2],
            rotation=tuple(self.rotation.ravel().tolist()),
            position=tuple(self.position.tolist()),
            side_sign=self.side_sign,
            low=(float(self.u_range[0]), float(self.v_range[0])),
            high=(float(self.u_range[1]), float(self.v_range[1])),
            closed=(bool(self.u_closed), bool(self.v_closed)),
            cells=(int(nu), int(nv)),
        )

    def cells(self, nu: int, nv: int) -> Cells:
        """Cut the patch into nu x nv E-cells of equal parameter steps.

        Raises:
            SurfaceError: nu or nv is not a whole number >= 0.

        Example:
            >>> from surfaces import sphere
            >>> cells = sphere(1.0, polar_deg=(10, 90), azimuth_deg=(10, 180)).cells(9, 10)
            >>> len(cells), len(cells.pairs)
            (90, 305)
        """
        from surfaces.cells import Cells

        return Cells.grid(self, nu, nv)

    def bounds(self, height: float, slack: float = 0.0) -> NormalBounds:
        """Bounds on how fast the normal turns near the parallel surface at a signed height.

        They hold at every point whose foot lies on the patch and whose height differs from
        `height` by at most `slack` (m); see `surfaces.bounds`.
        """
        return normal_bounds(self.curvature_slices(abs(slack)), height, abs(slack))

    def moved(self, rotation: ArrayLike, translation: ArrayLike) -> Surface:
        """The same patch after the rigid motion x -> rotation x + translation of the root frame."""
        turn = np.asarray(rotation, dtype=float)
        shift = np.asarray(translation, dtype=float)
        return replace(self, rotation=turn @ self.rotation, position=turn @ self.position + shift)

    def __repr__(self) -> str:
        """One line: the kind, its lengths, ranges (degrees or metres), side and position."""
        lengths = ", ".join(f"{length:g}" for length in self.shape)
        ranges = []
        for name, (low, high) in (("u", self.u_range), ("v", self.v_range)):
            if self.units["uv".index(name)] == "rad":
                ranges.append(f"{name}_deg=({math.degrees(low):g}, {math.degrees(high):g})")
            else:
                ranges.append(f"{name}=({low:g}, {high:g})")
        parts = [lengths, *ranges, f"side={self.side!r}", f"position={self.position.tolist()}"]
        return f"{self.kind}({', '.join(part for part in parts if part)})"


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> NDArray[np.float64]:
    """Rz(yaw) Ry(pitch) Rx(roll), (3, 3), from radians: URDF's fixed-axis roll, pitch, yaw."""
    cr, sr = math.cos(roll), math.sin(roll)
    cp, sp = math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
