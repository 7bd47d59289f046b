"""What a motion does: the figures of a path, and the same motion some full turns of joints away."""

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Ints, Mask, Protected
from feasibility.certification.segment_rates import smallest_singular_values
from feasibility.task import Task
from feasibility.verdict import Certificate, Walk
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

TURN = 2.0 * np.pi
ROUNDING = 1e-12  # [1] of a turn
BETWEEN = 4  # places along each straight line of joints at which the tool point is computed


@dataclass(frozen=True, eq=False, slots=True)
class PathFigures(Protected):
    """What a path does, measured along it."""

    length: float
    """m, length of the tool point's path, projected onto the surface."""
    revisited: float
    """m, the part of it that leads to cells visited before."""
    travel: Array
    """(n,) rad or m, travel of each joint, back and forth."""
    turn_margin: float
    """rad, smallest distance of a revolute joint from its limits; inf without such limits."""
    slide_margin: float
    """m, the same for sliding joints."""
    cone_margin: float
    """rad, smallest margin to the cone, between waypoints too."""
    singular_value: float
    """Smallest singular value along the path of the Jacobian of tool point (over the arm's reach)
    and approach axis: 0 where the tool cannot be moved in some direction. For arms of fewer than
    five joints the smallest of as many as there are joints."""

    @property
    def covered(self) -> float:
        """m, the part of the length that leads to cells not visited before."""
        return self.length - self.revisited

    @property
    def revisited_share(self) -> float:
        """Revisited length over covered length; 0 where there is neither."""
        return self.revisited / self.covered if self.covered > 0.0 else 0.0


def figures_of(
    robot: Robot,
    cells: Cells,
    task: Task,
    walk: Walk,
    certificate: Certificate,
    needed: Mask,
) -> PathFigures:
    """Measure a path over the cells `needed` (N,) that a replay has accepted with a certificate."""
    along, at = denser(walk.q, np.full(len(walk.q) - 1, BETWEEN))
    points, _ = Kinematics(robot).tools(along)
    closest_point = cells.surface.closest(points)
    places = points - closest_point.height[:, None] * closest_point.normal
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    margins = np.minimum(walk.q - robot.lower, robot.upper - walk.q)
    turns, slides = margins[:, ~robot.prismatic], margins[:, robot.prismatic]
    return PathFigures(
        length=float(steps.sum()),
        revisited=float(steps[revisiting(walk)[at[:-1].astype(int)]].sum()),
        travel=np.abs(np.diff(walk.q, axis=0)).sum(axis=0),
        turn_margin=float(turns.min(initial=np.inf)),
        slide_margin=float(slides.min(initial=np.inf)),
        cone_margin=task.cone - certificate.max_angle,
        singular_value=float(smallest_singular_values(robot, walk.q).min()),
    )


def revisiting(walk: Walk) -> Mask:
    """(m - 1,) segments of a walk that lead to a cell visited before.

    The segments from one marked waypoint to the next lead to the cell of the latter.
    """
    marks = np.flatnonzero(walk.cell >= 0)
    again = np.ones(len(marks), dtype=bool)
    again[np.unique(walk.cell[marks], return_index=True)[1]] = False
    return np.append(again, False)[np.searchsorted(marks, np.arange(1, len(walk.q)))]


def denser(q: Array, counts: Ints) -> tuple[Array, Array]:
    """More rows of a motion q (m, n), so many on each of its straight lines; m at least 1.

    Returns:
        (k, n) its rows, and (k,) where each is: the row before it, with the share of the line.
    """
    of = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[of]
    rows = q[of] + share[:, None] * (q[of + 1] - q[of])
    return np.vstack([rows, q[-1:]]), np.append(of + share, len(q) - 1.0)


def turns_inside(robot: Robot, q: Array) -> Array:
    """(2, n) fewest and most full turns by which joints can be moved on all along q (m, n)."""
    with np.errstate(invalid="ignore"):
        fewest = np.ceil((robot.lower - q.min(axis=0)) / TURN - ROUNDING)
        most = np.floor((robot.upper - q.max(axis=0)) / TURN + ROUNDING)
    return np.where(robot.prismatic, 0.0, [np.minimum(fewest, 0.0), np.maximum(most, 0.0)])


def unwound(robot: Robot, task: Task, walk: Walk) -> Walk:
    """A motion whose joints stay about as near to home, or the middle of their limits, as can be.

    Full turns of a joint place the arm alike. A search takes the turn that it comes upon, which may
    leave a joint with 300 deg where it could have -60. Where the arm has a start nothing is turned.
    """
    if robot.start is not None or not len(walk.q):
        return walk
    bounded = np.isfinite(robot.lower) & np.isfinite(robot.upper)
    with np.errstate(invalid="ignore"):  # a joint without limits has no middle
        wanted = np.where(bounded, 0.5 * (robot.lower + robot.upper), 0.0)
        if task.home_deg is not None:
            wanted = np.radians(task.home_deg)
        turns = np.round((wanted - 0.5 * (walk.q.min(axis=0) + walk.q.max(axis=0))) / TURN)
    turns = np.clip(turns, *turns_inside(robot, walk.q))
    if not turns.any():
        return walk
    # Rounding must not move a joint past its limit.
    q = np.where(turns != 0.0, np.clip(walk.q + TURN * turns, robot.lower, robot.upper), walk.q)
    return Walk(q=q, cell=walk.cell)
