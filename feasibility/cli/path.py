"""The command `coverable path`: a coverage motion over cells, or along passes."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING

from feasibility.cli.command_parts import (
    STATUS,
    add_case,
    add_command,
    add_html,
    json_text,
    open_case,
    positive,
    tell,
)
from feasibility.cli.console import print_err, print_out
from feasibility.cli.output_files import write_text
from feasibility.cli.passes import add_passes, check_passes, in_runs, passes_asked
from feasibility.cli.programs import add_programs, check_programs, period_of, write_runs
from feasibility.read_files import shown_path

if TYPE_CHECKING:
    from feasibility.cases.case import Case
    from feasibility.cli.command_parts import OpenCase
    from feasibility.demands.area import TreatedArea
    from feasibility.division.pass_planning import PlannedPasses
    from feasibility.paths.coverage import CoveragePath
    from feasibility.timing.sampled_trajectory import Trajectory
    from feasibility.timing.speed_limits import MotionLimits
    from feasibility.verdict import Verdict
    from feasibility.viewer.viewer import View

ORDERS = ("rows", "columns", "spiral", "shortest", "given")
STATUSES = "exit status: as of `coverable check`"
WHY_COMPLETE = "a path needs 'complete': the greedy search does not visit the cells' centres"
SPEED = 0.1  # [m/s] of the tool point
APPROACH = 0.05  # [m] of entry and exit, where there is a home


def add(subcommands: argparse._SubParsersAction) -> None:
    """Add the command."""
    add_command(
        subcommands, "path", path, add_case, add_html, add_passes, _add_timing,
        add_programs, _add_ends,
        help="a coverage motion that an arm can run",
        description="Plan a path over every cell in a chosen order, time it within the limits of "
        "joints and tool, and write it as a trajectory.",
        epilog=STATUSES,
    )  # fmt: skip


def _add_timing(parser: argparse.ArgumentParser) -> None:
    """How a path is ordered, timed and written."""
    parser.add_argument(
        "--order",
        choices=ORDERS,
        help="default: rows on a grid of cells, given of a toolpath, shortest on others",
    )
    parser.add_argument(
        "--speed", type=positive, metavar="M_PER_S",
        help="maximum speed of the tool point, m/s (default task.speed, else 0.1)",
    )  # fmt: skip
    parser.add_argument(
        "--velocity", type=positive, metavar="RAD_PER_S",
        help="maximum velocity of every joint, rad/s or m/s (default: the URDF's limits)",
    )  # fmt: skip
    parser.add_argument(
        "--acceleration", type=positive, metavar="RAD_PER_S2",
        help="maximum acceleration of every joint, rad/s^2 or m/s^2 (default: what takes a joint "
        "to its maximum velocity in half a second)",
    )  # fmt: skip
    parser.add_argument(
        "--period", type=positive, metavar="S",
        help="time between samples, seconds (default 0.02; 0.1 for programs alone, but URScript)",
    )  # fmt: skip
    parser.add_argument(
        "--out", metavar="FILE", action="append", default=[],
        help="write the trajectory; .csv, .json, .yaml like a ROS JointTrajectory, or "
        ".compas, the JSON of compas_fab; can be repeated",
    )  # fmt: skip


def _add_ends(parser: argparse.ArgumentParser) -> None:
    """How the surface is approached, and left."""
    parser.add_argument(
        "--approach", type=positive, metavar="M",
        help="begin and end with a straight move of this length along the approach direction, "
        "from and to task.home_deg where there is one (default 0.05 with a home, else none)",
    )  # fmt: skip


def path(args: argparse.Namespace, began: float) -> int:
    """`coverable path CASE`: a coverage motion in a chosen order, timed and written to files."""
    outputs = {"--html": args.html} | {f"--out[{k}]": out for k, out in enumerate(args.out)}
    outputs |= {f"--program[{k}]": file for k, file in enumerate(args.program)}

    def check_case(case: Case) -> None:
        from feasibility.paths.order import check_order
        from feasibility.results.trajectory_files import check_ending

        check_passes(args)
        for out in args.out:
            check_ending(out)
        check_programs(args, case)
        if args.order is not None:
            check_order(args.order, case.surface.kind, case.surface.is_grid)

    with open_case(args, began, outputs, WHY_COMPLETE, check_case) as opened:
        from feasibility.checking import check
        from feasibility.clock import OutOfTime
        from feasibility.demands.motion_rates import path_rates
        from feasibility.demands.treated_words import shortfall
        from feasibility.division.between_patches import ends_of
        from feasibility.paths.coverage import coverage_path
        from feasibility.reports import path as report
        from feasibility.timing.path_timing import trajectory
        from feasibility.timing.speed_limits import motion_limits
        from feasibility.verdict import Answer, Walk

        robot, loaded = opened.setup.robot, opened.so_far()
        period = period_of(args)
        speed = args.speed = args.speed or opened.setup.task.speed or SPEED
        limits = motion_limits(robot, speed, args.velocity, args.acceleration)
        along = None if args.passes is None else passes_asked(args, opened)
        verdict = check(*opened.setup, clock=opened.clock) if along is None else along.verdict
        if not verdict.feasible and along is not None and "time limit" not in verdict.message:
            return in_runs(args, opened, along)
        if not verdict.feasible:
            return _no_path(args, opened.case.name, verdict, loaded)
        try:
            with opened.clock.enforced():
                opened.progress(0, None, "planning the path")
                found = coverage_path(verdict, args.order)
                treated = _treated(opened, along, found)
                approach = args.approach or (None if found.task.home_deg is None else APPROACH)
                rates = path_rates(found)
                ends = None if approach is None else ends_of(found, approach)
                entry, leave = (None, None) if ends is None else (ends.entry, ends.exit)
                opened.progress(0, None, "timing the path")
                run = trajectory(
                    found, speed, velocity=args.velocity, acceleration=args.acceleration,
                    period=period, entry=entry, leave=leave,
                )  # fmt: skip
                path_rates(found, Walk(run.q[run.over], run.cell[run.over]))
        except OutOfTime:
            late = f"The time limit of {opened.clock.limit:g} s ran out before the path was timed."
            verdict = replace(verdict, answer=Answer.UNDECIDED, message=f"{verdict.message} {late}")
            return _no_path(args, opened.case.name, verdict, loaded)
    known = None if along is None else along.passes, treated, rates, ends
    tell(args, report, found, run, limits, *known)
    short = shortfall(opened.setup.task, treated)
    write_runs(args, opened, along, run)
    if args.html is not None:
        write_text(args.html, _view(opened, along, found, treated, run, limits).html(), "view")
    if short:
        print_err(f"undecided: {short}")
    return STATUS["undecided" if short else "feasible"]


def _view(
    opened: OpenCase,
    along: PlannedPasses | None,
    found: CoveragePath,
    treated: TreatedArea | None,
    run: Trajectory,
    limits: MotionLimits,
) -> View:
    """The picture of a path over cells, or along passes."""
    from feasibility.viewer.pass_view import view_passes
    from feasibility.viewer.path_and_division import view_path

    if along is None:
        return view_path(found, run, opened.case.name, limits, treated)
    return view_passes(along, [found], treated, run, opened.case.name, limits)


def _treated(
    opened: OpenCase, along: PlannedPasses | None, found: CoveragePath
) -> TreatedArea | None:
    """What the path treats; None where the task has no footprint."""
    from feasibility.demands.area import treated_by_walk

    if along is not None:
        return along.treated(found.walk)
    return treated_by_walk(found.robot, found.cells, opened.setup.task, found.walk)


def _no_path(args: argparse.Namespace, name: str, verdict: Verdict, loaded: float) -> int:
    """Say why there is no path; the exit status is the verdict's."""
    from feasibility.reports import path as report

    reason = f"no path over this surface is known. {verdict!r}"
    print_err(f"coverable path: {name}: {reason}")
    if str(verdict.answer) == "undecided" and "time limit" in verdict.message:
        print_err("`--set search.time_limit=...` gives the search more time.")
    print_err("`coverable explain` finds what would help, `coverable divide` splits the surface.")
    written = ("--out", args.out), ("--program", args.program), ("--html", [args.html])
    for flag, files in written:
        for file in files:
            if file is not None:
                print_err(f"{flag}: nothing written to {shown_path(file)}")
    if args.json:
        print_out(json_text(report.no_path_json(verdict, reason, loaded)))
    return STATUS[str(verdict.answer)]
