"""Time along a path: as fast as joints and tool may, from rest to rest.

The path's straight lines are blended into a smooth curve (`blended`), fast speeds along it are
found (`timed_curve`), and it is sampled: the motion is the spline through the samples
(`sampled_trajectory`). It is judged by what it is, not by how it was made: where it exceeds a
limit, the curve is timed again with less of that there, and what is left is mended by running all
of it slower. At last it is replayed like any witness, as straight lines and as the spline.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints, Mask
from coverable.errors import real
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.certification.motion_replay import replay
from feasibility.collisions.asked_bodies import gather
from feasibility.collisions.problem_bodies import Bodies
from feasibility.collisions.words import checked
from feasibility.paths.coverage import CoveragePath
from feasibility.paths.order import PathError
from feasibility.task import Task
from feasibility.timing.sampled_trajectory import Trajectory
from feasibility.timing.smooth_curve import Curve, blended, control_points, without_slivers
from feasibility.timing.speed_limits import (
    PLACES,
    MotionLimits,
    motion_limits,
    past_limits,
    used,
    used_each,
)
from feasibility.timing.timed_curve import CurveBounds, TimedCurve
from feasibility.verdict import Walk
from robots.robot import Robot
from surfaces.toolpaths.pose_surface import PoseSurface

DEFAULT_SPEED = 0.1  # [m/s] of the tool point
DEFAULT_PERIOD = 0.02  # [s] between samples
SHORTEST, LONGEST = 0.0001, 10.0  # [s], periods that can be requested
FINER = 4  # times that the period may be halved
FREE = 1e-6  # [rad] or [m] from joint limits to samples: between them a joint may come nearer
ROUNDS = 6  # timings of a curve, each with less where something was exceeded
SLIGHTLY = 1.01  # [1] times a limit that is mended by slowing all of it down
SLOWINGS = 16  # times that the last of them is slowed down
RESERVE = 1e-3  # [1] share of all limits that is left free
ROUNDING = 1e-6  # [1] of a limit
SHARE = 0.25  # [1] of the lines next to it that a turn of entry and exit uses, at first
MOST_SAMPLES = 1_000_000  # of one trajectory


def trajectory(
    path: CoveragePath,
    speed: float = DEFAULT_SPEED,
    *,
    velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    period: float = DEFAULT_PERIOD,
    entry: Array | None = None,
    leave: Array | None = None,
) -> Trajectory:
    """Run a path as fast as its limits allow.

    The samples keep to the limits, and the replay accepts them, as straight lines and as the
    quintics and cubics that controllers make of them.

    Args:
        path: the path.
        speed: m/s, largest speed of the tool point.
        velocity: rad/s or m/s, of all joints or (n,) of each; the URDF's limits by default.
        acceleration: rad/s^2 or m/s^2, of all joints or (n,) of each; by default what takes a joint
            to its largest velocity in half a second.
        period: s between samples; one more is taken where a cell's centre is passed. It is
            halved where the motion between samples would leave the tolerance.
        entry, leave: (k, n) rad or m, moves before and behind it, see `division.between_patches`.

    Raises:
        PathError: a number is not as it should be, or no such motion was found.

    Example:
        >>> from coverable import Task, check
        >>> from coverable import coverage_path
        >>> from coverable import load_robot
        >>> from coverable import plane
        >>> plate = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> verdict = check(load_robot("ur5"), plate.cells(2, 3), Task(standoff=0.02, cone_deg=30))
        >>> run = trajectory(coverage_path(verdict), speed=0.1)
        >>> round(float(run.tool_speed.max()), 2), run.duration > run.tool_way / 0.1
        (0.1, True)
    """
    robot, task, walk = path.robot, path.task, path.walk
    limits = motion_limits(robot, speed, velocity, acceleration)
    if not SHORTEST <= real(period) <= LONGEST:
        raise PathError(f"the period must be {SHORTEST} to {LONGEST} seconds, got {period!r}")
    said, still = tuple(checked(task.collision)), len(np.unique(walk.q, axis=0)) == 1
    if still and entry is None and leave is None:
        run = Trajectory.through(robot, np.zeros(1), walk.q[:1], walk.cell[:1])
        return replace(run, collisions=said)
    # Turns found without collisions mostly stay clear, and the motion is judged anyway.
    tries = [] if task.collision is None else [(replace(task, collision=None), 0)]
    refusal, curves = "", dict[Task, Curve]()
    for asked, halvings in (*tries, *((task, k) for k in range(FINER + 1))):
        share = 0.5**halvings
        if asked not in curves and not still:
            curves[asked] = blended(robot, path.cells, asked, walk)
        into = _move(entry, SHARE * share, int(walk.cell[0]), -1)
        out = _move(leave, SHARE * share, int(walk.cell[-1]), 0)
        parts = [part for part in (into, curves.get(asked), out) if part is not None]
        run = within_limits(robot, parts, limits, period * share)
        run = replace(run, working=_working(path, run), collisions=said)
        refusal = _refusal(path, run)
        if not refusal:
            return run
    raise PathError(f"the independent replay refuses the timed motion: {refusal}")


def _move(rows: Array | None, share: float, cell: int, end: int) -> Curve | None:
    """A move along rows (k, n) as a curve; its turns use a share of the lines next to them.

    At the row `end`, 0 or -1, it passes the centre of a cell.
    """
    if rows is None:
        return None
    cells = np.full(len(rows), -1, dtype=np.int64)
    cells[end] = cell
    walk = without_slivers(Walk(rows, cells), 0.0)
    return control_points(walk, np.full(len(walk.q), share))


def _working(path: CoveragePath, run: Trajectory) -> Mask | None:
    """(k,) where the tool works; None if that is all along."""
    surface, working = path.cells.surface, np.zeros(len(run), dtype=bool)
    working[run.over] = True
    if isinstance(surface, PoseSurface) and surface.working is not None:
        working[run.over] = surface.works(run.cell[run.over])
    return None if working.all() else working


def within_limits(
    robot: Robot, curves: Sequence[Curve], limits: MotionLimits, period: float
) -> Trajectory:
    """Curves one after the other, each from rest to rest; samples that keep to the limits.

    Raises:
        PathError: no such timing was found.
    """
    less, slower = 1.0 - RESERVE, 1.0
    given = MotionLimits(
        less * limits.velocity, less * limits.acceleration, less * limits.tool_speed
    )
    bounds = [CurveBounds.of(robot, curve) for curve in curves]
    shares = [np.ones((len(bound.grid) - 1, 2 * robot.n + 1)) for bound in bounds]
    for attempt in range(ROUNDS + SLOWINGS):
        timed = [b.timed(given, share, slower) for b, share in zip(bounds, shares, strict=True)]
        duration = sum(part.duration for part in timed)
        if duration > MOST_SAMPLES * period:
            raise PathError(
                f"the motion takes {duration:,.0f} s, more than {MOST_SAMPLES:,} samples "
                f"{period:g} s apart; give a higher speed, velocity or acceleration, or a longer "
                "period"
            )
        run = _joined(robot, [part.samples(robot, period) for part in timed])
        too_fast = used(robot, run, limits).too_fast
        if too_fast <= 1.0 - ROUNDING:
            return run
        if attempt < ROUNDS and too_fast > SLIGHTLY:
            worst = _over(run, used_each(robot, run, limits), timed)
            shares = [share / over for share, over in zip(shares, worst, strict=True)]
        else:
            slower *= max(too_fast, 1.0) + RESERVE
    raise PathError(
        "no timing was found that keeps to the limits between samples too; a shorter period helps"
    )


def _over(run: Trajectory, each: Array, timed: Sequence[TimedCurve]) -> list[Array]:
    """(m - 1, 2 n + 1) of each curve, the largest share used near a piece; 1 at least."""
    begin, found = 0.0, list[Array]()
    for part in timed:
        worst = np.ones((len(part.time) - 1, each.shape[1]))
        inside = (run.time[1:] > begin) & (run.time[:-1] < begin + part.duration)
        for k in np.flatnonzero(inside & (each > 1.0).any(axis=1)).tolist():
            ends = run.time[[max(k - 1, 0), min(k + 2, len(run) - 1)]] - begin
            first, last = np.searchsorted(part.time, ends)
            near = worst[max(first - 1, 0) : last]
            np.maximum(near, each[k], out=near)
        found.append(worst)
        begin += part.duration
    return found


def _joined(robot: Robot, parts: Sequence[tuple[Array, Array, Ints]]) -> Trajectory:
    """Samples one after the other; each part begins where the one before it ends.

    Joints that come to a limit are drawn in a little, for what a spline is past its samples.
    """
    times, rows, cells, begin = list[Array](), list[Array](), list[Ints](), 0.0
    for time, q, cell in parts:
        first = int(begin > 0.0)
        times.append(np.round(begin + time[first:], 9))
        rows.append(q[first:])
        cells.append(cell[first:])
        begin = float(times[-1][-1])
    q, free = np.vstack(rows), np.minimum(FREE, 0.5 * (robot.upper - robot.lower))
    low, high = q.min(axis=0), q.max(axis=0)
    first, last = np.clip([low, high], robot.lower + free, robot.upper - free)
    q = first + (q - low) * (last - first) / np.maximum(high - low, np.finfo(float).tiny)
    return Trajectory.through(robot, np.concatenate(times), q, np.concatenate(cells))


def _refusal(path: CoveragePath, run: Trajectory) -> str:
    """Why a timed motion is refused, at its samples or between them; empty if it is not."""
    past = float(past_limits(path.robot, run).max(initial=0.0))
    if past > 0.0:
        return f"between samples a joint may go {past:.2g} (rad or m) past its limits"
    robot, tool_alone = path.robot, replace(path.task, collision=None)
    for places in (1, PLACES):
        walk, over = run.between(places), run.over
        part = slice(places * over.start, places * (over.stop - 1) + 1)
        q = np.clip(walk.q[part], robot.lower, robot.upper)  # rounding alone is outside
        replayed = replay(robot, path.cells, tool_alone, Walk(q, walk.cell[part]), path.needed)
        if not replayed.accepted:
            return replayed.refusal
    through = "" if run.working is None else path.through_surface(run.q, run.working)
    return through or _collisions(path, run)


def _collisions(path: CoveragePath, run: Trajectory) -> str:
    """Which bodies come too near, as straight lines or as the spline; empty if all stay clear."""
    robot, task = path.robot, path.task
    bodies = gather(robot, path.cells.surface, task.collision, task.standoff)
    if bodies is None:
        return ""
    # At once, as lines between samples that both are near, where that is clear enough.
    if not _collision(robot, bodies, run, 1, run.off_lines(1)):
        return ""
    found = _collision(robot, bodies, run, 1)
    return found or _collision(robot, bodies, run, PLACES, run.off_lines(PLACES))


def _collision(
    robot: Robot, bodies: Bodies, run: Trajectory, places: int, off: Array | None = None
) -> str:
    """Which pair comes nearest to each other, how near, and when; empty if all stay clear.

    Of straight lines between so many places of each piece; joints may be `off` these (m, n).
    """
    replayed = collision_replay(robot, bodies, run.between(places).q, off)
    if replayed.accepted:
        return ""
    fault = replayed.faults[0]
    share = (fault.row + fault.share) / places
    at = float(np.interp(share, np.arange(len(run)), run.time))
    return f"{fault.text}, at {at:.3f} s"
