"""JoinedPatches: several patches joined along their seams, and the points closest to others."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints, Mask
from surfaces.adjacency import components
from surfaces.part_growth import Boxes, grown
from surfaces.parts import MOST_PARTS, PartModels, SurfaceParts
from surfaces.patches.patch import Patch
from surfaces.piecewise.seams import Seam
from surfaces.surface import ClosestPoint, Surface, points_of

if TYPE_CHECKING:
    from surfaces.piecewise.edges import Creases


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


CREASE = math.radians(2.0)  # seams that bend by more are reported


@dataclass(frozen=True, eq=False, repr=False)
class JoinedPatches(Surface):
    """Patches joined along seams; outward is that of the first piece of each joined group."""

    kind: ClassVar[str] = "piecewise"

    pieces: tuple[Patch, ...]
    """In the own frame of the joined surface. Their own `side` is not used."""
    turned: tuple[bool, ...]
    """Whether each piece's own normal is turned over."""
    gap: float
    """m, how far apart two borders may be that are one seam."""
    seams: tuple[Seam, ...]

    @property
    def notes(self) -> tuple[str, ...]:
        """Pieces turned over, creases, and pieces that touch nothing."""
        words = [
            f"pieces[{k}] (a {self.pieces[k].kind}) is turned over, so that its outward side "
            "continues that of the pieces it is joined to."
            for k in np.flatnonzero(self.turned)
        ]
        creases: dict[tuple[int, int], float] = {}
        for seam in self.seams:
            creases[seam.pieces] = max(creases.get(seam.pieces, 0.0), seam.crease)
        words += [
            f"pieces[{a}] and pieces[{b}] meet at a crease of up to {math.degrees(angle):.3g} "
            "degrees; motions across it cannot be certified where it is sharper than tolerance "
            "and cone allow."
            for (a, b), angle in creases.items()
            if angle > CREASE and (a, b) not in {pieces for _, pieces in self.creases.edges}
        ]
        words += [f"pieces[{k}]: {note}" for k, one in enumerate(self.pieces) for note in one.notes]
        groups = self.groups
        if len(groups) > 1:
            lists = "; ".join(", ".join(map(str, group)) for group in groups)
            words.append(
                f"The pieces make {len(groups)} surfaces that touch nowhere ({lists}), so no "
                f"motion along the surface joins them. Borders count as joined within "
                f"{1e3 * self.gap:.3g} mm; if they should be, move the pieces together, or widen "
                "gap."
            )
        return tuple(words)

    @property
    def deviations(self) -> tuple[float, float]:
        """See `Surface.deviations`: the largest of the pieces."""
        points, normals = zip(*(piece.deviations for piece in self.pieces), strict=True)
        return max(points), max(normals)

    @property
    def groups(self) -> tuple[tuple[int, ...], ...]:
        """The connected pieces, each group in order."""
        pairs = np.array([seam.pieces for seam in self.seams], dtype=np.int64).reshape(-1, 2)
        group = components(pairs, len(self.pieces))
        return tuple(tuple(np.flatnonzero(group == g).tolist()) for g in range(group.max() + 1))

    @cached_property
    def placed(self) -> tuple[Patch, ...]:
        """The pieces in the root frame."""
        return tuple(piece.moved(self.rotation, self.position) for piece in self.pieces)

    @cached_property
    def signs(self) -> tuple[float, ...]:
        """+1.0 where a piece's own normal is outward, -1.0 where it is turned over."""
        return tuple(-1.0 if turned else 1.0 for turned in self.turned)

    @cached_property
    def creases(self) -> Creases:
        """Where pieces meet at an angle: outer edges, and pairs that meet in an inner crease."""
        from surfaces.piecewise.edges import Joined, creases_of

        return creases_of(Joined(self.placed, self.signs, self.seams, self.gap, self.side))

    @cached_property
    def charts(self) -> tuple[tuple[Patch, float], ...]:
        """Each piece and each edge in the root frame, -1.0 where its normal is turned over."""
        pieces = zip(self.placed, self.signs, strict=True)
        return (*pieces, *((edge, 1.0) for edge, _ in self.creases.edges))

    def nearest(self, points: ArrayLike, pieces: Sequence[int] | None = None) -> PieceClosestPoints:
        """The nearest places of some pieces (all if None) to points (k, 3) m, in the root frame."""
        some = range(len(self.pieces)) if pieces is None else pieces
        found = nearest_places(
            [self.placed[k] for k in some], [self.signs[k] for k in some],
            points_of(points).reshape(-1, 3), self.gap,
        )  # fmt: skip
        return found._replace(piece=np.asarray(some, dtype=np.int64)[found.piece])

    def closest(self, points: ArrayLike) -> ClosestPoint:
        """The points of the closest piece to `points` (..., 3) m; see `ClosestPoint`.

        u and v are NaN: each piece has its own. Over the outer side of a crease the closest point
        lies on the seam, and `height` is the distance. Beyond a free border `height` is
        the part of the distance along the normal there, and `inside` is False.
        """
        points = points_of(points)
        found = self.nearest(points)
        nowhere = np.full((len(found.height), 2), np.nan)
        values = np.column_stack([nowhere, found.height, found.normals])
        return ClosestPoint.of_rows(points.shape[:-1], values, found.inside)

    def parts(self, flat: float, straight: float, most: int = MOST_PARTS) -> SurfaceParts:
        """See `Surface.parts`: those of all pieces, their normals turned over where theirs are.

        And those of all edges: a tool that goes round one is where no piece has its normal.
        """
        roots = [patch.part_roots for patch, _ in self.charts]
        owner = np.repeat(np.arange(len(roots)), [len(low) for low, _ in roots])

        def bounds(root: Ints, low: Array, high: Array) -> PartModels:
            some = [np.flatnonzero(owner[root] == k) for k in range(len(roots))]
            models = [
                patch.placed_models(low[rows], high[rows], sign)[0]
                for (patch, sign), rows in zip(self.charts, some, strict=True)
                if len(rows)
            ]
            back = np.argsort(np.concatenate(some), kind="stable")
            return PartModels.join(*models).of(back)

        low, high = (np.concatenate(ends) for ends in zip(*roots, strict=True))
        return grown(Boxes(bounds, np.arange(len(low)), low, high), flat, straight, most)

    def __repr__(self) -> str:
        """One line."""
        kinds = ", ".join(piece.kind for piece in self.pieces)
        return f"piecewise({kinds}, side={self.side!r}, position={self.position.tolist()})"
