"""Triangles in boxes, and these in larger boxes, as arrays: for many questions at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coverable_arrays import Array

Indices = NDArray[np.intp]

BRANCHES = 3  # a box holds 2^3 smaller ones, or triangles


@dataclass(frozen=True, eq=False, slots=True)
class Level:
    """Boxes around equally many triangles each; of one triangle each on the last level."""

    centres: Array
    """(k, 3) m."""
    axes: Array
    """(k, 3, 3) unit vectors along the sides, in rows; the first across, where it is thinnest."""
    halves: Array
    """(k, 3) m, half of the lengths of the sides."""
    balls: Array
    """(k,) m, radii of balls about the centres."""
    triangles: Array | None
    """(k, 3, 3) m, corners of the triangles, on the last level."""

    def of(self, boxes: Indices) -> Level:
        """Some of the boxes."""
        triangles = None if self.triangles is None else self.triangles[boxes]
        centres, axes, halves = self.centres[boxes], self.axes[boxes], self.halves[boxes]
        return Level(centres, axes, halves, self.balls[boxes], triangles)

    def farthest(self, n: Array) -> Array:
        """(k, 3) m, the point of each box, or triangle, that is furthest along n (k, 3)."""
        if self.triangles is not None:
            along = np.einsum("kci,ki->kc", self.triangles, n).argmax(axis=1)
            return np.asarray(self.triangles[np.arange(len(n)), along])
        reach = np.copysign(self.halves, np.einsum("kai,ki->ka", self.axes, n))
        return np.asarray(self.centres + np.einsum("ka,kai->ki", reach, self.axes))

    def support(self, n: Array) -> Array:
        """(p,) m, the most that any box reaches along n (p, 3)."""
        along = np.abs(np.einsum("pi,kai->pka", n, self.axes))
        return np.asarray((n @ self.centres.T + np.einsum("pka,ka->pk", along, self.halves)).max(1))


class TriangleTree:
    """Levels of boxes around the triangles of a mesh, each of eight of the next level."""

    def __init__(self, triangles: Array) -> None:
        """Sort triangles (k, 3, 3) m into boxes, by halves across the longest side.

        Where their number is no power of two, some triangles are there twice.
        """
        depth = max(len(triangles) - 1, 0).bit_length()
        count = 1 << depth
        order = (np.arange(count) * len(triangles) // count)[None]
        middles = triangles.mean(axis=1)
        self.levels: list[Level] = []
        """From the largest boxes to the triangles."""
        for level in range(depth + 1):
            if (depth - level) % BRANCHES == 0:
                self.levels.append(_level(triangles, order))
            if level < depth:
                order = _halved(middles, order)
        self.last: Indices = order[:, 0]
        """(2^depth,) which triangle each box of the last level is."""

    @staticmethod
    def inside(boxes: Indices) -> Indices:
        """(8 p,) the boxes of the next level that are in `boxes` (p,)."""
        return np.asarray((boxes[:, None] << BRANCHES) + np.arange(1 << BRANCHES)).ravel()


def _halved(middles: Array, order: Indices) -> Indices:
    """(2 k, c / 2) halves of sets (k, c) of triangles, of which the middles are given."""
    points = middles[order]
    side = np.ptp(points, axis=1).argmax(axis=1)
    along = np.take_along_axis(points, side[:, None, None], axis=2)[:, :, 0]
    sorted_ = np.take_along_axis(order, along.argsort(axis=1, kind="stable"), axis=1)
    return np.asarray(sorted_.reshape(2 * len(order), -1))


def _level(triangles: Array, order: Indices) -> Level:
    """Boxes around sets (k, c) of triangles, along the directions in which they spread."""
    points = triangles[order].reshape(len(order), -1, 3)
    apart = points - points.mean(axis=1, keepdims=True)
    axes = np.linalg.eigh(np.einsum("kci,kcj->kij", apart, apart))[1].transpose(0, 2, 1)
    along = np.einsum("kci,kai->kca", points, axes)
    low, high = along.min(axis=1), along.max(axis=1)
    centres = np.einsum("ka,kai->ki", 0.5 * (low + high), axes)
    leaves = points if order.shape[1] == 1 else None
    if leaves is not None:  # a point of the triangle
        centres = leaves.mean(axis=1)
    balls = np.linalg.norm(points - centres[:, None], axis=2).max(axis=1)
    return Level(centres, axes, 0.5 * (high - low), balls, leaves)
