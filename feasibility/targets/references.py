"""The reference direction that roll is measured from, before its part square to b is taken.

One direction all over the surface, or the direction in which u grows; between poses, whose tangents
are known at the poses alone, directions in between, along the arc from one tangent to the next.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from coverable.errors import ArgumentError, Fault
from feasibility.roll import ALONG, projected
from feasibility.task import Task
from surfaces.cells import Cells
from surfaces.patches.patch import Patch
from surfaces.surface import Surface


class OnPatch(NamedTuple):
    """Places on one patch."""

    rows: Ints
    """(k,) which of the given points."""
    patch: Patch
    u: Array
    """(k,)"""
    v: Array
    """(k,)"""


def on_patches(surface: Surface, points: Array) -> Iterator[OnPatch]:
    """The places of a patch, or of several, that are closest to points (k, 3) m."""
    from surfaces.piecewise.piecewise_surface import Piecewise

    if isinstance(surface, Patch):
        found = surface.closest(points)
        yield OnPatch(np.arange(len(points)), surface, found.u, found.v)
    elif isinstance(surface, Piecewise):
        nearest = surface.nearest(points)
        for k, patch in enumerate(surface.placed):
            rows = np.flatnonzero(nearest.piece == k)
            yield OnPatch(rows, patch, nearest.u[rows], nearest.v[rows])


def u_directions(surface: Surface, points: Array) -> Array | None:
    """(k, 3) unit, in which u grows under points (k, 3) m; None where there is no u."""
    from surfaces.piecewise.piecewise_surface import Piecewise

    one = isinstance(surface, Patch)
    if not one and not isinstance(surface, Piecewise):
        return None
    directions = np.full(points.shape, np.nan)
    for rows, patch, u, v in on_patches(surface, points):
        directions[rows] = patch.tangent(u, v)
    return directions


def reference_directions(cells: Cells, task: Task, curves: Ints, t: Array) -> Array:
    """(k, 3) unit, at t (k,) of some curves (k,)."""
    fixed = task.fixed_reference(cells)
    if fixed is not None:
        return np.broadcast_to(fixed, (len(t), 3))
    points, _ = cells.curves.at(curves, t)
    found = u_directions(cells.surface, points)
    if found is not None:
        return found
    from surfaces.toolpaths.arcs import arc_at

    ends = _tangents(cells)[cells.pairs[curves]]
    return arc_at(ends[:, 0], ends[:, 1], t)[0]


def _tangents(cells: Cells) -> Array:
    return np.full((len(cells), 3), np.nan) if cells.tangents is None else cells.tangents


def check_references(cells: Cells, task: Task) -> None:
    """Refuse a reference that shows no direction at some cell.

    Raises:
        ArgumentError: the roll is limited, and there is no reference, or it runs along the approach
            direction to within 1 degree; the cells are named.
    """
    if task.roll is None:
        return
    approaches = task.targets(cells).approaches
    fixed = task.fixed_reference(cells)
    directions = _tangents(cells) if fixed is None else np.broadcast_to(fixed, approaches.shape)
    _, sine = projected(directions, approaches)
    wrong = np.flatnonzero(~(sine >= ALONG))
    if not len(wrong):
        return
    where = f"cell{'s' if len(wrong) > 1 else ''} {cells.named(wrong, 3)}"
    what = "the u direction" if fixed is None else "the direction"
    raise ArgumentError(
        Fault(
            "roll_reference",
            f"{what} is along the approach direction at {where}, where it shows no roll",
            expected="give one that is along the surface there, or cut these cells off",
        ),
        "task",
    )
