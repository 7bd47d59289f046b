"""What a changed case builds, without building again what has not changed.

An arm takes 5 ms to load and a mesh seconds to cut; a slider that is dragged waits for neither.
"""

from __future__ import annotations

import json
import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

from coverable.errors import ArgumentError
from feasibility.cases.case import Case, Setup
from feasibility.cases.robot_table import in_robot_table
from feasibility.cases.table_reader import CaseError
from feasibility.placement.region import Pose, moved_cells
from feasibility.targets.references import check_references
from feasibility.task import Task
from robots.errors import RobotError
from robots.robot import Robot
from surfaces.cells import Cells

KEPT = 32  # arms, surfaces and scenes that are remembered: undo comes back to them

Made = TypeVar("Made")


class Workbench:
    """Arm, cells and task of a case and of its changes; for several threads at once."""

    def __init__(self, case: Case, setup: Setup | None = None) -> None:
        """Build the case as it is.

        Args:
            case: as it was given.
            setup: what it builds, where that is known.

        Raises:
            CaseError: it cannot be built.
        """
        self.case = case
        self.setup = case.build() if setup is None else setup
        self._lock = threading.Lock()
        self._made = OrderedDict[tuple[str, str], Any]()
        robot, cells, task, _ = self.setup
        self._kept("arm", case.robot.table(), lambda: robot)
        self._kept("bodies", _collision(case), lambda: task.collision)
        for kind in ("cells", "cells, roughly"):
            self._kept(kind, _pose(case), lambda: cells)

    def build(self, case: Case, roughly: bool = False) -> Setup:
        """What the case builds, which differs from the first in what a page changes alone.

        Args:
            case: the changed one.
            roughly: for a quick look; the curves between cells, whose fitting takes most of the
                time, are those of the first case, moved: right up to rounding.

        Raises:
            CaseError: the arm or the task do not go together with these values.
        """
        if case == self.case:
            return self.setup
        robot = self._kept("arm", case.robot.table(), lambda: _robot(case))
        kind = "cells, roughly" if roughly else "cells"
        cells = self._kept(kind, _pose(case), lambda: self._moved(case, roughly))
        collision = self._kept("bodies", _collision(case), lambda: case.built_task().collision)
        task: Task = replace(case.task, collision=collision)
        try:
            check_references(cells, task)
        except ArgumentError as error:
            named = [fault.renamed({}, "task") for fault in error.faults]
            raise CaseError(named, case.name) from error
        return Setup(robot, cells, task, case.search)

    def _moved(self, case: Case, roughly: bool) -> Cells:
        """The cells at the pose that the case has."""
        first = self.setup.cells
        cells = moved_cells(first, Pose(case.surface.position, case.surface.rpy_deg))
        if roughly:
            old, new = first.surface, cells.surface
            turn = new.rotation @ old.rotation.T
            vars(cells)["curves"] = first.curves.moved(turn, new.position - turn @ old.position)
        return cells

    def _kept(self, kind: str, of: Any, make: Callable[[], Made]) -> Made:
        """What was made before of these tables, or is made now; the oldest is forgotten."""
        key = kind, json.dumps(of, sort_keys=True, default=dict)
        with self._lock:
            if key in self._made:
                self._made.move_to_end(key)
                return self._made[key]
        made = make()
        with self._lock:
            self._made[key] = made
            while len(self._made) > KEPT:
                self._made.popitem(last=False)
        return made


def _robot(case: Case) -> Robot:
    """Load the arm.

    Raises:
        CaseError: it cannot be loaded so.
    """
    try:
        return case.robot.build(case.surface.frame)
    except RobotError as error:
        raise CaseError(in_robot_table(error), case.name) from error


def _collision(case: Case) -> Any:
    """What the arm must stay clear of, as a table."""
    return None if case.collision is None else case.collision.table()


def _pose(case: Case) -> Any:
    """Where the surface is."""
    return [case.surface.position, case.surface.rpy_deg]
