"""The arguments of the commands besides `check`."""

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
    path.set_defaults(run=_run("path_divide_explain", "path"))

    divide = subcommands.add_parser(
        "divide",
        help="the fewest sub-patches, each one continuous motion",
        description="Divide a surface that one motion cannot cover into the fewest patches, and "
        "say how the joints move from one to the next.",
        epilog=STATUSES,
        allow_abbrev=False,
    )
    add_case(divide)
    divide.set_defaults(run=_run("path_divide_explain", "divide"))

    explain = subcommands.add_parser(
        "explain",
        help="what would make a case feasible, and the margins of a feasible one",
        description="Find the thresholds at which the verdict turns: cone, joint limits, standoff, "
        "place of the surface, cells to drop.",
        epilog=STATUSES,
        allow_abbrev=False,
    )
    add_case(explain)
    explain.set_defaults(run=_run("path_divide_explain", "explain"))


def positive(text: str) -> float:
    """A finite number > 0."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number > 0.0):
        raise argparse.ArgumentTypeError(f"must be a finite number > 0, got {text!r}")
    return number


AXES = {
    "x": "m", "y": "m", "z": "m", "roll": "degrees", "pitch": "degrees", "yaw": "degrees"
}  # fmt: skip


def add_studies(subcommands: argparse._SubParsersAction, add_case: Callable[..., None]) -> None:
    """Add the three commands.

    Args:
        subcommands: of the command line.
        add_case: adds the arguments of a command about one case.
    """
    _add_study(subcommands)
    _add_compare(subcommands, add_case)
    _add_place(subcommands, add_case)


def _add_study(subcommands: argparse._SubParsersAction) -> None:
    """Add `coverable study`."""
    study = subcommands.add_parser(
        "study",
        help="many cases at once, kept as they come",
        description="Decide every case of a study file. What is finished is kept in one file; run "
        "the command again after an interruption, and it goes on from there.",
        epilog="exit status: 0; 3 where some cases failed; 2 bad input, 130 interrupted",
        allow_abbrev=False,
    )
    study.add_argument("file", metavar="FILE", help="a study file (TOML)")
    study.add_argument("--out", metavar="FILE", required=True, help="where finished cases are kept")
    study.add_argument("--json", action="store_true", help="print one JSON object")
    study.add_argument("--csv", metavar="FILE", help="write the table")
    study.add_argument("--html", metavar="FILE", help="write one page with tables, charts, poses")
    _add_workers(study)
    study.set_defaults(run=_run("study_compare", "study"))


def _add_compare(subcommands: argparse._SubParsersAction, add_case: Callable[..., None]) -> None:
    """Add `coverable compare`."""
    compare = subcommands.add_parser(
        "compare",
        help="one case, several arms side by side",
        description="Put the same question to several arms.",
        allow_abbrev=False,
    )
    add_case(compare)
    compare.add_argument(
        "--robots", metavar="NAMES", required=True, help="names of arms, such as ur5,panda,kinova"
    )
    compare.add_argument(
        "--critical", action="store_true", help="find the smallest cone of each arm too (slow)"
    )
    compare.add_argument("--csv", metavar="FILE", help="write the table")
    _add_workers(compare)
    compare.set_defaults(run=_run("study_compare", "compare"))


def _add_place(subcommands: argparse._SubParsersAction, add_case: Callable[..., None]) -> None:
    """Add `coverable place`."""
    place = subcommands.add_parser(
        "place",
        help="where the surface may stand",
        description="Search a region of positions and orientations of the surface (in the frame of "
        "the URDF's root link) for placements that one continuous motion covers.",
        epilog="exit status: 0 a placement is feasible, 1 none was found, 3 undecided",
        allow_abbrev=False,
    )
    add_case(place, html=False)
    for name, unit in AXES.items():
        place.add_argument(
            f"--{name}", nargs=2, type=float, metavar=("FROM", "TO"),
            help=f"range of the surface's {name}, {unit} (default: as in the case)",
        )  # fmt: skip
    place.add_argument("--count", type=int, metavar="N", help="placements that are tried first")
    place.add_argument(
        "--stations", action="store_true",
        help="where no placement will do alone: the fewest that together cover the surface",
    )  # fmt: skip
    place.add_argument("--csv", metavar="FILE", help="write the placements as a table")
    place.add_argument("--map", metavar="FILE", help="draw the share covered over the region")
    place.add_argument("--html", metavar="FILE", help="write a view of all placements tried")
    place.add_argument("--out", metavar="FILE", help="keep finished placements, to go on from them")
    place.add_argument(
        "--time-limit",
        type=positive,
        metavar="S",
        help="seconds for the search; stations, map and view come on top",
    )
    _add_workers(place)
    place.set_defaults(run=_run("place", "run_place"))


def _add_workers(parser: argparse.ArgumentParser) -> None:
    """Who does the work."""
    who = parser.add_mutually_exclusive_group()
    who.add_argument("--workers", type=int, metavar="N", help="processes (default: one a core)")
    who.add_argument("--dask", metavar="ADDRESS", help="a Dask scheduler, such as tcp://host:8786")


def _run(module: str, name: str) -> Callable[[argparse.Namespace, float], int]:
    """A command that is loaded when it runs, so that `--help` is quick."""

    def run(args: argparse.Namespace, began: float) -> int:
        from importlib import import_module

        return int(getattr(import_module(f"feasibility.cli.{module}"), name)(args, began))

    return run
