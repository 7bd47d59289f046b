"""ParametricSurface: parameters u and v in ranges, points and normals, and bounds over boxes."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints
from surfaces.enclosure_functions import of_length_one
from surfaces.enclosures import Enclosure, enclosed
from surfaces.parts import MOST_PARTS, PartModels, SurfaceParts
from surfaces.patches.box_models import Formula, Pieces, over_boxes
from surfaces.surface import TURN_TOLERANCE, Surface, SurfaceError

if TYPE_CHECKING:
    from surfaces.patches.closed_form_kernels import PatchKernel

EDGE = 1e-9  # [rad], [m]: a point that misses the ranges by no more than this lies within
AT_ONCE = 1024  # boxes, whose polynomials stay in the processor's cache: twice as fast
TANGENT_STEP = 1e-5  # [1], share of the range of u: step of differences


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class ParametricSurface(Surface):
    """Formulas (u, v) -> point of a smooth surface; a `Patch` is one that can be cut into cells."""

    units: ClassVar[tuple[str, str]]
    """'rad' or 'm' or '', of u and of v."""
    u_angle: ClassVar[bool] = False
    """True where u is an angle about an axis, so that u and u + 2 pi are one place."""
    v_angle: ClassVar[bool] = False
    u_polar: ClassVar[bool] = False
    """True where u is a polar angle: at 0 and pi all v, once around, are one place."""

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
        low, high = self.u_range
        around = self.u_polar and self.v_closed
        return (around and low <= 1e-9, around and high >= math.pi - 1e-9)

    @property
    def lengths(self) -> tuple[float, ...]:
        """The numbers that fix the surface in its own frame (m, slopes), as the kind lists them."""
        values = (getattr(self, field.name) for field in fields(self))
        return tuple(value for value in values if isinstance(value, (int, float)))

    @abstractmethod
    def local_point(self, u: Array, v: Array) -> Array:
        """Points (..., 3) m in the surface's own frame, from parameters of one shape."""

    @abstractmethod
    def local_normal(self, u: Array, v: Array) -> Array:
        """Outward unit normals (..., 3) in the surface's own frame."""

    @abstractmethod
    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """Area (m^2) of the part u0..u1 by v0..v1; exact, vectorised."""

    @property
    def breaks(self) -> tuple[Array, Array]:
        """Rising values of u and of v across which the formulas are not smooth."""
        return np.empty(0), np.empty(0)

    def local_enclosures(self, u: Enclosure, v: Enclosure) -> tuple[Enclosure, Enclosure]:
        """Points and normals in the own frame over boxes between `breaks`: the same formulas.

        Raises:
            SurfaceError: they take u and v to something that is not known over boxes.
        """
        normals = self._enclosed(self.local_normal, u, v)
        return self._enclosed(self.local_point, u, v), of_length_one(normals)

    def local_tangents(self, u: Enclosure, v: Enclosure) -> Enclosure:
        """Unit directions in which u grows, likewise.

        Raises:
            SurfaceError: see `local_enclosures`.
        """
        from surfaces.slopes import Slope

        def ahead(u: Enclosure, v: Enclosure) -> Any:
            zero = np.zeros(u.shape)
            point: Any = self.local_point(Slope(u, zero + 1.0), Slope(v, zero))  # pyrefly: ignore[bad-argument-type]
            return point.by / np.linalg.norm(point.by, axis=-1, keepdims=True)

        return self._enclosed(ahead, u, v)

    def _enclosed(self, formula: Callable[..., Any], u: Enclosure, v: Enclosure) -> Enclosure:
        """(k, 3) of a formula."""
        try:
            found = enclosed(formula(u, v))
            if found.shape == (*u.shape, 3):
                return found
            fault = f"{found.shape} in shape, not {(*u.shape, 3)}"
        except (TypeError, ValueError, IndexError, AttributeError) as error:
            fault = str(error)
        raise SurfaceError(
            f"no bounds are known between places of this kind, as its formulas for points and "
            f"normals cannot be followed over boxes of u and v ({fault}), so nothing can be "
            "proved of the whole surface; NumPy's own functions of u and v, combined by "
            "np.stack(..., axis=-1), can",
            self.kind,
        )

    def local_models(
        self, low: Array, high: Array, twisted: bool = False
    ) -> tuple[PartModels, Array]:
        """Models over boxes of parameters (k, 2) in the own frame, and t; see `placed_models`."""
        return self._models(self.local_enclosures, low, high, twisted)

    def _models(
        self, formula: Formula, low: Array, high: Array, twisted: bool = False
    ) -> tuple[PartModels, Array]:
        """Those of a formula, which is smooth between `breaks`."""
        if len(low) > AT_ONCE:
            cuts = np.arange(AT_ONCE, len(low), AT_ONCE)
            boxes = zip(np.split(low, cuts), np.split(high, cuts), strict=True)
            models, twists = zip(*(self._models(formula, *b, twisted) for b in boxes), strict=True)
            return PartModels.join(*models), np.concatenate(twists)
        pieces = Pieces.of(self.breaks, low, high)
        cut = len(pieces.box) > len(low)
        found, twist = over_boxes(formula, pieces.low, pieces.high, twisted and not cut)
        if cut:
            return pieces.merged(found, low, high), np.zeros((len(low), 3))
        return found, twist

    @property
    def part_roots(self) -> tuple[Array, Array]:
        """Lower and upper corners (m, 2) of boxes of parameters that together are the patch.

        With the hair's breadth around it that still counts as on it.
        """
        ends = np.array([self.u_range, self.v_range])
        return ends[None, :, 0] - 2.0 * EDGE, ends[None, :, 1] + 2.0 * EDGE

    def placed_models(
        self, low: Array, high: Array, sign: float = 1.0, twisted: bool = False
    ) -> tuple[PartModels, Array]:
        """Models over boxes of parameters in the root frame; sign -1.0 turns normals over.

        Twisted, those of points are closer, + x_1 x_2 t; see `VectorModel`.

        Returns:
            The models, and t (k, 3) m in the root frame; zero where there is no closer model.
        """
        found, twist = self.local_models(low, high, twisted)
        return found.placed(self.rotation, self.position, sign), twist @ self.rotation.T

    def tangent_models(self, low: Array, high: Array) -> PartModels:
        """Models of the unit directions in which u grows, in place of normals, likewise."""

        def both(u: Enclosure, v: Enclosure) -> tuple[Enclosure, Enclosure]:
            found = self.local_tangents(u, v)
            return found, found

        return self._models(both, low, high)[0].placed(self.rotation, self.position)

    def parts(self, flat: float, straight: float, most: int = MOST_PARTS) -> SurfaceParts:
        """See `Surface.parts`."""
        from surfaces.part_growth import Boxes, grown

        low, high = self.part_roots
        roots = Boxes(self._root_models, np.arange(len(low)), low, high)
        return grown(roots, flat, straight, most)

    def _root_models(self, root: Ints, low: Array, high: Array) -> PartModels:
        return self.placed_models(low, high)[0]

    def point(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Points (..., 3) m of the surface in the root frame."""
        u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
        return self.local_point(u, v) @ self.rotation.T + self.position

    def normal(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Outward unit normals (..., 3) in the root frame.

        Outward is away from the centre or axis of a sphere, cylinder or hyperboloid, and +z of
        the own frame of a plane.
        """
        u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
        return self.local_normal(u, v) @ self.rotation.T

    def point_and_normal(self, u: Array, v: Array) -> tuple[Array, Array]:
        """`point` and `normal` at places of the same shape, at once."""
        points, normals = self.local_point_and_normal(u, v)
        if not np.array_equal(self.rotation, np.eye(3)):
            points, normals = points @ self.rotation.T, normals @ self.rotation.T
        return points + self.position, normals

    def local_point_and_normal(self, u: Array, v: Array) -> tuple[Array, Array]:
        """`local_point` and `local_normal`; a kind that has both at once says so."""
        return self.local_point(u, v), self.local_normal(u, v)

    def tangent(self, u: ArrayLike, v: ArrayLike) -> Array:
        """Unit directions (..., 3), square to the normals, in which u grows, in the root frame.

        By central differences, to about 1e-9. Zero where the points do not move with u.
        """
        u, v = np.broadcast_arrays(np.asarray(u, float), np.asarray(v, float))
        step = TANGENT_STEP * (self.u_range[1] - self.u_range[0])
        along = self.local_point(u + step, v) - self.local_point(u - step, v)
        normal = self.local_normal(u, v)
        along = along - (along * normal).sum(axis=-1, keepdims=True) * normal
        length = np.linalg.norm(along, axis=-1, keepdims=True)
        return (along / np.maximum(length, 1e-300)) @ self.rotation.T

    def patch_kernel(self, nu: int = 1, nv: int = 1) -> PatchKernel | None:
        """What compiled loops need of it in nu x nv cells; None where they have no formulas."""
        return None

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
