"""One outer side for each piece of a mesh, and one fan of faces around each vertex."""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array, Ints
from surfaces.meshes.triangle_mesh import (
    areas_of,
    components,
    half_edge_ends,
    half_edges,
    piece_numbers,
)
from surfaces.surface import SurfaceError


def oriented(vertices: Array, faces: Ints) -> tuple[Ints, int]:
    """Turn faces over until neighbours agree about the outer side.

    Every face is two nodes of a graph, unchanged and turned over; neighbours join the nodes that
    fit together. A piece with two sides gives two components, mirror images of each other; the one
    that leaves more area unchanged is taken. A piece with one side gives one component.

    Args:
        vertices: (V, 3) m.
        faces: (F, 3), at most two on an edge.

    Returns:
        The faces, and how many were turned over.

    Raises:
        SurfaceError: a piece has only one side, as a Moebius strip.
    """
    count = len(faces)
    inner = half_edges(faces).of_count(2)
    ends = half_edge_ends(faces, inner)
    clash = (ends[:, 0] == ends[:, 1]).all(axis=1)
    if not clash.any():
        return faces, 0
    a, b = (inner // 3).T
    there = b + count * clash
    pairs = np.stack(
        [np.stack([a, there], 1), np.stack([a + count, (there + count) % (2 * count)], 1)]
    )
    nodes = components(pairs.reshape(-1, 2), 2 * count)
    areas = areas_of(vertices, faces)
    one_sided = nodes[:count] == nodes[count:]
    if one_sided.any():
        pieces = piece_numbers(np.column_stack([a, b]), areas)
        piece = pieces == pieces[one_sided.argmax()]
        middle = vertices[faces[piece]].mean(axis=(0, 1))
        raise SurfaceError(
            f"the piece of {piece.sum()} faces around {place(middle)} has only one side, as a "
            "Moebius strip has, so it has no outer normal; cut it through before exporting it"
        )
    unchanged = np.bincount(nodes[:count], areas, 2 * count)
    # Of the two mirror images the one that leaves more area unchanged; on a tie the one that leaves
    # the first face of the piece so, which has the lower number.
    mine, mirror = nodes[:count], nodes[count:]
    near = np.isclose(unchanged[mine], unchanged[mirror], rtol=1e-9, atol=0.0)
    turned = np.where(near, mirror < mine, unchanged[mirror] > unchanged[mine])
    faces = faces.copy()
    faces[turned] = faces[turned][:, ::-1]
    return faces, int(turned.sum())


def one_fan_each(vertices: Array, faces: Ints) -> tuple[Array, Ints, int]:
    """Give each fan of faces a vertex of its own where several fans touch in one.

    Returns:
        Vertices, faces, and how many vertices were added. The first fan keeps the old vertex; the
        new ones come last.
    """
    inner = half_edges(faces).of_count(2)
    face, corner = np.divmod(inner, 3)
    tails, heads = inner, face * 3 + (corner + 1) % 3
    # Neighbours run along their edge in opposite directions.
    pairs = np.concatenate(
        [np.column_stack([tails[:, 0], heads[:, 1]]), np.column_stack([heads[:, 0], tails[:, 1]])]
    )
    fans = components(pairs, faces.size)
    flat = faces.ravel()
    owner = np.empty(fans.max() + 1, np.int64)
    owner[fans] = flat
    fan_of_vertex = np.full(len(vertices), len(owner), np.int64)
    np.minimum.at(fan_of_vertex, owner, np.arange(len(owner)))
    extra = np.flatnonzero(fan_of_vertex[owner] != np.arange(len(owner)))
    if not len(extra):
        return vertices, faces, 0
    vertex_of_fan = owner.copy()
    vertex_of_fan[extra] = len(vertices) + np.arange(len(extra))
    vertices = np.concatenate([vertices, vertices[owner[extra]]])
    return vertices, vertex_of_fan[fans].reshape(-1, 3), len(extra)


def place(point: Array) -> str:
    """A point for a message, in metres."""
    return "({:.4g}, {:.4g}, {:.4g}) m".format(*point)
