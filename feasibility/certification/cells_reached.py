"""Which cells a motion reaches: where its tool is at their centres, and held as it has to be.

A cell counts as reached by one exact configuration of the motion, so no bound is needed. Cells that
no sample reaches are looked for between samples, where the tool passes nearest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.stretches import Judge, Samples, beyond, configurations
from feasibility.task import Targets, Task
from surfaces.cells import Cells

TRIES = np.linspace(0.0, 1.0, 9)  # of the part of a stretch that passes within the tolerance
NAMED = 5  # cells that are listed


@dataclass(frozen=True, eq=False, slots=True)
class Reached:
    """The N cells, and for each that is reached one configuration that does."""

    row: Ints
    """(N,) the row of the motion, or the row before; -1 where none is known."""
    chord: Array
    """(N,) |a - b| there, b the approach direction of the cell's centre; inf where none is."""
    roll: Array
    """(N,) rad, how far the roll is off the middle of its range there; 0 where it is free."""

    @staticmethod
    def none(count: int) -> Reached:
        """Of so many cells none is reached."""
        return Reached(np.full(count, -1, dtype=np.int64), np.full(count, np.inf), np.zeros(count))

    @property
    def cells(self) -> Mask:
        """(N,) which of them are."""
        return self.row >= 0

    def add(
        self, task: Task, aims: Targets, cell: Ints, row: Ints, points: Array, axes: Array, x: Array
    ) -> None:
        """Keep what holds a cell's tool best, of configurations (k,) as `at_targets` takes them."""
        chord, roll = at_targets(task, aims, cell, points, axes, x)
        order = np.argsort(-chord, kind="stable")  # of several over one cell the last is kept
        best = order[chord[order] < self.chord[cell[order]]]
        self.row[cell[best]], self.chord[cell[best]] = row[best], chord[best]
        self.roll[cell[best]] = roll[best]


def cells_reached(judge: Judge, task: Task, samples: Samples) -> Reached:
    """Which cells a motion reaches, of which `judge` knows the surface.

    The task's tolerance and cone are used exactly. The samples are of the motion, as it passes
    them, all rows among them; those that are marked are looked at first.
    """
    cells, marks = judge.cells, judge.marks
    reached = Reached.none(len(cells))
    if not len(cells) or not len(samples.row):
        return reached
    aims, tolerance = task.targets(cells), task.effective_tolerance
    if marks is not None:
        at = samples.of((samples.share == 0.0) & (marks[samples.row] >= 0))
        reached.add(task, aims, marks[at.row], at.row, at.points, at.axes, at.x)
        if reached.cells.all():
            return reached
    from scipy.spatial import cKDTree  # takes a while to load

    tree = cKDTree(samples.points)
    cell, sample = _flat(tree.query_ball_point(aims.points, tolerance))
    at = samples.of(sample)
    reached.add(task, aims, cell, at.row, at.points, at.axes, at.x)
    left = np.flatnonzero(~reached.cells)
    starts, ends = samples.points[:-1], samples.points[1:]
    if not len(left) or not len(starts):
        return reached
    half = 0.5 * np.linalg.norm(ends - starts, axis=1)
    tree = cKDTree(0.5 * (starts + ends))
    # Of stretches much longer than others there are few; a tool may bend off its chord a little.
    some, piece = _flat(tree.query_ball_point(aims.points[left], 2.0 * tolerance + half.max()))
    some = left[some]
    low, high = _passing(aims.points[some], starts[piece], ends[piece], 2.0 * tolerance)
    passes = low < high
    some, piece, low, high = some[passes], piece[passes], low[passes], high[passes]
    t = low[:, None] + TRIES * (high - low)[:, None]
    row = samples.row[piece]
    stop = np.where(samples.row[piece + 1] > row, 1.0, samples.share[piece + 1])
    share = samples.share[piece][:, None] + t * (stop - samples.share[piece])[:, None]
    cell, row = np.repeat([some, row], len(TRIES), axis=1)
    q = configurations(judge.rows, row, share.ravel())
    reached.add(task, aims, cell, row, *judge.kinematics.held(q))
    return reached


def _flat(lists: NDArray[np.object_]) -> tuple[Ints, Ints]:
    """Which list, and what in it, of all entries of all lists."""
    counts = [len(found) for found in lists]
    owner = np.repeat(np.arange(len(lists)), counts)
    return owner, np.array([k for found in lists for k in found], dtype=np.int64)


def at_targets(
    task: Task, aims: Targets, cell: Ints, points: Array, axes: Array, x: Array
) -> tuple[Array, Array]:
    """|a - b| and the roll (k,) of tools over cells: inf where one is not as it has to be there.

    That is within the tolerance of the target of its cell (k,) out of all, and the cone and the
    range of the roll, exactly. Of tools points (m), approach axes and reference axes (k, 3) count.
    """
    off = np.linalg.norm(points - aims.points[cell], axis=1)
    approaches = aims.approaches[cell]
    chord = np.linalg.norm(axes - approaches, axis=1)
    roll = np.zeros(len(cell))
    if task.roll is not None and aims.references is not None:
        from feasibility.certification.roll_held import off_middle, roll_vectors

        roll = off_middle(roll_vectors(x, axes, aims.references[cell], approaches, task.roll))
    inside = (beyond(task, off, chord, roll) <= 0.0).all(axis=0)
    return np.where(inside, chord, np.inf), roll


def _passing(aims: Array, starts: Array, ends: Array, within: float) -> tuple[Array, Array]:
    """(k,) from where to where on lines, 0..1, they are near (within, m); low = high: never."""
    along, off = ends - starts, starts - aims
    square = np.maximum((along**2).sum(axis=1), 1e-300)
    nearest = -(along * off).sum(axis=1) / square
    rest = within**2 - ((off + nearest[:, None] * along) ** 2).sum(axis=1)
    reach = np.sqrt(np.maximum(rest, 0.0) / square)
    return np.clip(nearest - reach, 0.0, 1.0), np.clip(nearest + reach, 0.0, 1.0)


def missed_text(cells: Cells, task: Task, missed: Ints, samples: Samples) -> str:
    """Which cells are missed, and by how much the nearest sample misses the first."""
    names, name = cells.named(missed, NAMED), cells.named(missed[:1], 1)
    what = f"cell {name} is" if len(missed) == 1 else f"cells {names} are"
    if not len(samples.row):
        return f"{what} never reached"
    aims, first = task.targets(cells), missed[0]
    off = np.linalg.norm(samples.points - aims.points[first], axis=1)
    nearest = int(np.argmin(off))
    where = f"comes no nearer to the target of {name} than about {1e3 * off[nearest]:.4g} mm"
    if off[nearest] <= task.effective_tolerance:
        held = "cone" if task.roll is None else "cone, or its range of the roll,"
        where = f"is at the target of {name}, but not inside the {held} there"
    row = f"near row {samples.row[nearest] + 1}"
    return f"{what} never reached: {row} the tool {where}"
