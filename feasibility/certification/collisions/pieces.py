"""Bodies as the judge of collisions sees them: coal's geometry, and how far they reach.

A piece is a convex body, or some triangles of a mesh. What a plane certificate needs of it is its
support h(n) = max n . x over its points x, which is computed here from corners and radii. Coal is
only called for distances and nearest points, from which directions n are taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from coverable_arrays import Array
from robots.urdf import Cylinder

TINY = 1e-300  # what keeps quotients of zeros finite
FEW = 8  # triangles, into no less of which a sheet is cut for a hull, which is larger than its mesh
COAL = 1e-6  # [m] more than coal's distances are off, which stops at GJK = 1e-8
GJK = 1e-8  # [m]
NO_CIRCLE = np.zeros(4)


@dataclass(frozen=True, eq=False, slots=True)
class Outline:
    """What the support of a piece is, in plain numbers: max n . corner + r |n x axis| + radius."""

    corners: Array
    """(k, 3) m."""
    circle: Array
    """(4,) an axis, and r (m); 0 where there is none."""
    radius: float
    """m."""


class Piece:
    """Part of a body, in the frame of the joint that carries it."""

    def __init__(self, geometry: Any, placement: Array, corners: Array, radius: float) -> None:
        """A convex body.

        Args:
            geometry: coal's; None where coal is never called.
            placement: (4, 4) the geometry's frame in the joint's frame, m.
            corners: (k, 3) m, in the joint's frame.
            radius: m; the body lies within this distance of the hull of the corners.
        """
        self.geometry, self.placement = geometry, placement
        self.corners, self.radius = corners, radius
        self.exact = True
        """Is the body itself meant, and not something around it?"""
        self.triangles = 0
        """How many there are; 0 of convex bodies."""
        low, high = corners.min(axis=0), corners.max(axis=0)
        self.centre: Array = 0.5 * (low + high)
        reach = np.linalg.norm(corners - self.centre, axis=1).max()
        self.ball = float(reach) + radius
        """m, radius of a ball about `centre` around the piece."""
        self.half: Array = 0.5 * (high - low) + radius
        """(3,) m, half the sides of a box around it, along the axes of the joint's frame."""

    @property
    def parts(self) -> tuple[Piece, ...]:
        """What it is made of, where that may be less than it is; nothing for convex bodies."""
        return ()

    @property
    def thin(self) -> Array | None:
        """(3,) unit vector across a part of a mesh, along which it is thinnest; or None."""
        return None

    @cached_property
    def outline(self) -> Outline | None:
        """Its support in plain numbers; None where it is something else."""
        return Outline(np.array(self.corners, order="C"), NO_CIRCLE, self.radius)

    def support(self, n: Array) -> Array:
        """(k,) m, h(n) for unit vectors n (k, 3) in the joint's frame."""
        return np.asarray((n @ self.corners.T).max(axis=1)) + self.radius

    def farthest(self, n: Array) -> Array:
        """(k, 3) m, the points furthest along n (k, 3), without the radius."""
        return self.corners[(n @ self.corners.T).argmax(axis=1)]

    @cached_property
    def truth(self) -> Piece:
        """The body itself."""
        return self


class Round(Piece):
    """A cylinder, whose support has a closed form."""

    def __init__(self, geometry: Any, placement: Array, shape: Cylinder) -> None:
        """See `Piece`."""
        r, h = shape.radius, 0.5 * shape.length
        box = np.array([[x, y, z] for x in (-r, r) for y in (-r, r) for z in (-h, h)])
        super().__init__(geometry, placement, moved(placement, box), 0.0)
        self.ball = float(np.hypot(r, h))
        self.shape = shape

    @cached_property
    def outline(self) -> Outline:
        """Its axis, and a circle about it."""
        half = 0.5 * self.shape.length * self.placement[:3, 2]
        ends = self.placement[:3, 3] + np.stack([-half, half])
        return Outline(ends, np.append(self.placement[:3, 2], self.shape.radius), 0.0)

    def support(self, n: Array) -> Array:
        """(k,) m: n . c + |n_z| l / 2 + r sqrt(1 - n_z^2), z along the axis."""
        along = n @ self.placement[:3, 2]
        across = np.sqrt(np.maximum((n**2).sum(axis=1) - along**2, 0.0))
        own = 0.5 * self.shape.length * np.abs(along) + self.shape.radius * across
        return np.asarray(n @ self.placement[:3, 3] + own)

    def farthest(self, n: Array) -> Array:
        """(k, 3) m, see `Piece`: on the circle of an end."""
        axis = self.placement[:3, 2]
        along = n @ axis
        across = n - along[:, None] * axis
        width = np.maximum(np.sqrt(np.einsum("ki,ki->k", across, across)), TINY)
        circle = (self.shape.radius / width)[:, None] * across
        ends = np.copysign(0.5 * self.shape.length, along)
        return np.asarray(self.placement[:3, 3] + ends[:, None] * axis + circle)


class Below(Piece):
    """A half space: its plane is the only one that can part it from anything."""

    def __init__(self, placement: Array) -> None:
        """See `Piece`."""
        super().__init__(None, placement, placement[None, :3, 3], 0.0)
        self.ball, self.half = np.inf, np.full(3, np.inf)

    @property
    def thin(self) -> Array:
        """(3,) its normal."""
        return np.asarray(self.placement[:3, 2])


def moved(placement: Array, points: Array) -> Array:
    """Points (k, 3) of a shape's frame in the joint's frame."""
    return np.asarray(points @ placement[:3, :3].T + placement[:3, 3])


@cache
def _coal() -> tuple[Any, Any, Any]:
    """Coal's module, and a request that keeps to its tolerances."""
    import coal

    request = coal.DistanceRequest()
    request.enable_signed_distance, request.gjk_tolerance = True, GJK
    return coal, request, coal.DistanceResult


def coal_distance(a: Piece, b: Piece, rotation: Array, point: Array) -> tuple[float, Array, Array]:
    """Coal's distance (m) of two pieces, b at a pose in the frame of a, and its nearest points."""
    coal, request, result_of = _coal()
    result = result_of()
    pose_a = coal.Transform3s(a.placement[:3, :3], a.placement[:3, 3])
    turned = rotation @ b.placement[:3, :3]
    pose_b = coal.Transform3s(turned, rotation @ b.placement[:3, 3] + point)
    distance = coal.distance(a.geometry, pose_a, b.geometry, pose_b, request, result)
    return float(distance), result.getNearestPoint1(), result.getNearestPoint2()


def is_exact(a: Piece, b: Piece) -> bool:
    """Are they no larger than the bodies? For a half space, a hull is its mesh."""
    return isinstance(a, Below) or (a.exact and b.exact)


def can_be_cut(a: Piece, b: Piece) -> bool:
    """May smaller pieces be clear where these are not?"""
    return not isinstance(a, Below) and (_worth_cutting(a, b) or _worth_cutting(b, a))


def cut(a: Piece, b: Piece) -> list[tuple[Piece, Piece]]:
    """The larger of two pieces that are worth it, cut into its parts."""
    if _worth_cutting(a, b) and (a.ball >= b.ball or not _worth_cutting(b, a)):
        return [(part, b) for part in a.parts]
    return [(a, part) for part in b.parts]


def _worth_cutting(piece: Piece, other: Piece) -> bool:
    """Has it parts, and not so few triangles that the other's hull is what hinders?"""
    return bool(piece.parts) and (other.exact or not piece.exact or piece.triangles > FEW)
