"""`coverable check`, which decides one case, and `coverable show`, which opens a saved result."""

from __future__ import annotations

import argparse

from feasibility.cli.arguments import add_case, add_command, add_html
from feasibility.cli.console import print_err, print_out
from feasibility.cli.outputs import STATUS, json_text, write_text
from feasibility.cli.session import open_case
from feasibility.safe_files import check_writable, shown_path

STATUSES = """exit status: 0 feasible, 1 infeasible, 3 undecided, 2 bad input,
130 interrupted"""


def add(subcommands: argparse._SubParsersAction) -> None:
    """Add both commands."""
    parser = add_command(
        subcommands,
        "check",
        check,
        help="decide one case",
        description="Decide one case, and report the evidence for the answer.",
        epilog=STATUSES,
    )
    add_case(parser)
    add_html(parser)
    parser.add_argument(
        "--witness", metavar="FILE", help="write the covering motion as CSV (feasible only)"
    )
    parser.add_argument("--save", metavar="RESULT", help="write a result file for `coverable show`")

    parser = subcommands.add_parser(
        "show",
        help="look at a result that `check --save` wrote",
        description="Open the view of a result in a browser window; Ctrl-C ends it.",
        allow_abbrev=False,
    )
    parser.set_defaults(run=show)
    parser.add_argument("result", metavar="RESULT", help="a file that `check --save` wrote")
    add_html(parser, "the view to a file instead")
    parser.add_argument(
        "--no-browser",
        dest="browser",
        action="store_false",
        help="only print the address of the view",
    )


def check(args: argparse.Namespace, began: float) -> int:
    """`coverable check CASE`: run the search, print the verdict, write the files asked for."""
    outputs = {"--save": args.save, "--html": args.html, "--witness": args.witness}
    with open_case(args, began, outputs) as opened:
        from feasibility.checking import check as run
        from feasibility.reports import verdict as report

        case, loaded = opened.case, opened.so_far()
        verdict = run(*opened.setup, progress=opened.progress)
    if args.json:
        print_out(json_text(report.as_json(verdict, loaded)))
    else:
        print_out(report.as_text(verdict, case, loaded))
    if args.save is not None:
        from feasibility.results import save_result

        save_result(verdict, case, args.save)
        print_err(f"result: {shown_path(args.save)} (`coverable show` opens it)")
    if args.html is not None:
        from feasibility.viewer import view

        write_text(args.html, view(verdict, case.name).html(), "view")
    if args.witness is not None:
        motion = report.as_csv(verdict)
        if motion is None:
            why = "has no stored motion" if verdict.feasible else f"is {verdict.answer}"
            print_err(f"--witness: nothing written to {shown_path(args.witness)}: this case {why}")
        else:
            write_text(args.witness, motion, "witness")
    return STATUS[str(verdict.answer)]


def show(args: argparse.Namespace, began: float) -> int:
    """`coverable show RESULT`: the view in a browser window until Ctrl-C, or in a file."""
    from feasibility.results import load_result

    if args.html is not None:
        check_writable(args.html)
    result = load_result(args.result)
    print_out(f"{result.case.name}: {result.verdict!r}")
    from feasibility.viewer import view

    drawn = view(result.verdict, result.case.name)
    if args.html is not None:
        write_text(args.html, drawn.html(), "view")
        return 0
    with drawn.show(open_browser=args.browser) as live:
        print_err(f"view: {live.url} (served until Ctrl-C)")
        try:
            live.wait()
        except KeyboardInterrupt:
            print_err("")
    return 0
