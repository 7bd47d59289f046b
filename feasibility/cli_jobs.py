"""The arguments of the commands that turn a verdict into work: `path`, `divide`, `explain`."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable

ORDERS = ("rows", "columns", "spiral", "shortest")
STATUSES = """exit status: as of `coverable check`; divide: 0 every cell is in a patch, 1 cells are
left out, 3 undecided"""


def add_case(parser: argparse.ArgumentParser, *, html: bool = True) -> None:
    """The arguments that every command about one case has."""
    parser.add_argument("case", metavar="CASE", help="a case file, or a built-in case")
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    if html:
        parser.add_argument("--html", metavar="FILE", help="write one self-contained page")
    parser.add_argument(
        "--set",
        dest="settings",
        metavar="KEY=VALUE",
        action="append",
        default=[],
        help="replace a key of the case, such as task.cone_deg=10; an empty value removes it; "
        "can be given many times",
    )


def add_jobs(subcommands: argparse._SubParsersAction) -> None:
    """Add the three commands."""
    path = subcommands.add_parser(
        "path",
        help="a coverage motion that an arm can run",
        description="Lay a path over every cell in a chosen order, time it within the limits of "
        "joints and tool, and write it as a trajectory.",
        epilog=STATUSES,
        allow_abbrev=False,
    )
    add_case(path)
    path.add_argument(
        "--order", choices=ORDERS, help="default: rows on a grid of cells, shortest on others"
    )
    path.add_argument(
        "--speed", type=positive, default=0.1, metavar="M_PER_S",
        help="largest speed of the tool point, m/s (default 0.1)",
    )  # fmt: skip
    path.add_argument(
        "--velocity", type=positive, metavar="RAD_PER_S",
        help="largest velocity of every joint, rad/s or m/s (default: the URDF's limits)",
    )  # fmt: skip
    path.add_argument(
        "--acceleration", type=positive, metavar="RAD_PER_S2",
        help="largest acceleration of every joint, rad/s^2 or m/s^2 (default: what takes a joint "
        "to its largest velocity in half a second)",
    )  # fmt: skip
    path.add_argument(
        "--period", type=positive, default=0.02, metavar="S",
        help="time between samples, seconds (default 0.02)",
    )  # fmt: skip
    path.add_argument(
        "--out", metavar="FILE", action="append", default=[],
        help="write the trajectory; .csv, .json, or .yaml like a ROS JointTrajectory; can be given "
        "many times",
    )  # fmt: skip
    path.set_defaults(run=_run("path"))

    divide = subcommands.add_parser(
        "divide",
        help="the fewest sub-patches, each one continuous motion",
        description="Divide a surface that one motion cannot cover into the fewest patches, and "
        "say how the joints move from one to the next.",
        epilog=STATUSES,
        allow_abbrev=False,
    )
    add_case(divide)
    divide.set_defaults(run=_run("divide"))

    explain = subcommands.add_parser(
        "explain",
        help="what would make a case feasible, and the margins of a feasible one",
        description="Find the thresholds at which the verdict turns: cone, joint limits, standoff, "
        "place of the surface, cells to drop.",
        epilog=STATUSES,
        allow_abbrev=False,
    )
    add_case(explain)
    explain.set_defaults(run=_run("explain"))


def _run(name: str) -> Callable[[argparse.Namespace, float], int]:
    """The command of that name in `feasibility.job_commands`, loaded when it runs."""

    def run(args: argparse.Namespace, began: float) -> int:
        from feasibility import job_commands

        return int(getattr(job_commands, name)(args, began))

    return run


def positive(text: str) -> float:
    """A finite number > 0."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number > 0.0):
        raise argparse.ArgumentTypeError(f"must be a finite number > 0, got {text!r}")
    return number
