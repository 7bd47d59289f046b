"""Planes between boxes and a body, of many couples at once.

The distance of two convex bodies is that of the origin from the set of differences of their points.
From one such difference v, one goes to the point w of the set that is furthest along -v, and from
there to the point nearest to the origin among those between w and the points that span v (Gilbert,
Johnson and Keerthi, IEEE Journal on Robotics and Automation 4, 1988). Each v is a direction to try
(`parting`), and the distance is at most |v|.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coverable_arrays import Array, Mask
from feasibility.certification.collisions.parting import TINY, nearest_points, unit
from feasibility.certification.collisions.pieces import Piece
from feasibility.certification.collisions.relative_motion import Stretches
from feasibility.certification.collisions.trees import Level
from feasibility.certification.rows import Rows

Indices = NDArray[np.intp]

NEAR = 0.9  # [1] share of the distances met, that is aimed at where it costs little
STEPS = 3  # after which smaller boxes are tried
LAST_STEPS = 16  # the same for triangles

# Of tetrahedra.
FLAT = 1e-30  # [m^4] square of twice the area of a face, below which its edges have to do
THIN = 1e-12  # [m] height of a tetrahedron, below which nothing is inside

EDGES = np.array([[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]])
FACES = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]])
OPPOSITE = np.array([3, 2, 1, 0])  # the corner that is not of each face
OF_EDGES = np.concatenate([EDGES, EDGES[:, 1:]], axis=1)  # as three corners, one of them twice


@dataclass(frozen=True, eq=False, slots=True)
class Couples(Rows):
    """Stretches and boxes, or triangles, two by two."""

    at: Indices
    """(p,) index of the stretch."""
    boxes: Indices
    """(p,) index of the box in its level."""
    low: Array
    """(p,) m, bounds of their distances."""


def ball_bounds(
    level: Level, b: Piece, s: Stretches, at: Indices, boxes: Indices
) -> tuple[Array, Array]:
    """(p,) m, bounds by balls; (p, 3) m, from the centres of boxes to those of the body."""
    start, end = s.first.moved(b.centre), s.last.moved(b.centre)
    ahead = nearest_points(start[at] - level.centres[boxes], (end - start)[at])
    away = np.sqrt(np.einsum("ki,ki->k", ahead, ahead))
    return away - level.balls[boxes] - (s.delta + s.deviation + b.ball)[at], ahead


def searched(
    level: Level, b: Piece, s: Stretches, couples: Couples, between: tuple[float, float]
) -> tuple[Array, Array]:
    """Look for planes that part boxes from a body, along stretches.

    Args:
        level: boxes, or triangles.
        b: the body.
        s: stretches.
        couples: (p,) which boxes and stretches.
        between: m, what is needed and what is aimed at. The search ends where it has `NEAR` of the
            distance, or the aim; and where what is needed cannot be had.

    Returns:
        (p,) m, the distances along the stretches are at least this; (p,) m, the chords come nearer
        than this, if that was met.
    """
    needed, aim = between
    at, boxes = couples.at, couples.boxes
    low, ahead = ball_bounds(level, b, s, at, boxes)
    most = np.full(len(low), np.inf)
    corners = np.repeat(ahead[:, None], 3, axis=1)
    open_ = np.flatnonzero(low < aim)
    for step in range(-1, STEPS if level.triangles is None else LAST_STEPS):
        v = ahead[open_]
        if step < 0:  # across thin boxes
            across = level.axes[boxes[open_], 0]
            n = np.copysign(1.0, np.einsum("ki,ki->k", v, across))[:, None] * across
        else:
            n = unit(v)
        some, off = s.of(at[open_]), (s.delta + s.deviation)[at[open_]]
        w = _beside(level.of(boxes[open_]), b, some, n)
        low[open_] = np.maximum(low[open_], np.einsum("ki,ki->k", n, w) - off)
        if step >= 0:
            if step == 0:
                corners[open_, 1:], v = w[:, None], nearest_points(v, w - v)
            else:
                v, corners[open_] = nearest_of(np.concatenate([corners[open_], w[:, None]], axis=1))
            ahead[open_] = v
            most[open_] = np.sqrt(np.einsum("ki,ki->k", v, v))
        can_be = most[open_] - off
        goal = np.clip(NEAR * can_be, needed, aim)
        open_ = open_[(low[open_] < goal) & (can_be >= needed)]
        if not len(open_):
            break
    return low, most


def _beside(boxes: Level, b: Piece, s: Stretches, n: Array) -> Array:
    """(k, 3) m, the differences of points of b and of the boxes that are least along n (k, 3)."""
    points = []
    for poses in (s.first, s.last):
        own = b.farthest(-np.einsum("kji,kj->ki", poses.rotations, n))
        points.append(np.einsum("kij,kj->ki", poses.rotations, own) + poses.points)
    sooner = np.einsum("ki,ki->k", n, points[0] - points[1]) <= 0.0
    nearer = np.where(sooner[:, None], points[0], points[1])
    return np.asarray(nearer - boxes.farthest(n) - b.radius * n)


def nearest_of(corners: Array) -> tuple[Array, Array]:
    """The nearest points, and what they are spanned by.

    Args:
        corners: (k, 4, 3), which may coincide.

    Returns:
        (k, 3) the points, 0 where the origin is inside; (k, 3, 3) corners that span them.
    """
    start = corners[:, EDGES[:, 0]]
    way = corners[:, EDGES[:, 1]] - start
    square = np.maximum(np.einsum("kei,kei->ke", way, way), TINY)
    share = np.clip(-np.einsum("kei,kei->ke", start, way) / square, 0.0, 1.0)
    on_edges = start + share[:, :, None] * way
    on_faces, inside = _on_faces(corners)
    points = np.concatenate([on_edges, on_faces], axis=1)
    best = np.einsum("kpi,kpi->kp", points, points).argmin(axis=1)
    rows = np.arange(len(corners))
    kept = np.concatenate([OF_EDGES, FACES])[best]
    found = np.where(inside[:, None], 0.0, points[rows, best])
    return found, corners[rows[:, None], kept]


def _on_faces(corners: Array) -> tuple[Array, Mask]:
    """(k, 4, 3) the origin projected onto the faces, inf if beside them; (k,) is it inside?"""
    a, b, c = (corners[:, FACES[:, i]] for i in range(3))
    normals = _cross(b - a, c - a)
    square = np.einsum("kfi,kfi->kf", normals, normals)
    flat = square <= FLAT
    height = np.einsum("kfi,kfi->kf", normals, a)
    projected = (height / np.where(flat, 1.0, square))[:, :, None] * normals
    ahead = projected - a, projected - b, projected - c
    turned = [_cross(one, other) for one, other in zip(ahead, ahead[1:] + ahead[:1], strict=True)]
    sides = np.stack([np.einsum("kfi,kfi->kf", normals, one) for one in turned])
    beside = flat | ~(sides.min(axis=0) >= 0.0)
    other = np.einsum("kfi,kfi->kf", normals, corners[:, OPPOSITE]) - height
    thin = flat | (np.abs(other) <= THIN * np.sqrt(square))
    inside = (~thin & (-height * other > 0.0)).all(axis=1)
    return np.where(beside[:, :, None], np.inf, projected), inside


def _cross(a: Array, b: Array) -> Array:
    """(k, 4, 3) cross products; numpy's own takes three times as long."""
    turned = np.empty_like(a)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        turned[..., i] = a[..., j] * b[..., k] - a[..., k] * b[..., j]
    return turned
