"""Notes about a mesh: its separate pieces, its holes, and closed pieces that face inwards."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from coverable.arrays import Array, Ints
from coverable.errors import counted
from surfaces.adjacency import components

if TYPE_CHECKING:
    from surfaces.meshes.triangle_mesh import TriangleMesh

LISTED = 5  # pieces that a note names
OUTWARD = 0.5  # [1] from which on a border line is a hole, see `_outward`


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
    """Counts holes, and the open ends of pieces that have several, such as pipes.

    A border line is a hole where the surface goes on away from its middle, as round a hole in a
    plate. The longest of each piece is none.
    """
    edges = mesh.edges
    if not len(edges.border_faces):
        return []
    # Every vertex on the border of a clean mesh has two border edges, so its border lines are
    # closed and never touch.
    _, ends = np.unique(edges.border_vertices, return_inverse=True)
    ends = ends.reshape(-1, 2)
    loops = components(ends, int(ends.max()) + 1)[ends[:, 0]]
    lengths: Array = np.bincount(loops, edges.border_lengths).astype(float)
    piece = np.zeros(len(lengths), np.int64)
    piece[loops] = mesh.pieces[edges.border_faces]
    longest = np.zeros(len(lengths), dtype=bool)
    ordered = np.lexsort((-lengths, piece))
    longest[ordered[np.concatenate([[True], np.diff(piece[ordered]) > 0])]] = True
    hole = ~longest & (_outward(mesh, loops, lengths) > OUTWARD)
    notes = []
    if hole.any():
        notes.append(
            f"the mesh has {counted(int(hole.sum()), 'hole')}; the longest is "
            f"{lengths[hole].max():.4g} m around"
        )
    open_ends = np.bincount(piece[~hole])
    if (open_ends > 1).any():
        several = ~hole & (open_ends[piece] > 1)
        notes.append(
            f"the mesh has {int(several.sum())} open ends, as a pipe has two; the longest is "
            f"{lengths[several].max():.4g} m around"
        )
    return notes


def _outward(mesh: TriangleMesh, loops: Ints, lengths: Array) -> Array:
    """How far the surface goes on away from the middle of each border line, -1 .. 1.

    1 round a hole in a plate, 0 at the end of a pipe, -1 at the outer border of a plate.

    Args:
        mesh: the mesh.
        loops: (B,) the line that each border edge is part of.
        lengths: (L,) m, of the lines.
    """
    edges = mesh.edges
    start, end = mesh.vertices[edges.border_vertices].transpose(1, 0, 2)
    middles, along = 0.5 * (start + end), end - start
    weights = edges.border_lengths
    centres = np.stack(
        [np.bincount(loops, weights * middles[:, axis]) / lengths for axis in range(3)], axis=1
    )
    normals = mesh.face_normals[edges.border_faces]
    inwards = np.cross(normals, along)  # a face lies to the left of its edges
    off = middles - centres[loops]
    size = np.linalg.norm(inwards, axis=1) * np.linalg.norm(off, axis=1)
    share = np.einsum("bi,bi->b", inwards, off) / np.maximum(size, np.finfo(float).tiny)
    return np.asarray(np.bincount(loops, weights * share) / lengths)


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
