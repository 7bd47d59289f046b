"""Notes about a mesh: its separate pieces, its holes, and closed pieces that face inwards."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from surfaces.adjacency import components

if TYPE_CHECKING:
    from surfaces.meshes.triangle_mesh import TriangleMesh

LISTED = 5  # pieces that a note names


def notes_of(mesh: TriangleMesh) -> tuple[str, ...]:
    """The repairs, and sentences about pieces, holes and inward faces."""
    return (*mesh.history, *_about_pieces(mesh), *_about_borders(mesh), *_about_sides(mesh))


def _about_pieces(mesh: TriangleMesh) -> list[str]:
    """Names the pieces, if there are several."""
    pieces = mesh.pieces
    areas = np.bincount(pieces, mesh.face_areas)
    if len(areas) == 1:
        return []
    faces = np.bincount(pieces)
    named = [
        f"{counted(int(faces[k]), 'face')}, {areas[k]:.4g} m^2"
        for k in range(min(LISTED, len(areas)))
    ]
    more = f"; {len(areas) - LISTED} smaller ones" if len(areas) > LISTED else ""
    return [
        f"the mesh is in {len(areas)} separate pieces ({'; '.join(named)}{more}): no continuous "
        "motion on the surface joins them, so cover one piece at a time, or mend the gaps"
    ]


def _about_borders(mesh: TriangleMesh) -> list[str]:
    """Counts the border lines that are not the outer one of a piece."""
    edges = mesh.edges
    if not len(edges.border_faces):
        return []
    # Every vertex on the border of a clean mesh has two border edges, so its border lines are
    # closed and never touch.
    _, ends = np.unique(edges.border_vertices, return_inverse=True)
    ends = ends.reshape(-1, 2)
    loops = components(ends, int(ends.max()) + 1)[ends[:, 0]]
    lengths = np.bincount(loops, edges.border_lengths)
    piece = np.zeros(len(lengths), np.int64)
    piece[loops] = mesh.pieces[edges.border_faces]
    # Of each piece, the longest border line counts as the outer one.
    ordered = np.lexsort((-lengths, piece))
    outer = np.concatenate([[True], np.diff(piece[ordered]) > 0])
    holes = lengths[ordered[~outer]]
    if not len(holes):
        return []
    return [
        f"the mesh has {counted(len(holes), 'hole')} (border lines beside the longest of each "
        f"piece); the longest is {holes.max():.4g} m around"
    ]


def _about_sides(mesh: TriangleMesh) -> list[str]:
    """Notes closed pieces that are inside out."""
    pieces = mesh.pieces
    closed = np.bincount(pieces) > 0
    closed[pieces[mesh.edges.border_faces]] = False
    # About the middle of the mesh, for a part far from the origin has no digits to spare.
    corners = mesh.vertices[mesh.faces] - mesh.vertices.mean(axis=0)
    volumes = np.einsum("fi,fi->f", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    inverted = closed & (np.bincount(pieces, volumes) < 0.0)
    if not inverted.any():
        return []
    return [
        f"{counted(int(inverted.sum()), 'closed piece')} of the mesh "
        f"face{'' if inverted.sum() > 1 else 's'} inwards: there, side 'outside' is the inner side"
    ]


def counted(count: int, one: str, several: str | None = None) -> str:
    """A number with its noun."""
    return f"{count} {one if count == 1 else several or one + 's'}"
