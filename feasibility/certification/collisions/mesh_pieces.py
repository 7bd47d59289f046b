"""Meshes as the judge of collisions sees them.

A mesh begins as its convex hull, which is larger than the mesh; its pieces are ever smaller parts
of its triangles.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coverable_arrays import Array, Ints
from coverable_errors import ArgumentError
from feasibility.certification.collisions.pieces import NO_CIRCLE, Outline, Piece
from feasibility.certification.collisions.trees import TriangleTree

# [1] least thickness of a hull relative to its length; qhull and coal fail on flat ones
FLAT = 1e-6
MERGED = 1e-12  # [1] of its size, how far what qhull leaves out may stand out of its hull
MANY = 64  # corners of a part of a mesh, above which only those on its hull are kept


class MeshPart(Piece):
    """Some triangles of a mesh, the surface of a body or a sheet."""

    def __init__(self, vertices: Array, faces: Ints, closed: bool) -> None:
        """Faces (m, 3) of vertices (k, 3) m in the joint's frame, m >= 1."""
        used, renumbered = np.unique(faces, return_inverse=True)
        self.vertices, self.faces = vertices[used], renumbered.reshape(-1, 3)
        self.closed = closed
        super().__init__(None, np.eye(4), self.vertices, 0.0)
        del self.geometry  # made when coal is called
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
    def tree(self) -> TriangleTree:
        """Its triangles in boxes."""
        return TriangleTree(self.vertices[self.faces])

    @cached_property
    def outline(self) -> Outline | None:
        """Of few triangles their corners."""
        if self.triangles > MANY:
            return None
        return Outline(np.array(self.outermost, order="C"), NO_CIRCLE, 0.0)

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


def mesh_piece(vertices: Array, faces: Ints, closed: bool, at_rest: bool) -> Piece:
    """A mesh behind its hull, or the mesh alone where it is flat.

    Args:
        vertices: (k, 3) m, in the joint's frame.
        faces: (m, 3), m >= 1.
        closed: is it the surface of a body?
        at_rest: does it belong to the scene?

    Raises:
        ArgumentError: a face names a vertex that is not there.
    """
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


def _coal_triangles(vertices: Array, faces: Ints) -> tuple[Any, Any]:
    """Coal's lists of points and triangles."""
    import coal

    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(np.ascontiguousarray(vertices)))
    triangles.extend([coal.Triangle(*face) for face in faces.tolist()])
    return points, triangles
