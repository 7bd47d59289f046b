"""Moves between patches that keep clear of collisions, each judged like a walk.

Where the standoff is 0, the pairs of tool and surface are not checked while a patch is worked on.
Between patches they are, but for the lift itself: the tool is drawn back along its own axis.
"""

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.certification.lever_bounds import jacobians, second_derivatives
from feasibility.collisions.asked_bodies import gather
from feasibility.collisions.kernels.memory import collision_buffer
from feasibility.collisions.problem_bodies import Bodies
from feasibility.division.free_motion import FreeSpace, free_motion
from feasibility.division.reconfiguration import Reconfiguration
from feasibility.paths.order import PathError
from feasibility.task import Task
from robots.kinematics import Kinematics, configuration_near
from robots.robot import Robot
from surfaces.cells import Cells

LIFT, STRAIGHT = 0.02, 1e-4  # [m] how far a tool is lifted, and how straight between rows
STEP = 0.005  # [m] of the tool point drawn back from row to row, at most
MOST_HALVINGS = 6  # of that, until the motion is straight enough between rows
NEWTON = 20
CLOSE = 1e-7  # [m], and [1] of the axis


def clear_moves(
    robot: Robot, cells: Cells, task: Task, moves: Iterable[Reconfiguration]
) -> tuple[Reconfiguration, ...]:
    """Straight moves led around obstacles; the same where collisions are not checked.

    A tool that touches the surface is lifted first, and set down at the end: in between it has to
    stay clear of the surface too.
    """
    bodies = lifted = gather(robot, cells.surface, task.collision, task.standoff)
    if bodies is not None and any(one.why == "contact" for one in bodies.left_out):
        lifted = gather(robot, cells.surface, task.collision, LIFT)
    if bodies is None or lifted is None:
        return tuple(moves)
    buffer = collision_buffer(lifted, robot)
    return tuple(_clear(robot, bodies, lifted, buffer, move) for move in moves)


def _clear(
    robot: Robot, bodies: Bodies, lifted: Bodies, buffer: Array, move: Reconfiguration
) -> Reconfiguration:
    """A move that the judge accepts; the straight one, judged, where none was found.

    Where `bodies`, those at both ends, lack the pairs of tool and surface, `lifted` has them; else
    it is the same. The `buffer` is of `lifted`.
    """
    touches, between, kinematics = lifted is not bodies, None, Kinematics(robot)
    with suppress(PathError):  # a limit may prevent the lift
        up, down = (
            drawn_back(robot, q, -kinematics.tool(q)[1], LIFT, STRAIGHT) if touches else q[None]
            for q in (move.start, move.end)
        )
        between = free_motion(FreeSpace(robot, buffer), up[-1], down[-1], seed=0)
    if between is not None:
        rows = np.concatenate([up[:-1], between, down[-2::-1]])
        found = [collision_replay(robot, bodies, rows)]
        if touches:
            found.append(collision_replay(robot, lifted, between))
        if all(one.accepted for one in found):
            clear = [np.inf if x.min_clearance is None else x.min_clearance for x in found]
            return replace(move, via=rows[1:-1], replayed=found[int(np.argmin(clear))])
    replayed = collision_replay(robot, lifted, np.stack([move.start, move.end]))
    return replace(move, via=np.zeros((0, robot.n)), replayed=replayed)


def drawn_back(
    robot: Robot, q: Array, direction: Array, distance: float, tolerance: float
) -> Array:
    """Configurations (k, n) rad or m, from q on, that move the tool point straight back.

    The axis keeps its direction (3,), a unit vector. Between rows, too, the tool point is off the
    line by the tolerance (m) at most.

    Raises:
        PathError: a limit or a singularity prevents it.
    """
    kinematics = Kinematics(robot)
    point, axis = kinematics.tool(q)
    count = max(2, int(np.ceil(distance / STEP)))
    for _ in range(MOST_HALVINGS):
        rows = [q]
        for away in np.linspace(0.0, distance, count + 1)[1:].tolist():
            there = point + away * direction
            reached = configuration_near(kinematics, rows[-1], there, axis, NEWTON, CLOSE)
            if reached is None:
                why = _in_the_way(robot, rows[-1], away - distance / count)
                raise PathError(f"the tool cannot be drawn back by {1e3 * distance:g} mm: {why}")
            rows.append(reached)
        at, steps = jacobians(kinematics, np.array(rows)), np.abs(np.diff(rows, axis=0))
        bound = second_derivatives(steps, robot.prismatic, at.levers, np.inf)
        if bound.max() / 8.0 + CLOSE <= tolerance:
            return np.array(rows)
        count *= 2
    why = "the joints would have to turn too far meanwhile"
    raise PathError(f"the tool cannot be drawn back by {1e3 * distance:g} mm: {why}")


def _in_the_way(robot: Robot, q: Array, done: float) -> str:
    """What stops the tool at a configuration, after `done` m."""
    margin = np.minimum(q - robot.lower, robot.upper - q)
    joint = int(np.argmin(margin))
    after = f"after {1e3 * done:.3g} mm"
    if margin[joint] < 1e-6:
        return f"{after} {robot.joint_names[joint]} is at its limit"
    return f"{after} the arm cannot follow, being stretched out or folded up"
