"""Which cells a motion reaches: where its tool is at their centres, and held as it has to be.

A cell counts as reached by one exact configuration of the motion, so no bound is needed. Cells that
no sample reaches are looked for between samples, where the tool passes nearest.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.stretches import Judge, Samples, beyond, configurations
from feasibility.certification.tool_along import less_room
from feasibility.task import Targets, Task
from surfaces.cells import Cells

TRIES = np.linspace(0.0, 1.0, 9)  # of the part of a stretch that passes within the tolerance
NAMED = 5  # cells that are listed


def cells_reached(judge: Judge, task: Task, samples: Samples, room: Array) -> Mask:
    """(N,) which cells a motion reaches, of which `judge` knows the surface.

    The task's tolerance and cone are used exactly. The samples are of the motion, as it passes
    them, all rows at which it works among them; those that are marked are looked at first. `room`
    (m, 2), see `Along`, is made less where the tool is over a cell.
    """
    count = len(judge.cells)
    row, chord, roll = np.full(count, -1), np.full(count, np.inf), np.zeros(count)
    for cell, at, *held in _over_cells(judge, task, samples, row):
        found, rolls = at_targets(task, task.targets(judge.cells), cell, *held)
        order = np.argsort(-found, kind="stable")  # of several over one cell the last is kept
        best = order[found[order] < chord[cell[order]]]
        row[cell[best]], chord[cell[best]], roll[cell[best]] = at[best], found[best], rolls[best]
        if (row >= 0).all():
            break
    reached = np.asarray(row >= 0)
    less_room(room, task, row[reached], chord[reached], roll[reached])
    return reached


def _over_cells(
    judge: Judge, task: Task, samples: Samples, known: Ints
) -> Iterator[tuple[Ints, Ints, Array, Array, Array]]:
    """Cells (k,), and tools that may be at their targets, as `at_targets` takes them.

    Each with the row that it is at, or behind. Between samples only cells that are not `known` (N,)
    by then, with a row, are looked for.
    """
    cells, marks = judge.cells, judge.marks
    if not len(cells) or not len(samples.row):
        return
    aims, tolerance = task.targets(cells), task.effective_tolerance
    if marks is not None:
        at = samples.of((samples.share == 0.0) & (marks[samples.row] >= 0))
        yield marks[at.row], at.row, at.points, at.axes, at.x
    from scipy.spatial import cKDTree  # takes a while to load

    tree = cKDTree(samples.points)
    cell, sample = _flat(tree.query_ball_point(aims.points, tolerance))
    at = samples.of(sample)
    yield cell, at.row, at.points, at.axes, at.x
    left = np.flatnonzero(known < 0)
    if len(samples.row) < 2:
        return
    starts, ends = samples.points[:-1], samples.points[1:]
    half = 0.5 * np.linalg.norm(ends - starts, axis=1)
    tree = cKDTree(0.5 * (starts + ends))
    # Of stretches much longer than others there are few; a tool may bend off its chord a little.
    some, piece = _flat(tree.query_ball_point(aims.points[left], 2.0 * tolerance + half.max()))
    some = left[some]
    low, high = _passing(aims.points[some], starts[piece], ends[piece], 2.0 * tolerance)
    passes = (low < high) & (np.diff(samples.row)[piece] <= 1)  # else it does not work between
    some, piece, low, high = some[passes], piece[passes], low[passes], high[passes]
    t = low[:, None] + TRIES * (high - low)[:, None]
    row = samples.row[piece]
    stop = np.where(samples.row[piece + 1] > row, 1.0, samples.share[piece + 1])
    share = samples.share[piece][:, None] + t * (stop - samples.share[piece])[:, None]
    cell, row = np.repeat([some, row], len(TRIES), axis=1)
    yield cell, row, *judge.kinematics.held(configurations(judge.rows, row, share.ravel()))


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
