"""Passes over a surface and their verdict: in one direction, or in the best of several."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from coverable.arrays import Mask
from coverable.errors import counted
from feasibility.certification.faults import less_deviations
from feasibility.checking import check
from feasibility.clock import Clock
from feasibility.demands.area import TreatedArea, treated_by_passes
from feasibility.search_settings import Search
from feasibility.task import Task
from feasibility.verdict import Verdict, Walk
from robots.robot import Robot
from surfaces.passes.parallel import Passes
from surfaces.passes.pass_directions import ranked_directions
from surfaces.passes.pass_stretches import Pass
from surfaces.passes.toolpath import PassPlaces, pass_route
from surfaces.passes.ways import ToolWay
from surfaces.surface import Surface
from surfaces.toolpaths.pose_cells import PoseCells

RETRACT = 0.05  # m, by default
WITHIN = 0.25  # [1] of the tolerance: how far straight lines between places may be from the surface
CERTIFIED = 3  # directions of the fewest pieces that are tried with the arm


@dataclass(frozen=True, eq=False, slots=True)
class PlannedPasses:
    """Passes, and the verdict on one motion along all of them."""

    passes: Passes
    places: PassPlaces
    cells: PoseCells
    """The same as a toolpath."""
    task: Task
    """With footprint and coverage."""
    verdict: Verdict
    """Of the toolpath, whatever the coverage."""

    def treated(self, *walks: Walk) -> TreatedArea | None:
        """What motions along the passes treat; None without a footprint."""
        robot, surface = self.verdict.robot, self.passes.surface
        return treated_by_passes(surface, self.places, robot, self.task, walks)


def plan_passes(
    robot: Robot,
    passes: Passes,
    task: Task,
    retract: float = RETRACT,
    search: Search | None = None,
    clock: Clock | None = None,
) -> PlannedPasses:
    """Look for one motion along passes.

    Where none is found, and the arm does not reach all of their overrun, that is shortened, which a
    note says.

    Args:
        robot, passes, search, clock: the arm, what it runs along, and those of `check`.
        task: footprint and coverage are those of the whole surface.
        retract: m > 0, how far the tool is lifted between stretches that are apart.

    Raises:
        SurfaceError: see `surfaces.passes.pass_route`.

    Example:
        >>> from coverable import Task
        >>> from coverable import load_robot
        >>> from coverable import parallel_passes, plane
        >>> plate = plane((0, 0.2), (0, 0.1), "outside", (0.4, -0.1, 0.2))
        >>> task = Task(standoff=0.02, cone_deg=20, footprint=0.06)
        >>> along = plan_passes(load_robot("ur5"), parallel_passes(plate, 0.05), task)
        >>> along.verdict.feasible, round(along.treated(along.verdict.witness).lower, 2)
        (True, 1.0)
    """
    way = tool_way(passes.surface, task)
    route = pass_route(passes, retract, way)
    alone = replace(task, footprint=None, coverage=None, smooth=None)
    verdict = check(robot, route.cells, alone, search, clock=clock)
    if not verdict.feasible and verdict.components:
        reached = np.zeros(len(route.cells), dtype=bool)
        reached[np.concatenate(verdict.components)] = True
        shorter = _with_reached_overrun(route.passes, route.places, reached)
        if shorter is not None:
            route = pass_route(shorter, retract, way)
            verdict = check(robot, route.cells, alone, search, clock=clock)
    notes, lifts, beyond = list(route.passes.notes), route.places.lifts, route.passes.beyond_border
    if lifts:
        times, height = counted(lifts, "time"), 1e3 * retract
        notes.append(f"the tool is lifted {times} between stretches, by {height:.4g} mm")
    if beyond > 0.0:
        notes.append(
            f"passes go on beyond the border by up to {1e3 * beyond:.4g} mm, straight in the plane "
            "that is tangent there"
        )
    passes = replace(route.passes, notes=tuple(notes))
    return PlannedPasses(passes, route.places, route.cells, task, verdict)


def tool_way(surface: Surface, task: Task) -> ToolWay:
    """Where the tool is to be beside a surface, and how near to that straight lines must stay."""
    within = WITHIN * less_deviations(task, surface).effective_tolerance
    return ToolWay(surface.side_sign * task.standoff, within)


def plan_best_passes(
    robot: Robot,
    surface: Surface,
    task: Task,
    pitch: float,
    passes_along: Callable[[float], Passes],
    retract: float = RETRACT,
    search: Search | None = None,
    clock: Clock | None = None,
) -> PlannedPasses:
    """The direction with the fewest passes that one motion runs.

    Directions are ranked by the number of pieces of passes with a pitch (m), and the best three are
    tried with the arm, as by `plan_passes`: `passes_along` makes the passes of one, an angle in
    rad. Where none of them can be run in one motion, it is the first of them.

    Raises:
        SurfaceError: see `surfaces.passes.parallel_passes` and `pass_route`.
    """
    found = [
        plan_passes(robot, passes_along(angle), task, retract, search, clock)
        for angle in ranked_directions(surface, pitch)[:CERTIFIED]
    ]
    feasible = [each for each in found if each.verdict.feasible]
    if not feasible:
        return found[0]
    return min(feasible, key=lambda each: (each.passes.count, len(each.passes.stretches)))


def _with_reached_overrun(passes: Passes, places: PassPlaces, reached: Mask) -> Passes | None:
    """Passes with a note, their overrun cut to the `reached` poses (N,) from the border on.

    None where nothing is to be cut.
    """
    found, cut, ends = list[Pass](), 0.0, 0
    for number, each in enumerate(passes.stretches):
        own = reached[places.stretch == number]
        inside = np.flatnonzero(each.on_surface)
        lost = np.flatnonzero(~own)
        before, behind = lost[lost < inside[0]], lost[lost > inside[-1]]
        first = int(before[-1]) + 1 if len(before) else 0
        last = int(behind[0]) if len(behind) else len(own)
        kept = slice(first, last)
        shorter = replace(
            each, points=each.points[kept], normals=each.normals[kept],
            on_surface=each.on_surface[kept],
        )  # fmt: skip
        cut += each.length - shorter.length
        ends += (first > 0) + (last < len(own))
        found.append(shorter)
    if not ends:
        return None
    note = (
        f"the overrun at {ends} of {2 * len(found)} ends is shortened to what can be reached, by "
        f"{1e3 * cut / ends:.3g} mm on average"
    )
    return replace(passes, stretches=tuple(found), notes=(*passes.notes, note))
