"""A smoothed copy of a mesh, triangle by triangle, whose offset surface folds less.

The displacement d of the vertices x minimises

    sum of m |d|^2  +  l^4 sum over edges of w |jump (x + d)|^2

with m a third of the areas about a vertex, l the length over 2 pi, and `jump` what the gradient of
a function that is linear in each face jumps by over an edge, with w so that the second sum is about
the squared second derivative over the surface. So a wave of the length keeps half its height, one
of half the length a seventeenth. Nothing jumps over the edges of a plane, nor is anything asked at
its border: flat parts stay where they are, and borders are not drawn in.

Every point of a face is a mean of its corners before and after. So neither surface is further from
the other than a vertex has moved.
"""

from __future__ import annotations

import math

import numpy as np

from coverable.arrays import Array, Ints
from surfaces.arguments import Checks
from surfaces.meshes.cells.subdivision import subdivide
from surfaces.meshes.mesh_surface import MeshSurface
from surfaces.meshes.normals import corner_normals
from surfaces.meshes.triangle_mesh import TriangleMesh
from surfaces.surface import Smoothing, SurfaceError

EDGES = 8.0  # edges along the length, at least
NEEDLE = 1e-4  # [1] of the length: lower triangles bend as if they were as high
MOST_FACES = 400_000  # that are solved for; about a minute


def smoothed(surface: MeshSurface, length: float, tolerance: float) -> MeshSurface:
    """A copy of a mesh without bends that are tighter than a length: for targets and approaches.

    Collisions and areas stay those of the mesh itself, which is the copy's `wall`.

    Args:
        surface: the mesh, or a smoothed copy of it.
        length: m > 0; a wave of this length keeps half its height.
        tolerance: m > 0, of the task; what the copy is off is taken off it, if it is less.

    Raises:
        SurfaceError: the length makes no sense, or is too short for a surface of this size.

    Example:
        >>> from surfaces.meshes.triangle_mesh import TriangleMesh
        >>> from coverable import mesh
        >>> ridge = [[0, 0, 0], [1, 0, 0.1], [1, 1, 0.1], [0, 1, 0], [2, 0, 0], [2, 1, 0]]
        >>> roof = TriangleMesh(ridge, [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]])
        >>> copy = smoothed(mesh(roof), 0.5, tolerance=0.02)
        >>> copy.smoothing.counted, round(copy.smoothing.off, 3)
        (True, 0.007)
    """
    checks = Checks("smooth")
    checks.positive("length", length, "metres")
    checks.positive("tolerance", tolerance, "metres")
    checks.done()
    mesh, most = surface.wall.mesh, math.sqrt(3.0) / 4.0 * (length / EDGES) ** 2
    if max(mesh.area / most, len(mesh.faces)) > MOST_FACES:
        least = EDGES * math.sqrt(4.0 / math.sqrt(3.0) * mesh.area / MOST_FACES)
        raise SurfaceError(
            f"smoothing over {length:g} m needs more than {MOST_FACES:,} triangles; take "
            f"{least:.2g} m or more, and a mesh of fewer triangles (it has {len(mesh.faces):,})"
        )
    fine = subdivide(mesh.vertices, mesh.faces, most)
    before = TriangleMesh(fine.vertices, fine.faces, mesh.history)
    moved = displacements(before, length)
    try:
        made = TriangleMesh(before.vertices + moved, before.faces, mesh.history)
    except SurfaceError as error:
        raise SurfaceError(f"smoothed over {length:g} m it is no surface: {error}") from error
    off = float(np.linalg.norm(moved, axis=1).max())
    normals = corner_normals(made)
    smoothing = Smoothing(float(length), off, off < tolerance, before.vertices)
    return MeshSurface(
        surface.rotation, surface.position, surface.side, made, normals, normals, smoothing
    )


def displacements(mesh: TriangleMesh, length: float) -> Array:
    """(V, 3) m, see the module's text."""
    from scipy import sparse
    from scipy.sparse.linalg import splu

    count, edges, x = len(mesh.vertices), mesh.edges, mesh.vertices
    (a, b), (c, d) = edges.vertices.T, _opposite(mesh).T
    # Over needles the second sum is stiff, and rounding in it would outweigh the first.
    short = NEEDLE * length
    heights = 2.0 * mesh.face_areas[edges.faces] / edges.lengths[:, None]
    above, below = 1.0 / np.maximum(heights, short).T
    squared = np.maximum(edges.lengths, short) ** 2
    one, other = (((x[top] - x[a]) * (x[b] - x[a])).sum(axis=1) / squared for top in (c, d))
    values = above, below, (one - 1.0) * above + (other - 1.0) * below, -one * above - other * below
    rows = np.tile(np.arange(len(a)), 4)
    jump = sparse.csr_array(
        (np.concatenate(values), (rows, np.concatenate([c, d, a, b]))), shape=(len(a), count)
    )
    weights = (length / math.tau) ** 4 * edges.lengths * 2.0 / (1.0 / above + 1.0 / below)
    weighted = jump.T @ sparse.diags_array(weights)
    masses = np.bincount(mesh.faces.ravel(), np.repeat(mesh.face_areas / 3.0, 3), count)
    solver = splu(
        (sparse.diags_array(masses) + weighted @ jump).tocsc(), permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0, options={"SymmetricMode": True},
    )  # fmt: skip
    # In a face the gradient of the place across an edge is the unit vector away from it.
    sides = (x[b] - x[a]) / edges.lengths[:, None]
    away = np.cross(mesh.face_normals[edges.faces], sides[:, None])
    return np.asarray(solver.solve(-(weighted @ (away[:, 0] - away[:, 1]))))


def _opposite(mesh: TriangleMesh) -> Ints:
    """(E, 2) the corners of both faces of each edge that do not lie on it."""
    on = mesh.edges.vertices.sum(axis=1)[:, None]
    return np.asarray(mesh.faces[mesh.edges.faces].sum(axis=2) - on)
