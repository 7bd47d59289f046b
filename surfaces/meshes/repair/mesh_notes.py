"""Notes about a mesh: its separate pieces, its holes, and closed pieces that face inwards."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from surfaces.adjacency import components

if TYPE_CHECKING:
    from surfaces.meshes.triangle_mesh import TriangleMesh

LISTED = 5  # pieces that a note names


def notes_of(mesh: TriangleMesh) -> tuple[str, ...]:
    """The repairs, and sentences about pieces, holes and inward faces."""
    return (*mesh.history, *_about_pieces(mesh), *_about_borders(mesh), *_about_sides(mesh))


def border_loops(mesh: TriangleMesh) -> NDArray[np.int64]:
    """(B,) number of the closed border line to which each border edge belongs.

    Every vertex on the border of a clean mesh has two border edges, so these lines are closed and
    never touch.
    """
    _, ends = np.unique(mesh.edges.border_vertices, return_inverse=True)
    ends = ends.reshape(-1, 2)
    return components(ends, int(ends.max(initial=-1)) + 1)[ends[:, 0]]


def _about_pieces(mesh: TriangleMesh) -> list[str]:
    """Names the pieces, if there are several."""
    pieces = mesh.pieces
    areas = np.bincount(pieces, mesh.face_areas)
    if len(areas) == 1:
        return []
    faces = np.bincount(pieces)
    named = [f"{_faces(faces[k])}, {areas[k]:.4g} m^2" for k in range(min(LISTED, len(areas)))]
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
    loops = border_loops(mesh)
    lengths = np.bincount(loops, edges.border_lengths)
    piece = np.zeros(len(lengths), np.int64)
    piece[loops] = mesh.pieces[edges.border_faces]
    # Of each piece, the longest border line counts as the outer one.
    ordered = np.lexsort((-lengths, piece))
    outer = np.concatenate([[True], np.diff(piece[ordered]) > 0])
    holes = lengths[ordered[~outer]]
    if not len(holes):
        return []
    count = "1 hole" if len(holes) == 1 else f"{len(holes)} holes"
    return [
        f"the mesh has {count} (border lines beside the longest of each piece); "
        f"the longest is {holes.max():.4g} m around"
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
        f"{inverted.sum()} closed piece{'s' if inverted.sum() > 1 else ''} of the mesh "
        f"face{'' if inverted.sum() > 1 else 's'} inwards: there, side 'outside' is the inner side"
    ]


def _faces(count: int) -> str:
    """A number of faces."""
    return f"{count} face{'s' if count != 1 else ''}"
