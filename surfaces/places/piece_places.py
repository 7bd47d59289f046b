"""Places of a piecewise surface: a piece, and u and v on it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coverable.arrays import Array, Ints, Mask
from surfaces.piecewise.joined_patches import nearest_places
from surfaces.piecewise.piecewise_surface import Piecewise
from surfaces.places.patch_places import PatchPlaces
from surfaces.places.places import OffsetSurface, PlacePaths, Places
from surfaces.surface import points_of

SHARED = 0.3  # of what is near: two pieces so near are equally so
STEPS = 6  # to where the offsets of two pieces meet
SMALLEST = 1e-12  # of the sine between two normals, squared
BORDERS = 2.0  # [1] of the gap that seams may have: so far apart may two sides of one place be


@dataclass(frozen=True, eq=False)
class PiecePlaces(OffsetSurface):
    """The places of several patches, `Places.chart` the number of the patch.

    After the pieces the outer edges count, round which the normal turns. A path from one piece to
    another goes to their seam, changes sides there, and goes on; normals jump with the side where
    the surface has a crease, and who follows the path has to be right for both. At an inner crease
    it changes sides before, where the offset points of both are one: the tool is at the right
    distance from both pieces there. From a piece to an edge of its own it goes to where both have
    the same normal.
    """

    surface: Piecewise

    @cached_property
    def pieces(self) -> tuple[PatchPlaces, ...]:
        """The places of each piece, and of each edge."""
        count = len(self.surface.pieces)  # on an edge u directions jump from one's to the other's
        return tuple(
            PatchPlaces(self.height, self.directed and k < count, *chart)
            for k, chart in enumerate(self.surface.charts)
        )

    def at(self, places: Places) -> tuple[Array, Array, Array]:
        """See `OffsetSurface.at`."""
        found = np.full((3, len(places.chart), 3), np.nan)
        for k in np.unique(places.chart[places.chart >= 0]):
            some = np.flatnonzero(places.chart == k)
            found[:, some] = self.pieces[k].at(places.of(some))
        return found[0], found[1], found[2]

    def nearest(
        self, points: Array, ahead: Array, within: float, only: Ints | None = None
    ) -> Places:
        """See `OffsetSurface.nearest`."""
        places = super().nearest(points, ahead, within)
        up = np.sign(self.height) * (points - ahead)
        best = (self.at(places)[1] * up).sum(axis=1)
        # Where a tool goes from one piece to another, over the one that it is held for.
        for k in sorted({k for both in self.surface.creases.inner for k in both}):
            found = self.pieces[k].closest(points)
            target, normals = self.pieces[k].placed(found.x)
            upright = (normals * up).sum(axis=1)
            near = np.linalg.norm(points - target, axis=1) <= SHARED * within
            some = np.flatnonzero(near & (upright > best))
            places.put(some, Places(np.full(len(some), k), found.x[some]))
            best[some] = upright[some]
        return places

    def closest(self, points: Array) -> Places:
        """See `OffsetSurface.closest`."""
        patches, signs = zip(*self.surface.charts, strict=True)
        found = nearest_places(patches, signs, points_of(points), self.surface.gap)
        return Places(found.piece, np.stack([found.u, found.v], axis=-1))

    def paths(self, start: Places, end: Places) -> PlacePaths:
        """See `OffsetSurface.paths`."""
        unknown = np.full((len(start.x), 3), np.inf)
        made = PlacePaths.straight(start, end, (self.at(start), self.at(end)), unknown)
        pairs = np.stack([start.chart, end.chart], axis=1)
        for a, b in np.unique(pairs[(pairs >= 0).all(axis=1)], axis=0):
            some = np.flatnonzero((pairs == (a, b)).all(axis=1))
            one, other = start.of(some), end.of(some)
            found = self.pieces[a].paths(one, other) if a == b else self._across(one, other)
            made.put(some, found)
        return made

    def _across(self, start: Places, end: Places) -> PlacePaths:
        """Paths from one piece to another, over the place of their seam that is closest to both."""
        numbers = int(start.chart[0]), int(end.chart[0])
        a, b = (self.pieces[k] for k in numbers)
        before, after = self._meeting(numbers, start.x, end.x)
        apart = np.linalg.norm(_on(a, before) - _on(b, after), axis=1)
        joined = apart <= BORDERS * self.surface.gap
        if tuple(sorted(numbers)) in self.surface.creases.inner:
            crossing, met = self._crossing(a, b, start.x, end.x)
            before[met], after[met] = crossing[0][met], crossing[1][met]
            joined |= met
        first = a.paths(start, Places(start.chart, before))
        last = b.paths(Places(end.chart, after), end)
        path = PlacePaths.joined(first, last, (first.length, last.length))
        path.deviations[~joined, ::2] = np.inf
        return path

    def _crossing(
        self, a: PatchPlaces, b: PatchPlaces, start: Array, end: Array
    ) -> tuple[tuple[Array, Array], Mask]:
        """u and v (k, 2) on two pieces whose offset points are one, near to others of both.

        And (k,) whether they are. By Newton's steps, of least length, to where both heights are.
        """
        target = 0.5 * (a.placed(start)[0] + b.placed(end)[0])
        for _ in range(STEPS):
            x = a.closest(target).x, b.closest(target).x
            (p, m), (q, n) = a.placed(x[0]), b.placed(x[1])
            cosine = (m * n).sum(axis=1)
            one, other = ((target - at) * way for at, way in ((p, m), (q, n)))
            one, other = one.sum(axis=1), other.sum(axis=1)
            square = np.maximum(1.0 - cosine**2, SMALLEST)
            shares = (one - cosine * other) / square, (other - cosine * one) / square
            target = target - shares[0][:, None] * m - shares[1][:, None] * n
        apart = np.linalg.norm(p - q, axis=1)
        return x, np.asarray(apart <= BORDERS * self.surface.gap)

    def _meeting(self, numbers: tuple[int, int], start: Array, end: Array) -> tuple[Array, Array]:
        """u and v (k, 2) on two pieces of places at which they meet, near to others of both."""
        a, b = (self.pieces[k] for k in numbers)
        middle = 0.5 * (_on(a, start) + _on(b, end))
        for (edge, piece), back in ((numbers, 1), (numbers[::-1], -1)):
            found = self._turned_to(edge, piece, middle)
            if found is not None:
                return found if back > 0 else (found[1], found[0])
        before = a.closest(middle).x
        for _ in range(2):  # back and forth, from one border to the other
            after = b.closest(_on(a, before)).x
            before = a.closest(_on(b, after)).x
        return before, after

    def _turned_to(self, edge: int, piece: int, points: Array) -> tuple[Array, Array] | None:
        """u and v (k, 2) on an edge and a piece of its own where both have the same normal.

        Near to points (k, 3) m; None where the first number is of no edge of this piece.
        """
        if edge < len(self.surface.pieces):
            return None
        patch, pieces = self.surface.creases.edges[edge - len(self.surface.pieces)]
        if piece not in pieces:
            return None
        which = pieces.index(piece)
        u = patch.along((points - patch.position) @ patch.rotation)
        x = np.stack(patch.on_side(which, u), axis=-1)
        return np.stack([u, np.full_like(u, float(which))], axis=-1), x


def _on(piece: PatchPlaces, x: Array) -> Array:
    """(k, 3) m, points of the surface itself."""
    return piece.patch.point(x[:, 0], x[:, 1])
