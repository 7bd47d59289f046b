"""The points of several patches closest to given points, borders included."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.patches.patch import Patch

TIE = 1e-9  # [m]: of two pieces so equally close, the one with the point inside it counts
BLOCK = 50_000  # points at once, to bound the memory
PARALLEL = 1e-3  # [1], sine of an angle below which two normals are one


class PieceClosestPoints(NamedTuple):
    """The closest points on some pieces to each of k points."""

    piece: Ints
    """(k,)"""
    u: Array
    """(k,) within the piece's range."""
    v: Array
    """(k,)"""
    places: Array
    """(k, 3) m."""
    normals: Array
    """(k, 3) outward unit normals of the joined surface there."""
    height: Array
    """(k,) m, distance with the sign of the side; beside the surface, its part along the normal."""
    inside: Mask
    """(k,) whether the normal there leads to the point; at a seam, one between both normals."""


def nearest_places(
    patches: Sequence[Patch], signs: Sequence[float], points: Array, gap: float
) -> PieceClosestPoints:
    """The closest points on all patches.

    Where the closest point on a patch lies beyond its border, the one on the border at the same
    parameters counts. That is the closest one as long as the point is near to the border.

    Args:
        patches: at least one.
        signs: +1.0 where a patch's own normal is outward, -1.0 where it is turned over.
        points: (k, 3) m; those that are not finite have places of NaN.
        gap: m, how far apart the two borders of a seam may be.
    """
    count = len(points)
    values = np.full((count, 9), np.nan)
    piece, inside = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=bool)
    finite = np.flatnonzero(np.isfinite(points).all(axis=1))
    for first in range(0, len(finite) if patches else 0, BLOCK):
        some = finite[first : first + BLOCK]
        piece[some], values[some], inside[some] = _nearest(patches, signs, points[some], gap)
    return PieceClosestPoints(
        piece, values[:, 0], values[:, 1], values[:, 2:5], values[:, 5:8], values[:, 8], inside
    )


def _closest_points(patch: Patch, sign: float, points: Array) -> tuple[Array, Array, Mask]:
    """On one patch: (k, 9) u, v, place, normal, height; distances (k,) m; and `inside` (k,)."""
    found = patch.closest(points)
    u, v = np.clip(found.u, *patch.u_range), np.clip(found.v, *patch.v_range)
    places, normals = patch.point(u, v), sign * patch.normal(u, v)
    away = points - places
    height = np.where(found.inside, sign * found.height, (away * normals).sum(axis=1))
    distance = np.where(found.inside, np.abs(found.height), np.linalg.norm(away, axis=1))
    return np.column_stack([u, v, places, normals, height]), distance, found.inside


def _nearest(
    patches: Sequence[Patch], signs: Sequence[float], points: Array, gap: float
) -> tuple[Ints, Array, Mask]:
    """Piece (k,), values (k, 9) as in `_closest_points`, and `inside` (k,) of finite points."""
    found = [
        _closest_points(patch, sign, points) for patch, sign in zip(patches, signs, strict=True)
    ]
    values, distance, within = (np.stack(part) for part in zip(*found, strict=True))
    distance = distance + np.where(within, 0.0, TIE)
    row = np.arange(len(points))
    piece = np.argmin(distance, axis=0)
    best, inside = values[piece, row], within[piece, row].copy()
    if len(patches) > 1:
        distance[piece, row] = np.inf
        second = values[np.argmin(distance, axis=0), row]
        over = ~inside & _over_seam(points, best, second, gap)
        away = np.linalg.norm(points - best[:, 2:5], axis=1)
        best[over, 8] = np.copysign(away, best[:, 8])[over]
        inside |= over
    return piece, best, inside


def _over_seam(points: Array, one: Array, other: Array, gap: float) -> Mask:
    """Points over a seam: both pieces are nearest there, and the point lies off neither end.

    Over the outer side of a crease, or over the hair's breadth between two borders, the closest
    point of no piece lies inside it.
    """
    together = np.linalg.norm(one[:, 2:5] - other[:, 2:5], axis=1) <= 2.0 * gap
    away = points - one[:, 2:5]
    along = np.cross(one[:, 5:8], other[:, 5:8])
    sine = np.linalg.norm(along, axis=1)
    off_end = np.abs((away * along).sum(axis=1)) / np.maximum(sine, PARALLEL)
    middle = one[:, 5:8] + other[:, 5:8]
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-300)
    beside = np.linalg.norm(away - (away * middle).sum(axis=1, keepdims=True) * middle, axis=1)
    return together & (np.where(sine > PARALLEL, off_end, beside) <= 2.0 * gap)
