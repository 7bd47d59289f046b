"""Triangles as they are drawn: merged where close, split at creases, shaded."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from coverable.meshes.raw_mesh import RawMesh
from feasibility.viewer.threejs import Colour
from robots.urdf.link_shapes import Box, Capsule, Cylinder, Sphere
from surfaces.meshes.triangle_mesh import doubled_areas

CREASE = 0.7  # [rad]: edges sharper than this keep a visible edge (40 degrees)
DEGREE = 57.0  # [1/rad] normals that agree to about a degree are one
GREY: Colour = (0.72, 0.74, 0.77)


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
    vertices: Array, faces: Ints, spacing: float, kinds: Ints | None = None
) -> Merged:
    """Merge vertices in one box of a grid into that which is nearest to their mean.

    Faces that collapse, and all but one of those with the same corners, go.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3) indices of vertices.
        spacing: width of the boxes, m.
        kinds: (V,) only vertices of one kind are merged; all where None.
    """
    if not len(faces):
        return Merged(faces, np.arange(0))
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    width = max(spacing, float((high - low).max()) / 2**20)
    boxes = np.rint((vertices - low) / width).astype(np.int64)
    group = _numbered((boxes[:, 0] << 42) + (boxes[:, 1] << 21) + boxes[:, 2])
    if kinds is not None:
        group = _numbered(group * (int(kinds.max()) + 1) + kinds)
    size = np.bincount(group)
    mean = np.column_stack([np.bincount(group, axis) / size for axis in vertices.T])
    off = np.linalg.norm(vertices - mean[group], axis=1)
    order = np.argsort(off, kind="stable")[::-1]
    chosen = np.empty(len(size), dtype=np.int64)
    chosen[group[order]] = order  # the last one written, the nearest, stays
    corners = chosen[group][faces]
    proper = np.flatnonzero((corners != np.roll(corners, 1, axis=1)).all(axis=1))
    ordered = np.sort(corners[proper], axis=1)
    # As whole numbers, which sort ten times faster than rows.
    key = ordered[:, 0] * len(vertices) + ordered[:, 1]
    key = (key if len(vertices) < 2**21 else _numbered(key)) * len(vertices) + ordered[:, 2]
    kept = proper[np.sort(np.unique(key, return_index=True)[1])]
    return Merged(corners[kept], kept)


def split_at_creases(corners: Ints, normals: Array) -> tuple[Ints, Ints]:
    """Split each vertex by the normals of its corners; those that agree become one again.

    Args:
        corners: (3 F,) vertex of each corner of each face.
        normals: (3 F, 3) unit normal of each.

    Returns:
        (V',) a corner for each vertex of the result, and (F, 3) faces of these vertices.
    """
    rounded = np.rint(DEGREE * normals).astype(np.int64) + 64
    key = (((corners << 7) + rounded[:, 0] << 7) + rounded[:, 1] << 7) + rounded[:, 2]
    _, first, faces = np.unique(key, return_index=True, return_inverse=True)
    return first, faces.reshape(-1, 3).astype(np.int64)


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

    Vertices within one box of a grid become that which is nearest to their mean, and triangles that
    collapse go. The grid starts at 0.01 mm (which only joins what is equal) and coarsens by half,
    or faster where there is far too much, from 0.4 mm to 2 cm. It goes on only while there is four
    times the budget, as with parts of kilometres, in shares of each mesh's width. Meshes that use
    less than a quarter of an even share of the budget are left as they are, so that small parts do
    not vanish beside large ones.

    Returns:
        As many meshes as were given, in their order; some may have lost all their triangles.
    """
    result = [_merged(mesh, 1e-5) for mesh in meshes]  # [m]
    spacing = 4e-4  # [m]
    small = budget / (4 * max(len(meshes), 1))
    while _triangles(result) > budget and spacing <= 2e-2:
        result = [mesh if len(mesh.faces) < small else _merged(mesh, spacing) for mesh in result]
        spacing *= 3.0 if _triangles(result) > 4 * budget else 1.5
    share = 1 / 128
    while _triangles(result) > 4 * budget and share <= 0.5:
        result = [
            mesh if len(mesh.faces) < small else _merged(mesh, share * float(np.ptp(mesh.vertices)))
            for mesh in result
        ]
        share *= 2.0
    return result


def _triangles(meshes: Sequence[Mesh]) -> int:
    """How many triangles there are in all."""
    return sum(len(mesh.faces) for mesh in meshes)


def shaded(mesh: Mesh) -> tuple[Mesh, Array]:
    """Split the vertices at creases, and give each its normal.

    A corner's normal is the mean, weighted by area, of those faces around its vertex that lean
    away from its own face by less than `CREASE`: round parts look round and edges stay sharp.

    Returns:
        The mesh with its vertices split, and (V, 3) unit normals.
    """
    areas = doubled_areas(mesh.vertices, mesh.faces)
    units = _unit(areas)
    flat = mesh.faces.reshape(-1)  # vertex of each corner
    face = np.repeat(np.arange(len(mesh.faces)), 3)
    order = np.argsort(flat, kind="stable")
    _, first, count = np.unique(flat[order], return_index=True, return_counts=True)
    # Every ordered pair of corners that share a vertex.
    pairs = count**2
    group = np.repeat(np.arange(len(count)), pairs)
    within = np.arange(pairs.sum()) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    left = order[first[group] + within // count[group]]
    right = order[first[group] + within % count[group]]
    alike = np.einsum("ij,ij->i", units[face[left]], units[face[right]]) > np.cos(CREASE)
    around = areas[face[right[alike]]].T
    normals = _unit(np.column_stack([np.bincount(left[alike], x, len(flat)) for x in around]))
    kept, faces = split_at_creases(flat, normals)
    split = replace(mesh, vertices=mesh.vertices[flat[kept]], faces=faces)
    return split, normals[kept]


def moved(mesh: Mesh, matrix: Array) -> Mesh:
    """The same mesh, placed by a homogeneous (4, 4) matrix."""
    return replace(mesh, vertices=mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3])


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


def _merged(mesh: Mesh, spacing: float) -> Mesh:
    """Merge the vertices within each box of a grid, and drop triangles that collapse."""
    faces = merge_vertices(mesh.vertices, mesh.faces, spacing).faces
    faces = faces[doubled_areas(mesh.vertices, faces).any(axis=1)]  # no normal, nothing to see
    used = np.zeros(len(mesh.vertices), dtype=bool)
    used[faces] = True
    return replace(mesh, vertices=mesh.vertices[used], faces=(np.cumsum(used) - 1)[faces])


def _unit(vectors: Array, least: float = 1e-300) -> Array:
    """Vectors (..., 3) at length 1; those shorter than `least` stay short."""
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=-1, keepdims=True), least))


def _numbered(keys: Ints) -> Ints:
    """Equal keys as equal numbers from 0."""
    return np.unique(keys, return_inverse=True)[1].reshape(-1).astype(np.int64)
