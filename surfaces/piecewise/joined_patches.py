"""JoinedPatches: several patches joined along their seams, as their cells know them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints
from surfaces.adjacency import components
from surfaces.part_growth import Boxes, grown
from surfaces.parts import MOST_PARTS, PartModels, SurfaceParts
from surfaces.patches.patch import Patch
from surfaces.piecewise.closest_on_pieces import PieceClosestPoints, nearest_places
from surfaces.piecewise.seams import Seam
from surfaces.surface import ClosestPoint, Surface, points_of

if TYPE_CHECKING:
    from surfaces.piecewise.edges import Creases


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
            return PartModels(*(np.concatenate(each)[back] for each in zip(*models, strict=True)))

        low, high = (np.concatenate(ends) for ends in zip(*roots, strict=True))
        return grown(Boxes(bounds, np.arange(len(low)), low, high), flat, straight, most)

    def __repr__(self) -> str:
        """One line."""
        kinds = ", ".join(piece.kind for piece in self.pieces)
        return f"piecewise({kinds}, side={self.side!r}, position={self.position.tolist()})"
