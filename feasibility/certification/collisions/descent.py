"""A sheet or mesh of many triangles against one convex body, along all stretches at once.

Where no plane parts the body from all triangles, one may part it from each small part of them. So
couples of a stretch and a box of triangles (`trees`) are looked at together, as arrays: most are
far apart as balls; of the others, planes are tried (`plane_search`), and what is left is
tried again with the smaller boxes inside.
"""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array, Mask
from feasibility.certification.collisions.pieces import Piece
from feasibility.certification.collisions.plane_search import NEAR, Couples, ball_bounds, searched
from feasibility.certification.collisions.relative_motion import Stretches
from feasibility.certification.collisions.trees import BRANCHES, Level, TriangleTree

AT_ONCE = 1 << 13  # couples, which keeps the arrays small


class Descent:
    """The triangles of a body and another body."""

    def __init__(self, tree: TriangleTree, b: Piece, needed: float, aim: float) -> None:
        """Look for planes that part them by `aim` (m), or else by `needed`."""
        self.tree, self.b, self.needed, self.aim = tree, b, needed, aim
        self.bound = np.inf
        """m, lower bound of the distances of all that was certified."""

    def parted(self, s: Stretches) -> Couples:
        """Part stretches of the body from all triangles; the triangles and stretches left.

        These have less than `needed`, or less than `aim` where there seems to be more.
        """
        first = min(1, len(self.tree.levels) - 1)  # the largest boxes are hardly ever clear
        couples = _all(self.tree.levels[first], s)
        for level in self.tree.levels[first:-1]:
            couples, _ = self._searched(level, s, couples, (self.aim, self.aim))
            couples = self.keep(couples, couples.low >= self.aim)
            at = np.repeat(couples.at, 1 << BRANCHES)
            couples = Couples(at, self.tree.inside(couples.boxes), np.empty(len(at)))
        same = couples.at * len(self.tree.last) + self.tree.last[couples.boxes]
        return self.again(s, couples.of(np.unique(same, return_index=True)[1]))

    def again(self, s: Stretches, couples: Couples) -> Couples:
        """`parted` of some triangles and stretches."""
        between = (self.needed, self.aim)
        couples, most = self._searched(self.tree.levels[-1], s, couples, between)
        return self.keep(couples, couples.low >= np.clip(NEAR * most, self.needed, self.aim))

    def keep(self, couples: Couples, good: Mask) -> Couples:
        """Note the bounds of the good ones; the others."""
        self.bound = min(self.bound, float(np.min(couples.low[good], initial=np.inf)))
        return couples.of(~good)

    def _searched(
        self, level: Level, s: Stretches, couples: Couples, between: tuple[float, float]
    ) -> tuple[Couples, Array]:
        """The couples with bounds of their distances, and what limits these, see `searched`."""
        low, most = np.empty(len(couples.at)), np.empty(len(couples.at))
        for start in range(0, len(low), AT_ONCE):
            part = slice(start, start + AT_ONCE)
            low[part], most[part] = searched(level, self.b, s, couples.of(part), between)
        return Couples(couples.at, couples.boxes, low), most


def rough_bounds(tree: TriangleTree, b: Piece, s: Stretches) -> Array:
    """(k,) m, rough bounds of the distances of a body from all triangles along stretches.

    They say nothing of the inside, if these bound a solid.
    """
    level = tree.levels[min(1, len(tree.levels) - 1)]
    couples = _all(level, s)
    low, _ = ball_bounds(level, b, s, couples.at, couples.boxes)
    return np.asarray(low.reshape(len(s.row), -1).min(axis=1))


def _all(level: Level, s: Stretches) -> Couples:
    """Every box of a level with every stretch."""
    count = len(level.centres)
    at, boxes = np.divmod(np.arange(len(s.row) * count), count)
    return Couples(at, boxes, np.empty(len(at)))
