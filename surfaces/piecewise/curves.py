"""Curves across the seams of a piecewise surface, from cell centre to cell centre."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from surfaces.piecewise.adjacency import SeamPairs
    from surfaces.piecewise.piecewise_surface import Piecewise

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

SMOOTH = math.radians(0.1)  # seams that bend by more are creases
JUMP = 3.0  # times the step along the straight line: there closest points jump


def curves_across(
    surface: Piecewise,
    seam_pairs: SeamPairs,
    start: Array,
    end: Array,
    t: Array,
    pieces: tuple[int, int],
    around: Sequence[int],
) -> tuple[Array, Array]:
    """Points and normals (m, k, 3) at t (k,) between cells of two pieces; see `Cells.trace`.

    Across a smooth seam these are the closest points to the straight line. Across a crease, and
    where closest points jump because the surface is strongly bent between the centres, the line is
    led over the middle of the border that the cells share. At a crease the normal turns all along
    the curve from one piece's to the other's; `CellCurves.deviations` count how far that is off.

    Args:
        surface: the pieces.
        seam_pairs: where the cells of each pair touch.
        start: (m, 3) m, centres of the first cells.
        end: (m, 3) m, centres of the second cells.
        t: (k,) places on the curves.
        pieces: those of the first and of the second cells.
        around: both, and those that touch both.
    """
    start, end = start[:, None], end[:, None]
    lines = start + t[:, None] * (end - start)
    found = surface.nearest(lines, around)
    points, normals = found.places.reshape(lines.shape), found.normals.reshape(lines.shape)
    steps = np.linalg.norm(np.diff(points, axis=1), axis=2)
    even = np.linalg.norm(end - start, axis=2) * np.diff(t)
    over = (seam_pairs.creases > SMOOTH) | (steps > JUMP * even).any(axis=1)
    if over.any():
        points[over], normals[over] = _over_the_border(
            surface, seam_pairs.rows(over), start[over], end[over], t, pieces
        )
    return points, normals


def _over_the_border(
    surface: Piecewise,
    seam_pairs: SeamPairs,
    start: Array,
    end: Array,
    t: Array,
    pieces: tuple[int, int],
) -> tuple[Array, Array]:
    """Straight to the border and straight on, each part on its piece."""
    middle = seam_pairs.crossings[:, None]
    before, after = (np.linalg.norm(part - middle, axis=2) for part in (start, end))
    share = before / np.maximum(before + after, 1e-300)
    points, normals = np.empty((2, len(start), len(t), 3))
    between = seam_pairs.normals.mean(axis=1)
    first = t <= share
    for k, (piece, centre, part) in enumerate(
        zip(pieces, (start, end), (first, ~first), strict=True)
    ):
        # 0 at the centre, 1 at the border.
        run, length = (t, share) if k == 0 else (1.0 - t, 1.0 - share)
        along = run / np.maximum(length, 1e-300)
        lines = centre + along[..., None] * (middle - centre)
        found = surface.nearest(lines[part], [piece])
        turn = np.broadcast_to((between - seam_pairs.normals[:, k])[:, None], lines.shape)
        normal = found.normals + along[part][:, None] * turn[part]
        points[part] = found.places
        size = np.linalg.norm(normal, axis=1, keepdims=True)
        normals[part] = normal / np.maximum(size, 1e-300)
    return points, normals
