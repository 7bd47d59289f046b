"""What is wrong with the configurations and stretches of a motion, in words."""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array
from coverable.errors import counted
from feasibility.certification.faults import MotionFault
from feasibility.certification.stretches import Bounds, Judge, SampledStretches, Samples
from feasibility.cone import angle_of
from robots.robot import Robot

OFF, TILTED, ROLLED, NEAR = range(4)  # rows of `Judge.beyond`


def past_limit(robot: Robot, rows: Array) -> MotionFault:
    """The worst row that passes a limit; there is one."""
    margins = np.minimum(rows - robot.lower, robot.upper - rows)
    row, joint = np.unravel_index(np.argmin(margins), margins.shape)
    least, slides = float(margins[row, joint]), robot.prismatic[joint]
    by = f"{-1e3 * least:.4g} mm" if slides else f"{-np.degrees(least):.4g} deg"
    text = f"{robot.joint_names[joint]} passes its limit by {by}"
    others = int((margins < 0.0).any(axis=1).sum()) - 1
    return MotionFault(int(row), 0.0, text + _others(others, "row"))


def exact_faults(judge: Judge, wrong: Samples, noun: str) -> list[MotionFault]:
    """The worst of configurations that are wrong, of each kind."""
    faults, beyond = [], judge.beyond(wrong)
    for what, more in enumerate(beyond):
        rows = np.flatnonzero(~(more <= 0.0))
        if not len(rows) or (what == NEAR and not (beyond[OFF] <= 0.0).all()):
            continue
        worst = int(rows[np.argmax(np.nan_to_num(more[rows], nan=np.inf))])
        text = _said(judge, wrong, what, worst)
        text += "" if what == NEAR else _others(len(rows) - 1, noun)
        faults.append(MotionFault(int(wrong.row[worst]), float(wrong.share[worst]), text))
    return faults


def _said(judge: Judge, wrong: Samples, what: int, k: int) -> str:
    """What is wrong with one configuration."""
    task = judge.task
    if what == OFF:
        return (
            f"the tool point is {1e3 * wrong.error[k]:.4g} mm off its surface, "
            f"{1e3 * task.effective_tolerance:g} mm are allowed"
        )
    if what == TILTED:
        return (
            f"the tool axis tilts {np.degrees(angle_of(float(wrong.chord[k]))):.6g} deg, "
            f"{task.cone_deg:g} deg are allowed"
        )
    if what == ROLLED and task.roll is not None and task.roll_deg is not None:
        beyond = np.degrees(wrong.roll[k] - task.roll.half)
        low, high = task.roll_deg
        return f"the roll is {beyond:.6g} deg outside its range, {low:g} to {high:g} deg"
    return (
        f"the tool point comes within {1e3 * wrong.facets[k]:.4g} mm of the mesh's triangles, "
        f"nearer than the standoff of {1e3 * task.standoff:g} mm: something protrudes there, or "
        "its facets are too coarse for this standoff"
    )


def _others(number: int, noun: str) -> str:
    """' (the worst; wrong at 3 other rows, too)', or nothing."""
    others = counted(number, f"other {noun}")
    return f" (the worst; wrong at {others}, too)" if number > 0 else ""


def open_fault(judge: Judge, left: SampledStretches, bounds: Bounds) -> MotionFault:
    """What to say of a stretch that neither bounds nor exact configurations decide."""
    # One with a jump first, then the shortest: what is wrong there is nearest to a place.
    one = int(np.lexsort((left.length, bounds.joined))[0])
    row, share = int(left.row[one]), float(left.middle[one])
    if not bounds.joined[one]:
        target = [
            judge.offset.at(s.places.of(np.array([one])))[0][0] for s in (left.start, left.end)
        ]
        jump = 1e3 * float(np.linalg.norm(target[1] - target[0]))
        text = f"the place on the surface that the tool is over jumps, by {jump:.3g} mm"
        return MotionFault(row, share, text)
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
    return MotionFault(row, share, f"not certified: {text}")
