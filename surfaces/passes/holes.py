"""Holes closed for measuring distances: fronts that go round a hole would meet behind it in a kink.

Passes run over the closed surface, and what runs over a lid is cut out of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from surfaces.passes.welded_triangles import WorkingMesh, border_edges

MOST_RINGS = 40
HOLE = 0.5  # [1] of the longest border: a border shorter than this goes round a hole


class Lidded(NamedTuple):
    """A mesh with lids over its holes."""

    mesh: WorkingMesh
    faces: int
    """How many of its faces, the first ones, are the surface's own."""
    holes: int
    """How many were closed."""


def with_lids(mesh: WorkingMesh, edge: float) -> Lidded:
    """Close each hole by rings of triangles about its middle, as fine as `edge` (m).

    The longest border is the surface's outer one, and so are those at least half as long: the two
    ends of a tube are no holes.
    """
    loops = _loops(border_edges(mesh.faces))
    lengths = [_length(mesh.vertices[loop]) for loop in loops]
    vertices, faces, count = [mesh.vertices], [mesh.faces], len(mesh.vertices)
    holes = 0
    for loop, length in zip(loops, lengths, strict=True):
        if length >= HOLE * max(lengths):
            continue
        points, lid = _lid(mesh.vertices[loop], loop, count, edge)
        vertices.append(points)
        faces.append(lid)
        count += len(points)
        holes += 1
    made = WorkingMesh(np.concatenate(vertices), np.concatenate(faces))
    return Lidded(made, len(mesh.faces), holes)


def _loops(edges: Ints) -> list[Ints]:
    """Borders as closed rows of vertices, in the direction in which their faces run along them."""
    after = dict(edges.tolist())
    loops = []
    while after:
        start, vertex = after.popitem()
        loop = [start]
        while vertex != start and vertex in after:
            loop.append(vertex)
            vertex = after.pop(vertex)
        loops.append(np.array(loop, dtype=np.int64))
    return loops


def _length(points: Array) -> float:
    """m, once round."""
    return float(np.linalg.norm(points - np.roll(points, 1, axis=0), axis=1).sum())


def _lid(points: Array, loop: Ints, count: int, edge: float) -> tuple[Array, Ints]:
    """Vertices and faces that fill a loop; the first new vertex has the number `count`."""
    middle, n = points.mean(axis=0), len(loop)
    radius = float(np.linalg.norm(points - middle, axis=1).max())
    rings = min(max(1, math.ceil(radius / edge)), MOST_RINGS)
    shares = np.arange(rings - 1, 0, -1) / rings
    inner = middle + shares[:, None, None] * (points - middle)
    number = np.concatenate([loop[None], count + np.arange((rings - 1) * n).reshape(-1, n)])
    outer, following = number[:-1].ravel(), np.roll(number[:-1], -1, axis=1).ravel()
    below, beside = number[1:].ravel(), np.roll(number[1:], -1, axis=1).ravel()
    last, centre = number[-1], count + (rings - 1) * n
    faces = [
        # A border's edges run with its faces, so the lid's run the other way.
        np.column_stack([following, outer, below]),
        np.column_stack([following, below, beside]),
        np.column_stack([np.roll(last, -1), last, np.full(n, centre)]),
    ]
    return np.concatenate([inner.reshape(-1, 3), middle[None]]), np.concatenate(faces)
