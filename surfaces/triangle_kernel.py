"""Any cells as compiled loops see them: triangles, and the cell that a point is over.

A mesh is its own triangles: the closest point, its normal and its cell are those of
`Surface.closest` and `Cells.locate`. A smooth surface is cut into tiles, on each of which points
and normals follow an affine model of u and v (`surfaces.tiles`): P and N with |f - P| <= r_f and
|n - N| <= r_n. Under a point p lies the place w with P(w) + h N(w) = p, which is found from the
nearest triangle. Over the edges of tiles that may be one beside it, where its model is no longer
one of the surface: then the triangle nearest to P(w) follows, until w is at most d beyond its tile.
With e the largest r_f + |h| r_n, and tangents of the tiles that lean by at most s from the tangents
of the surface, the height is right within e + s d; so are the places on the parallel surface, and a
point that is within that of a border between cells is in neither.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from coverable.kernels import allocating
from surfaces.meshes.face_tree import FaceTree, nearest_face
from surfaces.meshes.normals import WIDTH

_NEWTON = 4  # steps to the place under a point; each squares what is left
_TILES = 4  # that are tried one after the other
_FAR = 8.0  # [1] of a triangle: a place so far off it is not on its tile


class TriangleKernel(NamedTuple):
    """F triangles of N cells, as a plain tuple for numba; rows as in `tree.corners`."""

    tree: FaceTree
    """The triangles, in a frame of their own."""
    rotation: Array
    """(3, 3) axes of that frame, as columns, in the root frame."""
    position: Array
    """(3,) m, its origin."""
    normals: Array
    """(F, 3, 3) outward normals at the corners."""
    crease_normals: Array
    """(F, 3, 3) the same on creases; see `MeshSurface`."""
    on_crease: Mask
    """(F, 3) corners that lie on one."""
    on_border: Mask
    """(F, 2, 3) sides, by the corner across, and corners that lie on the border of a mesh."""
    cell: Ints
    """(F,) of a mesh the cell of each; -1 on patches."""
    piece: Ints
    """(F,) the patch of each."""
    parameters: Array
    """(F, 3, 2) u and v at the corners."""
    tangents: Array
    """(F, 3, 3) u directions at the corners; (0, 3, 3) where nobody asks for them."""
    ranges: Array
    """(patches, 2, 2) where u and v begin (first), and their widths."""
    closed: Mask
    """(patches, 2) whether u and v are."""
    counts: Ints
    """(patches, 3) cells along u and v, and the first cell."""
    total: int
    """N; as the number of a cell: on the border of several."""
    deviation: float
    """m, e + s d of the module's text; 0 for a mesh."""
    reach: float
    """m, d of the module's text."""
    gap: float
    """m, between patches that are joined."""
    last: Ints
    """(1,) the triangle found last, where the next search begins."""
    weights: Array
    """(3,) those of the place found last."""


@allocating
def cell_under(kernel, x, y, z):
    """The cell that a point is over, with height and normal; all in the root frame.

    Args:
        kernel: a `TriangleKernel`.
        x, y, z: m.

    Returns:
        (cell, height, nx, ny, nz): -1 for a point that is over no cell, N for one on the border of
        several; m along the outward normal; that unit normal.
    """
    r, corners, p = kernel.rotation, kernel.tree.corners, np.empty(3)
    x, y, z = x - kernel.position[0], y - kernel.position[1], z - kernel.position[2]
    for k in range(3):
        p[k] = r[0, k] * x + r[1, k] * y + r[2, k] * z
    weights, normal, off = kernel.weights, np.zeros(3), np.empty(3)
    f = nearest_face(kernel.tree, p[0], p[1], p[2], kernel.last[0], weights, off)
    kernel.last[0] = f
    cell, along = kernel.cell[f], 0.0
    for c in range(3):
        along += weights[c] * kernel.on_crease[f, c]
    share = min(max(1.0 - (1.0 - along) / WIDTH, 0.0), 1.0)
    for k in range(3):
        off[k] = p[k]
        for c in range(3):
            own = kernel.normals[f, c, k]
            normal[k] += weights[c] * (own + share * (kernel.crease_normals[f, c, k] - own))
            off[k] -= weights[c] * corners[f, c, k]
    length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    height = np.sqrt(off[0] ** 2 + off[1] ** 2 + off[2] ** 2)
    if off[0] * normal[0] + off[1] * normal[1] + off[2] * normal[2] < 0.0:
        height = -height
    for c in range(3):
        side, corner = kernel.on_border[f, 0, c], kernel.on_border[f, 1, c]
        if (side and weights[c] == 0.0) or (corner and weights[c] == 1.0):
            return -1, height, 0.0, 0.0, 0.0
    if cell < 0:
        for number in range(_TILES):
            cell, height, length, beyond = _cell_of_tile(kernel, f, p, weights, height, normal)
            if not kernel.reach < beyond < np.inf or number == _TILES - 1:
                break
            x, y, z = p - height / length * normal
            before, f = f, nearest_face(kernel.tree, x, y, z, f, weights, off)
            if f == before:
                break
            kernel.last[0] = f
        if cell >= 0 and not beyond <= kernel.reach:
            cell = kernel.total
    for k in range(3):
        normal[k] /= length
    return (
        cell,
        height,
        r[0, 0] * normal[0] + r[0, 1] * normal[1] + r[0, 2] * normal[2],
        r[1, 0] * normal[0] + r[1, 1] * normal[1] + r[1, 2] * normal[2],
        r[2, 0] * normal[0] + r[2, 1] * normal[1] + r[2, 2] * normal[2],
    )


@allocating
def u_direction_under(kernel):
    """(x, y, z), about the u direction at the place that `cell_under` found last, of any length."""
    x, y, z, f = 0.0, 0.0, 0.0, kernel.last[0]
    for c in range(3 if kernel.tangents.shape[0] else 0):
        x += kernel.weights[c] * kernel.tangents[f, c, 0]
        y += kernel.weights[c] * kernel.tangents[f, c, 1]
        z += kernel.weights[c] * kernel.tangents[f, c, 2]
    return x, y, z


@allocating
def _cross(a, b, made):
    """Write a x b."""
    made[0] = a[1] * b[2] - a[2] * b[1]
    made[1] = a[2] * b[0] - a[0] * b[2]
    made[2] = a[0] * b[1] - a[1] * b[0]


@allocating
def _beyond_tile(uv, w1, w2, ahead):
    """How far (m) a place of weights w_1 and w_2 is beyond the tile of a triangle.

    Args:
        uv: (3, 2) parameters at the corners.
        w1, w2: of the place.
        ahead: (3, 3) rows: m, the derivatives by w_1 and w_2.
    """
    first, second, over = uv[1] - uv[0], uv[2] - uv[0], np.empty(2)
    for axis in range(2):
        value = w1 * first[axis] + w2 * second[axis]
        low = min(0.0, first[axis], second[axis])
        over[axis] = value - min(max(value, low), max(0.0, first[axis], second[axis]))
    area = first[0] * second[1] - first[1] * second[0]
    by1 = (over[0] * second[1] - over[1] * second[0]) / area
    by2 = (first[0] * over[1] - first[1] * over[0]) / area
    away = 0.0
    for k in range(3):
        away += (by1 * ahead[0, k] + by2 * ahead[1, k]) ** 2
    return np.sqrt(away)


@allocating
def _cell_of_tile(kernel, f, p, weights, height, normal):
    """Solve P(w) + h N(w) = p on the tile of a triangle, from the triangle's nearest point.

    Args:
        kernel: a `TriangleKernel`.
        f: the triangle.
        p: (3,) m.
        weights: (3,) of its point nearest to p; receives 1 - w_1 - w_2, w_1, w_2.
        height: m, about the height of p.
        normal: (3,) receives N.

    Returns:
        (cell, height, |N|, m by which the place is beyond the tile), see `cell_under`.
    """
    corners, normals, uv = kernel.tree.corners, kernel.normals, kernel.parameters
    # Columns of the derivative by w_1, w_2 and h, and the rows of its inverse times `volume`.
    ahead, dual, rest = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    w1, w2, h, volume = weights[1], weights[2], height, 0.0
    for number in range(_NEWTON + 1):
        for k in range(3):
            by1, by2 = corners[f, 1, k] - corners[f, 0, k], corners[f, 2, k] - corners[f, 0, k]
            turn1, turn2 = normals[f, 1, k] - normals[f, 0, k], normals[f, 2, k] - normals[f, 0, k]
            normal[k] = normals[f, 0, k] + w1 * turn1 + w2 * turn2
            rest[k] = p[k] - corners[f, 0, k] - w1 * by1 - w2 * by2 - h * normal[k]
            ahead[0, k], ahead[1, k], ahead[2, k] = by1 + h * turn1, by2 + h * turn2, normal[k]
        for i in range(3):
            _cross(ahead[(i + 1) % 3], ahead[(i + 2) % 3], dual[i])
        volume = ahead[0, 0] * dual[0, 0] + ahead[0, 1] * dual[0, 1] + ahead[0, 2] * dual[0, 2]
        if number == _NEWTON or volume == 0.0:
            break
        w1 += (rest[0] * dual[0, 0] + rest[1] * dual[0, 1] + rest[2] * dual[0, 2]) / volume
        w2 += (rest[0] * dual[1, 0] + rest[1] * dual[1, 1] + rest[2] * dual[1, 2]) / volume
        h += (rest[0] * dual[2, 0] + rest[1] * dual[2, 1] + rest[2] * dual[2, 2]) / volume
    weights[0], weights[1], weights[2] = 1.0 - w1 - w2, w1, w2
    length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    if not (abs(w1) <= _FAR and abs(w2) <= _FAR and volume != 0.0):
        return -1, h * length, length, np.inf
    away = _beyond_tile(uv[f], w1, w2, ahead)
    piece, number, border = kernel.piece[f], 0, False
    for axis in range(2):
        first, second = uv[f, 1, axis] - uv[f, 0, axis], uv[f, 2, axis] - uv[f, 0, axis]
        value = uv[f, 0, axis] + w1 * first + w2 * second
        slope = 0.0  # of the parameter by metres
        for k in range(3):
            slope += ((first * dual[0, k] + second * dual[1, k]) / volume) ** 2
        begin, width = kernel.ranges[piece, 0, axis], kernel.ranges[piece, 1, axis]
        share, band = (value - begin) / width, np.sqrt(slope) / width
        beyond, band = band * (kernel.deviation + kernel.gap), band * kernel.deviation
        if kernel.closed[piece, axis]:
            share -= np.floor(share)
        elif share < -beyond or share > 1.0 + beyond:
            return -1, h * length, length, away
        count = kernel.counts[piece, axis]
        place = min(max(share, 0.0), 1.0) * count
        border |= abs(place - np.round(place)) <= band * count
        number = number * count + min(int(place), count - 1)
    if border or kernel.counts[piece, 0] * kernel.counts[piece, 1] == 0:
        return kernel.total, h * length, length, away
    return kernel.counts[piece, 2] + number, h * length, length, away
