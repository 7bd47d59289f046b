"""Lines along which a field over a mesh has one value, chained by the triangles they cross."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.passes.welded_triangles import WorkingMesh

OFF_VERTICES = 1e-7  # [1] of the field's range by which a level is off all vertices' values


class Line(NamedTuple):
    """One connected line of equal value."""

    points: Array
    """(k, 3) m, where it crosses edges, in order; the larger values lie to its left."""
    faces: Ints
    """(k - 1,) the face that each piece between them runs over; as many as points if closed."""
    closed: bool
    """True where its end is its beginning; the first point is not repeated."""

    @property
    def pieces(self) -> Array:
        """Lengths (m) of the pieces over each of `faces`."""
        points = np.concatenate([self.points, self.points[:1]]) if self.closed else self.points
        return np.asarray(np.linalg.norm(np.diff(points, axis=0), axis=1))

    @property
    def length(self) -> float:
        """m."""
        return float(self.pieces.sum())

    def reversed(self) -> Line:
        """The same, from its end to its beginning."""
        faces = np.roll(self.faces[::-1], -1) if self.closed else self.faces[::-1]
        return Line(self.points[::-1], faces, self.closed)


def level_lines(mesh: WorkingMesh, field: Array, level: float, which: Mask) -> list[Line]:
    """The lines on which a field is `level`, seen from outside with larger values to the left.

    Args:
        mesh: the triangles.
        field: (V,) values at the vertices, linear in each face.
        level: the value.
        which: (F,) the faces that lines may run over.
    """
    values = field[mesh.faces]
    nudge = OFF_VERTICES * float(np.ptp(field))
    if np.isclose(field, level, rtol=0.0, atol=0.5 * nudge).any():
        level += nudge
    above = values > level
    crossed = above.any(axis=1) & ~above.all(axis=1) & which
    faces = np.flatnonzero(crossed)
    if not len(faces):
        return []
    starts, ends = _crossings(mesh.faces[faces], above[faces])
    edges, of = np.unique(np.concatenate([starts, ends]), axis=0, return_inverse=True)
    low, high = field[edges[:, 0]], field[edges[:, 1]]
    share = (level - low) / (high - low)
    ends_at = mesh.vertices[edges]
    points = ends_at[:, 0] + share[:, None] * (ends_at[:, 1] - ends_at[:, 0])
    return _chained(of[: len(faces)], of[len(faces) :], faces, points)


def _crossings(faces: Ints, above: Mask) -> tuple[Ints, Ints]:
    """The edges (k, 2), lower vertex first, where lines enter and leave faces (k, 3).

    Faces run counterclockwise seen from outside. With the larger values to its left a line enters
    across the side that leads from a corner above to one below.
    """
    following = np.roll(above, -1, axis=1)
    rows = np.arange(len(faces))
    found = []
    for wanted in (above & ~following, ~above & following):
        side = wanted.argmax(axis=1)
        edge = np.column_stack([faces[rows, side], faces[rows, (side + 1) % 3]])
        found.append(np.sort(edge, axis=1))
    return found[0], found[1]


def _chained(starts: Ints, ends: Ints, faces: Ints, points: Array) -> list[Line]:
    """Pieces from edge to edge as lines, each as long as it goes."""
    after = dict(zip(starts.tolist(), range(len(starts)), strict=True))
    entered = set(ends.tolist())
    lines = []
    free = dict.fromkeys([k for s, k in after.items() if s not in entered])  # beginnings first
    free.update(dict.fromkeys(range(len(starts))))
    while free:
        first = piece = next(iter(free))
        row = [piece]
        del free[piece]
        while (piece := after.get(int(ends[piece]), -1)) in free:
            row.append(piece)
            del free[piece]
        closed = piece == first
        nodes = starts[row] if closed else np.append(starts[row], ends[row[-1]])
        lines.append(Line(points[nodes], faces[row], closed))
    return lines
