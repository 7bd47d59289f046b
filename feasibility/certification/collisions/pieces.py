"""Bodies as the judge of collisions sees them: coal's geometry, and how far they reach.

A piece is a convex body, or some triangles of a mesh. What a plane certificate needs of it is its
support h(n) = max n . x over its points x, which is computed here from corners and radii. Coal is
only asked for distances and nearest points, from which directions n are taken. A mesh begins as
its convex hull, which is larger than the mesh; its pieces are ever smaller parts of its triangles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coverable_errors import ArgumentError
from feasibility.certification.collisions.trees import Tree
from feasibility.collisions import HalfSpace
from robots.shapes import Triangles
from robots.urdf import Box, Capsule, Cylinder, Sphere

Array = NDArray[np.float64]

FLAT = (
    1e-6  # [1] least thickness of a hull relative to its length; qhull and coal fail on flat ones
)
MERGED = 1e-12  # [1] of its size, how far what qhull leaves out may stand out of its hull
TINY = 1e-300  # what keeps quotients of zeros finite
NO_RIM = np.zeros(4)
MANY = 64  # corners of a part of a mesh, above which only those on its hull are kept


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
            geometry: coal's; None where coal is never asked.
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
        return Outline(np.array(self.corners, order="C"), NO_RIM, self.radius)

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
        super().__init__(geometry, placement, _moved(placement, box), 0.0)
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


class MeshPart(Piece):
    """Some triangles of a mesh, the surface of a body or a sheet."""

    def __init__(self, vertices: Array, faces: NDArray[np.int64], closed: bool) -> None:
        """Faces (m, 3) of vertices (k, 3) m in the joint's frame, m >= 1."""
        used, renumbered = np.unique(faces, return_inverse=True)
        self.vertices, self.faces = vertices[used], renumbered.reshape(-1, 3)
        self.closed = closed
        super().__init__(None, np.eye(4), self.vertices, 0.0)
        del self.geometry  # made when coal is asked
        self.triangles = len(faces)

    @cached_property
    def geometry(self) -> Any:
        """Coal's tree over the triangles."""
        import coal

        model = coal.BVHModelOBBRSS()
        model.beginModel(len(self.faces), len(self.vertices))
        model.addSubModel(*_coal_triangles(self.vertices, self.faces))
        model.endModel()
        return model

    @cached_property
    def outermost(self) -> Array:
        """(k, 3) m, corners with the same hull."""
        return _outermost(self.corners)

    @cached_property
    def tree(self) -> Tree:
        """Its triangles in boxes."""
        return Tree(self.vertices[self.faces])

    @cached_property
    def outline(self) -> Outline | None:
        """Of few triangles their corners."""
        if self.triangles > MANY:
            return None
        return Outline(np.array(self.outermost, order="C"), NO_RIM, 0.0)

    def support(self, n: Array) -> Array:
        """(k,) m, see `Piece`; of many triangles that of boxes around them, which is larger."""
        if self.triangles > MANY:
            return self.tree.levels[min(1, len(self.tree.levels) - 1)].support(n)
        return np.asarray((n @ self.outermost.T).max(axis=1))

    def farthest(self, n: Array) -> Array:
        """(k, 3) m, see `Piece`."""
        return self.outermost[(n @ self.outermost.T).argmax(axis=1)]

    def of(self, triangles: NDArray[np.intp]) -> MeshPart:
        """Some of its triangles."""
        return MeshPart(self.vertices, self.faces[triangles], False)

    @cached_property
    def parts(self) -> tuple[Piece, ...]:
        """Two halves of its triangles, across their longest side; none where it is one triangle."""
        if len(self.faces) == 1:
            return ()
        middles = self.vertices[self.faces].mean(axis=1)
        side = int(np.argmax(np.ptp(middles, axis=0)))
        order = np.argsort(middles[:, side], kind="stable")
        halves = np.array_split(order, 2)
        return tuple(self.of(half) for half in halves)

    @cached_property
    def thin(self) -> Array:
        """(3,) direction in which the corners spread least."""
        spread = self.outermost - self.outermost.mean(axis=0)
        return np.asarray(np.linalg.eigh(spread.T @ spread)[1][:, 0])


class MeshHull(Piece):
    """The convex hull of a mesh: what is tried first, because it is fast."""

    def __init__(self, mesh: MeshPart, hull: Any, at_rest: bool) -> None:
        """`hull` is scipy's, of the mesh's vertices."""
        import coal

        used, renumbered = np.unique(hull.simplices, return_inverse=True)
        corners = mesh.vertices[used]
        geometry = coal.Convex(*_coal_triangles(corners, renumbered.reshape(-1, 3)))
        super().__init__(
            geometry, np.eye(4), corners, MERGED * (1.0 + float(np.abs(corners).max()))
        )
        self.exact, self.mesh, self.at_rest = False, mesh, at_rest

    @property
    def parts(self) -> tuple[Piece, ...]:
        """The mesh itself where it is at rest: what the arm is among may be hollow."""
        return (self.mesh,) if self.at_rest else ()

    @cached_property
    def truth(self) -> Piece:
        """The mesh."""
        return self.mesh


def piece_of(geometry: object, placement: Array, at_rest: bool = False) -> Piece:
    """A body of the arm or of the scene as the judge sees it.

    Args:
        geometry: a primitive, `Triangles` or a `HalfSpace`.
        placement: (4, 4) its frame in the joint's frame (or the root frame), m.
        at_rest: does it belong to the scene?

    Raises:
        ArgumentError: it is none of these, empty, or not finite.
    """
    import coal

    sizes = np.concatenate([np.ravel(placement), _sizes(geometry)])
    if not np.isfinite(sizes).all():
        raise ArgumentError(f"a shape for the replay is not finite: {geometry!r:.80}")
    origin = placement[None, :3, 3]
    match geometry:
        case Box(size):
            signs = np.array(np.meshgrid(*[(-0.5, 0.5)] * 3)).reshape(3, 8).T
            corners = _moved(placement, signs * np.array(size))
            return Piece(coal.Box(*size), placement, corners, 0.0)
        case Sphere(radius):
            return Piece(coal.Sphere(radius), placement, origin, radius)
        case Capsule(radius, length):
            ends = _moved(placement, np.array([[0.0, 0.0, -0.5 * length], [0, 0, 0.5 * length]]))
            return Piece(coal.Capsule(radius, length), placement, ends, radius)
        case Cylinder(radius, length):
            return Round(coal.Cylinder(radius, length), placement, geometry)
        case HalfSpace():
            return Below(placement)
        case Triangles(vertices, faces, closed) if len(faces):
            return _mesh(_moved(placement, vertices), faces, closed, at_rest)
    raise ArgumentError(f"the replay knows no shape like {geometry!r:.80}")


def sheet_piece(triangles: Array, closed: bool) -> Piece:
    """Triangles (k, 3, 3) m at rest in the root frame, k >= 1, as one piece.

    Raises:
        ArgumentError: there are none, or they are not finite.
    """
    if not len(triangles) or not np.isfinite(triangles).all():
        raise ArgumentError("a sheet for the replay has no triangles, or they are not finite")
    vertices, faces = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)
    return MeshPart(vertices, faces.reshape(-1, 3), closed)


def _mesh(vertices: Array, faces: NDArray[np.int64], closed: bool, at_rest: bool) -> Piece:
    """A mesh behind its hull, or the mesh alone where it is flat."""
    from scipy.spatial import ConvexHull, QhullError

    if faces.min() < 0 or faces.max() >= len(vertices):
        raise ArgumentError("a mesh for the replay has a triangle without its vertices")
    mesh = MeshPart(vertices, faces, closed)
    if _is_flat(mesh.vertices):
        return mesh
    try:
        return MeshHull(mesh, ConvexHull(mesh.vertices), at_rest)
    except (QhullError, RuntimeError):  # coal takes at most 255 edges at a corner
        return mesh


def _is_flat(points: Array) -> bool:
    """Are they so nearly in one plane that no hull of them may be made?"""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return len(spread) < 3 or not spread[2] > FLAT * spread[0]


def _outermost(points: Array) -> Array:
    """Few points with the same hull: all of them where they are few or flat."""
    from scipy.spatial import ConvexHull, QhullError

    if len(points) <= MANY or _is_flat(points):
        return points
    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:
        return points


def _moved(placement: Array, points: Array) -> Array:
    """Points (k, 3) of a shape's frame in the joint's frame."""
    return np.asarray(points @ placement[:3, :3].T + placement[:3, 3])


def _coal_triangles(vertices: Array, faces: NDArray[np.int64]) -> tuple[Any, Any]:
    """Coal's lists of points and triangles."""
    import coal

    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(np.ascontiguousarray(vertices)))
    triangles.extend([coal.Triangle(*face) for face in faces.tolist()])
    return points, triangles


def _sizes(geometry: object) -> Array:
    """The numbers of a shape, flat."""
    match geometry:
        case Triangles(vertices):
            return np.ravel(vertices)
        case Box(size):
            return np.array(size, dtype=float)
        case Sphere(radius):
            return np.array([radius])
        case Capsule(radius, length) | Cylinder(radius, length):
            return np.array([radius, length])
    return np.empty(0)
