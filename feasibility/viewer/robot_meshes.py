"""Triangles of a robot's visuals: read with trimesh, thinned, and shaded."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coverable_errors import CoverableError
from coverable_files import FileFault, read_regular
from feasibility.viewer.threejs import Colour
from feasibility.viewer.vertex_clusters import merge_vertices, split_at_creases

LARGEST_FILE = 200_000_000  # [byte]
CREASE = 0.7  # [rad]: edges sharper than this keep a visible edge (40 degrees)
GREY: Colour = (0.72, 0.74, 0.77)


class MeshError(CoverableError):
    """A mesh file that cannot be drawn, and why."""


@dataclass(frozen=True, eq=False, slots=True)
class Mesh:
    """Triangles of one colour."""

    vertices: NDArray[np.float64]
    """(V, 3) m."""
    faces: NDArray[np.int64]
    """(F, 3) indices of vertices."""
    colour: Colour
    opacity: float = 1.0


def read_mesh(file: Path, scale: NDArray[np.float64], colour: Colour | None) -> list[Mesh]:
    """Read every part of a mesh file.

    Only the file itself is opened: textures and material files that it names are not.

    Args:
        file: STL, DAE, OBJ, PLY or another format of trimesh.
        scale: (3,) factors along x, y and z.
        colour: for parts that bring no colour of their own; grey where None.

    Raises:
        MeshError: the file is missing, too large, or holds no finite triangles.
    """
    import trimesh

    try:
        # From memory: trimesh cannot know where other files would lie.
        stream = io.BytesIO(read_regular(file, LARGEST_FILE, "a mesh to draw"))
        scene = trimesh.load_scene(stream, file_type=file.suffix.lstrip(".").lower())
        parts = scene.dump()
    except FileFault as fault:
        raise MeshError(f"{file.name}: {fault}") from fault
    except Exception as error:
        raise MeshError(f"{file.name}: cannot be read as a mesh: {error}") from error
    meshes = []
    for part in parts:
        if not isinstance(part, trimesh.Trimesh) or len(part.faces) == 0:
            continue
        vertices = np.asarray(part.vertices, dtype=float) * scale
        if not np.isfinite(vertices).all():
            raise MeshError(f"{file.name}: a vertex is not finite")
        own, opacity = _colour(part)
        meshes.append(
            Mesh(vertices, np.asarray(part.faces, np.int64), own or colour or GREY, opacity)
        )
    if not meshes:
        raise MeshError(f"{file.name}: holds no triangles")
    return meshes


def thinned(meshes: Sequence[Mesh], budget: int) -> list[Mesh]:
    """Merge vertices that lie close together until all meshes have at most `budget` triangles.

    Vertices within one box of a grid become that which is nearest to their mean, and triangles that
    collapse go. The grid starts at 0.01 mm (which only joins what is equal) and coarsens by half
    from 0.4 mm to at most 2 cm. Meshes that use less than a quarter of an even share of the budget
    are left as they are, so that small parts do not vanish beside large ones.

    Returns:
        As many meshes as were given, in their order; some may have lost all their triangles.
    """
    result = [_merged(mesh, 1e-5) for mesh in meshes]  # [m]
    spacing = 4e-4  # [m]
    small = budget / (4 * max(len(meshes), 1))
    while sum(len(mesh.faces) for mesh in result) > budget and spacing <= 2e-2:
        result = [mesh if len(mesh.faces) < small else _merged(mesh, spacing) for mesh in result]
        spacing *= 1.5
    return result


def shaded(mesh: Mesh) -> tuple[Mesh, NDArray[np.float64]]:
    """Split the vertices at creases, and give each its normal.

    A corner's normal is the mean, weighted by area, of those faces around its vertex that lean
    away from its own face by less than `CREASE`: round parts look round and edges stay sharp.

    Returns:
        The mesh with its vertices split, and (V, 3) unit normals.
    """
    areas = _doubled_areas(mesh.vertices, mesh.faces)
    units = areas / np.maximum(np.linalg.norm(areas, axis=1, keepdims=True), 1e-300)
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
    normals = np.empty((len(flat), 3))
    for axis in range(3):
        normals[:, axis] = np.bincount(
            left[alike], areas[face[right[alike]], axis], minlength=len(flat)
        )
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    kept, faces = split_at_creases(flat, normals)
    split = replace(mesh, vertices=mesh.vertices[flat[kept]], faces=faces)
    return split, normals[kept]


def moved(mesh: Mesh, matrix: NDArray[np.float64]) -> Mesh:
    """The same mesh, placed by a homogeneous (4, 4) matrix."""
    return replace(mesh, vertices=mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3])


def tubes(
    lines: Sequence[NDArray[np.float64]], radius: float, sides: int = 5
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Thin tubes around polylines, (k, 3) m each: vertices (V, 3) and faces (F, 3).

    Lines are one pixel wide on most machines, whatever width is asked for.
    """
    vertices, faces, offset = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
    angle = 2.0 * np.pi * np.arange(sides) / sides
    for line in lines:
        steps = np.diff(line, axis=0)
        line = line[np.concatenate([[True], np.linalg.norm(steps, axis=1) > 1e-9])]
        if len(line) < 2:
            continue
        along = np.gradient(line, axis=0)
        helper = np.eye(3)[np.argmin(np.abs(line[-1] - line[0]))]
        side = np.cross(along, helper)
        side /= np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-12)
        up = np.cross(along, side)
        up /= np.maximum(np.linalg.norm(up, axis=1, keepdims=True), 1e-12)
        ring = (
            np.cos(angle)[None, :, None] * side[:, None]
            + np.sin(angle)[None, :, None] * up[:, None]
        )
        vertices.append((line[:, None] + radius * ring).reshape(-1, 3))
        i, j = np.meshgrid(np.arange(len(line) - 1), np.arange(sides), indexing="ij")
        a, b = i * sides + j, i * sides + (j + 1) % sides
        quads = np.stack([a, b, b + sides, a, b + sides, a + sides], axis=-1)
        faces.append(offset + quads.reshape(-1, 3))
        offset += len(line) * sides
    return np.concatenate(vertices), np.concatenate(faces)


def _merged(mesh: Mesh, spacing: float) -> Mesh:
    """Merge the vertices within each box of a grid, and drop triangles that collapse."""
    faces = merge_vertices(mesh.vertices, mesh.faces, spacing).faces
    faces = faces[_doubled_areas(mesh.vertices, faces).any(axis=1)]  # no normal, nothing to see
    used = np.zeros(len(mesh.vertices), dtype=bool)
    used[faces] = True
    return replace(mesh, vertices=mesh.vertices[used], faces=(np.cumsum(used) - 1)[faces])


def _doubled_areas(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """(F, 3) normals as long as twice the areas."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def _colour(part: Any) -> tuple[Colour | None, float]:
    """The colour and opacity that a part brings along; None where it brings none."""
    visual = part.visual
    if visual.kind == "texture":
        rgba = visual.material.main_color
    elif visual.kind in ("vertex", "face"):
        rgba = visual.main_color
    else:
        return None, 1.0
    red, green, blue, alpha = (float(value) / 255.0 for value in rgba)
    # An alpha of zero is a file's way of saying that it left transparency unset.
    return (red, green, blue), alpha if alpha > 0.05 else 1.0
