"""PoseSurface: poses in place of a surface, with nothing known between them but their curves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints, Mask
from surfaces.parts import MOST_PARTS, SurfaceParts
from surfaces.surface import ClosestPoint, Surface, SurfaceError, points_of
from surfaces.toolpaths.arcs import curve_parts

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


@dataclass(frozen=True, eq=False, repr=False)
class PoseSurface(Surface):
    """N poses: points with outward normals, perhaps with tool axes and tangents of their own.

    There is no surface between them: no closest points but the poses' own planes, bounds on their
    curves alone, and no sheet that an arm could collide with.
    """

    kind: ClassVar[str] = "poses"

    points: Array
    """(N, 3) m, in the own frame."""
    outward: Array
    """(N, 3) unit normals, in the own frame."""
    axes: Array | None
    """(N, 3) unit tool axes, in the own frame; None where they follow from the normals."""
    along: Array | None
    """(N, 3) unit tangents, in the own frame; None where there are none."""
    pairs: Ints
    """(M, 2) i < j, sorted: between which poses the tool may move."""
    in_order: bool
    """Whether they are a toolpath, to be run from the first to the last."""
    under: Surface | None = None
    """The surface that they lie over, if it is known."""
    working: Mask | None = None
    """(N,) at which poses the tool works on that surface, neither lifted nor beyond its border.
    None where that is not known."""

    @property
    def followed(self) -> Mask:
        """(M,) between which pairs a motion has to be right over the surface under them, too."""
        if self.under is None or self.working is None:
            return np.zeros(len(self.pairs), dtype=bool)
        return np.asarray(self.working[self.pairs].all(axis=1))

    def works(self, marks: Ints) -> Mask:
        """(m,) at which rows of a motion the tool works, by the poses that rows are marked with.

        Args:
            marks: (m,) indices of poses, -1 in between; all of it works where nothing is known.
        """
        at = np.flatnonzero(marks >= 0)
        if self.working is None or not len(at):
            return np.ones(len(marks), dtype=bool)
        row, last, on = np.arange(len(marks)), len(at) - 1, self.working[marks[at]]
        before = np.clip(np.searchsorted(at, row, side="right") - 1, 0, last)
        after = np.clip(np.searchsorted(at, row), 0, last)
        return np.asarray(on[before] & on[after])

    @property
    def wall(self) -> Surface | None:
        """See `Surface.wall`."""
        return self.under

    def moved(self, rotation: ArrayLike, translation: ArrayLike) -> Self:
        """See `Surface.moved`."""
        found = super().moved(rotation, translation)
        under = None if self.under is None else self.under.moved(rotation, translation)
        return replace(found, under=under)

    @property
    def bare(self) -> bool:
        """See `Surface.bare`."""
        return True

    @property
    def notes(self) -> tuple[str, ...]:
        """What is not looked at; and how a toolpath is run."""
        runs = (
            "The poses are run in their order, from the first to the last and never back; the arm "
            "may change its posture in place, over a pose."
        )
        between = "Between poses the tool point runs straight and its direction along the great arc"
        if self.under is None:
            between += "; there is no surface between them that anything could be checked against"
        return (f"{between}.", *([runs] if self.in_order else []))

    @cached_property
    def placed_points(self) -> Array:
        """(N, 3) m, in the root frame."""
        return self.points @ self.rotation.T + self.position

    @cached_property
    def tree(self) -> cKDTree:
        """The poses' points in the root frame, for neighbours."""
        from scipy.spatial import cKDTree

        return cKDTree(self.placed_points)

    def turned(self, directions: Array) -> Array:
        """Directions (N, 3) of the own frame in the root frame."""
        return directions @ self.rotation.T

    def closest(self, points: ArrayLike) -> ClosestPoint:
        """Where `points` (..., 3) m are over the planes of the poses nearest to them."""
        points = points_of(points)
        flat = points.reshape(-1, 3)
        values = np.full((len(flat), 6), np.nan)
        known = np.asarray(np.isfinite(flat).all(axis=1), dtype=np.bool_)
        nearest = self.tree.query(flat[known])[1]
        normals = self.turned(self.outward)[nearest]
        values[known, 2] = ((flat[known] - self.placed_points[nearest]) * normals).sum(axis=1)
        values[known, 3:] = normals
        return ClosestPoint.of_rows(points.shape[:-1], values, known)

    def parts(self, flat: float, straight: float, most: int = MOST_PARTS) -> SurfaceParts:
        """See `Surface.parts`: those of the curves between poses.

        Raises:
            SurfaceError: there are no curves or more than `most`, or the tool axes are given apart
                from the normals.
        """
        if self.axes is not None:
            raise SurfaceError("poses with tool axes of their own have no bounds", self.kind)
        if not 0 < len(self.pairs) <= most:
            what = f"there are {len(self.pairs):,} curves; bounds are made for 1 to {most:,}"
            raise SurfaceError(what, self.kind)
        normals = self.turned(self.outward)
        return curve_parts(self.placed_points, normals, self.pairs, flat, straight, most)

    def __repr__(self) -> str:
        """One line."""
        what = "in order" if self.in_order else f"{len(self.pairs)} pairs"
        at = f"side={self.side!r}, position={self.position.tolist()}"
        return f"poses({len(self.points)}, {what}, {at})"
