"""Vertices that mean the same point become one."""

from __future__ import annotations

import numpy as np

from surfaces.triangles import Floats, Ints, components

WELD = 1e-6  # of the mesh's diagonal: what lies closer is one vertex, what is thinner is no face


def weld_distance(vertices: Floats) -> float:
    """m: vertices closer than this are one; 1 micrometre for a part of 1 m.

    The single-precision numbers of most files are 16 times finer, so no detail that a file can
    tell is lost, and the same corner written twice with different last digits is still joined.
    """
    return WELD * float(np.linalg.norm(np.ptp(vertices, axis=0)))


def welded(vertices: Floats, distance: float) -> Ints:
    """Which vertex stands for each.

    A vertex keeps its place; those within `distance` of it, or of one another in a chain, are
    replaced by the first of them. The work is bounded however many vertices lie in one place:
    those that share a box of a grid are joined before distances are taken.

    Args:
        vertices: (V, 3) m, finite.
        distance: m, `weld_distance` of these vertices.

    Returns:
        (V,) for each vertex the index of the one that stands for it, the lowest of its group.
    """
    from scipy.spatial import cKDTree

    if distance <= 0.0:
        return np.zeros(len(vertices), np.int64)
    # Boxes whose diagonal is the distance; the extent holds at most 1.8 million of them, 21 bits.
    boxes = ((vertices - vertices.min(axis=0)) / (distance / np.sqrt(3.0))).astype(np.int64)
    first, box = _first_of((boxes[:, 0] << 42) + (boxes[:, 1] << 21) + boxes[:, 2])
    tree = cKDTree(vertices[first], balanced_tree=False, compact_nodes=False)
    pairs = tree.query_pairs(distance, output_type="ndarray").astype(np.int64)
    lowest, group = _first_of(components(pairs, len(first)))
    return first[lowest][group[box]]


def _first_of(keys: Ints) -> tuple[Ints, Ints]:
    """Groups of equal keys, in order of their first members: these, and each key's group."""
    _, first, group = np.unique(keys, return_index=True, return_inverse=True)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return np.sort(first).astype(np.int64), rank[group.reshape(-1)]
