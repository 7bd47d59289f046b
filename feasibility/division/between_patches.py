"""Moves between patches that keep clear of collisions, each judged like a walk."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from feasibility.certification import collision_replay
from feasibility.collisions import Bodies, gather
from feasibility.division.free_motion import FreeSpace, free_motion
from feasibility.division.reconfiguration import Reconfiguration
from feasibility.task import Task
from robots import Robot
from surfaces import Cells


def clear_moves(
    robot: Robot,
    cells: Cells,
    task: Task,
    buffer: NDArray[np.float64],
    moves: Iterable[Reconfiguration],
) -> tuple[Reconfiguration, ...]:
    """The same moves led around what is in their way; as they are where nothing is checked.

    Args:
        robot: the arm.
        cells: the cells of the surface.
        task: the task, with what is asked of collisions.
        buffer: of `collision_buffer`, for the same task.
        moves: straight lines.
    """
    bodies = gather(robot, cells.surface, task.collision, task.standoff)
    if bodies is None:
        return tuple(moves)
    return tuple(_clear(robot, bodies, buffer, move) for move in moves)


def _clear(
    robot: Robot, bodies: Bodies, buffer: NDArray[np.float64], move: Reconfiguration
) -> Reconfiguration:
    """A move that the judge accepts; the straight one, judged, where none was found."""
    rows = free_motion(FreeSpace(robot, buffer), move.start, move.end, seed=0)
    if rows is not None:
        replayed = collision_replay(robot, bodies, rows)
        if replayed.accepted:
            return replace(move, via=rows[1:-1], replayed=replayed)
    straight = np.stack([move.start, move.end])
    replayed = collision_replay(robot, bodies, straight)
    return replace(move, via=np.zeros((0, robot.n)), replayed=replayed)
