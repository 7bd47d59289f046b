"""Lower bounds of the distance of two bodies along stretches of a motion, by planes and balls.

Seen from body a, the points of body b move nearly along chords (`relative_motion`). So, for any
unit vector n, their distance along a stretch is at least

    min(low(0), low(1)) - h_a(n) - delta - deviation,    low(s) = n . t(s) - h_b(-R(s)^T n),

with h the supports of `pieces`, and R, t the pose of b at an end of the stretch. That n parts them
is checked by this formula alone; it does not matter where n is from.
"""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array
from feasibility.certification.collisions.pieces import Below, Piece
from feasibility.certification.collisions.plane_kernels import part
from feasibility.certification.collisions.relative_motion import Poses, Stretches

TINY = 1e-300  # what keeps quotients of zeros finite


def lows(b: Piece, poses: Poses, n: Array) -> Array:
    """(k,) m, least n . x over the points of b, for directions (k, 3), or one (3,) for all."""
    if n.ndim == 1:
        return np.asarray(poses.points @ n - b.support(-(n @ poses.rotations)))
    turned = np.einsum("kji,kj->ki", poses.rotations, n)
    return np.einsum("ki,ki->k", n, poses.points) - b.support(-turned)


def parted(a: Piece, b: Piece, s: Stretches, n: Array) -> Array:
    """(k,) m, how far planes across n, (k, 3) or (3,), part a and b along stretches, see above."""
    if isinstance(a, Below):
        n = a.thin
    own, other = a.outline, b.outline
    if own is not None and other is not None:
        found = np.empty(len(s.row))
        less = s.delta + s.deviation + (own.radius + other.radius)
        part(
            own.corners, own.circle, other.corners, other.circle, s.first.rotations, s.first.points,
            s.last.rotations, s.last.points, np.ascontiguousarray(np.atleast_2d(n)), less, found,
        )  # fmt: skip
        return found
    low = np.minimum(lows(b, s.first, n), lows(b, s.last, n))
    return np.asarray(low - a.support(np.atleast_2d(n)) - s.delta - s.deviation)


def guesses(a: Piece, b: Piece, s: Stretches) -> list[Array]:
    """Directions (k, 3) that cost nothing: between the centres, and across thin parts of a mesh."""
    ahead = 0.5 * (s.first.moved(b.centre) + s.last.moved(b.centre)) - a.centre
    found = [unit(ahead)]
    if a.thin is not None:
        found.append(np.where(ahead @ a.thin >= 0.0, 1.0, -1.0)[:, None] * a.thin)
    return found


def by_balls(a: Piece, b: Piece, s: Stretches) -> Array:
    """(k,) m, distances of balls around a and b along stretches, at least."""
    start, end = s.first.moved(b.centre), s.last.moved(b.centre)
    away = np.linalg.norm(nearest_points(start - a.centre, end - start), axis=1)
    return np.asarray(away - a.ball - b.ball - s.delta - s.deviation)


def nearest_points(start: Array, way: Array) -> Array:
    """(..., 3) m, the points nearest to the origin of lines from `start` along all of `way`."""
    square = np.maximum(np.einsum("...i,...i->...", way, way), TINY)
    share = np.clip(-np.einsum("...i,...i->...", start, way) / square, 0.0, 1.0)
    return np.asarray(start + share[..., None] * way)


def unit(vectors: Array) -> Array:
    """Vectors (k, 3) of length one, or z where there is no direction."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    some = length > 0.0
    return np.where(some, vectors / np.where(some, length, 1.0), [0.0, 0.0, 1.0])
