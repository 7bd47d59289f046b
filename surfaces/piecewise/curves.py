"""Ways across the seams of a piecewise surface, from cell centre to cell centre."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from surfaces.piecewise.adjacency import Joints
    from surfaces.piecewise.cells import PieceCells
    from surfaces.piecewise.piecewise_surface import Piecewise

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

SMOOTH = math.radians(0.1)  # seams that bend by more are creases
JUMP = 3.0  # times as far as the line goes: then nearest places jump


def ways_across(
    surface: Piecewise, cells: PieceCells, pairs: Ints, t: Array, pieces: tuple[int, int]
) -> tuple[Array, Array]:
    """Points and normals (m, k, 3) at t (k,) between cells of two pieces; see `Surface.trace`.

    Across a smooth seam these are the nearest places of the straight line. Across a crease, and
    where nearest places jump because the surface is strongly bent between the centres, the line is
    led over the middle of the border that the cells share. At a crease the normal turns all along
    the way from one piece's to the other's; `Courses.strays` tell how far that is off.
    """
    start, end = cells.centres[pairs[:, 0], None], cells.centres[pairs[:, 1], None]
    joints = cells.joints.of(pairs)
    lines = start + t[:, None] * (end - start)
    found = surface.nearest(lines, cells.around(*pieces))
    points, normals = found.places.reshape(lines.shape), found.normals.reshape(lines.shape)
    steps = np.linalg.norm(np.diff(points, axis=1), axis=2)
    even = np.linalg.norm(end - start, axis=2) * np.diff(t)
    over = (joints.creases > SMOOTH) | (steps > JUMP * even).any(axis=1)
    if over.any():
        points[over], normals[over] = _over_the_border(
            surface, joints.of(pairs[over]), start[over], end[over], t, pieces
        )
    return points, normals


def _over_the_border(
    surface: Piecewise, joints: Joints, start: Array, end: Array, t: Array, pieces: tuple[int, int]
) -> tuple[Array, Array]:
    """Ways straight to the border and straight on, each part on its piece."""
    middle = joints.crossings[:, None]
    before, after = (np.linalg.norm(part - middle, axis=2) for part in (start, end))
    share = before / np.maximum(before + after, 1e-300)
    points, normals = np.empty((2, len(start), len(t), 3))
    between = joints.normals.mean(axis=1)
    first = t <= share
    for k, (piece, centre, part) in enumerate(
        zip(pieces, (start, end), (first, ~first), strict=True)
    ):
        # 0 at the centre, 1 at the border.
        way = t / np.maximum(share, 1e-300) if k == 0 else (1.0 - t) / np.maximum(1 - share, 1e-300)
        lines = centre + way[..., None] * (middle - centre)
        found = surface.nearest(lines[part], [piece])
        turn = np.broadcast_to((between - joints.normals[:, k])[:, None], lines.shape)
        normal = found.normals + way[part][:, None] * turn[part]
        points[part] = found.places
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        normals[part] = normal / np.maximum(length, 1e-300)
    return points, normals
