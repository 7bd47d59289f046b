"""The seams of several patches, found by geometry, and what they make of the pieces.

Where borders run along each other, which pieces are connected, and which to turn over so that they
share one outside.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from surfaces.patches.patch import Patch
from surfaces.surface import SurfaceError

VERTICES = 129  # on a side, as a first guess of its nearest place
REFINEMENTS = 8  # Gauss-Newton steps from there
SLOPE = 1e-6  # [1], share of a side: step of its differences
PARTS = 64  # of a side, with a mark in the middle of each
ACROSS = 8  # parts of u and of v, with a place in the middle of each
TOGETHER = 2  # places; pieces that cut through each other may share one by chance
INWARD = 1e-4  # [1], share of a patch: step from a border into the patch


@dataclass(frozen=True, eq=False)
class Border:
    """One border of a patch, from s = 0 to s = 1 along the other parameter."""

    patch: Patch
    piece: int
    """Number of the patch among all."""
    fixed: int
    """0 where u is fixed, 1 where v is."""
    upper: bool
    """Whether it is the border of the highest value of the fixed parameter."""

    @property
    def closed(self) -> bool:
        """Whether its two ends are one place."""
        return self.patch.v_closed if self.fixed == 0 else self.patch.u_closed

    @property
    def ends(self) -> tuple[float, float]:
        """The parameter along it, at s = 0 and at s = 1."""
        return (self.patch.u_range, self.patch.v_range)[1 - self.fixed]

    def at(self, along: Array, inward: float = 0.0) -> tuple[Array, Array]:
        """u and v by the parameter along it, a share of the other's range off the border."""
        low, high = (self.patch.u_range, self.patch.v_range)[self.fixed]
        fixed = high - inward * (high - low) if self.upper else low + inward * (high - low)
        across = np.full_like(along, fixed)
        return (across, along) if self.fixed == 0 else (along, across)

    def parameters(self, s: Array, inward: float = 0.0) -> tuple[Array, Array]:
        """u and v at s, likewise."""
        low, high = self.ends
        return self.at(low + s * (high - low), inward)

    def point(self, s: Array) -> Array:
        """(k, 3) m."""
        return self.patch.point(*self.parameters(s))

    def normal(self, s: Array) -> Array:
        """(k, 3) the patch's outward unit normals."""
        return self.patch.normal(*self.parameters(s))

    def heading(self, s: Array) -> Array:
        """(k, 3) unit vectors along the border that keep the patch on one hand: normal x inward."""
        ends = np.clip(s - SLOPE, 0.0, 1.0), np.clip(s + SLOPE, 0.0, 1.0)
        along = _unit(self.point(ends[1]) - self.point(ends[0]))
        inward = self.patch.point(*self.parameters(s, INWARD)) - self.point(s)
        inward -= (inward * along).sum(axis=1, keepdims=True) * along
        return _unit(np.cross(self.normal(s), inward))

    @cached_property
    def vertices(self) -> Array:
        """(VERTICES, 3) m, evenly along s."""
        return self.point(np.linspace(0.0, 1.0, VERTICES))

    @cached_property
    def length(self) -> float:
        """m."""
        return float(np.linalg.norm(np.diff(self.vertices, axis=0), axis=1).sum())

    def touching(self, points: Array, gap: float) -> tuple[Ints, Array]:
        """Which of points (k, 3) m lie within `gap` (m) of the side, and s of their places."""
        some = np.flatnonzero(self._to_chords(points) <= gap + self._sag)
        if len(some) == 0:
            return some, np.empty(0)
        points = points[some]
        s = self.nearest(points)
        near = np.linalg.norm(points - self.point(s), axis=1) <= gap
        return some[near], s[near]

    def nearest(self, points: Array) -> Array:
        """(k,) s of the places nearest to points (k, 3) m, from the nearest vertices on."""
        away = np.linalg.norm(points[:, None] - self.vertices, axis=2)
        s = np.argmin(away, axis=1) / (VERTICES - 1.0)
        for _ in range(REFINEMENTS):
            ends = np.clip(s - SLOPE, 0.0, 1.0), np.clip(s + SLOPE, 0.0, 1.0)
            slope = (self.point(ends[1]) - self.point(ends[0])) / (ends[1] - ends[0])[:, None]
            square = np.maximum((slope**2).sum(axis=1), 1e-300)
            step = ((points - self.point(s)) * slope).sum(axis=1) / square
            s = s + np.clip(step, -1.0 / VERTICES, 1.0 / VERTICES)
            s = np.mod(s, 1.0) if self.closed else np.clip(s, 0.0, 1.0)
        return s

    @cached_property
    def _sag(self) -> float:
        """m, how far the side may be from the chords between its vertices, at most."""
        # An arc of length h and curvature k sags by h^2 k / 8, and h^2 k is a second difference.
        return 0.5 * float(np.linalg.norm(np.diff(self.vertices, n=2, axis=0), axis=1).max())

    def _to_chords(self, points: Array) -> Array:
        """(k,) m, distances from the chords between vertices."""
        start, chord = self.vertices[:-1], np.diff(self.vertices, axis=0)
        square = np.maximum((chord**2).sum(axis=1), 1e-300)
        away = points[:, None] - start  # (k, VERTICES - 1, 3)
        share = np.clip((away * chord).sum(axis=2) / square, 0.0, 1.0)
        return np.asarray(np.linalg.norm(away - share[..., None] * chord, axis=2).min(axis=1))


class Contact(NamedTuple):
    """Where marks on one side lie on another side."""

    side: int
    other: int
    marks: Ints
    """(k,) numbers of the marks that do."""
    there: Array
    """(k,) s on the other side."""


class Seam(NamedTuple):
    """Two pieces that share part of their borders."""

    pieces: tuple[int, int]
    length: float
    """m."""
    crease: float
    """rad, the largest angle between their outward normals, both turned to one outside."""
    agree: bool
    """Whether both call the same side outward."""


def sides_of(patches: Sequence[Patch], gap: float) -> list[Border]:
    """All borders of some patches, without those joined to themselves or shrunk to a point."""
    sides = [
        Border(patch, piece, fixed, upper)
        for piece, patch in enumerate(patches)
        for fixed in (0, 1)
        if not (patch.u_closed, patch.v_closed)[fixed]
        for upper in (False, True)
    ]
    return [side for side in sides if side.length > 10.0 * gap]


def contacts(sides: Sequence[Border], marks: Sequence[Array], gap: float) -> Iterator[Contact]:
    """Which marks of each side lie within `gap` (m) of sides of other pieces.

    Args:
        sides: borders.
        marks: for each side s (k,) of its marks.
        gap: m.
    """
    low = np.array([side.vertices.min(axis=0) for side in sides]).reshape(-1, 3)
    high = np.array([side.vertices.max(axis=0) for side in sides]).reshape(-1, 3)
    lengths = np.array([side.length for side in sides])
    pieces = np.array([side.piece for side in sides])
    for a, (side, s) in enumerate(zip(sides, marks, strict=True)):
        points = side.point(s)
        # Between its vertices a side may leave their box, by less than a step.
        margin = (gap + (lengths + lengths[a]) / VERTICES)[:, None]
        near = ((low - margin <= high[a]) & (low[a] <= high + margin)).all(axis=1)
        for b in np.flatnonzero(near & (pieces != side.piece)).tolist():
            some, there = sides[b].touching(points, gap)
            if len(some):
                yield Contact(a, b, some, there)


def survey(patches: Sequence[Patch], gap: float) -> tuple[tuple[Seam, ...], tuple[int, ...]]:
    """The seams between patches, by marks in the middle of equal parts of their borders.

    Returns:
        The seams; and three pieces or more that share one stretch of border, empty where none do.
    """
    sides = sides_of(patches, gap)
    s = (np.arange(PARTS) + 0.5) / PARTS
    best: dict[tuple[int, int], tuple[int, Seam]] = {}
    touched: dict[tuple[int, int], set[int]] = {}
    for contact in contacts(sides, [s] * len(sides), gap):
        one, other = sides[contact.side], sides[contact.other]
        for mark in contact.marks.tolist():
            touched.setdefault((contact.side, mark), {one.piece}).add(other.piece)
        # The shorter of two sides has more marks on the seam. With one mark they meet in a point.
        key = (min(contact.side, contact.other), max(contact.side, contact.other))
        if len(contact.marks) > max(1, best[key][0] if key in best else 0):
            best[key] = (len(contact.marks), _seam(one, s[contact.marks], other, contact.there))
    crowds = [tuple(sorted(pieces)) for pieces in touched.values() if len(pieces) > 2]
    return tuple(seam for _, seam in best.values()), min(crowds, default=())


def _seam(one: Border, here: Array, other: Border, there: Array) -> Seam:
    """The seam through places on one side that lie on another."""
    against = (one.heading(here) * other.heading(there)).sum(axis=1)
    agree = bool(np.median(against) < 0.0)
    cosine = (one.normal(here) * other.normal(there)).sum(axis=1)
    crease = np.arccos(np.clip(cosine if agree else -cosine, -1.0, 1.0)).max()
    pieces = (min(one.piece, other.piece), max(one.piece, other.piece))
    return Seam(pieces, one.length * len(here) / PARTS, float(crease), agree)


def _unit(vectors: Array) -> Array:
    """(k, 3) of length 1; zero stays zero."""
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)


def turned_pieces(count: int, seams: Sequence[Seam]) -> tuple[bool, ...]:
    """Which pieces to turn over, so that all agree with the first of their group.

    Raises:
        SurfaceError: there is no such choice.
    """
    turned: dict[int, bool] = {}
    for first in range(count):
        if first in turned:
            continue
        turned[first] = False
        waiting = [first]
        while waiting:
            k = waiting.pop()
            for seam in seams:
                if k not in seam.pieces:
                    continue
                other = seam.pieces[1] if seam.pieces[0] == k else seam.pieces[0]
                wanted = turned[k] if seam.agree else not turned[k]
                if other not in turned:
                    turned[other] = wanted
                    waiting.append(other)
                elif turned[other] != wanted:
                    raise SurfaceError(
                        f"piecewise: pieces[{min(k, other)}] and pieces[{max(k, other)}] cannot be "
                        "joined: going around the pieces, outward becomes inward, as on a Moebius "
                        "strip; leave one piece out, or cut the strip open"
                    )
    return tuple(turned[k] for k in range(count))


def on_each_other(patches: Sequence[Patch], gap: float) -> tuple[int, ...]:
    """The first two pieces of which one lies on the other in part; empty where none do.

    Places inside each piece are looked at, an eighth of its width apart.

    Args:
        patches: in one frame.
        gap: m, how far two sheets may be apart that are one.
    """
    places = [_places(patch) for patch in patches]
    low = np.array([part.min(axis=0) for part in places]).reshape(-1, 3)
    high = np.array([part.max(axis=0) for part in places]).reshape(-1, 3)
    # The places end half a part before the borders; bent ones may leave their box between them.
    margin = gap + 0.5 * np.linalg.norm(high - low, axis=1, keepdims=True)
    for a, points in enumerate(places):
        near = ((low - margin <= high[a]) & (low[a] <= high + margin)).all(axis=1)
        near[a] = False
        for b in np.flatnonzero(near).tolist():
            closest_point = patches[b].closest(points)
            if (closest_point.inside & (np.abs(closest_point.height) <= gap)).sum() >= TOGETHER:
                return (min(a, b), max(a, b))
    return ()


def _places(patch: Patch) -> Array:
    """(ACROSS^2, 3) m, inside the patch."""
    share = (np.arange(ACROSS) + 0.5) / ACROSS
    u, v = (low + share * (high - low) for low, high in (patch.u_range, patch.v_range))
    return patch.point(u[:, None], v[None, :]).reshape(-1, 3)
