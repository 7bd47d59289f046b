"""`coverable verify`: a motion, or a saved result, checked without searching."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from feasibility.cli.command_parts import (
    TooLate,
    add_case,
    add_command,
    command_clock,
    json_text,
    open_case,
)
from feasibility.cli.console import Bar, print_out
from feasibility.cli.passes import add_layout, check_passes, places_asked
from feasibility.read_files import shown_path

if TYPE_CHECKING:
    from collections.abc import Sequence

    from feasibility.cases.case import Case
    from feasibility.verifying import Verification

LIMIT = "search.time_limit"


def add(subcommands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = add_command(
        subcommands, "verify", verify, add_case, add_layout,
        help="check a motion from anywhere, or a saved result, without searching",
        usage="coverable verify [--json] [--set KEY=VALUE] CASE MOTION\n"
        "       coverable verify [--json] [--set search.time_limit=SECONDS] RESULT",
        description="Check a joint motion against a case by the independent replay alone: limits, "
        "tool point and tool axis at every instant, between rows too, every cell reached, and all "
        "else that the case demands. Or check the witness or the proof of a result that "
        "`check --save` wrote.",
        epilog="MOTION is CSV: a first line of joint names in any order, then a row a waypoint, in "
        "rad (NAME_deg: degrees) or m, unwrapped; rows are joined by straight lines in joint "
        "space, and counted from 1. A column `working`, as `coverable path` writes it, is 1 in "
        "rows at which the tool works and else 0: there it may be lifted. A motion along passes "
        "is judged with the --passes and --pitch that it was planned with. exit status: 0 holds, "
        "1 does not, or is not verified within search.time_limit, 2 bad input, 130 interrupted",
    )  # fmt: skip
    parser.add_argument(
        "motion", metavar="MOTION", nargs="?", help="a file of joint values; none for a RESULT"
    )


def verify(args: argparse.Namespace, began: float) -> int:
    """`coverable verify CASE MOTION`, and `coverable verify RESULT`."""
    return _result(args, began) if args.motion is None else _motion(args, began)


def _motion(args: argparse.Namespace, began: float) -> int:
    """Check a motion file against a case."""

    def check_case(case: Case) -> None:
        check_passes(args)

    try:
        with open_case(args, began, {}, check_case=check_case) as opened:
            import numpy as np

            from feasibility.results.motion_file import load_motion
            from feasibility.verifying import verify as run

            robot, cells, task, _ = opened.setup
            motion = load_motion(args.motion, robot)
            if args.passes is not None:
                opened.progress(0, None, "planning passes")
                cells = places_asked(args, cells.surface, task)
            opened.progress(0, None, "replaying the motion")
            working = motion.working
            if working is None and args.passes is not None:
                working = np.ones(len(motion.q), dtype=bool)
            marks = motion.marks if args.passes is None else None
            found = run(
                robot, cells, task, motion.q, working=working, marks=marks, clock=opened.clock
            )
    except TooLate as late:
        return _too_late(args, late.case)
    return _said(args, found, opened.case.name, args.motion, motion.notes)


def _result(args: argparse.Namespace, began: float) -> int:
    """Check a saved result."""
    with Bar() as progress:
        from coverable.errors import CoverableError
        from feasibility.clock import OutOfTime
        from feasibility.results.result_file import ResultError, case_of_result, load_result
        from feasibility.verifying import verify as run

        if args.passes is not None or args.pitch is not None:
            raise CoverableError("--passes is of a motion; a result knows what was asked")
        if any(setting.partition("=")[0].strip() != LIMIT for setting in args.settings):
            raise CoverableError(
                "--set changes a case; a result holds the case it was found for, of which only "
                f"{LIMIT} may be another"
            )
        try:
            case = case_of_result(args.case).with_overrides(args.settings)
            clock = command_clock(args, case.search.time_limit, progress, began)
            progress(0, None, "verifying")
            with clock.enforced():
                result = load_result(args.case)
        except OutOfTime:
            return _too_late(args, case)
        except ResultError as error:
            hint = "a motion is checked by `coverable verify CASE MOTION`"
            raise ResultError(f"{error}; {hint}") from error
        found = run(result, clock=clock)
    return _said(args, found, case.name, args.case, ())


def _too_late(args: argparse.Namespace, case: Case) -> int:
    """Say that the time ran out while arm and surface were loaded; the exit status."""
    from feasibility.reports import verification as report

    print_out(json_text(report.late_json(case)) if args.json else report.late_text(case))
    return 1


def _said(
    args: argparse.Namespace, found: Verification, case: str, source: str, notes: Sequence[str]
) -> int:
    """Print the answer; the exit status."""
    from feasibility.reports import verification as report

    if args.json:
        print_out(json_text(report.as_json(found, notes)))
    else:
        print_out(report.as_text(found, case, shown_path(source), notes))
    return 0 if found.holds else 1
