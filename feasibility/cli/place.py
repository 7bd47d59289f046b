"""`coverable place CASE`: where in a region may the surface stand?"""

from __future__ import annotations

import argparse
import contextlib
import json
import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from coverable_errors import Fault
from feasibility.cli.check_command import write_view
from feasibility.cli.console import Bar, interruptible, say, tell
from feasibility.cli.study_compare import check_files
from feasibility.safe_files import FileError, shown_path, write_whole

if TYPE_CHECKING:
    from feasibility.placement import Judge, PlacementMap, Placements, StationPlan
    from feasibility.search import Progress
    from feasibility.viewer import View

STATUS = {"feasible": 0, "infeasible": 1, "undecided": 3}
PICTURES = (".png", ".svg", ".pdf")


def run_place(args: argparse.Namespace, began: float) -> int:
    """`coverable place CASE`: search a region for placements, and say which will do.

    Args:
        args: `case`, `settings` (a list of KEY=VALUE); `x`, `y`, `z`, `roll`, `pitch`, `yaw`, each
            two numbers or None; `count` or None; `workers` or None, `dask` or None; `stations`,
            `json`; `csv`, `map`, `out`, files or None; `html`, a file or None, which may be left
            out; `time_limit` or None.
        began: `time.perf_counter()` when the command began.

    Returns:
        0 when a placement is feasible, 1 when none was found, 3 when undecided.

    Raises:
        PlacementError, CaseError, FileError, WorkersError: the input cannot be used.
    """
    with interruptible() as settle:
        from feasibility.cases import load_case
        from feasibility.placement import (
            COUNT,
            Pose,
            Region,
            StudyJudge,
            map_around_best,
            place,
            station_plan,
        )
        from feasibility.studies import Store, open_workers

        html = vars(args).get("html")
        outputs = {"--csv": args.csv, "--map": args.map, "--out": args.out, "--html": html}
        _check_outputs(args.case, outputs)
        case = load_case(args.case, args.settings)
        held = Pose.of_values([*case.surface.position, *case.surface.rpy_deg])
        region = Region.around(held, _ranges(args))
        setup = case.build()
        for note in (*setup.robot.notes, *setup.cells.surface.notes):
            tell(f"note: {note}")
        with contextlib.ExitStack() as stack:
            bar = stack.enter_context(Bar())
            progress = _reporting(bar, settle)
            count = COUNT if args.count is None else args.count
            store = None if args.out is None else stack.enter_context(Store(args.out))
            workers = stack.enter_context(open_workers(args.workers, args.dask))
            judge: Judge = StudyJudge(case, workers, store, lambda *rest: settle())
            placements = place(
                *setup[:3], region, setup.search, judge=judge, progress=progress,
                count=count, time_limit=args.time_limit,
            )  # fmt: skip
            plan: StationPlan | None = None
            if args.stations and not placements.found:
                plan = station_plan(placements, judge, setup.search, count, progress)
            drawn: View | None = None
            if html is not None:
                from feasibility.viewer import view_placements

                drawn = view_placements(
                    placements, setup.search, case.name, plan, progress=progress
                )
            chart: PlacementMap | None = None
            if args.map is not None:
                chart = map_around_best(placements, judge, progress)
        settle()
    placements.timing["command_s"] = time.perf_counter() - began
    _say(args, placements, case.name, plan, chart)
    if drawn is not None and html is not None:
        write_view(drawn, html)
    return STATUS[str(placements.answer)]


def _ranges(args: argparse.Namespace) -> dict[str, Any]:
    """The ranges given, by the names of the region's axes."""
    names = {"x": "x", "y": "y", "z": "z", "roll_deg": "roll", "pitch_deg": "pitch"}
    names["yaw_deg"] = "yaw"
    given = {axis: getattr(args, name) for axis, name in names.items()}
    return {axis: value for axis, value in given.items() if value is not None}


def _reporting(bar: Bar, settle: Any) -> Progress:
    """What the search reports to: the bar, and a look for a dropped Ctrl-C."""

    def report(done: int, total: int | None, text: str) -> None:
        settle()
        if bar.callback is not None:
            bar(done, total, text)

    return report


def _check_outputs(given: str, outputs: Mapping[str, str | None]) -> None:
    """Refuse outputs that could not be written, before the search and not after it."""
    faults = list[str | Fault]()
    try:
        check_files(given, outputs)
    except FileError as error:
        faults += error.faults
    picture = outputs["--map"]
    if picture is not None and not picture.lower().endswith(PICTURES):
        faults.append(
            f"--map {shown_path(picture)}: is no kind of picture; expected a name that ends in "
            f"{', '.join(PICTURES)}"
        )
    if faults:
        raise FileError(faults)


def _say(
    args: argparse.Namespace,
    placements: Placements,
    name: str,
    plan: StationPlan | None,
    chart: PlacementMap | None,
) -> None:
    """Print the answer, and write what was asked for."""
    from feasibility.reports import placement as report

    if args.json:
        say(json.dumps(report.as_json(placements, plan, chart), allow_nan=False, indent=2))
    else:
        say(report.as_text(placements, name, plan))
    if args.csv is not None:
        text = report.as_csv(placements)
        write_whole(args.csv, lambda stream: stream.write(text.encode()))
        tell(f"table: {shown_path(args.csv)}")
    if chart is not None:
        from feasibility.viewer import plot_map

        figure = plot_map(chart, placements, title=name)
        kind = str(args.map).rsplit(".", 1)[-1].lower()
        write_whole(args.map, lambda stream: figure.savefig(stream, format=kind, dpi=150))
        tell(f"map: {shown_path(args.map)}")
