"""Places of a surface, and continuous paths from one to another with bounds along them.

A place is a point of the surface by its parameters: u and v on a patch, weights on the face of a
mesh. Over a place x with the point f(x) and the outward unit normal n(x), the offset surface at a
signed height h has the point T(x) = f(x) + h n(x). A path of places runs straight in the parameters
between up to four of them. Along each straight piece T and n are near to straight lines between
its ends; so whoever knows both there knows them along it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from coverable.arrays import Array, Ints, Mask, Rows

ROUNDING = 1.0 + 1e-9  # covers the rounding of the bounds' own operations
GUESSES = 6  # closest points that lead from a guess to a place


@dataclass(frozen=True, eq=False, slots=True)
class Places(Rows):
    """k places of a surface."""

    chart: Ints
    """(k,) which patch or face; -1 for no place, whose point is NaN."""
    x: Array
    """(k, 2) u and v; on a face the weights of its second and third corner."""


@dataclass(frozen=True, eq=False, slots=True)
class PlacePaths(Rows):
    """k continuous paths of places, of three straight pieces each, some of them without length."""

    share: Array
    """(k, 4) rising from 0 to 1: when a motion along the path is to be at the four places."""
    points: Array
    """(k, 4, 3) m, the offset surface's points over them."""
    normals: Array
    """(k, 4, 3) the surface's outward unit normals there."""
    tangents: Array
    """(k, 4, 3) its unit u directions there."""
    deviations: Array
    """(k, 3, 3) how far offset point (m), normal and u direction may be, anywhere along each piece,
    from the straight line between its ends; inf where nothing is known. On a surface that
    `bends_evenly` points and normals are no further than 4 s (1 - s) times this, s the piece's own
    parameter in 0..1."""
    chart: Ints
    """(k, 4) patch or face of the four places."""
    x: Array
    """(k, 4, 2) their parameters; the first piece and the last run straight from one to the next,
    also where a patch closes."""

    def place(self, which: int) -> Places:
        """One of the four places of each path."""
        return Places(self.chart[:, which], self.x[:, which])

    @staticmethod
    def straight(
        start: Places, end: Places, placed: Sequence[tuple[Array, ...]], deviations: Array
    ) -> PlacePaths:
        """Paths of one piece each, the last.

        Args:
            start, end: k places each.
            placed: what is `at` the first, and at the last.
            deviations: (k, 3) of that piece.
        """
        ends = zip((*placed[0], *start.values()), (*placed[1], *end.values()), strict=True)
        p, n, t, chart, x = (np.stack([a, a, a, b], axis=1) for a, b in ends)
        share, off = np.tile([0.0, 0.0, 0.0, 1.0], (len(x), 1)), np.zeros((len(x), 3, 3))
        off[:, 2] = deviations
        return PlacePaths(share, p, n, t, off, chart, x)

    @staticmethod
    def joined(first: PlacePaths, last: PlacePaths, lengths: Sequence[Array]) -> PlacePaths:
        """Paths of two pieces, over a place that belongs to both: on an edge, a seam, a pole.

        Args:
            first, last: of one piece each; where those end is where these begin.
            lengths: (k,) of both, which share the motion.
        """
        (to, fro), zero = lengths, np.zeros(len(first.x))
        half = np.divide(to, to + fro, out=zero.copy(), where=to + fro > 0.0)
        ends = zip(first.values(), last.values(), strict=True)
        _, p, n, t, off, chart, x = (
            np.stack([a[:, 0], a[:, -1], b[:, 0], b[:, -1]], axis=1) for a, b in ends
        )
        share = np.stack([zero, half, half, zero + 1.0], axis=1)
        return PlacePaths(share, p, n, t, off[:, [1, 0, 3]], chart, x)

    @property
    def length(self) -> Array:
        """(k,) m, of the straight line between the ends."""
        return np.linalg.norm(self.points[:, 3] - self.points[:, 0], axis=1)

    @property
    def known(self) -> Mask:
        """(k,) whether something is known of points and normals of all pieces."""
        return np.asarray(np.isfinite(self.deviations[..., :2]).all(axis=(1, 2)))


@dataclass(frozen=True, eq=False)
class OffsetSurface(ABC):
    """The points f + h n over a surface, all in the root frame."""

    height: float
    """m, h along the outward normal."""
    directed: bool
    """Are u directions wanted? Else nothing is known of them."""

    @abstractmethod
    def at(self, places: Places) -> tuple[Array, Array, Array]:
        """Points T (k, 3) m of the offset surface, and the surface's normals (k, 3).

        And its unit u directions (k, 3), NaN where it has none, or they are not wanted.
        """

    bends_evenly: ClassVar[bool] = False
    """Are `PlacePaths.deviations` from bounds of second derivatives?"""
    square: ClassVar[bool] = True
    """Whether u directions are square to normals everywhere."""
    least_look: ClassVar[float] = 0.0
    """m, how far ahead of a tool point the second guess of `nearest` has to lie."""

    def closest(self, points: Array) -> Places:
        """The places of the surface itself that are closest to points (k, 3) m, or nearly so."""
        raise NotImplementedError

    def nearest(
        self, points: Array, ahead: Array, within: float, only: Ints | None = None
    ) -> Places:
        """Places whose offset points are near to given points; the nearest, if all goes well.

        Under closest points, first of the given points themselves. Parallel surfaces share their
        normals, so the closest point of the surface is under that of the offset surface, unless
        another part of the surface is nearer.

        Args:
            points: (k, 3) m.
            ahead: (k, 3) m, points of space near which the surface may be: a second guess.
            within: m, the distance from which on a second guess is worth its while.
            only: (k,) between poses, the curve that each is on, where that is known.
        """
        places = self.closest(points)
        away = np.linalg.norm(points - self.at(places)[0], axis=1)
        rest = np.flatnonzero(~(away <= within))
        guess = ahead[rest].copy()
        for _ in range(GUESSES if len(rest) else 0):
            found = self.closest(guess)
            offset, normal, _ = self.at(found)
            there = np.linalg.norm(points[rest] - offset, axis=1)
            nearer = there < away[rest]
            places.put(rest[nearer], found.of(nearer))
            away[rest[nearer]] = there[nearer]
            guess = points[rest] - self.height * normal
        return places

    def approached(self, points: Array, start: Places) -> Places:
        """Places whose offset points are nearer to points (k, 3) m than those of a start, if known.

        Not the nearest of all, but those that the start leads to.
        """
        return start

    def facets(self, points: Array) -> Array:
        """(k,) m, how far points (k, 3) are from the triangles of a mesh themselves.

        Without interpolated normals; inf where the surface is smooth.
        """
        return np.full(len(points), np.inf)

    def along(self, places: Places) -> Array | None:
        """(k,) m, how far along a toolpath places are; None where there is no order."""
        return None

    @abstractmethod
    def paths(self, start: Places, end: Places) -> PlacePaths:
        """Continuous paths from places to places, meant for such that are near to each other."""


class JoinedCharts(OffsetSurface):
    """Charts that meet at corners: the faces of a mesh at vertices, curves at poses."""

    @abstractmethod
    def corners(self, chart: Ints) -> Ints:
        """(k, c) the corners of charts; one number is one corner."""

    @abstractmethod
    def bends(self, chart: Ints, start: Array, stop: Array) -> Array:
        """(k, 3) see `PlacePaths.deviations`, of straight lines in the parameters of charts."""

    @abstractmethod
    def across(self, start: Places, end: Places, equal: Mask) -> PlacePaths:
        """Paths from one chart to another that has a corner in common with it.

        Args:
            start: places.
            end: places on other charts.
            equal: (k, c, c) which corners of both charts are one.
        """

    def straight(self, start: Places, end: Places) -> PlacePaths:
        """Paths straight in the parameters of a chart; nothing is known of those to another."""
        off = np.full((len(start.chart), 3), np.inf)
        some = np.flatnonzero((start.chart == end.chart) & (start.chart >= 0))
        off[some] = self.bends(start.chart[some], start.x[some], end.x[some])
        return PlacePaths.straight(start, end, (self.at(start), self.at(end)), off)

    def paths(self, start: Places, end: Places) -> PlacePaths:
        """See `OffsetSurface.paths`: over one corner, or the edge between two, at most."""
        made = self.straight(start, end)
        known = (start.chart >= 0) & (end.chart >= 0)
        row = np.flatnonzero(known & (start.chart != end.chart))
        one, other = self.corners(start.chart[row]), self.corners(end.chart[row])
        equal = one[:, :, None] == other[:, None, :]
        touching = equal.any(axis=(1, 2))
        row, equal = row[touching], equal[touching]
        if len(row):
            made.put(row, self.across(start.of(row), end.of(row), equal))
        return made


def second_derivative_of_unit(length: Array, first: Array, second: Array) -> Array:
    """Bound of |d2/ds2 (g / |g|)| for a curve g(s).

    With P the projection across n = g / |g|, and g' = a n + b with b across n,

        n'' = P g'' / |g| - (2 a b + |b|^2 n) / |g|^2

    where |2 a b + |b|^2 n|^2 = |b|^2 (4 a^2 + |b|^2), which for a^2 + |b|^2 = |g'|^2 is at most
    (4 / 3) |g'|^4.

    Args:
        length: lower bounds of |g|; where they are not positive, the answer is inf.
        first: bounds of |g'|.
        second: bounds of |g''|.
    """
    known = length > 0.0
    safe = np.where(known, length, 1.0)
    bound = second / safe + (2.0 / np.sqrt(3.0)) * (first / safe) ** 2
    return np.where(known, bound, np.inf)
