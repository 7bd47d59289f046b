"""`coverable live`: a page where one moves the part, and the verdict follows."""

from __future__ import annotations

import argparse

from feasibility.cli.command import add_case, open_case
from feasibility.cli.console import print_err
from feasibility.interrupts import forgive


def add(subcommands: argparse._SubParsersAction) -> None:
    """Add the command."""
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
    parser.add_argument(
        "--no-browser", dest="browser", action="store_false",
        help="only print the address of the page",
    )  # fmt: skip


def live(args: argparse.Namespace, began: float) -> int:
    """`coverable live CASE`: the page in a browser window until Ctrl-C."""
    with open_case(args, began, {}) as opened:
        from feasibility.live import Live

        page = Live(opened.case, opened.setup)
    with page:
        if args.browser:
            page.open()
        print_err(f"live: {page.url} (served until Ctrl-C)")
        try:
            page.wait()
        except KeyboardInterrupt:
            forgive()
            print_err("")
    return 0
