"""How a task wants the tool held where its roll is limited: its reference direction.

Along a straight piece of a path of places b differs from a straight line by at most d_b
(`PlacePaths`). The reference e is fixed, or the u direction, which differs from a straight line by
a known amount, too (`OffsetSurface.tangent_deviations`). What that says of t, `reference_parts`
knows, as over boxes: t is within a radius r_t of a straight line, and within d_t = 2 r_t of that
between its ends. The product u = b x t has D_u = 2 |db| |dt|, and d_u = d_b + d_t on top.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array
from feasibility.certification.roll_bounds import (
    ROOT,
    largest_off,
    off_middle,
    products_of_changes,
    roll_vectors,
    vectors_of,
)
from feasibility.certification.roll_box_models import Directions, reference_parts
from feasibility.certification.tool_directions import Held
from feasibility.roll import Roll, projected
from surfaces.places.places import OffsetSurface, PlacePaths, Places

FIRST, LAST = 0, 2  # pieces of a path; in the middle one the place changes sides, on the spot


class ReferencesAlong(NamedTuple):
    """Reference directions along k paths of places."""

    t: Array
    """(k, 4, 3) at the four places."""
    second_u: Array
    """(k, 3) D_u of the pieces."""
    beside: Array
    """(k, 3) d_t + d_u."""


@dataclass(frozen=True, eq=False, slots=True)
class HeldRoll:
    """Reference directions over the places of one surface, and the range of the roll."""

    held: Held
    offset: OffsetSurface
    reference: Array | None
    """(3,) where it is one direction; else the u direction."""
    roll: Roll
    """Its range."""

    def _references(self, places: Places, approaches: Array) -> tuple[Array, Array]:
        """t (k, 3) and h (k,) at places."""
        if self.reference is None:
            return projected(self.offset.tangents(places), approaches)
        return projected(np.broadcast_to(self.reference, approaches.shape), approaches)

    def rolls(self, x: Array, axes: Array, approaches: Array, places: Places) -> Array:
        """(k,) rad, how far rolls are off the middle of their range.

        Args:
            x, axes: (k, 3) of the tool.
            approaches: (k, 3) at the places.
            places: k of them.
        """
        references, _ = self._references(places, approaches)
        return off_middle(roll_vectors(x, axes, references, approaches, self.roll))

    def rolls_between(
        self,
        x: tuple[Array, Array],
        axes: tuple[Array, Array],
        second: Array,
        path: PlacePaths,
        approaches: Array,
    ) -> Array:
        """(k,) rad, bounds on that along stretches; inf where the roll may leave its range.

        Args:
            x, axes: (k, 3) of the tool at both ends.
            second: (k,) D_x + D_y along the stretch.
            path: of places.
            approaches: (k, 4, 3) at its four places.
        """
        references, second_u, beside = self.references_along(path, approaches)
        share = path.share[..., None]
        ends = x, tuple(map(np.cross, axes, x))
        xs, ys = ((1.0 - share) * one[:, None] + share * other[:, None] for one, other in ends)
        z = vectors_of(xs, ys, references, np.cross(approaches, references), self.roll)
        unknown = 0.5 * path.share * (1.0 - path.share) * second[:, None]
        dt, du = np.diff(references, axis=1), np.diff(np.cross(approaches, references), axis=1)
        width = np.diff(path.share, axis=1)
        with np.errstate(invalid="ignore"):  # inf * 0 is NaN, and refused
            most = width**2 * second[:, None] + ROOT * second_u
            most += products_of_changes(np.diff(xs, axis=1), np.diff(ys, axis=1), dt, du)
        most[:, 1] = 0.0  # on the spot: right on both sides is enough
        found = []
        for k in range(3):
            less = unknown[:, k : k + 2] + ROOT * beside[:, k, None]
            found.append(largest_off(z[:, k], z[:, k + 1], most[:, k], less, self.roll.half))
        return np.asarray(np.max(found, axis=0))

    def references_along(self, path: PlacePaths, approaches: Array) -> ReferencesAlong:
        """t at the places of paths, and how much t and u bend along their pieces.

        Args:
            path: of places.
            approaches: (k, 4, 3) at its four places.
        """
        ends = [self._references(path.place(k), approaches[:, k])[0] for k in range(4)]
        references = np.stack(ends, axis=1)
        d_b = self.held.deviations(path)
        db, dt = (np.linalg.norm(np.diff(a, axis=1), axis=2) for a in (approaches, references))
        beside = np.zeros_like(d_b)
        for piece in (FIRST, LAST):
            two = approaches[:, piece : piece + 2]
            d_t = 2.0 * self._along_piece(path, piece, two, d_b[:, piece]).radius
            beside[:, piece] = 2.0 * d_t + d_b[:, piece]
        with np.errstate(invalid="ignore"):  # inf * 0 is NaN, and refused
            return ReferencesAlong(references, 2.0 * db * dt, beside)

    def _along_piece(
        self, path: PlacePaths, piece: int, approaches: Array, beside: Array
    ) -> Directions:
        """t along one piece of paths, from b at its two ends (k, 2, 3) and d_b (k,)."""
        b = Directions.between(approaches[:, 0], approaches[:, 1], beside)
        if self.reference is not None:
            return reference_parts(b, Directions.fixed(self.reference, len(beside)))
        start, end = path.place(piece), path.place(piece + 1)
        ends = self.offset.tangents(start), self.offset.tangents(end)
        e = Directions.between(*ends, 0.5 * self.offset.tangent_deviations(start, end))
        return reference_parts(b, e, self.held.approach is None and self.offset.square)
