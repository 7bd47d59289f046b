"""Triangles as they are drawn: few enough, and split at creases."""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from coverable.meshes.raw_mesh import RawMesh
from feasibility.viewer.threejs import Colour, Command, mesh_object
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere
from surfaces.adjacency import components
from surfaces.meshes.degenerate import weld_distance, welded
from surfaces.meshes.triangle_mesh import doubled_areas
from surfaces.passes.welded_triangles import WorkingMesh, renumbered, twin_sides

CREASE = 0.7  # [rad]: edges sharper than this keep a visible edge (40 degrees)
FINEST, COARSEST = 1e-3, 0.1  # [1] of the largest mesh's size: how far they are merged where many
GREY: Colour = (0.72, 0.74, 0.77)
KEPT = 6
_LAST: dict[bytes, list[Mesh]] = {}
"""Of the robots that were drawn last, by a digest of all: arms are loaded again and again."""


@dataclass(frozen=True, eq=False, slots=True)
class Mesh:
    """Triangles of one colour."""

    vertices: Array
    """(V, 3) m."""
    faces: Ints
    """(F, 3) indices of vertices."""
    colour: Colour
    opacity: float = 1.0


class Merged(NamedTuple):
    """Faces after merging vertices."""

    faces: Ints
    """(F', 3) indices of the vertices that were given."""
    kept: Ints
    """(F',) which of the given faces they were, in their order."""


def merge_vertices(
    vertices: Array, faces: Ints, distance: float, kinds: Ints | None = None
) -> Merged:
    """Merge vertices that lie close together into that which is nearest to their mean.

    Faces that lose their area go.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3) indices of vertices.
        distance: m, how far a vertex may move at most.
        kinds: (V,) only vertices of one kind are merged; all where None.
    """
    group = welded(vertices, distance)
    if kinds is None:
        group = renumbered(group)[1]
    else:
        each = group * (int(kinds.max()) + 1) + kinds
        group = np.unique(each, return_inverse=True)[1].reshape(-1)
    size = np.bincount(group)
    mean = np.column_stack([np.bincount(group, axis) / size for axis in vertices.T])
    order = np.argsort(-np.linalg.norm(vertices - mean[group], axis=1), kind="stable")
    chosen = np.empty(len(size), dtype=np.int64)
    chosen[group[order]] = order  # the last one written, the nearest, stays
    corners = chosen[group][faces]
    kept = np.flatnonzero(doubled_areas(vertices, corners).any(axis=1))
    return Merged(corners[kept], kept)


def joined(vertices: Array, faces: Ints, distance: float | None = None) -> tuple[Array, Ints]:
    """Faces (F, 3) of vertices (V, 3) m that are merged up to a distance, m.

    By default those are merged that lie in one place. Vertices of no face go.
    """
    if not len(faces):
        return vertices[:0], faces
    distance = weld_distance(vertices) if distance is None else distance
    return WorkingMesh(vertices, merge_vertices(vertices, faces, distance).faces).compact()


def split_at_creases(vertices: Array, faces: Ints) -> tuple[Array, Ints]:
    """Part the faces around each vertex where they meet at a crease.

    The normals at vertices are means over the faces that share them: so round parts look round and
    edges stay sharp.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3) indices of vertices.

    Returns:
        (V', 3) m and (F, 3).
    """
    normals = _unit(doubled_areas(vertices, faces))
    sides = twin_sides(faces)
    one, other = normals[sides // 3].transpose(1, 0, 2)
    a, b = sides[np.einsum("ij,ij->i", one, other) > np.cos(CREASE)].T
    # The corners at either end of such an edge belong together.
    pairs = np.concatenate([np.stack([a, _next(b)], 1), np.stack([_next(a), b], 1)])
    _, first, corners = np.unique(
        components(pairs, faces.size), return_index=True, return_inverse=True
    )
    return vertices[faces.ravel()[first]], corners.reshape(-1, 3).astype(np.int64)


def _next(corners: Ints) -> Ints:
    """The corner 3 f + k that follows another one in its face."""
    return corners - corners % 3 + (corners + 1) % 3


def drawn(part: RawMesh, scale: Array, colour: Colour | None) -> Mesh:
    """A part of a mesh file, scaled by (3,) factors, in its own colour or else in the one given."""
    if part.rgba is None:
        return Mesh(part.vertices * scale, part.faces, colour or GREY)
    red, green, blue, alpha = part.rgba
    # An alpha of zero is a file's way of saying that it left transparency unset.
    alpha = alpha if alpha > 0.05 else 1.0
    return Mesh(part.vertices * scale, part.faces, (red, green, blue), alpha)


def as_mesh(body: Any, colour: Colour, opacity: float = 1.0) -> Mesh:
    """A trimesh as a `Mesh`."""
    vertices = np.asarray(body.vertices, dtype=float)
    return Mesh(vertices, np.asarray(body.faces, dtype=np.int64), colour, opacity)


def solid_mesh(
    geometry: Box | Cylinder | Capsule | Sphere, colour: Colour, opacity: float = 1.0
) -> Mesh:
    """A primitive in its own frame."""
    import trimesh

    match geometry:
        case Box(size):
            body = trimesh.creation.box(size)
        case Cylinder(radius, length):
            body = trimesh.creation.cylinder(radius=radius, height=length, sections=48)
        case Capsule(radius, length):
            body = trimesh.creation.capsule(radius=radius, height=length, count=(24, 24))
            # trimesh has one half ball at the origin; URDF has the middle there.
            body.apply_translation(-body.bounds.mean(axis=0))
        case Sphere(radius):
            body = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    return as_mesh(body, colour, opacity)


def thinned(meshes: Sequence[Mesh], budget: int) -> list[Mesh]:
    """Merge vertices that lie close together until all meshes have at most `budget` triangles.

    First only what is equal, then further and further from each other, up to `COARSEST`. Meshes
    that use less than a quarter of an even share of the budget are left as they are, so that small
    parts do not vanish beside large ones. Of a mesh that would lose all its triangles, as far apart
    as they are, as many are taken.

    Returns:
        As many meshes as were given, in their order.
    """
    digest = hashlib.sha256(str(budget).encode())
    for mesh in meshes:
        digest.update(repr((mesh.colour, mesh.opacity, mesh.faces.shape)).encode())
        digest.update(mesh.vertices.tobytes() + mesh.faces.tobytes())
    key = digest.digest()
    if key not in _LAST:
        if len(_LAST) >= KEPT:
            del _LAST[next(iter(_LAST))]
        _LAST[key] = _thinned(meshes, budget)
    return _LAST[key]


def _thinned(meshes: Sequence[Mesh], budget: int) -> list[Mesh]:
    """See `thinned`."""
    result = [_merged(mesh) for mesh in meshes]
    small = budget / (4 * max(len(meshes), 1))
    size = max((float(np.ptp(mesh.vertices)) for mesh in result if len(mesh.faces)), default=0.0)
    distance = FINEST * size
    while (total := sum(len(mesh.faces) for mesh in result)) > budget:
        if distance > COARSEST * size:
            break
        result = [mesh if len(mesh.faces) < small else _merged(mesh, distance) for mesh in result]
        distance *= max(1.15, (total / budget) ** 0.3)
    for k, mesh in enumerate(meshes):
        if len(result[k].faces) == 0:
            some = mesh.faces[:: int(len(mesh.faces) / small) + 1]
            vertices, faces = WorkingMesh(mesh.vertices, some).compact()
            result[k] = replace(mesh, vertices=vertices, faces=faces)
    return result


def mesh_command(path: str, mesh: Mesh) -> Command:
    """The command that draws a mesh with its creases."""
    shape = split_at_creases(mesh.vertices, mesh.faces)
    return mesh_object(path, *shape, mesh.colour, opacity=mesh.opacity)


def moved(mesh: Mesh, matrix: Array) -> Mesh:
    """The same mesh, placed by a homogeneous (4, 4) matrix."""
    return replace(mesh, vertices=mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3])


def _merged(mesh: Mesh, distance: float | None = None) -> Mesh:
    """See `joined`."""
    vertices, faces = joined(mesh.vertices, mesh.faces, distance)
    return replace(mesh, vertices=vertices, faces=faces)


def tubes(lines: Sequence[Array], radius: float, sides: int = 5) -> tuple[Array, Ints]:
    """Thin tubes around polylines, (k, 3) m each: vertices (V, 3) and faces (F, 3).

    Lines are one pixel wide on most machines, whatever width is asked for.
    """
    vertices, faces, offset = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
    angle = 2.0 * np.pi * np.arange(sides) / sides
    # Lines of as many points, such as the edges of a graph, are drawn at once.
    for count, alike in itertools.groupby(_without_repeats(lines), key=len):
        if count < 2:
            continue
        points = np.stack(list(alike))
        along = np.gradient(points, axis=1)
        helper = np.eye(3)[np.argmin(np.abs(points[:, -1] - points[:, 0]), axis=1)]
        side = _unit(np.cross(along, helper[:, None]), 1e-12)[:, :, None]
        up = _unit(np.cross(along, side[:, :, 0]), 1e-12)[:, :, None]
        ring = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * up
        vertices.append((points[:, :, None] + radius * ring).reshape(-1, 3))
        i, j = np.meshgrid(np.arange(count - 1), np.arange(sides), indexing="ij")
        a, b = i * sides + j, i * sides + (j + 1) % sides
        quads = np.stack([a, b, b + sides, a, b + sides, a + sides], axis=-1).reshape(-1, 3)
        firsts = offset + count * sides * np.arange(len(points))
        faces.append((firsts[:, None, None] + quads).reshape(-1, 3))
        offset += len(points) * count * sides
    return np.concatenate(vertices), np.concatenate(faces)


def _without_repeats(lines: Sequence[Array]) -> list[Array]:
    """The lines without points that lie on the one before them."""
    if not len(lines):
        return []
    points = np.concatenate(lines)
    ends = np.cumsum([len(line) for line in lines])
    kept = np.ones(len(points), dtype=bool)
    kept[1:] = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-9
    kept[ends[:-1][ends[:-1] < len(points)]] = True
    left = np.cumsum(kept)[ends - 1]
    return np.split(points[kept], left[:-1])


def _unit(vectors: Array, least: float = 1e-300) -> Array:
    """Vectors (..., 3) at length 1; those shorter than `least` stay short."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), least))
