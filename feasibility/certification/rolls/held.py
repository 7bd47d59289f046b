"""How a task wants the tool held over places of a surface: approach and reference direction.

Along a straight piece of a path of places let b differ from a straight line by at most
s (1 - s) / 2 times D_b, and turn by at most beta = |db| + D_b / 2 in all. The reference e is fixed,
or the u direction, of slope L_e at most (`OffsetSurface.tangent_slopes`). Its part square to b has
the length h, at least that at the ends less (beta + L_e) / 2, so

    |t'| <= L_t = (beta + L_e) / h

and a curve of that slope differs from a straight line by at most 2 s (1 - s) L_t: D_t = 4 L_t. Of
second order, with e fixed and b smooth, |b''| <= D_b: there g = e - (e . b) b has |g'| <= beta and
|g''| <= 2 D_b + 2 beta^2. The product u = b x t has D_u = D_b + D_t + 2 |db| |dt|.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from coverable_arrays import Array
from feasibility.certification.rolls.bounds import (
    ROOT,
    largest_off,
    off_middle,
    products_of_changes,
    roll_vectors,
    vectors_of,
)
from feasibility.roll import Roll, projected
from feasibility.task import Task
from surfaces import Cells
from surfaces.places import OffsetSurface, PlacePaths, Places, second_derivative_of_unit

FIRST, LAST = 0, 2  # pieces of a path; in the middle one the place changes sides, on the spot


class ToolAxes(NamedTuple):
    """Approach and reference axis of k configurations."""

    axes: Array
    """(k, 3)"""
    x: Array
    """(k, 3)"""


class ReferencesAlong(NamedTuple):
    """Reference directions along k paths of places."""

    t: Array
    """(k, 4, 3) at the four places."""
    second_t: Array
    """(k, 3) D_t of the pieces."""
    second_u: Array
    """(k, 3) D_u."""


@dataclass(frozen=True, eq=False, slots=True)
class Held:
    """Approach and reference directions over the places of one surface."""

    offset: OffsetSurface
    sign: float
    """The approach is this times the outward normal, unless it is fixed."""
    approach: Array | None
    """(3,) where it is one direction."""
    reference: Array | None
    """(3,) where it is one direction; else the u direction."""
    roll: Roll | None
    """None where it is free."""
    smooth: bool
    """Whether normals are differentiable twice along the pieces of paths."""

    @staticmethod
    def of(task: Task, cells: Cells, offset: OffsetSurface) -> Held:
        """What `task` wants over the surface of `cells`, or that under them, by its `offset`."""
        wall = cells.surface.wall
        return Held(
            offset,
            -cells.surface.side_sign,
            task.fixed_approach(cells),
            task.fixed_reference(cells),
            task.roll,
            wall is None or wall.mean_edge_length == 0.0,
        )

    def approaches(self, normals: Array) -> Array:
        """Approach directions (..., 3) where the surface has these normals."""
        if self.approach is None:
            return self.sign * normals
        return np.where(np.isnan(normals), np.nan, self.approach)

    def second_derivatives(self, path: PlacePaths) -> Array:
        """(k, 3) D_b of the pieces of paths."""
        bounds = path.derivative_bounds[..., 1]
        return bounds if self.approach is None else np.zeros_like(bounds)

    def _references(self, places: Places, approaches: Array) -> tuple[Array, Array]:
        """t (k, 3) and h (k,) at places."""
        if self.reference is None:
            return projected(self.offset.tangents(places), approaches)
        return projected(np.broadcast_to(self.reference, approaches.shape), approaches)

    def rolls(self, x: Array, axes: Array, approaches: Array, places: Places) -> Array:
        """(k,) rad, how far rolls are off the middle of their range; 0 where it is free.

        Args:
            x, axes: (k, 3) of the tool.
            approaches: (k, 3) at the places.
            places: k of them.
        """
        if self.roll is None:
            return np.zeros(len(x))
        references, _ = self._references(places, approaches)
        return off_middle(roll_vectors(x, axes, references, approaches, self.roll))

    def rolls_between(
        self, start: ToolAxes, end: ToolAxes, second: Array, path: PlacePaths, approaches: Array
    ) -> Array:
        """(k,) rad, bounds on that along stretches; inf where the roll may leave its range.

        Args:
            start, end: the tool at both ends.
            second: (k,) D_x + D_y along the stretch.
            path: of places.
            approaches: (k, 4, 3) at its four places.
        """
        count = len(second)
        if self.roll is None:
            return np.zeros(count)
        references, second_t, second_u = self.references_along(path, approaches)
        share = path.share[..., None]
        ends = (start.x, end.x), (np.cross(start.axes, start.x), np.cross(end.axes, end.x))
        x, y = ((1.0 - share) * one[:, None] + share * other[:, None] for one, other in ends)
        z = vectors_of(x, y, references, np.cross(approaches, references), self.roll)
        unknown = 0.5 * path.share * (1.0 - path.share) * second[:, None]
        dt, du = np.diff(references, axis=1), np.diff(np.cross(approaches, references), axis=1)
        width = np.diff(path.share, axis=1)
        with np.errstate(invalid="ignore"):  # inf * 0 is NaN, and refused
            most = width**2 * second[:, None] + ROOT * (second_t + second_u)
            most += products_of_changes(np.diff(x, axis=1), np.diff(y, axis=1), dt, du)
        most[:, 1] = 0.0  # on the spot: right on both sides is enough
        found = [
            largest_off(z[:, k], z[:, k + 1], most[:, k], unknown[:, k : k + 2], self.roll.half)
            for k in range(3)
        ]
        return np.asarray(np.max(found, axis=0))

    def references_along(self, path: PlacePaths, approaches: Array) -> ReferencesAlong:
        """t at the places of paths, and how much t and u bend along their pieces.

        Args:
            path: of places.
            approaches: (k, 4, 3) at its four places.
        """
        known = [self._references(path.place(k), approaches[:, k]) for k in range(4)]
        references = np.stack([t for t, _ in known], axis=1)
        sines = np.stack([h for _, h in known], axis=1)
        db, dt = np.diff(approaches, axis=1), np.diff(references, axis=1)
        second_t = self._second_of_references(path, db, sines)
        with np.errstate(invalid="ignore"):  # inf * 0 is NaN, and refused
            second_u = self.second_derivatives(path) + second_t
            second_u += 2.0 * np.linalg.norm(db, axis=2) * np.linalg.norm(dt, axis=2)
        return ReferencesAlong(references, second_t, second_u)

    def _second_of_references(self, path: PlacePaths, db: Array, sines: Array) -> Array:
        """(k, 3) D_t of the pieces; 0 where the place changes sides on the spot."""
        second_b = self.second_derivatives(path)
        beta = np.linalg.norm(db, axis=2) + 0.5 * second_b
        own = np.zeros_like(beta)
        for piece in (FIRST, LAST) if self.reference is None else ():
            own[:, piece] = self.offset.tangent_slopes(path.place(piece), path.place(piece + 1))
        with np.errstate(invalid="ignore"):
            least = np.minimum(sines[:, :-1], sines[:, 1:]) - 0.5 * (beta + own)
            known = least > 0.0
            first = np.divide(beta + own, least, out=np.full_like(beta, np.inf), where=known)
            second = 4.0 * first
            if self.reference is not None and self.smooth:
                smooth = second_derivative_of_unit(least, beta, 2.0 * second_b + 2.0 * beta**2)
                second = np.minimum(second, smooth)
        second[:, 1] = 0.0
        return np.asarray(np.where(np.isnan(second), np.inf, second))
