"""What the subcommands of `coverable` do; each returns its exit status."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from feasibility.cli.console import say, tell
from feasibility.cli.session import asked
from feasibility.safe_files import FileError, check_writable, shown_path, write_whole

if TYPE_CHECKING:
    from feasibility.viewer import View

STATUS = {"feasible": 0, "infeasible": 1, "undecided": 3}
BAD_INPUT = 2


def check(args: argparse.Namespace, began: float) -> int:
    """`coverable check CASE`: run the search, say the verdict, write what was asked for."""
    outputs = {"--save": args.save, "--html": args.html, "--witness": args.witness}
    with asked(args, began, check_first=lambda: check_outputs(outputs)) as question:
        from feasibility.checking import check as run
        from feasibility.reports import verdict as report

        case, loaded = question.case, question.so_far()
        verdict = run(*question.setup, progress=question.progress)
    say(
        json_text(report.as_json(verdict, loaded))
        if args.json
        else report.as_text(verdict, case, loaded)
    )
    if args.save is not None:
        from feasibility.results import save_result

        save_result(verdict, case, args.save)
        tell(f"result: {shown_path(args.save)} (`coverable show` opens it)")
    if args.html is not None:
        from feasibility.viewer import view

        write_view(view(verdict, case.name), args.html)
    if args.witness is not None:
        walk = report.witness_csv(verdict)
        if walk is None:
            what = "has no stored motion" if verdict.feasible else f"is {verdict.answer}"
            tell(f"--witness: nothing written to {shown_path(args.witness)}: this case {what}")
        else:
            write_whole(args.witness, lambda stream: stream.write(walk.encode()))
            tell(f"witness: {shown_path(args.witness)}")
    return STATUS[str(verdict.answer)]


def check_outputs(outputs: Mapping[str, str | None]) -> None:
    """Refuse outputs that could not be written, before the search and not after it."""
    faults, taken = [], dict[str, str]()
    for flag, path in outputs.items():
        if path is None:
            continue
        try:
            check_writable(path)
        except FileError as error:
            faults.append(f"{flag} {error}")
        place = os.path.realpath(path)
        if place in taken and os.path.realpath(os.devnull) != place:
            faults.append(f"{flag} {shown_path(path)}: is the file of {taken[place]} too")
        taken[place] = flag
    if faults:
        raise FileError(faults)


def write_view(drawn: View, path: str) -> None:
    """Write a view as one self-contained page."""
    page = drawn.html()
    write_whole(path, lambda stream: stream.write(page.encode()))
    tell(f"view: {shown_path(path)}")


def show(args: argparse.Namespace, began: float) -> int:
    """`coverable show RESULT`: the view in a browser window until Ctrl-C, or in a file."""
    from feasibility.results import load_result

    if args.html is not None:
        check_writable(args.html)
    result = load_result(args.result)
    say(f"{result.case.name}: {result.verdict!r}")
    from feasibility.viewer import view

    if args.html is not None:
        write_view(view(result.verdict, result.case.name), args.html)
        return 0
    with view(result.verdict, result.case.name).show(open_browser=args.browser) as live:
        tell(f"view: {live.url} (served until Ctrl-C)")
        try:
            live.wait()
        except KeyboardInterrupt:
            tell("")
    return 0


def cases(args: argparse.Namespace, began: float) -> int:
    """`coverable cases`: the built-in cases."""
    from feasibility.cli.listing import case_rows, cases_table

    rows = case_rows()
    say(json_text({"cases": rows}) if args.json else cases_table(rows))
    return 0


def robots(args: argparse.Namespace, began: float) -> int:
    """`coverable robots`: the robots that a case can name."""
    from feasibility.cli.listing import robot_rows, robots_table

    rows = robot_rows()
    say(json_text({"robots": rows}) if args.json else robots_table(rows))
    return 0


def json_text(value: dict[str, Any]) -> str:
    """One JSON object without NaN."""
    return json.dumps(value, allow_nan=False, indent=2)
