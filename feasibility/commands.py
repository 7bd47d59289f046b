"""What the subcommands of `coverable` do; each returns its exit status."""

from __future__ import annotations

import argparse
import json
import os
import time
from collections.abc import Mapping
from typing import Any

from feasibility.console import Bar, interruptible, say, tell
from feasibility.files import FileError, check_writable, shown_path, write_whole

STATUS = {"feasible": 0, "infeasible": 1, "undecided": 3}
BAD_INPUT = 2


def check(args: argparse.Namespace, began: float) -> int:
    """`coverable check CASE`: run the search, say the verdict, write what was asked for."""
    with interruptible() as settle:
        from feasibility.case import load_case

        case = load_case(args.case, args.settings)
        _check_outputs({"--save": args.save, "--html": args.html, "--witness": args.witness})
        setup = case.build()
        for note in setup.robot.notes:
            tell(f"note: {setup.robot.name}: {note}")
        for note in getattr(setup.cells, "notes", setup.cells.surface.notes):
            tell(f"note: {case.surface.label}: {note}")
        from feasibility.checking import check as run
        from feasibility.report import as_json, as_text, witness_csv

        loaded = time.perf_counter() - began
        with Bar() as bar:

            def report(done: int, total: int | None, text: str) -> None:
                settle()  # stop even if Python has dropped the Ctrl-C
                if bar.callback is not None:
                    bar(done, total, text)

            verdict = run(*setup, progress=report)
        settle()
    say(_json(as_json(verdict, loaded)) if args.json else as_text(verdict, case, loaded))
    if args.save is not None:
        from feasibility.result import save_result

        save_result(verdict, case, args.save)
        tell(f"result: {shown_path(args.save)} (`coverable show` opens it)")
    if args.html is not None:
        _write_html(verdict, case.name, args.html)
    if args.witness is not None:
        walk = witness_csv(verdict)
        if walk is None:
            what = "has no stored motion" if verdict.feasible else f"is {verdict.answer}"
            tell(f"--witness: nothing written to {shown_path(args.witness)}: this case {what}")
        else:
            write_whole(args.witness, lambda stream: stream.write(walk.encode()))
            tell(f"witness: {shown_path(args.witness)}")
    return STATUS[str(verdict.answer)]


def _check_outputs(outputs: Mapping[str, str | None]) -> None:
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
        raise FileError("\n  ".join(faults))


def _write_html(verdict: Any, case: str, path: str) -> None:
    """Write the self-contained view."""
    from feasibility.viewer import view

    page = view(verdict, case).html()
    write_whole(path, lambda stream: stream.write(page.encode()))
    tell(f"view: {shown_path(path)}")


def show(args: argparse.Namespace, began: float) -> int:
    """`coverable show RESULT`: the view in a browser window until Ctrl-C, or in a file."""
    from feasibility.result import load_result

    if args.html is not None:
        check_writable(args.html)
    result = load_result(args.result)
    say(f"{result.case.name}: {result.verdict!r}")
    if args.html is not None:
        _write_html(result.verdict, result.case.name, args.html)
        return 0
    from feasibility.viewer import view

    with view(result.verdict, result.case.name).show(open_browser=args.browser) as live:
        tell(f"view: {live.url} (served until Ctrl-C)")
        try:
            live.wait()
        except KeyboardInterrupt:
            tell("")
    return 0


def cases(args: argparse.Namespace, began: float) -> int:
    """`coverable cases`: the built-in cases."""
    from feasibility.listing import case_rows, cases_table

    rows = case_rows()
    say(_json({"cases": rows}) if args.json else cases_table(rows))
    return 0


def robots(args: argparse.Namespace, began: float) -> int:
    """`coverable robots`: the robots that a case can name."""
    from feasibility.listing import robot_rows, robots_table

    rows = robot_rows()
    say(_json({"robots": rows}) if args.json else robots_table(rows))
    return 0


def _json(value: dict[str, Any]) -> str:
    """One JSON object without NaN."""
    return json.dumps(value, allow_nan=False, indent=2)
