"""Closest points on triangles, and on the faces of two cells, compiled."""

from __future__ import annotations

import numpy as np

from coverable_kernels import njit


@njit(cache=True, error_model="numpy")
def nearest_on_triangle(a, b, c, p):  # type: ignore[no-untyped-def]
    """Weights (w0, w1, w2) of the point of a triangle nearest to p.

    By the regions of Ericson, Real-Time Collision Detection (2005), section 5.1.5.

    Args:
        a: (3,) corner, as b and c.
        b: (3,)
        c: (3,)
        p: (3,)
    """
    d1, d2, d3, d4, d5, d6 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        ab, ac = b[k] - a[k], c[k] - a[k]
        d1 += ab * (p[k] - a[k])
        d2 += ac * (p[k] - a[k])
        d3 += ab * (p[k] - b[k])
        d4 += ac * (p[k] - b[k])
        d5 += ab * (p[k] - c[k])
        d6 += ac * (p[k] - c[k])
    if d1 <= 0.0 and d2 <= 0.0:
        return 1.0, 0.0, 0.0
    if d3 >= 0.0 and d4 <= d3:
        return 0.0, 1.0, 0.0
    if d6 >= 0.0 and d5 <= d6:
        return 0.0, 0.0, 1.0
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        return 1.0 - v, v, 0.0
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        return 1.0 - w, 0.0, w
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        return 0.0, 1.0 - w, w
    total = 1.0 / (va + vb + vc)
    return va * total, vb * total, vc * total


@njit(cache=True, error_model="numpy")
def nearest_of(corners, middles, radii, some, p, weights):  # type: ignore[no-untyped-def]
    """The face nearest to p among `some`, and its distance; -1 and inf where there are none.

    Args:
        corners: (F, 3, 3) m.
        middles: (F, 3) m, a point of each face.
        radii: (F,) m, no point of the face is further from its middle.
        some: (k,) faces.
        p: (3,) m.
        weights: (3,) receives the weights of the nearest point.
    """
    best, least = -1, np.inf
    for f in some:
        away = 0.0
        for k in range(3):
            away += (p[k] - middles[f, k]) ** 2
        if best >= 0 and away > (least + radii[f]) ** 2:
            continue
        w0, w1, w2 = nearest_on_triangle(corners[f, 0], corners[f, 1], corners[f, 2], p)
        distance = 0.0
        for k in range(3):
            x = w0 * corners[f, 0, k] + w1 * corners[f, 1, k] + w2 * corners[f, 2, k]
            distance += (p[k] - x) ** 2
        distance = np.sqrt(distance)
        if distance < least:
            best, least = f, distance
            weights[0], weights[1], weights[2] = w0, w1, w2
    return best, least


@njit(cache=True, error_model="numpy")
def _around(pair, members, indptr, near, near_indptr):  # type: ignore[no-untyped-def]
    """Faces of two cells, and of those that touch both: the straight line may cut their corners."""
    cells = np.empty(2 + near_indptr[pair[0] + 1] - near_indptr[pair[0]], dtype=np.int64)
    cells[0], cells[1] = pair[0], pair[1]
    count = 2
    for i in range(near_indptr[pair[0]], near_indptr[pair[0] + 1]):
        for j in range(near_indptr[pair[1]], near_indptr[pair[1] + 1]):
            if near[i] == near[j]:
                cells[count] = near[i]
                count += 1
    total = 0
    for cell in cells[:count]:
        total += indptr[cell + 1] - indptr[cell]
    some = np.empty(total, dtype=np.int64)
    total = 0
    for cell in cells[:count]:
        for i in range(indptr[cell], indptr[cell + 1]):
            some[total] = members[i]
            total += 1
    return some


@njit(cache=True, error_model="numpy")
def put_on_cells(  # type: ignore[no-untyped-def]
    corners, middles, radii, members, indptr, near, near_indptr, pairs, points, faces, weights
):
    """Closest points on the faces of two cells each, and of those that touch both.

    Args:
        corners: see `nearest_of`, as for middles and radii.
        members: (F,) faces, cell by cell.
        indptr: (N + 1,) where each cell's faces begin.
        near: neighbours, cell by cell.
        near_indptr: (N + 1,) where each cell's neighbours begin.
        pairs: (m, 2) cells.
        points: (m, k, 3) m.
        faces: (m, k) receives the nearest face.
        weights: (m, k, 3) receives the weights of its nearest point.
    """
    for m in range(pairs.shape[0]):
        some = _around(pairs[m], members, indptr, near, near_indptr)
        for k in range(points.shape[1]):
            found, _ = nearest_of(corners, middles, radii, some, points[m, k], weights[m, k])
            faces[m, k] = found
            # A face close to one point of the line is close to the next: try it first there.
            for i in range(some.shape[0]):
                if some[i] == found:
                    some[i] = some[0]
                    some[0] = found
                    break
