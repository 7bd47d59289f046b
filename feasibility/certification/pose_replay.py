"""The replay of a motion along poses, or at work over a surface here and there.

Along poses that follow a surface the same has to hold over that surface (`followed`), and where the
tool does not work it must not go through the surface.

A toolpath is run from its first pose to its last, and never back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from coverable.arrays import Array, Ints, Mask
from feasibility.certification.bisection import runs
from feasibility.certification.faults import MotionFault, less_deviations, too_vague
from feasibility.certification.followed import followed_parts, lifted_faults, rows_and_shares
from feasibility.certification.stretches import Judge, Samples, configurations
from feasibility.certification.tool_along import Along, tool_along
from feasibility.task import Task
from feasibility.verdict import Walk
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.places.places import OffsetSurface
from surfaces.surface import Surface

if TYPE_CHECKING:
    from surfaces.toolpaths.pose_surface import PoseSurface


def order_of_marks(cells: Cells, walk: Walk) -> str:
    """Why the marks of a walk are not in the order of a toolpath; empty where they are."""
    marks = walk.cell[walk.cell >= 0]
    steps = np.diff(marks)
    wrong = np.flatnonzero((steps < 0) | (steps > 1))
    if not len(wrong):
        return ""
    before, after = marks[wrong[0] : wrong[0] + 2].tolist()
    how = "back" if after < before else "on"
    return f"the motion goes {how} from pose {before} to pose {after}, out of their order"


def marks_in_order(robot: Robot, cells: Cells, task: Task, q: Array) -> Ints | None:
    """(m,) marks for rows that have none: the first that is at each pose, one behind the other.

    None where cells have no order, or rows pass some pose between them.
    """
    if not cells.in_order or not len(q):
        return None
    from scipy.spatial import cKDTree  # takes a while to load

    (points, axes), targets = Kinematics(robot).tools(q), task.targets(cells)
    near = cKDTree(points).query_ball_point(targets.points, task.effective_tolerance)
    marks, row = np.full(len(q), -1), 0
    for k, (rows, approach) in enumerate(zip(near, targets.approaches, strict=True)):
        some = np.sort([at for at in rows if at >= row]).astype(np.int64)
        some = some[np.linalg.norm(axes[some] - approach, axis=1) <= task.cone_chord]
        if not len(some):
            return None
        marks[some[0]], row = k, int(some[0]) + 1
    return marks


def curves_of_marks(cells: Cells, marks: Ints) -> Ints | None:
    """(m,) between poses, the curve that a motion is on behind each row, by its marks.

    None where there is a surface, or two marks in a row are those of poses without a curve.
    """
    at = np.flatnonzero(marks >= 0)
    if not cells.surface.bare or len(at) < 2 or at[0] != 0 or at[-1] != len(marks) - 1:
        return None
    start, end = marks[at[:-1]], marks[at[1:]]
    count = len(cells)
    keys = cells.pairs[:, 0] * count + cells.pairs[:, 1]
    wanted = np.minimum(start, end) * count + np.maximum(start, end)
    row = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    any_curve = np.full(count, -1)  # to stay over a pose, at the end of any of its curves
    any_curve[cells.pairs.ravel()] = np.repeat(np.arange(len(keys)), 2)
    curve = np.where(start == end, any_curve[start], np.where(keys[row] == wanted, row, -1))
    if (curve < 0).any():
        return None
    return np.append(np.repeat(curve, np.diff(at)), curve[-1])


def order_of_places(offset: OffsetSurface, samples: Samples, tolerance: float) -> list[MotionFault]:
    """Where a motion goes back along a toolpath's curves by more than the tolerance (m).

    The samples are of the motion, as it passes them.
    """
    along = offset.along(samples.places)
    if along is None or not len(along):
        return []
    known = np.nan_to_num(along, nan=-np.inf)
    back: Array = np.maximum.accumulate(known) - along
    worst = int(np.argmax(np.nan_to_num(back)))
    if not back[worst] > tolerance:
        return []
    text = f"the tool goes back along the toolpath, by {1e3 * back[worst]:.4g} mm"
    return [MotionFault(text, int(samples.row[worst]), float(samples.share[worst]))]


def over_parts(
    judge: Judge, parts: Sequence[Array], lifted: tuple[Array, Array], wall: Surface | None
) -> Along:
    """What is found along parts of a motion, each by row numbers with their shares (k,).

    Where it is `lifted`, from where to where by such numbers (k,), it must not go through the wall.
    """
    rows = judge.rows
    most, faults, room = np.zeros(3), list[MotionFault](), np.full((len(rows), 2), np.inf)
    samples = [judge.sampled(np.zeros(0, dtype=np.int64), np.zeros(0))]
    for part in parts:
        row, share = rows_and_shares(part)
        found = tool_along(judge.along(configurations(rows, row, share)))
        most = np.maximum(most, found.most)
        np.minimum.at(room, row, found.room)
        number = np.arange(len(part))
        for fault in found.faults:
            where = float(np.interp(fault.row + fault.share, number, part))
            faults.append(replace(fault, row=int(where), share=where % 1.0))
        at = np.interp(found.samples.row + found.samples.share, number, part)
        row, share = rows_and_shares(at)
        samples.append(replace(found.samples, row=row, share=share))
    tolerance = judge.task.effective_tolerance
    faults += lifted_faults(wall, rows, lifted, judge.kinematics, tolerance)
    return Along(most, faults, Samples.join(*samples), room)


def tool_at_work(judge: Judge, wall: Surface | None, working: Mask) -> Along:
    """What is found where the tool works; elsewhere it must not go through the wall."""
    lifted = np.flatnonzero(~(working[:-1] & working[1:])).astype(float)
    parts = [part.astype(float) for part in runs(working)]
    return over_parts(judge, parts, (lifted, lifted + 1.0), wall)


def along_poses(found: Along, judge: Judge, surface: PoseSurface, right: bool) -> Along:
    """What is found along poses, and its faults besides those that were found before.

    Where all is `right`, also over the surface under them of what follows that. What is lifted, or
    beyond the border, must not go through the surface.
    """
    faults = order_of_places(judge.offset, found.samples, judge.task.effective_tolerance)
    if faults or not right or surface.under is None or surface.working is None:
        return found._replace(faults=faults)
    task = less_deviations(judge.task, surface.under)
    over = Judge(judge.robot, task, surface.under, judge.cells, judge.rows)
    faults += too_vague(judge.task, surface.under)
    parts, lifted = followed_parts(judge, surface.followed, found.samples)
    more = over_parts(over, parts, lifted, surface.under.wall)
    room = np.minimum(found.room, more.room)
    return Along(np.maximum(found.most, more.most), faults + more.faults, found.samples, room)
