"""Passes for `coverable path`: arguments, directions, and runs where one motion is not enough."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING, Any

from coverable.errors import CoverableError, Fault
from feasibility.cli.command_parts import STATUS, numbers, positive, tell
from feasibility.cli.output_files import write_text
from feasibility.cli.programs import period_of, write_runs

if TYPE_CHECKING:
    from feasibility.cli.command_parts import OpenCase
    from feasibility.division.pass_planning import PlannedPasses
    from feasibility.task import Task
    from surfaces.passes.parallel import Passes
    from surfaces.surface import Surface
    from surfaces.toolpaths.pose_cells import PoseCells

BEST = "best"
BY = ("distance", "planes", "parameters")
SQUARE = math.pi / 2


def add_layout(parser: argparse.ArgumentParser) -> None:
    """Which parallel passes stand in place of the cells."""
    parser.add_argument(
        "--passes", metavar="DIRECTION",
        help="run parallel passes over the surface, whatever its cells: an angle in degrees at its "
        "middle, from the u direction (or the x axis of a mesh's frame), an axis as X,Y,Z, or "
        "best: the direction with the fewest passes that one motion runs",
    )  # fmt: skip
    parser.add_argument(
        "--pitch", type=positive, metavar="M", help="largest distance between passes, m"
    )
    parser.add_argument(
        "--by", choices=BY, default="distance",
        help="how it is measured: on the surface (default), between section planes, or by "
        "parameters",
    )  # fmt: skip
    parser.add_argument(
        "--cross",
        action="store_true",
        help="then run passes square to them too (an angle, or best)",
    )


def add_passes(parser: argparse.ArgumentParser) -> None:
    """Parallel passes in place of the cells, and how they are run."""
    add_layout(parser)
    parser.add_argument(
        "--overrun", type=positive, default=0.0, metavar="M",
        help="how far passes go on beyond the border, m; less where the arm cannot reach",
    )  # fmt: skip
    parser.add_argument(
        "--retract", type=positive, default=0.05, metavar="M",
        help="how far the tool is lifted between stretches that are not side by side, m "
        "(default 0.05)",
    )  # fmt: skip
    parser.add_argument(
        "--one-way", action="store_true", help="run all passes in the same direction"
    )


def check_passes(args: argparse.Namespace) -> None:
    """Refuse arguments of passes that do not go together.

    Raises:
        CoverableError: there is one without another, or an order besides.
    """
    faults = []
    if (args.passes is None) != (args.pitch is None):
        missing = "--pitch" if args.pitch is None else "--passes"
        faults.append(Fault(missing, "is missing", expected="--passes and --pitch go together"))
    if args.passes is not None and getattr(args, "order", None) is not None:
        given = f"got {args.order!r}, but passes have an order of their own"
        faults.append(Fault("--order", given, expected="leave it out"))
    if args.cross and (args.passes is None or "," in args.passes):
        wanted = "give --passes an angle in degrees, or best"
        faults.append(Fault("--cross", "needs a direction that can be turned", expected=wanted))
    if faults:
        raise CoverableError(faults)


def direction_of(text: str) -> Any:
    """An angle (rad) from degrees, or a vector (x, y, z).

    Raises:
        CoverableError: the text is neither.
    """
    found = numbers(text)
    if len(found) == 1:
        return math.radians(found[0])
    if len(found) == 3:
        return found
    wanted = "must be degrees, or an axis as 1,0,0, or best"
    raise CoverableError(Fault("--passes", f"got {text!r:.60}", expected=wanted))


def _passes(args: argparse.Namespace, surface: Surface, direction: Any) -> Passes:
    """The passes that the arguments describe, in one direction."""
    from surfaces.passes.parallel import parallel_passes
    from surfaces.passes.pass_directions import crossed

    found = [
        parallel_passes(
            surface, args.pitch, direction + turn if turn else direction,
            by=args.by, overrun=getattr(args, "overrun", 0.0),
            one_way=getattr(args, "one_way", False),
        )
        for turn in (0.0, SQUARE)[: 1 + args.cross]
    ]  # fmt: skip
    return crossed(*found) if args.cross else found[0]


def places_asked(args: argparse.Namespace, surface: Surface, task: Task) -> PoseCells:
    """The places of the passes that the arguments describe, for a motion to be judged.

    Raises:
        CoverableError: the direction is none.
    """
    from feasibility.division.pass_planning import tool_way
    from surfaces.passes.toolpath import places_along

    if args.passes.strip() == BEST:
        fault = "is the best for an arm, which only `coverable path` looks for"
        raise CoverableError(Fault("--passes", fault, expected="give the direction itself"))
    return places_along(_passes(args, surface, direction_of(args.passes)), tool_way(surface, task))


def passes_asked(args: argparse.Namespace, opened: OpenCase) -> PlannedPasses:
    """Plan the passes that the arguments describe, and look for one motion along all of them."""
    from feasibility.division.pass_planning import plan_best_passes, plan_passes

    robot, cells, task, search = opened.setup
    opened.progress(0, None, "planning passes")
    if args.passes.strip() != BEST:
        passes = _passes(args, cells.surface, direction_of(args.passes))
        return plan_passes(robot, passes, task, args.retract, search, opened.clock)

    def passes_at(angle: float) -> Passes:
        return _passes(args, cells.surface, angle)

    return plan_best_passes(
        robot, cells.surface, task, args.pitch, passes_at, args.retract, search, opened.clock
    )


def in_runs(args: argparse.Namespace, opened: OpenCase, along: PlannedPasses) -> int:
    """Passes that no single motion is known to run: cut them, and say why; the verdict's status."""
    from feasibility.division.pass_runs import pass_runs
    from feasibility.reports import pass_runs as report
    from feasibility.timing.path_timing import trajectory

    verdict = along.verdict
    opened.progress(0, None, "cutting passes into runs")
    clock = opened.clock.allow(opened.setup.search.evaluations)
    found = pass_runs(
        verdict.robot, along.cells, verdict.task, along.places, verdict.seed, clock,
    )  # fmt: skip
    timed = [
        trajectory(
            run, args.speed, velocity=args.velocity, acceleration=args.acceleration,
            period=period_of(args),
        )
        for run in found.runs
    ]  # fmt: skip
    treated = along.treated(*(run.walk for run in found.runs)) if found.runs else None
    tell(args, report, along, found, timed, treated)
    write_runs(args, opened, along, *timed, numbered=True)
    if args.html is not None:
        from feasibility.viewer.pass_view import view_passes

        drawn = view_passes(along, found.runs, treated, case=opened.case.name)
        write_text(args.html, drawn.html(), "view")
    return STATUS[str(verdict.answer)]
