"""The replay of speeds: may the tool have its speed along a motion, but where it rests?

A motion, straight in joint space between its rows, **holds the speed v** where on every segment,
and all along it, the tool may move at v relative to the surface with every joint inside its
velocity limit (`segment_rates`), except where it stops:

- **in place**: a segment with the tool point at both its ends within a tenth of the tolerance of
  the target of one cell, and within the tolerance of it in between. There the arm changes its
  posture, and the tool waits; where the speed is possible there too, it is no stop.
- **at a corner**: a row at which the tool's path turns by more than `CORNER_DEG`. Velocities may
  jump at rows anyway, accelerations are the business of timing; a corner is counted, no more.

A motion **keeps its distance from singularities** where the smallest singular value (see
`segment_rates`) is nowhere below what the task asks, in place too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial import cKDTree

from coverable.arrays import Array, Mask
from coverable.errors import ArgumentError, Fault
from feasibility.certification.faults import Judged
from feasibility.certification.lever_bounds import jacobians, second_derivatives
from feasibility.certification.segment_rates import SegmentRates, fastest_anywhere, segment_rates
from feasibility.task import Task
from feasibility.verdict import Walk
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

IN_PLACE = 0.1  # [1] share of the tolerance within which the tool point begins and ends in place
CORNER_DEG = 30.0  # [deg] by which the tool's path turns at a corner
CLOSE_TO_ZERO = 1e-12  # [m]: rounding


@dataclass(frozen=True, slots=True)
class Stop:
    """A place at which the tool has to stop."""

    why: Literal["in place", "corner"]
    row: int
    """Of the motion, where it begins."""
    cell: int
    """Flat index of the cell whose target is nearest."""


@dataclass(frozen=True, eq=False, slots=True)
class RateReplay(Judged):
    """What a motion allows."""

    speed: float
    """m/s, lower bound of what the tool may have all along, but for the stops; inf where it never
    moves. Where a speed was asked for it is only shown whether that is possible."""
    sigma: float
    """Lower bound of the smallest singular value; inf where it was not asked for."""
    segment: SegmentRates
    """Of each segment."""
    stops: tuple[Stop, ...]
    waiting: float
    """s, how long the stops in place take together at least."""
    faults: tuple[str, ...]
    """Why it does not do what the task asks of speed and singularities, each with joint or place;
    none where it does."""


def replay_rates(
    robot: Robot, cells: Cells, task: Task, walk: Walk, closely: bool = False
) -> RateReplay:
    """Judge a motion by the module's rules.

    Args:
        robot: the arm; without velocity limits no speed is known, and speeds are inf.
        cells: the cells; their targets are where the tool may wait.
        task: its speed and least singular value, where it has them.
        walk: the motion.
        closely: whether the figures are to be close to the exact ones, and not only enough to
            decide what is asked.
    """
    speed, sigma = task.speed, task.min_manipulability
    rows = walk.q if len(walk.q) > 1 else np.repeat(walk.q, 2, axis=0)
    starts, ends = rows[:-1], rows[1:]
    targets = task.targets(cells).points
    resting = in_place(robot, cells, task, rows)
    asked = (None, np.inf) if closely else (speed, sigma)
    found = segment_rates(robot, starts, ends, *asked, resting=resting)
    at = jacobians(Kinematics(robot), rows)
    # How long segments take with one joint at its limit; 0 where limits are not known.
    steps = ends - starts
    lasts = (np.abs(steps) / robot.max_velocity).max(axis=1, initial=0.0)
    lasts = np.where(np.isfinite(lasts), lasts, 0.0)
    waits = resting & (lasts > 0.0)
    if speed is not None:  # where it is possible at both ends, it is no stop
        ways = [np.einsum("kij,kj->ki", one, steps) for one in (at.point[:-1], at.point[1:])]
        waits &= np.linalg.norm(ways, axis=2).min(axis=0) < speed * lasts
    stops = _stops(at.points, targets, resting, waits)
    faults = []
    slow = np.flatnonzero(~resting & ~(found.speed >= (speed or -np.inf)))
    if speed is not None and len(slow):
        worst = int(slow[np.argmin(found.sampled_speed[slow])])
        place = _named(cells, targets, at.points[worst + int(found.share[worst] > 0.5)])
        with np.errstate(divide="ignore"):
            times = speed / found.sampled_speed[worst]
        said = too_slow(robot, int(found.joint[worst]), times, f" at cell {place}")
        faults.append(said + _others(len(slow) - 1))
    near = np.flatnonzero(~(found.sigma >= (sigma or -np.inf)))
    if len(near):
        worst = int(near[np.argmin(found.sampled_sigma[near])])
        place = _named(cells, targets, at.points[worst])
        faults.append(
            f"the smallest singular value is {found.sampled_sigma[worst]:.3g} at cell {place}; "
            f"{sigma:g} is required" + _others(len(near) - 1)
        )
    return RateReplay(
        float(found.speed[~resting].min(initial=np.inf)), float(found.sigma.min(initial=np.inf)),
        found, stops, float(lasts[waits].sum()), tuple(faults),
    )  # fmt: skip


def in_place(robot: Robot, cells: Cells, task: Task, q: Array) -> Mask:
    """(m - 1,) segments of rows q (m, n) on which the tool stays in place over one of the cells.

    Between its ends the tool point is off its chord by D / 8 at most, see `segment_rates`.
    """
    targets, tolerance = task.targets(cells).points, task.effective_tolerance
    if len(q) < 2 or not len(targets):
        return np.zeros(max(len(q) - 1, 0), dtype=bool)
    poses = jacobians(Kinematics(robot), q)
    off, nearest = cKDTree(targets).query(poses.points)
    after = np.linalg.norm(poses.points[1:] - targets[nearest[:-1]], axis=1)
    second = second_derivatives(np.abs(np.diff(q, axis=0)), robot.prismatic, poses.levers, np.inf)
    ends = np.maximum(off[:-1], after)
    return np.asarray((ends <= IN_PLACE * tolerance) & (ends + second / 8.0 <= tolerance))


def too_slow(robot: Robot, joint: int, times: float, where: str) -> str:
    """How fast a joint would have to be, so many times as fast as it may, `where`."""
    allowed = float(robot.max_velocity[joint])
    unit = "m/s" if robot.prismatic[joint] else "rad/s"
    needed = f"{allowed * times:.3g} {unit}" if np.isfinite(times) else "endless speed"
    return f"{robot.joint_names[joint]} would need {needed}{where}; it allows {allowed:.3g}"


def _others(count: int) -> str:
    """How many segments are wrong besides."""
    return f" ({count:,} other segments, too)" if count > 0 else ""


def _nearest(targets: Array, point: Array) -> int:
    return int(np.linalg.norm(targets - point, axis=1).argmin())


def _named(cells: Cells, targets: Array, point: Array) -> str:
    """The cell whose target is nearest to a tool point."""
    return str(list(cells.unravel(_nearest(targets, point))))


def _stops(points: Array, targets: Array, resting: Mask, waits: Mask) -> tuple[Stop, ...]:
    """Runs of segments on which the tool waits, and corners between those not in place."""
    if not len(resting):
        return ()
    begins = np.flatnonzero(waits & ~np.append(False, waits[:-1]))
    stops = [Stop("in place", int(k), _nearest(targets, points[k])) for k in begins]
    way = np.diff(points, axis=0)
    length = np.linalg.norm(way, axis=1)
    moving = np.flatnonzero(~resting & (length > CLOSE_TO_ZERO))
    unit = way[moving] / length[moving, None]
    turned = (unit[:-1] * unit[1:]).sum(axis=1) < np.cos(np.radians(CORNER_DEG))
    waited = np.append(0, np.cumsum(waits))
    corners = moving[1:][turned & (waited[moving[1:]] == waited[moving[:-1]])]
    stops += [Stop("corner", int(k), _nearest(targets, points[k])) for k in corners]
    return tuple(sorted(stops, key=lambda stop: stop.row))


def check_rates(robot: Robot, task: Task) -> None:
    """Refuse a speed that no motion of this arm has, or that nobody can judge.

    Raises:
        ArgumentError: joints have no velocity limits, or the speed is beyond all of them together.
    """
    if task.speed is None:
        return
    unknown = [robot.joint_names[j] for j in np.flatnonzero(~np.isfinite(robot.max_velocity))]
    if unknown:
        what = f"cannot be judged: the URDF of {robot.name!r} limits no velocity of "
        add = 'add velocity="..." to <limit>, or max_velocity_deg (_m) to [[robot.axis]]'
        raise ArgumentError(Fault("speed", what + ", ".join(unknown), expected=add), "task")
    most = fastest_anywhere(robot)
    if task.speed > most:
        what = f"got {task.speed:g}, but with all joints at their velocities the tool of "
        what += f"{robot.name!r} has less than {most:.3g} m/s anywhere"
        raise ArgumentError(Fault("speed", what, expected="give less"), "task")
