"""Programs, entry and exit of `coverable path`: their arguments, and the files that it writes."""

from __future__ import annotations

import argparse
import math
from typing import TYPE_CHECKING

from feasibility.cli.command import positive
from feasibility.cli.console import print_err
from feasibility.safe_files import shown_path

if TYPE_CHECKING:
    from feasibility.task import Task
    from feasibility.timing import Trajectory
    from robots import Robot

PERIOD = 0.02  # [s] between samples
APPROACH = 0.05  # [m] of entry and exit, where there is a home


def add_ends(parser: argparse.ArgumentParser) -> None:
    """How the surface is approached, and left."""
    parser.add_argument(
        "--approach", type=positive, metavar="M",
        help="begin and end with a straight move of this length along the approach direction, "
        "from and to task.home_deg where there is one (default 0.05 with a home, else none)",
    )  # fmt: skip


def approach_of(args: argparse.Namespace, task: Task) -> float | None:
    """m, length of the moves along the approach direction; None where there are none."""
    if args.approach is not None or task.home_deg is None:
        return None if args.approach is None else float(args.approach)
    return APPROACH


def add_programs(parser: argparse.ArgumentParser) -> None:
    """Programs of robot controllers."""
    parser.add_argument(
        "--program", metavar="FILE", action="append", default=[],
        help="write the trajectory as a program: .script (URScript), .mod (ABB RAPID) or .src "
        "(KUKA KRL); can be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--axis-signs", metavar="S1,..,S6", type=_six,
        help="of a program: 1 or -1 for each axis of the controller, where its sense is not that "
        "of the URDF's joint; write --axis-signs=-1,1,1,1,1,1",
    )  # fmt: skip
    parser.add_argument(
        "--axis-offsets-deg", metavar="D1,..,D6", type=_six,
        help="of a program: degrees that are added to each axis, where its zero is another",
    )  # fmt: skip


def _six(text: str) -> list[float]:
    """Six finite numbers with commas between them.

    Raises:
        ArgumentTypeError: the text is something else.
    """
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if len(numbers) != 6 or not all(map(math.isfinite, numbers)):
        raise argparse.ArgumentTypeError(f"must be six numbers with commas, got {text!r:.60}")
    return numbers


def check_programs(args: argparse.Namespace, robot: Robot) -> float:
    """Refuse programs that this arm has not, before the search; s between samples.

    Raises:
        CoverableError: a file's ending is that of no program, or the arm has none of that kind.
    """
    from feasibility.programs import check_program, language_of

    languages = [language_of(file) for file in args.program]
    for language in languages:
        check_program(language, robot, args.axis_signs, args.axis_offsets_deg)
    if args.period is not None:
        return float(args.period)
    slow = [language.period for language in languages]
    return PERIOD if args.out or not slow else min(slow)


def write_path(args: argparse.Namespace, robot: Robot, run: Trajectory, name: str) -> None:
    """Write the wanted trajectories and programs, and report them on stderr.

    Raises:
        FileError: a file cannot be written.
    """
    for out in args.out:
        from feasibility.results import save_trajectory

        save_trajectory(out, run)
        print_err(f"trajectory: {shown_path(out)}")
    for file in args.program:
        from feasibility.programs import save_program

        save_program(file, robot, run, name, args.axis_signs, args.axis_offsets_deg)
        print_err(f"program: {shown_path(file)}")
