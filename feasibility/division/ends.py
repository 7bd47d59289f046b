"""The moves before and after a motion over a surface.

In: from home, where there is one, to a place behind the first one over the surface, then straight
along its approach direction. Out: straight back along that of the last place, then home. The move
to and from home is a straight line of the joints, or leads around obstacles; all of it is inside
the limits, and judged like any motion where collisions are checked.
"""

import math
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Protected
from feasibility.certification.collisions.collision_replay import collision_replay
from feasibility.collisions.asked_bodies import gather
from feasibility.collisions.kernels.memory import collision_buffer
from feasibility.collisions.problem_bodies import Bodies
from feasibility.division.between_patches import drawn_back
from feasibility.division.free_motion import FreeSpace, free_motion
from feasibility.paths.coverage import CoveragePath
from feasibility.paths.metrics import denser
from feasibility.paths.order import PathError
from robots.robot import Robot

HOME_STEP = 0.2  # [rad], [m] of a joint between rows of a move home: the judge has a budget a row
TRIES = 5  # moves home that are looked for, until the judge accepts one


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
