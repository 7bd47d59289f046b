"""Bodies as the judge of collisions sees them: coal's shapes, and how far they reach.

What a plane certifies rests on the support of a body alone, h(n) = max n . x over its points x,
which is computed here from corners, circles and radii; coal only says which n to try.

Meshes are only their triangles to coal, and have no inside there.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any

import coal
import numpy as np

from coverable.arrays import Array
from feasibility.collisions.problem_bodies import Soup
from robots.shapes.bodies import Geometry, HalfSpace, Outline, Solid, Triangles, outline
from robots.shapes.coal_shapes import coal_hull, coal_shape, with_contacts
from robots.shapes.hulls import is_convex

COAL = 1e-7  # [m] more than coal's distances are off, which stops at GJK
GJK = 1e-8  # [m]
FLAT = 1e-6  # [1] of its length, how thick a hull has to be: qhull and coal fail on flat ones
MERGED = 1e-12  # [1] of its size, how far what qhull leaves out may stand out of its hull
MOST_NUMBERS = 1 << 22  # of corners times directions, looked at at a time
KEPT = 256  # meshes whose hulls are kept

_asked = coal.DistanceRequest()
_asked.enable_signed_distance, _asked.gjk_tolerance = True, GJK


class Body:
    """One body, in the frame of the joint that carries it."""

    def __init__(self, solid: Solid, deviation: float = 0.0) -> None:
        """A solid that the body may stand out from by some deviation (m)."""
        self.joint, self.shape, self.deviation = solid.joint, solid.geometry, deviation
        self.placement, shape = solid.placement, self.shape
        self._hull, (corners, self.radius, self.circle) = _held(shape)
        self._place = coal.Transform3s(self.placement[:3, :3], self.placement[:3, 3])
        self.corners: Array = corners @ self.placement[:3, :3].T + self.placement[:3, 3]
        """(k, 3) m; the body is what `outline` says, about these."""
        self.axis: Array = self.placement[:3, 2]
        """(3,) of a cylinder, or what a half space is below of."""
        self.half_space = isinstance(shape, HalfSpace)
        self.convex = not isinstance(shape, Triangles) or is_convex(shape)
        """Is there nothing else in its hull?"""
        self.centre: Array = 0.5 * (self.corners.min(axis=0) + self.corners.max(axis=0))
        reach = float(np.linalg.norm(self.corners - self.centre, axis=1).max())
        self.ball = np.inf if self.half_space else np.hypot(reach, self.circle) + self.radius
        """m, radius of a ball about `centre` around it."""

    @cached_property
    def _geometry(self) -> Any:
        """Coal's; of a convex mesh its hull, which has an inside."""
        return self._hull if self.convex else coal_shape(self.shape)

    def placed(self, rotations: Array, points: Array) -> list[Any]:
        """Coal's placements with the joint at poses (k, 3, 3), (k, 3) m."""
        turned, moved = rotations @ self.placement[:3, :3], rotations @ self.placement[:3, 3]
        return [coal.Transform3s(*pose) for pose in zip(turned, moved + points, strict=True)]

    def highest(self, n: Array) -> Array:
        """(k,) m, h(n) for unit vectors n (k, 3), which are not along a half space."""
        few = max(MOST_NUMBERS // len(self.corners), 1)
        parts = (n[k : k + few] for k in range(0, max(len(n), 1), few))
        found = [(part @ self.corners.T).max(axis=1) for part in parts]
        along = n @ self.axis
        across = np.sqrt(np.maximum((n * n).sum(axis=1) - along * along, 0.0))
        return np.concatenate(found) + self.circle * across + self.radius

    def meets(self, other: Body, place: Any, margin: float) -> float | None:
        """Ask coal: does a body at a place in this one's frame come nearer than a margin (m)?

        None where it does not, else a distance (m) of some of their triangles that is less.
        """
        # One of its own: in another thread a margin of another couple would certify this one.
        request, found = with_contacts(coal.CollisionRequest()), coal.CollisionResult()
        request.gjk_tolerance, request.security_margin = GJK, margin + COAL
        if not coal.collide(self._geometry, self._place, other._geometry, place, request, found):
            return None
        return float(found.getContact(0).penetration_depth)

    def distance(self, other: Body, place: Any, hulls: bool = False) -> tuple[float, Array, Array]:
        """Coal's distance (m) to a body at a place in this one's frame, and nearest points (3,) m.

        Below 0 as deep as they overlap. Of meshes that are not convex it is that of their
        triangles, at least 0; with `hulls` that of what is around them.
        """
        one, two = (self._hull, other._hull) if hulls else (self._geometry, other._geometry)
        result = coal.DistanceResult()
        found = coal.distance(one, self._place, two, place, _asked, result)
        return float(found), result.getNearestPoint1(), result.getNearestPoint2()


def body_of_soup(soup: Soup) -> Body:
    """Triangles at rest."""
    vertices, faces = np.unique(soup.triangles.reshape(-1, 3), axis=0, return_inverse=True)
    mesh = Triangles(vertices, faces.reshape(-1, 3), soup.closed)
    return Body(Solid(soup.owner, 0, np.eye(4), mesh), soup.deviation)


@lru_cache(maxsize=KEPT)
def _held(mesh: Geometry) -> tuple[Any, Outline]:
    """Coal's of something convex that holds a shape, its hull, and what that is to planes.

    Of what is flat that is a box along it, and coal's are its triangles.
    """
    from scipy.spatial import QhullError

    if not isinstance(mesh, Triangles):
        return coal_shape(mesh), outline(mesh)
    points = mesh.vertices[np.unique(mesh.faces)]
    rounding = MERGED * (1.0 + float(np.abs(points).max()))
    middle = points.mean(axis=0)
    _, spread, axes = np.linalg.svd(points - middle, full_matrices=False)
    if spread[-1] > FLAT * spread[0]:
        try:
            hull, corners = coal_hull(points)
            return hull, Outline(corners, rounding)
        except (QhullError, RuntimeError):  # coal takes at most 255 edges at a corner
            pass
    along = (points - middle) @ axes.T
    ends = np.stack([along.min(axis=0), along.max(axis=0)])
    box = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, len(axes)) @ axes + middle
    return coal_shape(mesh), Outline(box, rounding)


def one_inside_other(a: Body, b: Body, rotation: Array, point: Array) -> bool:
    """Is a shell of one body inside the other, b at a pose (3, 3), (3,) m in the frame of a?

    Their boundaries must not touch. Only closed meshes are tested; coal knows of the inside of
    primitives and convex hulls.
    """
    return _any_inside(a, _points(b) @ rotation.T + point) or _any_inside(
        b, (_points(a) - point) @ rotation
    )


def _any_inside(body: Body, points: Array) -> bool:
    """Is one of the points (k, 3) inside a mesh, whose shells are oriented as it is closed?"""
    mesh = body.shape
    if not (isinstance(mesh, Triangles) and mesh.closed):
        return False
    corners, own = mesh.vertices[mesh.faces], body.placement
    seen = (points - own[:3, 3]) @ own[:3, :3]
    return any(abs(winding(corners, point)) > 0.5 for point in seen)


def winding(triangles: Array, point: Array) -> float:
    """How often triangles (k, 3, 3) wind around a point (3,): their solid angles over 4 pi.

    Van Oosterom and Strackee, 1983: tan(w / 2) = det[a b c] / (abc + (a.b) c + (b.c) a + (c.a) b).
    """
    a, b, c = (triangles[:, k] - point for k in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=1) for side in (a, b, c))
    above = np.einsum("ki,ki->k", a, np.cross(b, c))
    below = la * lb * lc
    below += (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
    return float(2.0 * np.arctan2(above, below).sum() / (4.0 * np.pi))


def _points(body: Body) -> Array:
    """(k, 3) m, a point of each shell of a mesh; of a primitive its centre."""
    if not isinstance(body.shape, Triangles):
        return body.centre[None]
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    faces, count = body.shape.faces, len(body.shape.vertices)
    links = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
    graph = coo_array((np.ones(len(links)), (links[:, 0], links[:, 1])), shape=(count, count))
    shells = connected_components(graph, directed=False)[1]
    first = np.unique(shells, return_index=True)[1]
    used = np.intersect1d(first, faces)  # a vertex without a triangle is no shell
    return body.shape.vertices[used] @ body.placement[:3, :3].T + body.placement[:3, 3]
