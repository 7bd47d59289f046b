"""Further commands on one case: `coverable show`, `live`, `divide` and `explain`."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from feasibility.cli.command_parts import (
    STATUS,
    add_case,
    add_command,
    add_html,
    json_text,
    open_case,
    tell,
)
from feasibility.cli.console import print_err, print_out
from feasibility.cli.first_interrupt import raised
from feasibility.cli.output_files import write_text
from feasibility.safe_files import check_writable

if TYPE_CHECKING:
    from feasibility.sensitivity.thresholds import Explanation
    from feasibility.viewer.live_server import Served

LATER_STATUSES = """exit status: as of `coverable check`; divide: 0 every cell is in a patch,
1 cells are left out, 3 undecided"""
WHY_COMPLETE = {
    "divide": "a division needs 'complete': the greedy search keeps one motion only",
    "explain": "thresholds need 'complete': a greedy search that fails depends on its start",
}


def add(subcommands: argparse._SubParsersAction) -> None:
    """Add the commands."""
    parser = subcommands.add_parser(
        "show",
        help="look at a result that `check --save` wrote, or at the faces of a STEP file",
        description="Open the view of a result, or of the faces of a STEP file with their numbers, "
        "in a browser window; Ctrl-C ends it.",
        allow_abbrev=False,
    )
    parser.set_defaults(run=show)
    parser.add_argument(
        "result", metavar="RESULT", help="a file that `check --save` wrote, or a .step or .stp file"
    )
    add_html(parser, "the view to a file instead")
    _add_browser(parser)
    parser = subcommands.add_parser(
        "live",
        help="move the part, turn the limits, and see the verdict follow",
        description="Open a page with controls for placement, cone, standoff and joint limits, "
        "which decides anew at each change; Ctrl-C ends it. 'Save as case' downloads what is "
        "shown as a case file.",
        allow_abbrev=False,
    )
    parser.set_defaults(run=live, json=False)
    add_case(parser)
    _add_browser(parser)
    parser = add_command(
        subcommands, "divide", divide, add_case, add_html,
        help="the fewest sub-patches, each covered by one continuous motion",
        description="Divide a surface that one motion cannot cover into the fewest patches, and "
        "report how the joints move from one to the next.",
        epilog=LATER_STATUSES,
    )  # fmt: skip
    parser = add_command(
        subcommands, "explain", explain, add_case, add_html,
        help="what would make a case feasible, and the margins of a feasible one",
        description="Find the thresholds at which the verdict changes: cone, joint limits, "
        "standoff, position of the surface, clearances and objects in the way, cells to drop.",
        epilog=LATER_STATUSES,
    )  # fmt: skip
    parser.add_argument(
        "--witness", metavar="FOLDER",
        help="write the covering motion at each threshold as CSV, for `check --seeds` and `verify`",
    )  # fmt: skip


def _add_browser(parser: argparse.ArgumentParser) -> None:
    """Whether a browser is opened."""
    parser.add_argument(
        "--no-browser", dest="browser", action="store_false",
        help="only print the address of the page",
    )  # fmt: skip


def show(args: argparse.Namespace, began: float) -> int:
    """`coverable show RESULT`: the view in a browser window until Ctrl-C, or in a file."""
    if args.html is not None:
        check_writable(args.html)
    if args.result.lower().endswith((".step", ".stp")):
        return _show_faces(args)
    from feasibility.results.result_file import load_result

    result = load_result(args.result)
    print_out(f"{result.case.name}: {result.verdict!r}")
    from feasibility.viewer.viewer import view

    drawn = view(result.verdict, result.case.name)
    if args.html is not None:
        write_text(args.html, drawn.html(), "view")
        return 0
    return _serve("view", drawn.show(open_browser=False), args.browser)


def _show_faces(args: argparse.Namespace) -> int:
    """The faces of a STEP file with their numbers."""
    from feasibility.viewer.faces_view import faces_page
    from feasibility.viewer.live_server import LiveView
    from surfaces.meshes.step_surface import face_words, step_parts

    parts = step_parts(args.result)
    for face in parts.faces:
        print_out(face_words(face))
    drawn = faces_page(parts, Path(args.result).name)
    if args.html is not None:
        write_text(args.html, drawn, "view")
        return 0
    return _serve("view", LiveView(drawn), args.browser)


def live(args: argparse.Namespace, began: float) -> int:
    """`coverable live CASE`: a page where one moves the part, until Ctrl-C."""
    with open_case(args, began, {}) as opened:
        from feasibility.live.serving import Live

        page = Live(opened.case, opened.setup)
    return _serve("live", page, args.browser)


def _serve(name: str, page: Served, in_browser: bool) -> int:
    """Serve a page until Ctrl-C; returns the exit status."""
    with page, raised():
        try:
            if in_browser:
                page.open()
            print_err(f"{name}: {page.url} (served until Ctrl-C)")
            page.wait()
        except KeyboardInterrupt:
            print_err("")
    return 0


def divide(args: argparse.Namespace, began: float) -> int:
    """`coverable divide CASE`: the fewest sub-patches, each covered by one continuous motion."""
    with open_case(args, began, {"--html": args.html}, WHY_COMPLETE["divide"]) as opened:
        from feasibility.division.surface_division import divide as run
        from feasibility.reports import division as report

        loaded = opened.so_far()
        division = run(*opened.setup, clock=opened.clock)
    if args.json:
        print_out(json_text(report.as_json(division, loaded)))
    else:
        print_out(report.as_text(division, opened.case.name, loaded))
    if args.html is not None:
        from feasibility.viewer.path_and_division import view_division

        page = view_division(division, opened.case.name).html()
        write_text(args.html, page, "view")
    return report.STATUS[report.answer_of(division)]


def explain(args: argparse.Namespace, began: float) -> int:
    """`coverable explain CASE`: what would make it feasible, or how far it can be tightened."""
    outputs = {"--html": args.html}
    if args.witness is not None:
        outputs["--witness"] = os.path.join(args.witness, "x.csv")
    with open_case(args, began, outputs, WHY_COMPLETE["explain"]) as opened:
        from feasibility.reports import explanation as report
        from feasibility.sensitivity.explanation import explain as run

        explanation = run(*opened.setup, progress=opened.progress, clock=opened.clock)
    name, verdict = opened.case.name, explanation.verdict
    tell(args, report, explanation, name, opened.case)
    if args.witness is not None:
        _write_witnesses(args.witness, explanation)
    if args.html is not None:
        from feasibility.viewer.viewer import view

        page = report.as_html(explanation, name, view(verdict, name), opened.case)
        write_text(args.html, page, "page")
    return STATUS[str(verdict.answer)]


def _write_witnesses(folder: str, explanation: Explanation) -> None:
    """The motion at each threshold, in a file named after the quantity."""
    from feasibility.reports.explanation import witnesses

    for name, text in witnesses(explanation).items():
        write_text(os.path.join(folder, name), text, "witness")
