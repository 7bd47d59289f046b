"""Which configurations over places are joined to a motion by straight joint segments.

Each configuration names the one that it came from. A segment between two is judged as a stretch of
any motion over the surface is (`stretches`), along a path between the places that are given.
"""

from __future__ import annotations

import numpy as np

from coverable_arrays import Array, Ints, Mask
from feasibility.certification.jacobians import placements
from feasibility.certification.stretches import Judge, Stretches
from feasibility.task import Task
from robots import Robot
from surfaces import Cells
from surfaces.places import OffsetSurface, Places

CLOSE_TO_LIMIT = 1e-12  # rad or m: rounding
HALVINGS = 6  # of a segment


def joined(
    robot: Robot,
    cells: Cells,
    task: Task,
    offset: OffsetSurface,
    q: Array,
    places: Places,
    came: Ints,
) -> Mask:
    """Which of m configurations are right, and joined by certified segments to one that began.

    Args:
        robot: the arm.
        cells: the cells of the surface.
        task: its tolerance and cone are used exactly; the roll has to be free.
        offset: the offset surface of the task's targets.
        q: (m, n) rad or m.
        places: m places that they are over.
        came: (m,) the configuration that each was reached from, one before it in this order; -1
            where it is one of a motion that is certified already.
    """
    judge = Judge(robot, task, offset, cells)
    alone = np.flatnonzero(came < 0)
    step = np.flatnonzero(came >= 0)
    # Pairs of rows, of which every second stretch counts.
    row = np.stack([came[step], step], axis=1).ravel()
    row = np.concatenate([row, alone])
    poses, x = placements(robot, q[row]), judge.reference_axes(q[row])
    start = np.zeros(len(row))
    at = judge.over(places.of(row), np.arange(len(row)), start, poses.points, poses.axes, x)
    stretches = judge.between_rows(q[row], poses, at).of(np.arange(0, 2 * len(step), 2))
    good = np.zeros(len(q), dtype=bool)
    inside = ((q >= robot.lower - CLOSE_TO_LIMIT) & (q <= robot.upper + CLOSE_TO_LIMIT)).all(axis=1)
    right = judge.within(at)
    good[alone] = right[2 * len(step) :]
    good[step] = right[1 : 2 * len(step) : 2] & _hold(judge, stretches, q[row])
    return _back_to_beginning(good & inside, came)


def _hold(judge: Judge, stretches: Stretches, rows: Array) -> Mask:
    """Which stretches hold all along; what bounds leave open is halved a few times.

    Args:
        judge: compares configurations with the surface.
        stretches: k of them, each from one row to the next.
        rows: (m, n) the rows.
    """
    held = np.ones(len(stretches.length), dtype=bool)
    left, owner = stretches, np.arange(len(held))
    for level in range(HALVINGS + 1):
        open_ = ~judge.within(judge.bounds(left)) & held[owner]
        left, owner = left.of(open_), owner[open_]
        if level == HALVINGS:
            held[owner] = False
        if not len(owner) or level == HALVINGS:
            break
        middle = judge.middles(rows, left)
        good = judge.within(middle)
        held[owner[~good]] = False
        left, owner = left.of(good).halves(middle.of(good)), np.tile(owner[good], 2)
    return held


def _back_to_beginning(good: Mask, came: Ints) -> Mask:
    """Which are good all the way back; each comes from one before it."""
    found, back = good.copy(), came.copy()
    while (back >= 0).any():  # twice as far back each time
        some = np.flatnonzero(back >= 0)
        found[some] &= found[back[some]]
        back[some] = back[back[some]]
    return found
