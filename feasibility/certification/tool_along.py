"""The tool along a motion over one surface: at all rows, and between them by bisection.

Between rows, bounds are used (`stretches`). A stretch that they do not accept is halved: they fall
to a quarter, and one exact configuration is added. What is wrong at an exact configuration is
refused, and so is what is still open after many halvings.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.bisection import bisected
from feasibility.certification.faults import MotionFault, and_others
from feasibility.certification.stretches import Bounds, Judge, SampledStretches, Samples
from feasibility.cone import angle_of
from feasibility.task import Task

LEVELS = 26  # halvings of a segment between two rows
MOST_SAMPLES = 1_000_000  # configurations looked at between rows
ENOUGH = 1000  # wrong configurations, after which no more are looked for


class Along(NamedTuple):
    """What is found of tool point, axis and roll along a motion."""

    most: Array
    """(3,) bounds: m, how far the tool point is off; of |a - b|; rad of the roll."""
    faults: list[MotionFault]
    samples: Samples
    """In the order of the motion, all rows among them."""
    room: Array
    """(m, 2) rad, how much of cone and roll is left at least from each row to the next; inf where
    they are free, or the tool does not work."""


def tool_along(judge: Judge) -> Along:
    """Judge tool point, axis and roll at all rows and between them."""
    marks, samples, n_wrong = judge.marks, [judge.at_rows()], 0
    if marks is not None:
        samples[0] = _at_marks(judge, marks, samples[0])
    good, every = judge.within(samples[0]), judge.between_rows(samples[0])
    most, room = np.zeros(3), np.full((len(good), 2), np.inf)

    def note(one: Samples | Bounds, row: Ints) -> None:
        # Nearer to a mesh's triangles than the standoff a tool point is off, too; further from them
        # by no more than from its target.
        off = np.maximum(one.error, judge.task.standoff - one.facets)
        each = [np.max(values, initial=0.0) for values in (off, one.chord, one.roll)]
        np.maximum(most, each, out=most)
        less_room(room, judge.task, row, one.chord, one.roll)

    def decided(left: SampledStretches) -> Mask:
        bounds = judge.bounds(left)
        good = judge.within(bounds)
        note(bounds.of(good), left.row[good])
        return good

    def halves(left: SampledStretches) -> SampledStretches:
        nonlocal n_wrong
        middle = judge.sampled(left.row, left.middle)
        good = judge.within(middle)
        samples.append(middle)
        n_wrong += int((~good).sum())
        good &= n_wrong <= ENOUGH
        return left.of(good).halves(middle.of(good))

    whole = every.of(good[:-1] & good[1:])  # others are wrong already
    left, seen = bisected(whole, decided, halves, LEVELS, MOST_SAMPLES), Samples.join(*samples)
    if marks is not None and len(good) > 1:
        wrong = ~judge.within(seen)
        if (wrong.any() or len(left.row)) and wrong.sum() <= ENOUGH:  # or some were not looked at
            from feasibility.certification.followed import on_the_way

            doubtful = np.append(seen.row[wrong], left.row)
            right, more = on_the_way(judge, marks, samples[0], every.of_segment, doubtful, decided)
            before = right[np.maximum(seen.row - 1, 0)] | (seen.share > 0.0)
            seen = Samples.join(seen.of(~(wrong & right[seen.row] & before)), *more)
            left = left.of(~right[left.row])
    wrong, rough = ~judge.within(seen), seen.share > 0.0
    faults = exact_faults(judge, seen.of(wrong & ~rough), "row")
    if (wrong & rough).any():
        faults += exact_faults(judge, seen.of(wrong & rough), "place")
    elif len(left.row):
        faults.append(open_fault(judge, left, judge.bounds(left)))
    seen = seen.of(np.lexsort((seen.share, seen.row)))  # as the motion passes them
    note(seen, seen.row)
    return Along(most, faults, seen, room)


def _at_marks(judge: Judge, marks: Ints, at: Samples) -> Samples:
    """The samples at all rows, over their marked cells where the places found will not do."""
    bad = np.flatnonzero(~judge.within(at) & (marks >= 0))
    if not len(bad):
        return at
    aims = judge.task.targets(judge.cells).points[marks[bad]]
    return judge.corrected(at, bad, judge.offset.nearest(aims, aims, 0.0))


def less_room(room: Array, task: Task, row: Ints, chord: Array, roll: Array) -> None:
    """Take what is left of cone and roll behind rows (k,), where it is less, into `room` (m, 2)."""
    if task.cone < np.pi:
        angle = 2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0))
        np.minimum.at(room[:, 0], row, np.maximum(task.cone - angle, 0.0))
    if task.roll is not None:
        np.minimum.at(room[:, 1], row, np.maximum(task.roll.half - roll, 0.0))


OFF, NEAR = 0, 3  # rows of `Judge.beyond`


def exact_faults(judge: Judge, wrong: Samples, noun: str) -> list[MotionFault]:
    """The worst of configurations that are wrong, of each kind."""
    faults, beyond = [], judge.beyond(wrong)
    for what, more in enumerate(beyond):
        rows = np.flatnonzero(~(more <= 0.0))
        if not len(rows) or (what == NEAR and not (beyond[OFF] <= 0.0).all()):
            continue
        worst = int(rows[np.argmax(np.nan_to_num(more[rows], nan=np.inf))])
        text = _said(judge, wrong, worst)[what]
        text += "" if what == NEAR else and_others(len(rows) - 1, noun)
        faults.append(MotionFault(text, int(wrong.row[worst]), float(wrong.share[worst])))
    return faults


def _said(judge: Judge, wrong: Samples, k: int) -> tuple[str, ...]:
    """What may be wrong with one configuration, in the order of `Judge.beyond`."""
    task, (low, high) = judge.task, judge.task.roll_deg or (-180.0, 180.0)
    beyond = np.degrees(wrong.roll[k] - (task.roll.half if task.roll else 0.0))
    return (
        f"the tool point is {1e3 * wrong.error[k]:.4g} mm off its surface, "
        f"{1e3 * task.effective_tolerance:g} mm are allowed",
        f"the tool axis tilts {np.degrees(angle_of(float(wrong.chord[k]))):.6g} deg, "
        f"{task.cone_deg:g} deg are allowed",
        f"the roll is {beyond:.6g} deg outside its range, {low:g} to {high:g} deg",
        f"the tool point comes within {1e3 * wrong.facets[k]:.4g} mm of the mesh's triangles, "
        f"nearer than the standoff of {1e3 * task.standoff:g} mm: something protrudes there, or "
        "its facets are too coarse for this standoff",
    )


def open_fault(judge: Judge, left: SampledStretches, bounds: Bounds) -> MotionFault:
    """What to say of a stretch that neither bounds nor exact configurations decide."""
    # One with a jump first, then the shortest: what is wrong there is nearest to a place.
    one = int(np.lexsort((left.length, bounds.joined))[0])
    row, share = int(left.row[one]), float(left.middle[one])
    if not bounds.joined[one]:
        stuck = left.of(slice(one, one + 1))
        target = [judge.offset.at(end.places)[0][0] for end in (stuck.start, stuck.end)]
        jump = 1e3 * float(np.linalg.norm(target[1] - target[0]))
        text = f"the place on the surface that the tool is over jumps, by {jump:.3g} mm"
        return MotionFault(text, row, share)
    allowed = f"{1e3 * judge.task.effective_tolerance:g} mm"
    text = (
        "the tool point is at the edge of the tolerance, or its place on the surface jumps (within "
        f"{1e3 * bounds.error[one]:.6g} mm, {allowed} are allowed)",
        "the tool axis is at the edge of the cone (within "
        f"{np.degrees(angle_of(float(bounds.chord[one]))):.6f} deg, {judge.task.cone_deg:g} deg "
        "are allowed)",
        "the roll is at the edge of its range, or the reference turns there",
        "the tool point may come too near to the mesh's triangles",
    )[int(np.argmin(judge.beyond(bounds)[:, one] <= 0.0))]
    return MotionFault(f"not certified: {text}", row, share)
