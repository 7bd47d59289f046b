"""Arguments that several commands have in common.

Each module of commands has a function `add(subcommands)` that declares the arguments of its
commands beside the functions that run them, as `run(arguments, began)` with the time at which the
program began.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from typing import Any

Command = Callable[[argparse.Namespace, float], int]


def add_command(
    subcommands: argparse._SubParsersAction, name: str, run: Command, **texts: Any
) -> argparse.ArgumentParser:
    """Add a command that prints people's text, or JSON with `--json`.

    Args:
        subcommands: of the command line.
        name: of the command.
        run: what it does with its arguments; returns the exit status.
        texts: `help`, `description`, `epilog`, see `argparse`.
    """
    parser: argparse.ArgumentParser = subcommands.add_parser(name, allow_abbrev=False, **texts)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(run=run)
    return parser


def add_case(parser: argparse.ArgumentParser) -> None:
    """The arguments that every command about one case has."""
    parser.add_argument("case", metavar="CASE", help="a case file, or a built-in case")
    parser.add_argument(
        "--set",
        dest="settings",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="replace a key of the case, such as task.cone_deg=10; an empty value removes it; "
        "can be repeated",
    )


def add_html(parser: argparse.ArgumentParser, what: str = "one self-contained page") -> None:
    """The file for a page."""
    parser.add_argument("--html", metavar="FILE", help=f"write {what}")


def add_csv(parser: argparse.ArgumentParser) -> None:
    """The file for a table."""
    parser.add_argument("--csv", metavar="FILE", help="write the table")


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Which processes do the work."""
    group = parser.add_mutually_exclusive_group()
    group.add_argument("--workers", type=int, metavar="N", help="processes (default: one per core)")
    group.add_argument("--dask", metavar="ADDRESS", help="a Dask scheduler: tcp://host:8786")


def positive(text: str) -> float:
    """A finite number > 0.

    Raises:
        ArgumentTypeError: the text is something else.
    """
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number > 0.0):
        raise argparse.ArgumentTypeError(f"must be a finite number > 0, got {text!r}")
    return number
