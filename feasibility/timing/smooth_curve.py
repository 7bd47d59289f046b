"""A smooth curve along a motion of straight lines, certified like the motion itself.

The curve is a uniform cubic B-spline whose control points lie on the lines: each waypoint W with
one control point on either side of it. So

- it stays in the convex hull of points that are inside the joint limits, and is inside them too;
- where four control points in a row are on one line, it is on that line;
- at a waypoint it is off by (W- - 2 W + W+) / 6: the nearer the neighbours, the sharper the turn.

Each turn begins as wide as its lines allow, and is made sharper until the independent replay
accepts the curve. At a cell's centre it must leave the tool within tolerance and cone of its
target, which is tried beforehand.
"""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from coverable.arrays import Array, Ints
from feasibility.certification.motion_replay import replay
from feasibility.paths.order import PathError
from feasibility.task import Task
from feasibility.timing.sampled_trajectory import deviations
from feasibility.verdict import Walk
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

WIDEST = 0.5  # [1] share of the lines next to a waypoint that its turn may use
SHARPEST = 2.0**-12  # [1] share below which it is given up
GROWTH = 2.0  # [1] how much longer a piece between control points may be than the one before it
SAMPLES = 4  # places on each piece of the curve that a replay looks at
ROUNDING = 1e-12  # [rad] or [m]
NO_TURN = 0.25  # [1] share of the first and of the last line up to their first control point
SLIVERS = (3e-3, 1e-5)  # [rad] or [m], waypoints nearer than this to others are left out


@dataclass(frozen=True, eq=False, slots=True)
class Curve:
    """A uniform cubic B-spline q(k), k from 0 to the number of its pieces."""

    control: Array
    """(K, n) control points; q(k) is near control point k, q(0) and q(K - 1) are at the ends."""
    marks: Ints
    """(m,) k where the curve passes centres of cells."""
    cell: Ints
    """(m,) those cells."""

    @property
    def pieces(self) -> int:
        """Number of cubics."""
        return len(self.control) - 1

    def spline(self) -> BSpline:
        """The curve as a function of k; its derivatives are `.derivative(1)` and so on."""
        first = 2.0 * self.control[0] - self.control[1]
        last = 2.0 * self.control[-1] - self.control[-2]
        points = np.vstack([first, self.control, last])
        return BSpline(np.arange(-3.0, len(points) + 1.0), points, 3, extrapolate=False)


def control_points(walk: Walk, shares: Array) -> Curve:
    """The curve along a motion.

    Args:
        walk: m >= 2 waypoints, no two in a row alike.
        shares: (m,) share of the shorter line next to each waypoint that its turn uses on either
            side, at most 1/2. The first and the last waypoint have no turn.
    """
    lines = np.diff(walk.q, axis=0)
    length = np.sqrt((lines**2).sum(axis=1))
    wide = shares[1:-1] * np.minimum(length[:-1], length[1:])
    before = np.concatenate([[NO_TURN], wide / length[1:]])
    behind = np.concatenate([wide / length[:-1], [NO_TURN]])
    ts, segments = [np.zeros(1)], [np.zeros(1, dtype=np.int64)]
    at = np.zeros(len(walk.q), dtype=np.int64)  # control point of each waypoint
    for k, (first, last) in enumerate(zip(before.tolist(), behind.tolist(), strict=True)):
        inner = graded(first, last)
        ts.append(np.append(inner, 1.0))
        segments.append(np.full(len(inner) + 1, k))
        at[k + 1] = at[k] + len(inner) + 1
    t, segment = np.concatenate(ts)[:, None], np.concatenate(segments)
    control = walk.q[segment] + t * lines[segment]
    control[at] = walk.q  # exactly
    marked = walk.cell >= 0
    return Curve(control, at[marked], walk.cell[marked])


def graded(first: float, last: float) -> Array:
    """Places in 0..1 from `first` to 1 - `last`, whose gaps grow from both ends by `GROWTH`.

    In the middle, where the rest is shared out, two gaps may differ by twice that.

    Example:
        >>> graded(0.5, 0.5).tolist(), graded(0.125, 0.5).tolist()
        ([0.5], [0.125, 0.3125, 0.5])
    """
    low, high = [first], [1.0 - last]
    steps = [first, last]
    while high[-1] - low[-1] > GROWTH * min(steps):
        side = int(steps[1] < steps[0])
        steps[side] = min(GROWTH * steps[side], 0.5 * (high[-1] - low[-1]))
        if side == 0:
            low.append(low[-1] + steps[0])
        else:
            high.append(high[-1] - steps[1])
    if high[-1] - low[-1] <= 1e-9:
        high.pop()
    return np.array(low + high[::-1])


def sampled(robot: Robot, curve: Curve, first: int, last: int) -> Walk:
    """The curve between two of its marks as a walk of straight lines."""
    low, high = int(curve.marks[first]), int(curve.marks[last])
    k = np.linspace(low, high, SAMPLES * (high - low) + 1)
    cell = np.full(len(k), -1, dtype=np.int64)
    cell[SAMPLES * (curve.marks[first : last + 1] - low)] = curve.cell[first : last + 1]
    return Walk(q=inside(robot, curve.spline()(k)), cell=cell)


def inside(robot: Robot, q: Array) -> Array:
    """The same configurations with what rounding has put outside the limits put back."""
    near = (q > robot.lower - ROUNDING) & (q < robot.upper + ROUNDING)
    return np.where(near, np.clip(q, robot.lower, robot.upper), q)


def blended(robot: Robot, cells: Cells, task: Task, walk: Walk) -> Curve:
    """The smoothest curve of its kind along an accepted motion that the replay accepts too.

    The motion begins and ends at a cell's centre.

    Raises:
        PathError: the replay refuses the curve, however sharp its turns.
    """
    fault = ""
    for sliver in SLIVERS:
        thin = without_slivers(walk, sliver)
        curve, where, why = _turned(robot, cells, task, thin)
        if curve is not None:
            return curve
        fault = f"{list(cells.unravel(int(thin.cell[thin.cell >= 0][where])))} on ({why})"
    raise PathError(
        f"no smooth motion was found that the replay accepts from cell {fault}, however sharply it "
        "turns; use a larger tolerance or a wider cone"
    )


def _turned(robot: Robot, cells: Cells, task: Task, walk: Walk) -> tuple[Curve | None, int, str]:
    """The accepted curve along a motion; or None, the mark from which on it is refused, and why."""
    shares = _near_targets(robot, cells, task, walk)
    marks = np.flatnonzero(walk.cell >= 0)
    last = len(marks) - 1
    curve = control_points(walk, shares)
    refused = _refused(robot, cells, task, curve, 0, last)
    while refused:
        while refused:
            for k in refused:
                shares[marks[k] : marks[k + 1] + 1] *= 0.5
            if shares.min() < SHARPEST:
                return None, *next(iter(refused.items()))
            curve = control_points(walk, shares)
            # Only these and the ones next to them have changed; all are replayed again in the end.
            changed = sorted({near for k in refused for near in (k - 1, k, k + 1)} - {-1, last})
            again = [_refused(robot, cells, task, curve, k, k + 1) for k in changed]
            refused = {k: why for found in again for k, why in found.items()}
        refused = _refused(robot, cells, task, curve, 0, last)
    return curve, -1, ""


def _near_targets(robot: Robot, cells: Cells, task: Task, walk: Walk) -> Array:
    """(m,) the widest shares with which the tool is right where the curve passes marked waypoints.

    No replay would accept wider ones. How far off a waypoint the curve is depends on its own share.
    """
    shares, aims = np.full(len(walk.q), WIDEST), task.targets(cells)
    points, approaches = aims.points[walk.cell], aims.approaches[walk.cell]
    wide = np.flatnonzero(walk.cell >= 0)
    while len(wide):
        curve = control_points(walk, shares)
        at = np.searchsorted(np.flatnonzero(walk.cell >= 0), wide)
        q = inside(robot, curve.spline()(curve.marks[at].astype(float)))
        tool, axes = Kinematics(robot).tools(q)
        off = np.linalg.norm(tool - points[wide], axis=1) > task.effective_tolerance
        tilted = np.linalg.norm(axes - approaches[wide], axis=1) > task.cone_chord
        wide = wide[(off | tilted) & (shares[wide] >= SHARPEST)]
        shares[wide] *= 0.5
    return shares


def _refused(
    robot: Robot, cells: Cells, task: Task, curve: Curve, first: int, last: int
) -> dict[int, str]:
    """Why the replay refuses which stretches between marks `first` and `last`, by halving."""
    nowhere, walk = np.zeros(len(cells), dtype=bool), sampled(robot, curve, first, last)
    k = np.arange(int(curve.marks[first]), int(curve.marks[last]) + 1)
    seconds = curve.spline().derivative(2)(k) / SAMPLES**2  # it runs straight from one to the next
    both = np.repeat(np.stack([seconds[:-1], seconds[1:]]), SAMPLES, axis=1)
    replayed = replay(robot, cells, task, walk, nowhere, deviations(walk.q, both))
    if replayed.accepted:
        return {}
    if last == first + 1:
        return {first: replayed.refusal}
    middle = (first + last) // 2
    return {
        **_refused(robot, cells, task, curve, first, middle),
        **_refused(robot, cells, task, curve, middle, last),
    }


def without_slivers(walk: Walk, sliver: float) -> Walk:
    """The same motion without waypoints that hardly differ from the ones next to them.

    Marked waypoints stay, but of two in a row over one cell only the later. The replay of what
    comes of it decides whether it will do.
    """
    kept: list[int] = []
    for k in range(len(walk.q)):
        while kept and np.abs(walk.q[k] - walk.q[kept[-1]]).max() <= sliver:
            last = int(walk.cell[kept[-1]])
            if last >= 0 and last != walk.cell[k]:
                break
            kept.pop()
        near = bool(kept) and np.abs(walk.q[k] - walk.q[kept[-1]]).max() <= sliver
        if not near or walk.cell[k] >= 0:
            kept.append(k)
    return Walk(q=walk.q[kept], cell=walk.cell[kept])
