"""How far a part may stand from where the case says, so that a continuous motion still exists.

**Claim.** Let q(t) be an accepted motion, and let any rigid motion g displace the surface against
the arm, by a translation of at most D and a turn of at most Theta about a pivot. Then there is a
continuous motion q_g(t) whose tool point runs along g(p(q(t))): so its distance from the displaced
surface, the cells it reaches and the tolerance it uses are exactly those of q(t). Joints stay
inside their limits, the tool inside cone and roll, bodies clear, singularities as far as asked.

`displacement_balls` has the lemma: along each stretch of the motion, what is within rho is followed
inside a ball |v| <= y of configurations q + P v. The part turns the approach direction by at most
Theta, and moves the tool point by rho = D + Theta r, r the largest distance from the pivot.

**Triangle.** With the bounds of one ball as constants, what it reaches is concave in y, and all
that is required of y is convex in (y, Theta). So where y_1 will do for (D, 0), and y_2 for
(0, Theta), means of both do between: for whatever has position / D + angle / Theta <= 1.

**Bodies.** How much nearer two may come as joints are off by e_j, and the part, or what is at rest
beside it, is displaced (both may be, or one), is convex in (D, Theta), too: the judge of collisions
says which share of it they allow.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from coverable.arrays import Array
from feasibility.certification.displacement_balls import (
    BELOW,
    BOUNDS,
    Balls,
    Given,
    balls_along,
    left_to_limits,
    ratio,
)
from feasibility.collisions.asked_bodies import gather
from feasibility.task import PlacementError, Task
from feasibility.verdict import Bound, Certificate, PlacementMargin
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

SHARES = (0.25, 1.0)  # [1] of a margin that bodies are asked about: less takes less of them


def placement_margin(
    robot: Robot, cells: Cells, task: Task, q: Array, room: Array, apart: float
) -> PlacementMargin:
    """The margin of an accepted motion; see the module.

    Args:
        robot, cells, task: the case.
        q: (m, n) the motion, m >= 1, rad or m.
        room: (m, 2) rad, what is left of cone and roll from each row to the next; inf where free.
        apart: m, that all pairs of bodies are along it, at least.
    """
    case = Given(robot, task, cells.centres.mean(axis=0))
    middle = tuple(case.pivot.tolist())
    if robot.start is not None:  # the motion has to begin there, wherever the part stands
        return PlacementMargin(0.0, 0.0, middle, Bound.START, _cell(case, cells, q[0]))
    if len(q) == 1:
        q, room = np.repeat(q, 2, axis=0), np.repeat(room, 2, axis=0)
    room = np.vstack([room[:-2], room[-2:].min(axis=0)])  # the last row ends the last segment
    balls = Balls.join(*balls_along(case, q, room))
    along = np.full(len(q) - 1, np.inf)
    np.minimum.at(along, balls.row, balls.positions)
    worst = balls.of(np.array([np.argmin(balls.positions)]))
    row, bound_by = int(worst.row[0]), BOUNDS[int(np.argmin(worst.allowed(0.0)))]
    what, most = "", (BELOW * float(along.min()), BELOW * float(balls.angles.min()))
    if bound_by is Bound.LIMIT:
        left = left_to_limits(robot, q[row], q[row + 1])
        what = robot.joint_names[int(np.argmin(ratio(left, worst.moves[0])))]
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    if bodies is not None and bodies.pairs and most[0] > 0.0:
        from feasibility.certification.displaced_bodies import displaced_share

        for some in SHARES:
            part, moved = (some * most[0], some * most[1]), np.zeros((len(along), robot.n))
            np.maximum.at(moved, balls.row, balls.moved(*part))
            clear = displaced_share(robot, bodies, q, case.pivot, part, moved, apart)
            if clear.share < 1.0:
                break
        most = clear.share * part[0], clear.share * part[1]
        if clear.pair is not None:
            row, bound_by, what = clear.row, Bound.CLEARANCE, " and ".join(clear.pair)
    return PlacementMargin(*most, middle, bound_by, _cell(case, cells, q[row]), what, along)


def _cell(case: Given, cells: Cells, q: Array) -> tuple[int, ...]:
    """The cell whose target is nearest to the tool at q (n,)."""
    off = case.task.targets(cells).points - Kinematics(case.robot).tool(q)[0]
    return cells.unravel(int(np.linalg.norm(off, axis=1).argmin()))


def margin_fault(task: Task, certificate: Certificate) -> str:
    """Why the margin is less than what the task asks for; empty where it is not, or not known."""
    if task.placement_error is None or certificate.placement_margin is None:
        return ""
    error, margin = PlacementError(*task.placement_error), certificate.placement_margin
    if margin.share(error) <= 1.0:
        return ""
    asked = f"{1e3 * error.position:g} mm and {error.angle_deg:g} deg off its place"
    return f"the part may stand {asked}; certified is {margin}"


def margin_of(
    robot: Robot, cells: Cells, task: Task, q: Array, room: Array
) -> Callable[[float | None], PlacementMargin]:
    """`placement_margin` by how far bodies are apart, found once, when it is first asked for."""
    return cache(lambda apart: placement_margin(robot, cells, task, q, room, apart or 0.0))
