"""The question as one value: which arm, which cells, which task."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from feasibility.collisions.asked_bodies import gather
from feasibility.task import Task, check_footprint, check_smooth
from robots.robot import Robot
from surfaces.cells import Cells
from surfaces.surface import Surface

if TYPE_CHECKING:
    from feasibility.certification.faults import Replay
    from feasibility.collisions.problem_bodies import Bodies, Pair
    from feasibility.verdict import Walk

HELD = 0.3  # [m] lever by which a shift of the tool turns a joint, about
NARROWER = 0.9  # [1] of tolerance, cone and roll, when the replay refuses what just kept to them
HELD_BACK = ((0.2, 0.0), (0.2, 1.5), (0.4, 1.5), (0.6, 3.0))
"""Shares of cone and roll that are held back in turn, and for how many times the error of the
placement limits and clearances are."""

Given = tuple[object, str, type, str]
"""The value of an argument, its name, its type, and an example in words."""


@dataclass(frozen=True, eq=False)
class Problem:
    """What `check` has to decide: built once, for search, replay and verdict."""

    robot: Robot
    cells: Cells
    task: Task
    searched: Task
    """The task that the search keeps to: `task`, or a little less than it, see `narrowed`."""
    tried: dict[Any, Any] = field(default_factory=dict)
    """Proofs that one attempt looked for and the next need not, see `roadmap/blockers.py`."""

    @classmethod
    def of(cls, robot: Robot, cells: Cells, task: Task, *others: Given) -> Problem:
        """The problem of covering `cells` with `robot`.

        Args:
            robot, cells, task: see the fields.
            others: further arguments of the caller, refused together with these.

        Raises:
            TypeError: an argument is something else, such as a surface that is not cut into cells;
                all of them are named.
            ArgumentError: the roll is limited, but the surface has no reference direction for it,
                or one that is along the approach direction at some cell; there is a footprint, but
                no surface; or the surface is not smoothed as the task says.
        """
        _refuse_other_types(
            (robot, "robot", Robot, 'a Robot, such as robots.load_robot("ur5")'),
            (cells, "cells", Cells, _cells_wanted(cells)),
            (task, "task", Task, "a Task, such as Task(standoff=0.02, cone_deg=20)"),
            *others,
        )
        if task.roll is not None:
            from feasibility.targets.references import check_references

            check_references(cells, task)
        check_footprint(cells, task)
        check_smooth(cells, task)
        task = task_over(cells, task)
        return cls(robot, cells, task, task)

    @property
    def bodies(self) -> Bodies | None:
        """What can collide; None where collisions are not checked.

        Raises:
            RobotError: the arm has no shapes, or the SRDF is not of this arm.
            ArgumentError: a pair names something that is not there.
        """
        return gather(self.robot, self.cells.surface, self.task.collision, self.task.standoff)

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """What must stay apart; none where collisions are not checked."""
        bodies = self.bodies
        return () if bodies is None else bodies.pairs

    @property
    def narrowed(self) -> Problem:
        """The same problem, searched with less of tolerance, cone and range of the roll."""
        tolerance = NARROWER * self.task.effective_tolerance
        return replace(self, searched=replace(_narrower(self.task, NARROWER), tolerance=tolerance))

    @property
    def with_room(self) -> Iterator[Problem]:
        """The same problem, searched with more and more room for its error of the placement.

        Nothing is proved by it: the answer counts where the motion keeps what is asked for. None
        where there is no such error; nor with a start, which the motion has, wherever it goes.
        """
        cells, robot, error = self.cells, self.robot, self.task.placement_error
        if error is None or robot.start is not None:
            return
        size = np.linalg.norm(cells.centres - cells.centres.mean(axis=0), axis=1).max(initial=0.0)
        for held, times in HELD_BACK:
            shift = times * (error[0] + np.radians(error[1]) * float(size))
            turn = shift * np.where(robot.prismatic, 1.0, 1.0 / HELD)
            lower, upper = robot.lower + turn, robot.upper - turn
            limits = np.where(lower < upper, [lower, upper], [robot.lower, robot.upper]).T
            task = _narrower(self.searched, 1.0 - held)
            if task.collision is not None:
                task = replace(task, collision=task.collision.raised(shift))
            yield replace(self, robot=robot.with_limits(limits), searched=task, tried={})

    @property
    def in_pieces(self) -> Problem | None:
        """The same problem with the links cut into convex pieces; None where that is no different.

        Nor is it tried where the task chooses other shapes of links than hulls.
        """
        collision, bodies = self.task.collision, self.bodies
        if collision is None or bodies is None or collision.shapes != "hulls":
            return None
        finer = replace(collision, shapes="pieces")
        task, searched = (replace(one, collision=finer) for one in (self.task, self.searched))
        problem = replace(self, task=task, searched=searched)
        cut = problem.bodies
        return problem if cut and len(cut.polytopes) > len(bodies.polytopes) else None

    def replayed(self, walk: Walk) -> Replay:
        """The independent replay of a motion, which has to visit every cell."""
        from feasibility.certification.motion_replay import replay

        return replay(self.robot, self.cells, self.task, walk, np.ones(len(self.cells), dtype=bool))

    @property
    def within(self) -> str:
        """Tolerance, cone and range of the roll in words."""
        words = f"within {1e3 * self.task.effective_tolerance:g} mm and {self.task.cone_deg:g} deg"
        if self.task.smooth is not None:
            words += f" of a copy smoothed over {1e3 * self.task.smooth:g} mm"
        if self.task.roll is None or self.task.roll_deg is None:
            return words
        low, high = self.task.roll_deg
        return f"{words}, at a roll of {low:g} to {high:g} deg"


def task_over(cells: Cells, task: Task) -> Task:
    """The task without collisions with a surface where there is none: between poses."""
    collision = task.collision
    if collision is None or not collision.surface or cells.surface.wall is not None:
        return task
    return replace(task, collision=collision.without_surface)


def _cells_wanted(given: object) -> str:
    """What the cells should be, where a surface that is not cut was given, or a function."""
    if callable(given):
        return (
            "a surface cut into cells; a function g(u, v) of your own becomes one by "
            "parametric(g, u=(0, 1), v=(0, 1)).cells(9, 10), triangles by "
            "mesh(triangles).cells(100)"
        )
    how = {"mesh": "count=100", "piecewise": "[(3, 4), (3, 4)]"}
    kind = given.kind if isinstance(given, Surface) else ""
    return f"a surface cut into cells, such as surface.cells({how.get(kind, '9, 10')})"


def _refuse_other_types(*given: Given) -> None:
    """Refuse arguments of a wrong type, all of them at once.

    Raises:
        TypeError: some are of another type.
    """
    faults = [
        f"{name}: expected {words}, got {value!r:.60}"
        for value, name, kind, words in given
        if not isinstance(value, kind)
    ]
    if faults:
        raise TypeError("; ".join(faults))


def _narrower(task: Task, share: float) -> Task:
    """A task with that share of cone and range of the roll."""
    roll_deg = task.roll_deg
    if task.roll is not None and roll_deg is not None:
        less = 0.5 * (1.0 - share) * (roll_deg[1] - roll_deg[0])
        roll_deg = roll_deg[0] + less, roll_deg[1] - less
    return replace(task, cone_deg=share * task.cone_deg, roll_deg=roll_deg)
