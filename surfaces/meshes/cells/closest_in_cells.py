"""Closest points on the faces of two cells and of those that touch both, compiled."""

from __future__ import annotations

import numpy as np

from coverable.kernels import allocating, allocating_entry, kernel
from surfaces.meshes.closest_on_triangle import on_triangle
from surfaces.meshes.face_tree import nearest_face


@kernel
def _nearest_of(corners, balls, radii, some, x, y, z, weights, found):  # type: ignore[no-untyped-def]
    """The face nearest to a point among `some`; -1 where there are none.

    Args:
        corners: (F, 3, 3) m.
        balls: (F, 3) m, a point of each face.
        radii: (F,) m, no point of the face is further from it.
        some: (k,) faces.
        x, y, z: m.
        weights: (3,) receives the weights of the nearest point.
        found: (3,) scratch.
    """
    best, least = -1, np.inf
    for i in range(some.shape[0]):
        f = some[i]
        away = (x - balls[f, 0]) ** 2 + (y - balls[f, 1]) ** 2 + (z - balls[f, 2]) ** 2
        if best >= 0 and away > (least + radii[f]) ** 2:
            continue
        distance = np.sqrt(on_triangle(corners, f, x, y, z, found))
        if distance < least:
            best, least = f, distance
            for k in range(3):
                weights[k] = found[k]
    return best


@allocating
def _faces_of(cells, members, indptr):  # type: ignore[no-untyped-def]
    """All faces of some cells."""
    total = 0
    for cell in cells:
        total += indptr[cell + 1] - indptr[cell]
    some = np.empty(total, dtype=np.int64)
    total = 0
    for cell in cells:
        for i in range(indptr[cell], indptr[cell + 1]):
            some[total] = members[i]
            total += 1
    return some


@allocating
def _around(pair, near, near_indptr):  # type: ignore[no-untyped-def]
    """Two cells, and those that touch both: the straight line may cut their corners."""
    cells = np.empty(2 + near_indptr[pair[0] + 1] - near_indptr[pair[0]], dtype=np.int64)
    cells[0], cells[1] = pair[0], pair[1]
    count = 2
    for i in range(near_indptr[pair[0]], near_indptr[pair[0] + 1]):
        for j in range(near_indptr[pair[1]], near_indptr[pair[1] + 1]):
            if near[i] == near[j]:
                cells[count] = near[i]
                count += 1
    return cells[:count]


@allocating_entry
def put_on_cells(  # type: ignore[no-untyped-def]
    tree, corners, balls, radii, labels, members, indptr, near, near_indptr, pairs, points, faces,
    weights,
):  # fmt: skip
    """Closest points on the faces of two cells each, and of those that touch both.

    The face of all that is nearest is mostly one of theirs. Where it is not, as where another part
    of the mesh is close, all of theirs are looked at.

    Args:
        tree: the faces as a `FaceTree`.
        corners: see `_nearest_of`, as for balls and radii.
        balls: middles of the faces.
        radii: of the balls around them.
        labels: (F,) cell of each face.
        members: (F,) faces, cell by cell.
        indptr: (N + 1,) where each cell's faces begin.
        near: neighbours, cell by cell.
        near_indptr: (N + 1,) where each cell's neighbours begin.
        pairs: (m, 2) cells.
        points: (m, k, 3) m.
        faces: (m, k) receives the nearest face; -1 for points that are not finite.
        weights: (m, k, 3) receives the weights of its nearest point; NaN likewise.
    """
    wanted, found, row = np.full(indptr.shape[0] - 1, -1), np.empty(3), 0
    for m in range(pairs.shape[0]):
        cells = _around(pairs[m], near, near_indptr)
        wanted[cells] = m
        some = np.empty(0, dtype=np.int64)
        for k in range(points.shape[1]):
            x, y, z = points[m, k, 0], points[m, k, 1], points[m, k, 2]
            if not np.isfinite(x + y + z):
                faces[m, k], weights[m, k] = -1, np.nan
                continue
            row = nearest_face(tree, x, y, z, row, weights[m, k], found)
            face = tree.order[row]
            if wanted[labels[face]] != m:
                if some.shape[0] == 0:
                    some = _faces_of(cells, members, indptr)
                face = _nearest_of(corners, balls, radii, some, x, y, z, weights[m, k], found)
                # A face close to one point of the line is close to the next: try it first there.
                for i in range(some.shape[0]):
                    if some[i] == face:
                        some[i], some[0] = some[0], face
                        break
            faces[m, k] = face
