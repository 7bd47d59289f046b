"""Moves before, between and after motions over a surface, each judged like a walk.

Between patches: around obstacles. Where the standoff is 0, the pairs of tool and surface are not
checked while a patch is worked on. Between patches they are, but for the lift itself: the tool is
drawn back along its own axis.

In: from home, where there is one, to a place behind the first one over the surface, then straight
along its approach direction. Out: straight back along that of the last place, then home.
"""

import math
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from coverable.arrays import Array, Protected
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.certification.lever_bounds import jacobians, second_derivatives
from feasibility.collisions.asked_bodies import gather
from feasibility.collisions.kernels.memory import collision_buffer
from feasibility.collisions.problem_bodies import Bodies
from feasibility.division.free_motion import FreeSpace, free_motion
from feasibility.division.reconfiguration import Reconfiguration
from feasibility.paths.coverage import CoveragePath
from feasibility.paths.metrics import denser
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
HOME_STEP = 0.2  # [rad], [m] of a joint between rows of a move home: the judge has a budget a row
TRIES = 5  # moves home that are looked for, until the judge accepts one


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


@dataclass(frozen=True, eq=False, slots=True)
class Ends(Protected):
    """The two moves, straight in joint space between their rows."""

    approach: float
    """m, length of the straight lines of the tool point."""
    entry: Array
    """(k, n) rad or m; the last row is the first one over the surface."""
    exit: Array
    """(k, n) rad or m; the first row is the last one over the surface."""
    from_home: bool


def ends_of(path: CoveragePath, approach: float) -> Ends:
    """How a path is entered and left: drawn back by `approach` (m), and from and to home.

    Raises:
        PathError: the tool cannot be drawn back, or would go through the surface; a body is too
            near; or no move home is found.
    """
    q, cell = path.walk.q, path.walk.cell
    marks = np.flatnonzero(cell >= 0)
    if not len(marks):
        raise PathError("the path passes no cell, so there is no approach direction")
    moves = list[Array]()
    for row, mark, what in ((0, marks[0], "entry"), (-1, marks[-1], "exit")):
        moves.append(_move(path, q[row], int(cell[mark]), approach, what))
        through = path.through_surface(moves[-1])
        if through:
            raise PathError(f"{what}: {through}; give another --approach, or task.home_deg")
    home = path.task.home_deg is not None
    return Ends(approach=approach, entry=moves[0][::-1], exit=moves[1], from_home=home)


def _move(path: CoveragePath, q: Array, cell: int, approach: float, what: str) -> Array:
    """(k, n) from a configuration over the surface back, and home where there is one."""
    robot, task = path.robot, path.task
    direction = -task.approaches(path.cells)[cell]
    try:
        back = drawn_back(robot, q, direction, approach, task.effective_tolerance)
    except PathError as error:
        raise PathError(f"{what}: {error}; give another --approach") from error
    surface = path.cells.surface
    bodies = gather(robot, surface, task.collision, task.standoff)
    # A tool that touches the surface may do so only until it is drawn back.
    lifted = gather(robot, surface, task.collision, task.standoff + approach)
    _judged(robot, bodies, back, f"{what}: the tool cannot be drawn back along its approach")
    if task.home_deg is None:
        return back
    home = np.array([math.radians(angle) for angle in task.home_deg])
    if lifted is None:
        return np.vstack([back, home])
    _judged(robot, lifted, home[None], f"{what}: home_deg")
    space = FreeSpace(robot, collision_buffer(lifted, robot))
    refusal = "no move between home and the surface was found that keeps clear"
    for seed in range(TRIES):
        move = free_motion(space, back[-1], home, seed=seed)
        if move is None:
            continue
        steps = np.ceil(np.abs(np.diff(move, axis=0)).max(axis=1) / HOME_STEP)
        move, _ = denser(move, np.maximum(steps, 1).astype(int))
        refused = _refusal(robot, lifted, move)
        if not refused:
            return np.vstack([back, move[1:]])
        refusal = f"the move home: {refused}"
    raise PathError(f"{what}: {refusal}")


def _judged(robot: Robot, bodies: Bodies | None, rows: Array, what: str) -> None:
    """Refuse rows (k, n) along which bodies come too near to each other.

    Raises:
        PathError: they do.
    """
    refusal = "" if bodies is None else _refusal(robot, bodies, rows)
    if refusal:
        raise PathError(f"{what}: {refusal}")


def _refusal(robot: Robot, bodies: Bodies, rows: Array) -> str:
    """Why the judge of collisions refuses rows (k, n) or their reverse; empty for nothing.

    Near the clearance it may certify one and not the other.
    """
    for motion in (rows, rows[::-1]):
        found = collision_replay(robot, bodies, motion)
        if not found.accepted:
            return found.refusal
    return ""
