"""What thins and shades drawn triangles: vertices merged where they are close, split at creases."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

DEGREE = 57.0  # [1/rad] normals that agree to about a degree are one


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


def _numbered(keys: Ints) -> Ints:
    """Equal keys as equal numbers from 0."""
    return np.unique(keys, return_inverse=True)[1].reshape(-1).astype(np.int64)
