"""Outer edges between two pieces, as patches without width over which the normal turns.

The tool goes round an outer edge in an arc: at each point f of the edge the surface has all normals
between those of the two pieces, n(v) = (1 - v) n_1 + v n_2 over its length, v from 0 to 1, and so
the offset surface has a strip f + h n(v) that joins those of both. That is right on the side on
which the edge is convex, where the edge is what is nearest to the tool; on the other,
an inner crease, the strips of both pieces cross before they reach it, and a tool goes from one to
the other where they do: there the same point is right over both pieces.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array
from surfaces.patches.patch import Patch
from surfaces.patches.smooth_patch import LocalClosestPoints, SmoothPatch
from surfaces.piecewise.seams import INWARD, PARTS, Border, Seam, contacts, sides_of
from surfaces.surface import Side, SurfaceError

SMOOTH = math.radians(0.1)  # seams that bend by more are creases
UPRIGHT = 1e-7  # m, by which the steps to the nearest place of a border may miss it


@dataclass(frozen=True, eq=False, slots=True, repr=False)
class Edge(SmoothPatch):
    """u runs along the border of one piece, as its own parameter does; v from it to the other.

    In the frame of the first piece.
    """

    kind: ClassVar[str] = "edge"
    units: ClassVar[tuple[str, str]] = ("", "")

    sides: tuple[Border, Border]
    """Both borders, of pieces whose own poses do not count."""
    signs: tuple[float, float]
    """-1.0 where a piece's normal is turned over."""
    shift: float
    """The other piece's parameter is shift + rate u."""
    rate: float
    turn: Array
    """(3, 3) from the other piece's frame to the first one's."""

    @property
    def u_closed(self) -> bool:
        """Where the border is."""
        return self.sides[0].closed

    @property
    def breaks(self) -> tuple[Array, Array]:
        """Those of the two borders."""
        one, other = (side.patch.breaks[1 - side.fixed] for side in self.sides)
        return np.unique(np.concatenate([one, (other - self.shift) / self.rate])), np.empty(0)

    def local_point(self, u: Array, v: Array) -> Array:
        """Of the first border."""
        return self.sides[0].patch.local_point(*self.sides[0].at(u))

    def on_side(self, which: int, u: Array) -> tuple[Array, Array]:
        """The parameters of the first or the second piece at places of the edge."""
        return self.sides[which].at(self.shift + self.rate * u if which else u)

    def ends(self, u: Array) -> tuple[Array, Array]:
        """Both unit normals, in the own frame."""
        one, other = (
            self.signs[k] * self.sides[k].patch.local_normal(*self.on_side(k, u)) for k in (0, 1)
        )
        turned: Any = sum(other[..., k, None] * self.turn[:, k] for k in range(3))
        return one, turned

    def local_normal(self, u: Array, v: Array) -> Array:
        """(1 - v) n_1 + v n_2 over its length."""
        one, other = self.ends(u)
        between = one + v[..., None] * (other - one)
        return between / np.linalg.norm(between, axis=-1, keepdims=True)

    def area(self, u0: ArrayLike, u1: ArrayLike, v0: ArrayLike, v1: ArrayLike) -> Array:
        """None."""
        return np.zeros(np.broadcast_shapes(*map(np.shape, (u0, u1, v0, v1))))

    def local_closest_points(self, points: Array) -> LocalClosestPoints:
        """The nearest place of the border, and the turn at which the normal leads to the point.

        Seen from the side of the normals, or from the other, whichever is nearer.
        """
        u = self.along(points)
        one, other = self.ends(u)
        away = points - self.local_point(u, u)
        outward = np.where((away * (one + other)).sum(axis=1) < 0.0, -1.0, 1.0)
        a, b = (outward * (away * normal).sum(axis=1) for normal in (one, other))
        cosine = (one * other).sum(axis=1)
        # away = x one + y other, but for what is along the edge.
        x, y = a - cosine * b, b - cosine * a
        total = x + y
        v = np.divide(y, total, out=np.full_like(y, 0.5), where=total > 0.0)
        normal = self.local_normal(u, np.clip(v, 0.0, 1.0))
        height = (away * normal).sum(axis=1)
        off = np.linalg.norm(away - height[:, None] * normal, axis=1)
        return LocalClosestPoints(u, v, height, normal, off <= UPRIGHT)

    def along(self, points: Array) -> Array:
        """(k,) u of the places of the border that are nearest to points (k, 3) m in the frame."""
        side = self.sides[0]
        own = replace(side, patch=side.patch.moved(*_back(side.patch)))
        low, high = side.ends
        return np.clip(low + (high - low) * own.nearest(points), *self.u_range)


def _back(patch: Any) -> tuple[Array, Array]:
    """The motion that takes a patch to where its own frame is the root frame."""
    return patch.rotation.T, -patch.rotation.T @ patch.position


class Joined(NamedTuple):
    """What has to be known of joined pieces; see `Piecewise`."""

    placed: tuple[Patch, ...]
    signs: tuple[float, ...]
    seams: tuple[Seam, ...]
    gap: float
    side: Side

    @property
    def side_sign(self) -> float:
        """See `Surface.side_sign`."""
        return 1.0 if self.side == "outside" else -1.0


class Creases(NamedTuple):
    """What is known of the creases between pieces, from the tool's side."""

    edges: tuple[tuple[Edge, tuple[int, int]], ...]
    """Outer edges, each with its two pieces: those along which places of both pieces belong
    together evenly, as on planes, and on surfaces that are turned about one axis."""
    inner: frozenset[tuple[int, int]]
    """Pairs of pieces that meet in an inner one."""


def creases_of(surface: Joined) -> Creases:
    """The seams that are creases of one kind all along, in the root frame."""
    sides = sides_of(surface.placed, surface.gap)
    s = (np.arange(PARTS) + 0.5) / PARTS
    joined = {seam.pieces for seam in surface.seams}
    edges, inner = [], set()
    for contact in contacts(sides, [s] * len(sides), surface.gap):
        pair = sides[contact.side], sides[contact.other]
        pieces = pair[0].piece, pair[1].piece
        if pieces not in joined or len(contact.marks) < 2:
            continue
        bends = _bends(surface, pair, s[contact.marks], contact.there)
        if (bends < -SMOOTH).all():
            inner.add(pieces)
        elif (bends > SMOOTH).all():
            edge = _edge(surface, pair, s[contact.marks], contact.there)
            edges += [] if edge is None else [(edge, pieces)]
    return Creases(tuple(edges), frozenset(inner))


def _bends(surface: Joined, sides: tuple[Border, Border], here: Array, there: Array) -> Array:
    """(k,) rad, from one normal to the other at places of two borders; below 0 at inner creases."""
    one, other = (
        surface.signs[side.piece] * side.normal(s)
        for side, s in zip(sides, (here, there), strict=True)
    )
    inward = sides[0].patch.point(*sides[0].parameters(here, INWARD)) - sides[0].point(here)
    size = 2.0 * np.arcsin(np.clip(0.5 * np.linalg.norm(one - other, axis=1), 0.0, 1.0))
    return np.asarray(-surface.side_sign * np.sign((inward * other).sum(axis=1)) * size)


def _edge(surface: Joined, sides: tuple[Border, Border], here: Array, there: Array) -> Edge | None:
    """The edge between two borders, from shares of both that lie on each other."""
    one, other = sides
    order = np.argsort(here)
    low, high = one.ends
    u = low + here[order] * (high - low)
    start, stop = other.ends
    w = start + there[order] * (stop - start)
    if other.closed:
        w = np.unwrap(w, period=stop - start)
    rate = (w[-1] - w[0]) / (u[-1] - u[0])
    shift = w[0] - rate * u[0]
    if rate == 0.0:
        return None
    ends = (low, high)
    if not other.closed:
        ends = np.clip(np.sort((np.array([start, stop]) - shift) / rate), low, high).tolist()
    same = one.patch.rotation.T
    made = Edge(
        rotation=one.patch.rotation, position=one.patch.position, side=surface.side,
        u_range=(float(ends[0]), float(ends[1])), v_range=(0.0, 1.0), sides=sides,
        signs=(surface.signs[one.piece], surface.signs[other.piece]),
        shift=float(shift), rate=float(rate), turn=same @ other.patch.rotation,
    )  # fmt: skip
    apart = one.patch.point(*one.at(u)) - other.patch.point(*other.at(shift + rate * u))
    if np.linalg.norm(apart, axis=1).max() > 2.0 * surface.gap:
        return None
    low_corner = np.array([[made.u_range[0], 0.0]])
    try:  # bounds over it have to be known
        made.local_models(low_corner, np.array([[made.u_range[1], 1.0]]))
    except SurfaceError:
        return None
    return made
