"""Time along a path: as fast as joints and tool may, from rest to rest.

The path's straight lines are blended into a smooth curve (`blended`), along which the largest speed
is found that velocities, accelerations and the tool's speed allow (`timed_curve`), so that all
limits hold along the curve.

A controller sees its samples only, and puts quintics or cubics through them (`sampled_trajectory`).
The fastest timing of a curve jumps from one acceleration to another, and these swing past both. So
the joints that would exceed a limit then are given less there, the curve is timed again, and the
little that is left is mended by running slower. The samples at last are replayed like any witness:
as a motion of straight lines, of quintics and of cubics; collisions between samples too, along the
polynomials themselves, or along lines with bounds on how far these are from them.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from coverable_arrays import Array
from coverable_errors import real
from feasibility.certification import collision_replay, replay
from feasibility.collisions import Bodies, checked, gather
from feasibility.paths import CoveragePath, PathError
from feasibility.task import Task
from feasibility.timing.between_samples import NearMotion, deviations_between, motion_near
from feasibility.timing.sampled_trajectory import (
    KINDS,
    PLACES,
    Trajectory,
    accelerations_each,
    held_inside,
    motion_between,
    past_limits,
    used_by_joints,
)
from feasibility.timing.smoothing import Curve, blended, control_points
from feasibility.timing.speed_limits import MotionLimits, motion_limits, tool_slopes
from feasibility.timing.timed_curve import TimedCurve, samples, speed_bounds, timed_curve
from feasibility.timing.tool_between_samples import fastest_tool
from feasibility.verdict import Walk
from robots import Robot
from surfaces.toolpaths import PoseSurface

DEFAULT_SPEED = 0.1  # [m/s] of the tool point
DEFAULT_PERIOD = 0.02  # [s] between samples
SHORTEST, LONGEST = 0.0001, 10.0  # [s], periods that can be requested
FINER = 4  # times that the period may be halved
MENDED = 1e-6  # [rad] or [m] past a joint's limit between samples: the motion is drawn in by that
ROUNDS = 6  # timings of a curve, each with less where joints exceeded a limit
PARTS = (1.0, 0.95, 0.91, 0.86)  # [1] of a period: where samples lie between jumps is chance
SLIGHTLY = 1.01  # [1] times a limit that is mended by slowing all of it down
SLOWINGS = 8  # times that the last of them is slowed down a little; and then as much as it needs
SMALL = 1.004  # [1] times that this is slower
RESERVE = 1e-3  # [1] share of all limits that is left free
MOST_SAMPLES = 1_000_000  # of one trajectory


def trajectory(
    path: CoveragePath,
    speed: float = DEFAULT_SPEED,
    *,
    velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    period: float = DEFAULT_PERIOD,
) -> Trajectory:
    """Run a path as fast as its limits allow.

    Args:
        path: the path.
        speed: m/s, largest speed of the tool point.
        velocity: rad/s or m/s, of all joints or (n,) of each; the URDF's limits by default.
        acceleration: rad/s^2 or m/s^2, of all joints or (n,) of each; by default what takes a joint
            to its largest velocity in half a second.
        period: s between samples; one more is taken where a cell's centre is passed. It is
            halved where the motion between samples would leave the tolerance.

    Returns:
        The samples. They keep to the limits, and the independent replay accepts them, as straight
        lines and as the quintics and cubics that controllers make of them.

    Raises:
        PathError: a number is not as it should be, or no such motion was found.

    Example:
        >>> from feasibility import Task, check
        >>> from feasibility.paths import coverage_path
        >>> from robots import load_robot
        >>> from surfaces import plane
        >>> plate = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> verdict = check(load_robot("ur5"), plate.cells(2, 3), Task(standoff=0.02, cone_deg=30))
        >>> run = trajectory(coverage_path(verdict), speed=0.1)
        >>> round(float(run.tool_speed.max()), 2), run.duration > run.tool_way / 0.1
        (0.1, True)
    """
    robot, cells, task = path.robot, path.cells, path.task
    limits = motion_limits(robot, speed, velocity, acceleration)
    if not SHORTEST <= real(period) <= LONGEST:
        raise PathError(f"the period must be {SHORTEST} to {LONGEST} seconds, got {period!r}")
    if len(np.unique(path.walk.q, axis=0)) == 1:
        q, still = path.walk.q[:1], np.zeros((1, robot.n))
        names = tuple(checked(task.collision))
        return Trajectory(
            robot.joint_names, np.zeros(1), q, still, still, np.zeros(1), path.walk.cell[:1], names
        )
    if task.collision is not None:
        # Turns found without collisions mostly stay clear, and the motion is judged anyway.
        curve = blended(robot, cells, replace(task, collision=None), path.walk)
        run, refusal = _judged(path, curve, limits, period)
        if not refusal:
            return _with_work(path, run)
    curve = blended(robot, cells, task, path.walk)
    for _ in range(FINER + 1):
        run, refusal = _judged(path, curve, limits, period)
        if not refusal:
            return _with_work(path, run)
        period *= 0.5
    raise PathError(f"the independent replay refuses the timed motion: {refusal}")


def _with_work(path: CoveragePath, run: Trajectory) -> Trajectory:
    """The same with where the tool works, if that is not all along."""
    surface = path.cells.surface
    if not isinstance(surface, PoseSurface) or surface.working is None:
        return run
    working = surface.works(run.cell)
    return run if working.all() else replace(run, working=working)


def _judged(
    path: CoveragePath, curve: Curve, limits: MotionLimits, period: float
) -> tuple[Trajectory, str]:
    """Samples of a curve, and why they are refused; empty if they are not."""
    run = within_limits(path.robot, curve, limits, period)
    if past_limits(path.robot, run).max(initial=0.0) <= MENDED:
        run = held_inside(path.robot, run)
    return replace(run, collisions=tuple(checked(path.task.collision))), _refusal(path, run)


def within_limits(robot: Robot, curve: Curve, limits: MotionLimits, period: float) -> Trajectory:
    """Samples of a curve that keep to the limits however they are interpolated.

    Raises:
        PathError: no such timing was found.
    """
    less, share = 1.0 - RESERVE, np.ones((1, robot.n))
    given = MotionLimits(
        less * limits.velocity, less * limits.acceleration, less * limits.tool_speed
    )
    bounds = speed_bounds(robot, curve, given)
    for _ in range(ROUNDS):
        timed = timed_curve(bounds, share)
        if timed.duration > MOST_SAMPLES * period:
            raise PathError(
                f"the motion takes {timed.duration:,.0f} s, more than {MOST_SAMPLES:,} samples "
                f"{period:g} s apart; give a higher speed, velocity or acceleration, or a longer "
                "period"
            )
        runs = [samples(robot, timed, part * period, with_tool=False) for part in PARTS]
        over = _over(timed, runs, limits)
        if over.max() <= SLIGHTLY:
            break
        share = share / over
    slower = 1.0
    for attempt in range(2 * SLOWINGS):
        run = samples(robot, timed.slowed(slower), period, with_tool=False)
        too_fast = used_by_joints(run, limits).too_fast
        if too_fast <= 1.0:
            too_fast = fastest_tool(robot, run, limits.tool_speed) / limits.tool_speed
        if too_fast <= 1.0:
            return replace(run, tool_speed=tool_slopes(robot, run.q, run.dq))
        # Other samples are over by another little: at first small steps, which may do.
        slower *= min(too_fast, SMALL if attempt < SLOWINGS else too_fast) + RESERVE
    raise PathError(
        "no timing was found that keeps to the limits between samples too; a shorter period helps"
    )


def _over(timed: TimedCurve, runs: list[Trajectory], limits: MotionLimits) -> Array:
    """(m - 1, n) largest share of each joint's acceleration in samples near a piece; 1 at least."""
    worst = np.ones((len(timed.time) - 1, len(limits.acceleration)))
    for run in runs:
        share = accelerations_each(run, limits)
        for k in np.flatnonzero(share.max(axis=1) > 1.0).tolist():
            first = int(np.searchsorted(timed.time, run.time[max(k - 1, 0)]))
            last = int(np.searchsorted(timed.time, run.time[min(k + 2, len(run) - 1)]))
            near = worst[max(first - 1, 0) : last]
            np.maximum(near, share[k], out=near)
    return worst


def timed_moves(
    robot: Robot, rows: Array, share: float, limits: MotionLimits, period: float, slower: float
) -> Trajectory:
    """Samples of a motion that is over no surface: straight lines between rows, turns blended.

    Args:
        robot: the arm.
        rows: (k, n) rad or m.
        share: of the shorter line next to each row that its turn uses on either side.
        limits: to keep to.
        period: s between samples.
        slower: times that it is run slower than it might be.

    Raises:
        PathError: no such timing was found.
    """
    apart = np.append(True, np.abs(np.diff(rows, axis=0)).max(axis=1) > 0.0)
    kept = rows[apart] if apart.sum() > 1 else rows[:1]
    cell = np.full(len(kept), -1, dtype=np.int64)
    cell[[0, -1]] = 0  # marked, so that both ends are sampled
    walk = Walk(q=kept, cell=cell)
    curve = control_points(walk, np.full(len(kept), share))
    less = MotionLimits(
        limits.velocity / slower, limits.acceleration / slower**2, limits.tool_speed / slower
    )
    run = within_limits(robot, curve, less, period)
    return replace(run, cell=np.full(len(run), -1, dtype=np.int64))


def move_refusal(path: CoveragePath, run: Trajectory) -> str:
    """Why a timed motion that is over no surface is refused: limits, bodies; empty if it is not."""
    return _past_limits(path.robot, run) or _collisions(path, run)


def _refusal(path: CoveragePath, run: Trajectory) -> str:
    """Why the samples are refused, as straight lines or interpolated; empty if they are not."""
    return _past_limits(path.robot, run) or _off_surface(path, run) or _collisions(path, run)


def _past_limits(robot: Robot, run: Trajectory) -> str:
    """How far a joint may go past its limits; empty where all keep to them."""
    past = float(past_limits(robot, run).max(initial=0.0))
    return f"between samples a joint may go {past:.2g} (rad or m) past its limits" * (past > 0.0)


def _off_surface(path: CoveragePath, run: Trajectory) -> str:
    """Why the replay refuses the tool alone; empty where it accepts the samples."""
    tool_alone = replace(path.task, collision=None)
    replayed = replay(path.robot, path.cells, tool_alone, run.walk, path.needed)
    for kind in KINDS if replayed.accepted else ():
        if _near_enough(path, tool_alone, motion_near(path.robot, run, kind)):
            continue
        walk = motion_between(run, kind, PLACES)
        replayed = replay(path.robot, path.cells, tool_alone, walk, path.needed)
        if not replayed.accepted:
            break
    return replayed.refusal


def _near_enough(path: CoveragePath, task: Task, near: NearMotion) -> bool:
    """Is all that is near a motion of straight lines shown to be right?

    How far the roll may be off is not known.
    """
    if task.roll is not None:
        return False
    replayed = replay(path.robot, path.cells, task, near.walk, path.needed)
    off = replayed.certificate.max_position_error + near.point
    tilt = replayed.certificate.max_angle + near.turn
    return replayed.accepted and off <= task.effective_tolerance and tilt <= task.cone


def _collisions(path: CoveragePath, run: Trajectory) -> str:
    """Which bodies come too near, as straight lines or interpolated; empty if all stay clear."""
    robot, task = path.robot, path.task
    bodies = gather(robot, path.cells.surface, task.collision, task.standoff)
    if bodies is None:
        return ""
    # At once, as lines between samples that all of them are near, where that is clear enough.
    away = np.maximum.reduce([deviations_between(run, kind, run.q) for kind in KINDS])
    if not _collision(robot, bodies, run.q, run.time, away):
        return ""
    found = _collision(robot, bodies, run.walk.q, run.time)
    for kind in KINDS:
        walk = motion_between(run, kind, PLACES)
        share = np.arange(len(walk.q)) / PLACES
        time = np.interp(share, np.arange(len(run)), run.time)
        deviations = deviations_between(run, kind, walk.q)
        found = found or _collision(robot, bodies, walk.q, time, deviations)
    return found


def _collision(
    robot: Robot, bodies: Bodies, q: Array, time: Array, deviations: Array | None = None
) -> str:
    """Which pair comes nearest to each other, how near, and when; empty if all stay clear.

    Rows q (m, n) are at times (m,) s; joints may be off the straight lines between them by
    `deviations` (m - 1, n).
    """
    replayed = collision_replay(robot, bodies, q, deviations)
    if replayed.accepted:
        return ""
    fault = replayed.faults[0]
    at = float(np.interp(fault.row + fault.share, np.arange(len(time)), time))
    return f"{fault.text}, at {at:.3f} s"
