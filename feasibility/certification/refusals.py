"""What is wrong with the configurations and stretches of a motion, in words."""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array
from coverable.errors import counted
from feasibility.certification.faults import MotionFault
from feasibility.certification.rolls.bounds import CLOSE_TO_ZERO as ROLL_CLOSE
from feasibility.certification.stretches import CLOSE_TO_ZERO, Bounds, Judge, Samples, Stretches
from feasibility.cone import angle_of
from feasibility.task import Task
from robots.robot import Robot


def limits(robot: Robot, rows: Array) -> tuple[float, list[MotionFault]]:
    """The smallest distance from a limit, and the worst row that passes one; limits are convex."""
    margins = np.minimum(rows - robot.lower, robot.upper - rows)
    least = float(margins.min(initial=np.inf))
    if least >= 0.0:
        return least, []
    row, joint = np.unravel_index(np.argmin(margins), margins.shape)
    slides = robot.prismatic[joint]
    by = f"{-1e3 * least:.4g} mm" if slides else f"{-np.degrees(least):.4g} deg"
    text = f"{robot.joint_names[joint]} passes its limit by {by}"
    others = int((margins < 0.0).any(axis=1).sum()) - 1
    return least, [MotionFault(int(row), 0.0, text + _others(others, "row"))]


def exact_faults(judge: Judge, wrong: Samples, noun: str) -> list[MotionFault]:
    """The worst of configurations that are wrong: the furthest off, and the most tilted."""
    task, faults = judge.task, []
    tolerance = task.effective_tolerance
    off = np.flatnonzero(~(wrong.error <= tolerance))
    if len(off):
        worst = off[np.argmax(np.nan_to_num(wrong.error[off], nan=np.inf))]
        text = (
            f"the tool point is {1e3 * wrong.error[worst]:.4g} mm off its surface, "
            f"{1e3 * tolerance:g} mm are allowed" + _others(len(off) - 1, noun)
        )
        faults.append(MotionFault(int(wrong.row[worst]), float(wrong.share[worst]), text))
    tilted = np.flatnonzero(~(wrong.chord <= task.cone_chord + CLOSE_TO_ZERO))
    if len(tilted):
        worst = tilted[np.argmax(np.nan_to_num(wrong.chord[tilted], nan=np.inf))]
        text = (
            f"the tool axis tilts {np.degrees(angle_of(float(wrong.chord[worst]))):.6g} deg, "
            f"{task.cone_deg:g} deg are allowed" + _others(len(tilted) - 1, noun)
        )
        faults.append(MotionFault(int(wrong.row[worst]), float(wrong.share[worst]), text))
    faults += _roll_faults(task, wrong, noun)
    near = np.flatnonzero(~(wrong.facets >= judge.least_distance - CLOSE_TO_ZERO))
    if len(near) and not len(off):
        worst = near[np.argmin(wrong.facets[near])]
        text = (
            f"the tool point comes within {1e3 * wrong.facets[worst]:.4g} mm of the mesh's "
            f"triangles, nearer than the standoff of {1e3 * task.standoff:g} mm: something "
            "protrudes there, or its facets are too coarse for this standoff"
        )
        faults.append(MotionFault(int(wrong.row[worst]), float(wrong.share[worst]), text))
    return faults


def _roll_faults(task: Task, wrong: Samples, noun: str) -> list[MotionFault]:
    """The one whose roll is furthest outside its range."""
    if task.roll is None or task.roll_deg is None:
        return []
    rolled = np.flatnonzero(~(wrong.roll <= task.roll.half + ROLL_CLOSE))
    if not len(rolled):
        return []
    worst = rolled[np.argmax(np.nan_to_num(wrong.roll[rolled], nan=np.inf))]
    beyond = np.degrees(wrong.roll[worst] - task.roll.half)
    low, high = task.roll_deg
    text = f"the roll is {beyond:.6g} deg outside its range, {low:g} to {high:g} deg" + _others(
        len(rolled) - 1, noun
    )
    return [MotionFault(int(wrong.row[worst]), float(wrong.share[worst]), text)]


def _others(number: int, noun: str) -> str:
    """' (the worst; wrong at 3 other rows, too)', or nothing."""
    others = counted(number, f"other {noun}")
    return f" (the worst; wrong at {others}, too)" if number > 0 else ""


def open_fault(judge: Judge, left: Stretches, bounds: Bounds) -> MotionFault:
    """What to say of a stretch that neither bounds nor exact configurations decide."""
    # One with a jump first, then the shortest: what is wrong there is nearest to a place.
    one = int(np.lexsort((left.length, bounds.joined))[0])
    row, share = int(left.start.row[one]), float(left.start.share[one] + 0.5 * left.length[one])
    if not bounds.joined[one]:
        target = [
            judge.offset.at(s.places.of(np.array([one])))[0][0] for s in (left.start, left.end)
        ]
        jump = 1e3 * float(np.linalg.norm(target[1] - target[0]))
        text = f"the place on the surface that the tool is over jumps, by {jump:.3g} mm"
    elif not bounds.error[one] <= judge.task.effective_tolerance:
        text = (
            "not certified: the tool point is at the edge of the tolerance, or its place on the "
            f"surface jumps (within {1e3 * bounds.error[one]:.6g} mm, "
            f"{1e3 * judge.task.effective_tolerance:g} mm are allowed)"
        )
    elif not bounds.chord[one] <= judge.task.cone_chord + CLOSE_TO_ZERO:
        text = (
            "not certified: the tool axis is at the edge of the cone (within "
            f"{np.degrees(angle_of(float(bounds.chord[one]))):.6f} deg, {judge.task.cone_deg:g} "
            "deg are allowed)"
        )
    elif not bounds.facets[one] >= judge.least_distance - CLOSE_TO_ZERO:
        text = "not certified: the tool point may come too near to the mesh's triangles"
    else:
        text = "not certified: the roll is at the edge of its range, or the reference turns there"
    return MotionFault(row, share, text)
