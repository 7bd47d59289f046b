"""Where a path in some order begins, so that it revisits least.

Rows may be followed from any corner of a grid, and where the surface closes on itself from any row.
An arm whose joint has to turn with the surface cannot always go on over its seam: where a path gets
stuck is where it had better begin.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from feasibility.paths.ladder import JointRoute, joint_route
from feasibility.paths.motion_graph import MotionGraph
from feasibility.paths.order import GRID_ORDERS, Order, PathError, closed_sides, grid_order, route
from surfaces import Cells

MOST_CELLS = 6000  # cells that are passed in all attempts together, so that large grids end too
MOST_TRIED = 24  # attempts at one order
FLIPS = ((False, False), (True, True), (True, False), (False, True))  # corners to begin at


def least_revisiting(
    graph: MotionGraph, cells: Cells, order: Order, needed: NDArray[np.bool_]
) -> JointRoute:
    """The motion over cells in an order that revisits least, of those that are tried.

    Args:
        graph: the known motions.
        cells: the cells.
        order: one of `ORDERS`.
        needed: (N,) cells to visit.

    Raises:
        PathError: no such order, or no motion leads from cell to cell.
    """
    attempts = _Attempts(graph, cells, needed)
    if order != "shortest":
        route(cells, order, needed)  # it refuses orders that these cells do not have
        attempts.along_grid(order)
        return attempts.best()
    attempts.along(route(cells, order, needed, graph.joined_cells()))
    if attempts.left() and len(cells.shape) == 2:
        for grid in GRID_ORDERS:
            attempts.along_grid(grid)
    return attempts.best()


@dataclass
class _Attempts:
    """Motions that have been tried, of which the best is kept."""

    graph: MotionGraph
    cells: Cells
    needed: NDArray[np.bool_]
    found: JointRoute | None = None
    fault: PathError | None = None

    def best(self) -> JointRoute:
        """The motion that revisits least."""
        if self.found is None:
            raise self.fault or PathError("there are no cells to cover")
        return self.found

    def left(self) -> bool:
        """Is there anything to gain?"""
        return self.found is None or self.found.revisited > 0.0

    def along(self, visits: NDArray[np.int64]) -> list[int]:
        """Try an order; the cells at which it got stuck."""
        for wind in (True, False):
            most = math.inf if self.found is None else self.found.revisited
            try:
                found = joint_route(
                    self.graph.copy(), self.cells, visits, wind=wind, most_revisited=most
                )
            except PathError as error:
                self.fault = self.fault or error
                continue
            if self.found is None or _key(found) < _key(self.found):
                self.found = found
            return found.stuck
        return []

    def along_grid(self, order: Order) -> None:
        """Try an order of a grid from its corners, and from where the best one got stuck."""
        rows, columns = int(self.cells.shape[0]), int(self.cells.shape[1])
        close = closed_sides(self.cells)
        left = max(1, min(MOST_TRIED, MOST_CELLS // max(1, int(self.needed.sum()))))
        begins = [(0, 0)]
        for begin in begins:  # grows
            for flipped in FLIPS:
                if left <= 0:
                    return
                left -= 1
                visits = grid_order(order, rows, columns, begin, flipped)
                stuck = self.along(visits[self.needed[visits]])
                if not self.left():
                    return
                for cell in stuck:
                    row, column = divmod(cell, columns)
                    new = (row if close[0] else 0, column if close[1] else 0)
                    if new not in begins:
                        begins.append(new)


def _key(found: JointRoute) -> tuple[float, float]:
    """What is less is better."""
    return round(found.revisited, 9), found.travel
