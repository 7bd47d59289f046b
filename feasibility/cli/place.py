"""`coverable place CASE`: where in a region can the surface stand?"""

from __future__ import annotations

import argparse
import contextlib
import math
import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from feasibility.cli.command_parts import (
    STATUS,
    add_case,
    add_command,
    add_csv,
    add_html,
    add_workers,
    json_text,
    open_case,
    positive,
)
from feasibility.cli.console import print_err, print_out, with_rate
from feasibility.cli.first_interrupt import raised
from feasibility.cli.output_files import write_text
from feasibility.interrupts import INTERRUPTED, MESSAGE
from feasibility.read_files import shown_path
from feasibility.safe_files import write_whole

if TYPE_CHECKING:
    from feasibility.cli.command_parts import OpenCase
    from feasibility.placement.map import PlacementMap
    from feasibility.placement.placements import Placements
    from feasibility.placement.stations import StationPlan
    from feasibility.placement.trials import Evaluator
    from feasibility.viewer.viewer import View

AXES = {
    "x": "m", "y": "m", "z": "m", "roll": "degrees", "pitch": "degrees", "yaw": "degrees"
}  # fmt: skip
_LEAST = 1e-3  # [s] for a view, once the time is up: then it shows what is known
PICTURES = (".png", ".svg", ".pdf")


def add(subcommands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = add_command(
        subcommands, "place", run_place, add_case, add_csv, add_workers,
        help="where the surface can stand",
        description="Search a region of positions and orientations of the surface (in the "
        "world, or in surface.frame) for placements at which one continuous motion covers it.",
        epilog="exit status: 0 a placement is feasible, 1 none was found, 3 undecided, 130 "
        "interrupted, after what was known by then",
    )  # fmt: skip
    for name, unit in AXES.items():
        parser.add_argument(
            f"--{name}", nargs=2, type=float, metavar=("FROM", "TO"),
            help=f"range of the surface's {name}, {unit} (default: as in the case)",
        )  # fmt: skip
    parser.add_argument("--count", type=int, metavar="N", help="number of placements to begin with")
    parser.add_argument(
        "--stations", action="store_true",
        help="if no single placement is feasible: the fewest that together cover the surface",
    )  # fmt: skip
    parser.add_argument(
        "--map", type=_picture, metavar="FILE", help="draw the covered share over the region"
    )
    add_html(parser, "a view of all placements tried")
    parser.add_argument(
        "--out", metavar="FILE", help="store finished placements; run again to continue"
    )
    parser.add_argument(
        "--time-limit", type=positive, metavar="S",
        help="seconds for the whole command, stations and map included (default: the case's)",
    )  # fmt: skip


def run_place(args: argparse.Namespace, began: float) -> int:
    """`coverable place CASE`: search a region for placements, and report the feasible ones.

    Args:
        args: case, settings; x, y, z, roll, pitch, yaw, each two numbers or None; count, stations,
            workers, dask, json; csv, map, out, html, files or None; time_limit.
        began: `time.perf_counter()` when the command began.

    Returns:
        0 when a placement is feasible, 1 when none was found, 3 when undecided, 130 after a Ctrl-C,
        when what is known by then is reported.

    Raises:
        PlacementError, CaseError, FileError, WorkersError: the input cannot be used.
    """
    files = {"--csv": args.csv, "--map": args.map, "--out": args.out, "--html": args.html}
    drawn = chart = plan = None
    opening = open_case(args, began, files, time_limit=args.time_limit)
    with opening as opened, contextlib.ExitStack() as stack, raised() as settle:
        from feasibility.placement.placements import COUNT, place
        from feasibility.placement.region import Pose, Region
        from feasibility.placement.trials import evaluator_of_study
        from feasibility.studies.store import Store
        from feasibility.studies.workers import open_workers

        case, setup, clock = opened.case, opened.setup, opened.clock
        held = Pose.of_values([*case.surface.position, *case.surface.rpy_deg])
        region = Region.around(held, _ranges(args))
        count = COUNT if args.count is None else args.count
        store = None if args.out is None else stack.enter_context(Store(args.out))
        workers = stack.enter_context(open_workers(args.workers, args.dask))
        number = len(setup.cells)
        evaluator = evaluator_of_study(case, number, workers, store, lambda *_: settle())
        placements = place(
            *setup[:3], region, setup.search, evaluator=evaluator, count=count, clock=clock,
            progress=with_rate(opened.progress), interruptible=True,
        )  # fmt: skip
        interrupted = placements.interrupted
        try:
            if not interrupted:
                plan, chart = _further(args, opened, placements, evaluator, count)
                drawn = _view(args, opened, placements, plan)
        except KeyboardInterrupt:
            interrupted = True
    placements.timing["command_s"] = time.perf_counter() - began
    _report(args, placements, case.name, plan, chart)
    if drawn is not None:
        write_text(args.html, drawn.html(), "view")
    if interrupted:
        left_out = [name for name, made in (("map", chart), ("html", drawn)) if made is None]
        for name in (name for name in left_out if getattr(args, name) is not None):
            print_err(f"nothing written to --{name}: {shown_path(getattr(args, name))}")
        print_err(MESSAGE)
    return INTERRUPTED if interrupted else STATUS[str(placements.answer)]


def _view(
    args: argparse.Namespace, opened: OpenCase, placements: Placements, plan: StationPlan | None
) -> View | None:
    """The view, where it is wanted; its motion is searched for in the time that is left."""
    if args.html is None:
        return None
    from feasibility.viewer.placement_view import view_placements

    left = opened.clock.left
    limit = None if math.isinf(left) else max(left, _LEAST)
    search = replace(opened.setup.search, time_limit=limit)
    return view_placements(
        placements, search, opened.case.name, plan, progress=opened.progress
    )  # fmt: skip


def _further(
    args: argparse.Namespace,
    opened: OpenCase,
    placements: Placements,
    evaluator: Evaluator,
    count: int,
) -> tuple[StationPlan | None, PlacementMap | None]:
    """Stations and map, where they are wanted; reports what there was no time for."""
    from feasibility.clock import OutOfTime
    from feasibility.placement.map import placement_map
    from feasibility.placement.region import Pose
    from feasibility.placement.stations import station_plan

    plan = chart = None
    clock, progress = opened.clock, with_rate(opened.progress)
    wanted = "stations" if args.stations and not placements.found else ""
    try:
        with clock.enforced():
            if wanted:
                search = opened.setup.search
                plan = station_plan(placements, evaluator, search, count, progress, clock)
            wanted = "map" if args.map is not None else ""
            if wanted:
                region, best = placements.region, placements.best
                held = (
                    Pose.of_values(0.5 * (region.low + region.high)) if best is None else best.pose
                )
                chart = placement_map(evaluator, region, held, progress=progress)
    except OutOfTime:
        missing = [wanted] * bool(wanted) + ["map"] * (wanted != "map" and args.map is not None)
        if missing:
            print_err(f"no {' and no '.join(missing)}: the time limit of {clock.limit:g} s ran out")
    return plan, chart


def _ranges(args: argparse.Namespace) -> dict[str, Any]:
    """The ranges given, by the names of the region's axes."""
    return {
        name if unit == "m" else f"{name}_deg": getattr(args, name)
        for name, unit in AXES.items()
        if getattr(args, name) is not None
    }


def _picture(path: str) -> str:
    """The name of a picture.

    Raises:
        ArgumentTypeError: the name has another ending.
    """
    if not path.lower().endswith(PICTURES):
        wanted = f"expected a name that ends in {', '.join(PICTURES)}"
        raise argparse.ArgumentTypeError(f"{shown_path(path)} is no kind of picture; {wanted}")
    return path


def _report(
    args: argparse.Namespace,
    placements: Placements,
    name: str,
    plan: StationPlan | None,
    chart: PlacementMap | None,
) -> None:
    """Print the answer, and write table and map."""
    from feasibility.reports import placement as report

    if args.json:
        print_out(json_text(report.as_json(placements, plan, chart)))
    else:
        print_out(report.as_text(placements, name, plan))
    if args.csv is not None:
        write_text(args.csv, report.as_csv(placements), "table")
    if chart is not None:
        from feasibility.viewer.figures import plot_map

        figure = plot_map(chart, placements, title=name)
        kind = str(args.map).rsplit(".", 1)[-1].lower()
        write_whole(args.map, lambda stream: figure.savefig(stream, format=kind, dpi=150))
        print_err(f"map: {shown_path(args.map)}")
