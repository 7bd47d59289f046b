"""Moves between patches that keep clear of collisions, each judged like a walk.

Where the standoff is 0, the pairs of tool and surface are not checked while a patch is worked on.
Between patches they are, but for the lift itself: the tool is drawn back along its own axis.
"""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from coverable.arrays import Array
from feasibility.certification.collisions.collision_replay import CollisionReplay, collision_replay
from feasibility.collisions.asked_bodies import gather
from feasibility.collisions.kernels.memory import collision_buffer
from feasibility.collisions.problem_bodies import Bodies
from feasibility.division.free_motion import FreeSpace, free_motion
from feasibility.division.reconfiguration import Reconfiguration
from feasibility.task import Task
from robots.kinematics import Kinematics, configuration_near
from robots.robot import Robot
from surfaces.cells import Cells

LIFT = 0.02  # [m]
STEPS = 4  # of the lift: a straight line of the tool point to 0.01 mm or so
NEWTON = 8
CLOSE = 1e-6  # [m], and [1] of the axis


def clear_moves(
    robot: Robot,
    cells: Cells,
    task: Task,
    buffer: Array,
    moves: Iterable[Reconfiguration],
) -> tuple[Reconfiguration, ...]:
    """The same moves led around obstacles; unchanged where collisions are not checked.

    A tool that touches the surface is lifted first, and set down at the end: in between it has to
    stay clear of the surface too.

    Args:
        robot, cells, task: the question, with its collisions.
        buffer: of `collision_buffer`, for the same task.
        moves: straight lines.
    """
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    if bodies is None:
        return tuple(moves)
    if not any(one.why == "contact" for one in bodies.left_out):
        return tuple(_clear(robot, bodies, buffer, move) for move in moves)
    lifted = gather(robot, cells.surface, task.collision, LIFT)
    if lifted is None:
        return tuple(moves)
    return tuple(_clear_of_contact(robot, bodies, lifted, move) for move in moves)


def _clear(robot: Robot, bodies: Bodies, buffer: Array, move: Reconfiguration) -> Reconfiguration:
    """A move that the judge accepts; the straight one, judged, where none was found."""
    rows = free_motion(FreeSpace(robot, buffer), move.start, move.end, seed=0)
    if rows is not None:
        replayed = collision_replay(robot, bodies, rows)
        if replayed.accepted:
            return replace(move, via=rows[1:-1], replayed=replayed)
    return _straight(robot, bodies, move)


def _straight(robot: Robot, bodies: Bodies, move: Reconfiguration) -> Reconfiguration:
    """A move without a way around, judged."""
    replayed = collision_replay(robot, bodies, np.stack([move.start, move.end]))
    return replace(move, via=np.zeros((0, robot.n)), replayed=replayed)


def _clear_of_contact(
    robot: Robot, touching: Bodies, lifted: Bodies, move: Reconfiguration
) -> Reconfiguration:
    """The same of a tool that touches at both ends; the straight move where it cannot be lifted.

    `touching` are the bodies without the pairs of tool and surface, `lifted` those with them.
    """
    up, down = lift(robot, move.start), lift(robot, move.end)
    if up is None or down is None:
        return _straight(robot, lifted, move)
    space = FreeSpace(robot, collision_buffer(lifted, robot))
    between = free_motion(space, up[-1], down[-1], seed=0)
    if between is None:
        return _straight(robot, lifted, move)
    via = np.concatenate([up[:-1], between, down[-2::-1]])
    found = [
        collision_replay(robot, touching, np.vstack([move.start, *via, move.end])),
        collision_replay(robot, lifted, between),
    ]
    if not all(one.accepted for one in found):
        return _straight(robot, lifted, move)
    return replace(move, via=via, replayed=min(found, key=_nearest))


def _nearest(replayed: CollisionReplay) -> float:
    """m, of what was found; inf where there is no pair."""
    return np.inf if replayed.min_clearance is None else replayed.min_clearance


def tool_moved(robot: Robot, q: Array, move: Array, count: int, newton: int, close: float) -> Array:
    """Configurations (k, n) rad or m, q (n,) the first, with the tool point ever further on a line.

    The line is `move` (3,) m, in `count` equal steps; the axis keeps its direction. Fewer rows
    follow q where the arm cannot go on. Each takes at most `newton` steps of Newton's method, and
    is off by less than `close`, m and 1 of the axis.
    """
    kinematics = Kinematics(robot)
    point, axis = kinematics.tool(q)
    rows = [q]
    for k in range(1, count + 1):
        there = point + k / count * move
        reached = configuration_near(kinematics, rows[-1], there, axis, newton, close)
        if reached is None:
            break
        rows.append(reached)
    return np.array(rows)


def lift(robot: Robot, q: Array) -> Array | None:
    """Configurations (k, n) rad or m that draw the tool back from where it touches at q (n,).

    The last is `LIFT` away; None where a limit prevents it.
    """
    back = -LIFT * Kinematics(robot).tool(q)[1]
    rows = tool_moved(robot, q, back, STEPS, NEWTON, CLOSE)
    return rows[1:] if len(rows) > STEPS else None
