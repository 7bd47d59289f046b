"""The replay of a motion along poses, or at work over a surface here and there.

Along poses that follow a surface the same has to hold over that surface (`followed`), and where the
tool does not work it must not go through the surface.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.certification.cells_reached import Reached, cells_reached
from feasibility.certification.deviations import less_deviations, too_vague
from feasibility.certification.faults import MotionFault
from feasibility.certification.followed import followed_parts, lifted_faults, off_surface
from feasibility.certification.stretches import Judge, Samples
from feasibility.certification.tool_along import Along, tool_along
from feasibility.certification.toolpath_order import order_of_places
from feasibility.task import Task
from robots.kinematics import Kinematics
from surfaces.cells import Cells
from surfaces.places.offset_surfaces import offset_surface
from surfaces.surface import Surface

if TYPE_CHECKING:
    from surfaces.toolpaths.pose_surface import PoseSurface


def tool_at_work(
    judge: Judge, rows: Array, cells: Cells, surface: Surface, working: Mask
) -> tuple[Along, Reached]:
    """What is found where the tool works, and the cells that are reached there.

    Where it does not, it must not go through the surface.
    """
    most, faults, samples = np.zeros(3), list[MotionFault](), list[Samples]()
    reached, room = Reached.none(len(cells)), np.full((len(rows), 2), np.inf)
    turns = np.flatnonzero(np.diff(working)) + 1
    for part in np.split(np.arange(len(rows)), turns):
        if len(part) and working[part[0]]:
            found = tool_along(judge, rows[part])
            most = np.maximum(most, found.most)
            faults += [replace(each, row=each.row + part[0]) for each in found.faults]
            samples.append(replace(found.samples, row=found.samples.row + part[0]))
            room[part] = found.room
            some = cells_reached(judge.robot, cells, judge.task, rows[part], found.samples)
            new = some.cells & (some.chord < reached.chord)
            reached.row[new] = some.row[new] + part[0]
            reached.chord[new], reached.roll[new] = some.chord[new], some.roll[new]
    lifted = np.flatnonzero(~(working[:-1] & working[1:])).astype(float)
    kinematics, tolerance = Kinematics(judge.robot), judge.task.effective_tolerance
    faults += lifted_faults(surface.wall, rows, (lifted, lifted + 1.0), kinematics, tolerance)
    none = judge.sampled(np.zeros(0, dtype=np.int64), np.zeros(0), rows[:0])
    return Along(most, faults, Samples.join(none, *samples), room), reached


def along_poses(
    found: Along,
    judge: Judge,
    rows: Array,
    cells: Cells,
    surface: PoseSurface,
    task: Task,
    right: bool,
) -> tuple[Along, list[MotionFault]]:
    """What is found along poses, and its faults; over what they follow too, where all is right."""
    faults = order_of_places(judge.offset, found.samples, task.effective_tolerance)
    if faults or not right:
        return found, faults
    found = _with_what_follows(found, judge, rows, cells, surface)
    return found, found.faults


def _with_what_follows(
    found: Along, judge: Judge, rows: Array, cells: Cells, surface: PoseSurface
) -> Along:
    """What is found along poses, and of what follows the surface under them over that, too.

    What is lifted, or beyond the border, must not go through the surface.
    """
    if surface.under is None or surface.working is None:
        return found
    task = less_deviations(judge.task, surface.under)
    over = Judge(judge.robot, task, offset_surface(surface.under, judge.offset.height), cells)
    followed, most, room = surface.followed, found.most, found.room
    at = off_surface(followed, found.samples)
    kinematics, tolerance = Kinematics(judge.robot), judge.task.effective_tolerance
    faults = lifted_faults(surface.under.wall, rows, at, kinematics, tolerance)
    faults += too_vague(judge.task, surface.under)
    for part in followed_parts(judge, followed, rows, found.samples):
        one = tool_along(over, part.q)
        most = np.maximum(most, one.most)
        faults += [part.placed(fault) for fault in one.faults]
        np.minimum.at(room, part.row, one.room)
    return Along(most, faults, found.samples, room)
