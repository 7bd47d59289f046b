"""Surface: what is to be covered, with its pose and working side, and its closest points."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Mask, Protected
from coverable.errors import ArgumentError, CoverableError
from surfaces.parts import MOST_PARTS, SurfaceParts

Side = Literal["inside", "outside"]
TURN_TOLERANCE = 1e-9  # [rad]: a range this close to a full turn is one


class SurfaceError(CoverableError):
    """A surface that cannot be built: what was wrong, where, and what would do."""


@dataclass(frozen=True, eq=False, slots=True)
class ClosestPoint:
    """The points of a surface closest to given points; every array has the points' leading shape.

    They lie on the unbounded surface that a patch is cut from; `inside` is True where they lie on
    the patch. A mesh has nothing beyond its border: there they are always inside.
    """

    u: Array
    """First parameter, rad or m; an angle is wrapped into the patch's range where it can be. NaN
    where the surface has no parameters."""
    v: Array
    """Second parameter, likewise."""
    height: Array
    """m, signed distance along the outward normal: point = closest point + height * normal."""
    normal: Array
    """(..., 3) outward unit normal at the closest point."""
    inside: Mask
    """True where it lies on the patch, and the normal there leads to the given point."""

    @staticmethod
    def of_rows(shape: tuple[int, ...], values: Array, inside: Mask) -> ClosestPoint:
        """From rows (k, 6) of u, v, height and normal, and `inside` (k,), to a leading shape."""
        u, v, height = values.T[:3].reshape(3, *shape)
        return ClosestPoint(u, v, height, values[:, 3:].reshape(*shape, 3), inside.reshape(shape))


class Smoothing(NamedTuple):
    """How a surface was smoothed, triangle by triangle."""

    length: float
    """m; a wave of this length keeps half its height, one of half the length a seventeenth."""
    off: float
    """m, how far the two are apart at most, either from the other: no vertex moved further."""
    counted: bool
    """Whether that is taken off the tolerance; it is not where it is more than that."""
    vertices: Array
    """(V, 3) m, those of the surface before, in its own frame."""

    def words(self) -> str:
        """What a user should know about it, without a full stop."""
        off = f"{1e3 * self.off:.3g} mm"
        what = (
            "which is taken off the tolerance"
            if self.counted
            else "which is more than the tolerance: that holds from the copy, and the distance "
            f"from the surface itself may differ from the standoff by {off} more"
        )
        return (
            "targets and approach directions are those of a copy smoothed over "
            f"{1e3 * self.length:g} mm, up to {off} off the surface, {what}"
        )


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Surface(Protected, ABC):
    """A surface placed in the root frame: the world, or the frame of the link that carries it.

    All methods are vectorised and use the root frame. Surfaces are values: they pickle and are
    never changed in place. `surfaces.sphere` and the like build them from checked numbers.
    """

    kind: ClassVar[str]

    rotation: Array
    """(3, 3) axes of the surface's own frame, as columns, in the root frame."""
    position: Array
    """(3,) m, origin of the surface's own frame in the root frame."""
    side: Side
    """'inside': the tool works at -d along the outward normal; 'outside': at +d."""

    @property
    def side_sign(self) -> float:
        """-1.0 inside, +1.0 outside: target = point + side_sign * standoff * normal."""
        return -1.0 if self.side == "inside" else 1.0

    @property
    def notes(self) -> tuple[str, ...]:
        """What a user should know about the surface: repairs, doubts; one sentence each."""
        return ()

    @property
    def deviations(self) -> tuple[float, float]:
        """How far points (m) and normals (1) may be from those of the surface meant, at most."""
        return (0.0, 0.0)

    @property
    def smoothing(self) -> Smoothing | None:
        """Of a smoothed copy of a mesh, how it was made; None for any other surface."""
        return None

    @property
    def bare(self) -> bool:
        """Whether there is nothing but the curves between cells, and so no surface to look at."""
        return False

    @property
    def wall(self) -> Surface | None:
        """The surface that an arm could collide with; None where there is none."""
        return self

    @property
    def mean_edge_length(self) -> float:
        """m, typical length of a mesh's edges; 0 where the surface is smooth."""
        return 0.0

    @abstractmethod
    def closest(self, points: ArrayLike) -> ClosestPoint:
        """The points of the surface closest to `points` (..., 3) m; see `ClosestPoint`.

        Raises:
            ArgumentError: `points` does not end in an axis of length 3.
        """

    @abstractmethod
    def parts(self, flat: float, straight: float, most: int = MOST_PARTS) -> SurfaceParts:
        """All of the surface, margins outside the outermost cell centres included, as a tree.

        Parts are cut in halves, the roughest first, until none is rougher than wanted or there are
        `most` of them.

        Args:
            flat: m > 0, the largest r_f of a finest part; see `SurfaceParts`.
            straight: > 0, the largest r_n.
            most: how many parts may be made in all; never fewer than the surface begins with.

        Raises:
            ArgumentError: flat or straight is not above 0.
            SurfaceError: no bounds are known for this kind; all those of `surfaces` have them.
        """

    def moved(self, rotation: ArrayLike, translation: ArrayLike) -> Self:
        """The same surface after the rigid motion x -> rotation x + translation."""
        turn = np.asarray(rotation, dtype=float)
        shift = np.asarray(translation, dtype=float)
        return replace(self, rotation=turn @ self.rotation, position=turn @ self.position + shift)


def points_of(points: ArrayLike) -> Array:
    """Points as an array (..., 3); one that is not finite is NaN.

    Raises:
        ArgumentError: they do not end in an axis of length 3.
    """
    array = np.asarray(points, dtype=float)
    if array.shape[-1:] != (3,):
        raise ArgumentError(f"points must have shape (..., 3), got {array.shape}")
    finite = np.isfinite(array).all(axis=-1, keepdims=True)
    return array if finite.all() else np.where(finite, array, np.nan)


def max_principal_curvature(steps: Array, turns: Array) -> Array:
    """(k,) 1/m, the larger principal curvature by magnitude: how fast a normal turns, at most.

    Args:
        steps: (k, 2, 3) m, two steps on the surface.
        turns: (k, 2, 3) what the normal changes by along these steps.

    Its square is the larger eigenvalue of [[e, f], [f, g]]^-1 [[a, b], [b, c]], where e, f, g are
    the products x.x, x.y, y.y of the steps x and y; a, b, c those of the turns.
    """
    (e, f, g), (a, b, c) = (
        [_products(pair[:, i], pair[:, j]) for i, j in ((0, 0), (0, 1), (1, 1))]
        for pair in (steps, turns)
    )
    area = np.maximum(e * g - f * f, 1e-300)
    with np.errstate(over="ignore", invalid="ignore"):  # both steps are zero
        half = 0.5 * (a * g - 2.0 * b * f + c * e) / area
        product = (a * c - b * b) / area
        largest = half + np.sqrt(np.maximum(half * half - product, 0.0))
    return np.where(np.isfinite(largest), np.sqrt(np.maximum(largest, 0.0)), np.inf)


def _products(a: Array, b: Array) -> Array:
    """(k,) scalar products of (k, 3); numpy's own sums are slow over three numbers."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> Array:
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
