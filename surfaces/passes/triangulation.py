"""A surface of any kind as one connected mesh of triangles, fine enough to measure distances on.

Patches are cut along their parameters, the pieces of a piecewise surface are sewn along their
seams, and the large triangles of a mesh are cut. Every vertex lies on the surface.

Exact distances on 200,000 triangles take the better part of a minute, on 20,000 a part of a second.
So they are measured on a simplified copy of a large surface. The passes are projected from the copy
back onto the surface itself: what the copy leaves out changes no more than the distance between
them, by about the share by which lengths on the two differ.
"""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from surfaces.adjacency import components
from surfaces.meshes.cells.subdivision import subdivide
from surfaces.meshes.mesh_surface import MeshSurface
from surfaces.meshes.triangle_mesh import areas_of, doubled_areas
from surfaces.passes.welded_triangles import WorkingMesh, border_edges
from surfaces.patches.patch import Patch
from surfaces.piecewise.piecewise_surface import Piecewise
from surfaces.surface import Surface, SurfaceError

MOST_FACES = 2_000_000
SHAPE = 4.0  # edge^2 / area of triangles: 2.3 in an equilateral one
FINER = 8.0  # than its area says: so many of them there may be of a mesh
SAMPLES = 65  # along each parameter, to see how long its lines are
MOST_EXACT = 50_000  # faces up to which distances are measured on the surface itself
COPIED = 20_000  # faces of the copy
WELDED = 1e-9  # [1] of the surface's extent: vertices nearer to each other are one


def working_mesh(surface: Surface, edge: float) -> WorkingMesh:
    """The surface as triangles with edges of at most about `edge` m.

    Args:
        surface: a patch, a piecewise surface or a mesh.
        edge: m > 0; inf for as few as there are.

    Raises:
        SurfaceError: the kind is another, or it would take more than `MOST_FACES` triangles.
    """
    if isinstance(surface, MeshSurface):
        placed = surface.mesh.vertices @ surface.rotation.T + surface.position
        if edge == np.inf:
            return WorkingMesh(placed, surface.mesh.faces)
        fewest = float(areas_of(placed, surface.mesh.faces).sum()) / MOST_FACES * FINER
        fine = subdivide(placed, surface.mesh.faces, max(edge**2 / SHAPE, fewest))
        return WorkingMesh(fine.vertices, fine.faces)
    if isinstance(surface, Patch):
        return _welded(_grid(surface, edge, 1.0), 0.0)
    if isinstance(surface, Piecewise):
        pieces = zip(surface.placed, surface.signs, strict=True)
        joined = _joined([_grid(patch, edge, sign) for patch, sign in pieces])
        return _sewn(joined, surface.gap)
    raise SurfaceError("passes over a surface of this kind are not supported", surface.kind)


class WorkingCopy(NamedTuple):
    """What distances are measured on."""

    mesh: WorkingMesh
    deviation: float
    """m, how far it is from the surface at most, at its vertices and the middles of its faces; 0
    where it is the surface itself."""


def working_copy(surface: Surface, mesh: WorkingMesh) -> WorkingCopy:
    """The mesh of a surface itself, or a copy with fewer faces where it has more than `MOST_EXACT`.

    Edges are collapsed in the order of the error that this makes (Garland and Heckbert's quadrics).
    """
    if len(mesh.faces) <= MOST_EXACT:
        return WorkingCopy(mesh, 0.0)
    from fast_simplification import simplify

    share = 1.0 - COPIED / len(mesh.faces)
    vertices, faces = simplify(mesh.vertices, mesh.faces.astype(np.int32), share)[:2]
    made = WorkingMesh(np.asarray(vertices, dtype=float), np.asarray(faces, dtype=np.int64))
    made = made._replace(faces=made.faces[made.areas > 0.0]).compact()
    places = np.concatenate([made.vertices, made.corners.mean(axis=1)])
    away = float(np.abs(surface.closest(places).height).max())
    return WorkingCopy(made, away)


def grid_shape(patch: Patch, edge: float) -> tuple[int, int]:
    """How many pieces of at most about `edge` m there are along u and v of a patch."""
    (u0, u1), (v0, v1) = patch.u_range, patch.v_range
    u, v = np.meshgrid(np.linspace(u0, u1, SAMPLES), np.linspace(v0, v1, SAMPLES), indexing="ij")
    points = patch.point(u, v)
    longest = [
        float(np.linalg.norm(np.diff(points, axis=axis), axis=2).sum(axis=axis).max())
        for axis in (0, 1)
    ]
    return max(1, math.ceil(longest[0] / edge)), max(1, math.ceil(longest[1] / edge))


def _grid(patch: Patch, edge: float, sign: float) -> WorkingMesh:
    """A patch cut along its parameters; sign -1.0 turns the faces over."""
    (u0, u1), (v0, v1) = patch.u_range, patch.v_range
    nu, nv = (max(2, count) for count in grid_shape(patch, edge))
    if 2 * nu * nv > MOST_FACES:
        raise SurfaceError(
            f"edges of {1e3 * edge:.3g} mm make {2 * nu * nv:,} triangles of it, more than "
            f"{MOST_FACES:,}; take a larger pitch",
            patch.kind,
        )
    u, v = np.meshgrid(np.linspace(u0, u1, nu + 1), np.linspace(v0, v1, nv + 1), indexing="ij")
    vertices = patch.point(u, v).reshape(-1, 3)
    corner = np.arange((nu + 1) * (nv + 1)).reshape(nu + 1, nv + 1)
    a, b, c, d = (
        part.ravel()
        for part in (corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:])
    )
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    first = faces[: len(a)]
    middle, normal = vertices[first].mean(axis=1), doubled_areas(vertices, first)
    outward = (normal * patch.closest(middle).normal).sum() * sign
    return WorkingMesh(vertices, faces if outward >= 0.0 else faces[:, ::-1].copy())


def _joined(meshes: list[WorkingMesh]) -> WorkingMesh:
    """Several meshes as one, their vertices apart."""
    first = np.cumsum([0, *(len(each.vertices) for each in meshes)])
    faces = [each.faces + start for each, start in zip(meshes, first, strict=False)]
    return WorkingMesh(np.concatenate([each.vertices for each in meshes]), np.concatenate(faces))


def _welded(mesh: WorkingMesh, gap: float) -> WorkingMesh:
    """Vertices within `gap` (m) of one another made one: closed ends, poles, seams."""
    from scipy.spatial import KDTree

    vertices = mesh.vertices
    near = max(gap, WELDED * float(np.ptp(vertices, axis=0).max(initial=0.0)))
    pairs = KDTree(vertices).query_pairs(near, output_type="ndarray")
    number = components(pairs, len(vertices))
    _, kept, of = np.unique(number, return_index=True, return_inverse=True)
    faces = of[mesh.faces].astype(np.int64)
    distinct = (faces != np.roll(faces, 1, axis=1)).all(axis=1)
    return WorkingMesh(vertices[kept], faces[distinct]).compact()


def _sewn(mesh: WorkingMesh, gap: float) -> WorkingMesh:
    """Pieces joined where their borders touch: vertices of one border are put into the other."""
    from scipy.spatial import KDTree

    mesh = _welded(mesh, 0.0)
    edges = border_edges(mesh.faces)
    on_border = np.unique(edges)
    tree = KDTree(mesh.vertices[on_border])
    a, b = mesh.vertices[edges[:, 0]], mesh.vertices[edges[:, 1]]
    length = np.linalg.norm(b - a, axis=1)
    # A curved border lies off the chord of the other by up to a part of the chord's length.
    slack = np.maximum(gap, 0.02 * length)
    put = dict[tuple[int, int], list[int]]()
    around = tree.query_ball_point(0.5 * (a + b), 0.5 * length + slack)
    for row, some in enumerate(around):
        ends = edges[row]
        inner = [int(k) for k in on_border[some] if k not in ends]
        off, way = mesh.vertices[inner] - a[row], (b[row] - a[row]) / length[row]
        along = off @ way
        away = np.linalg.norm(off - along[:, None] * way, axis=1)
        # What is nearer to an end is welded to it afterwards.
        between = (along > gap) & (along < length[row] - gap) & (away <= slack[row])
        if between.any():
            order = np.argsort(along[between])
            put[int(ends[0]), int(ends[1])] = np.array(inner)[between][order].tolist()
    return _welded(_with_points_on_edges(mesh, put), max(gap, 0.0))


def _with_points_on_edges(mesh: WorkingMesh, put: dict[tuple[int, int], list[int]]) -> WorkingMesh:
    """Faces cut in fans where further vertices lie on their border edges.

    One side after the other: a fan from the corner opposite to the side has no face without area.
    """
    faces = mesh.faces.tolist()
    waiting = [k for k, face in enumerate(faces) if _first_cut(face, put) is not None]
    while waiting:
        face = faces[waiting[-1]]
        side = _first_cut(face, put)
        if side is None:
            waiting.pop()
            continue
        a, b, c = face[side:] + face[:side]
        row = [a, *put[a, b], b]
        fan = [[p, q, c] for p, q in pairwise(row)]
        faces[waiting[-1]] = fan[0]
        waiting += range(len(faces), len(faces) + len(fan) - 1)
        faces += fan[1:]
    return WorkingMesh(mesh.vertices, np.array(faces, dtype=np.int64))


def _first_cut(face: list[int], put: dict[tuple[int, int], list[int]]) -> int | None:
    """The first side of a face on which further vertices lie."""
    return next((k for k in range(3) if (face[k], face[(k + 1) % 3]) in put), None)
