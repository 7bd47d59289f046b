"""Programs of robot controllers for `coverable path`: arguments, refusals; and what it writes."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from coverable.errors import CoverableError, Fault, alternatives
from feasibility.cli.command_parts import numbers
from feasibility.cli.console import print_err
from feasibility.programs.controllers import NAMED, language_of
from feasibility.read_files import shown_path

if TYPE_CHECKING:
    from feasibility.cases.case import Case
    from feasibility.cli.command_parts import OpenCase
    from feasibility.division.pass_planning import PlannedPasses
    from feasibility.programs.controller_axes import ProgramSettings
    from feasibility.timing.sampled_trajectory import Trajectory

PERIOD = 0.02  # [s] between samples
ARGUMENTS = {
    "signs": "--axis-signs", "offsets_deg": "--axis-offsets-deg",
    "pulses_per_deg": "--pulses-per-deg", "on": "--on", "off": "--off",
}  # fmt: skip
"""What settings are called on the command line."""


def add_programs(parser: argparse.ArgumentParser) -> None:
    """Programs of robot controllers."""
    parser.add_argument(
        "--program", metavar="FILE", action="append", default=[],
        help=f"write the trajectory as a program: {NAMED}; can be repeated",
    )  # fmt: skip
    parser.add_argument(
        "--on", metavar="TEXT", default="",
        help="of a program: a line of its language that is put at the beginning of each stretch in "
        "which the tool works, such as 'SetDO gun,1;' (of KRL: what a TRIGGER may do)",
    )  # fmt: skip
    parser.add_argument(
        "--off",
        metavar="TEXT",
        default="",
        help="the same for the end of each; off before the tool is lifted, and over holes",
    )
    parser.add_argument(
        "--axis-signs", metavar="S1,..,S6", type=_six,
        help="of a program: 1 or -1 for each axis of the controller, where its sense is not that "
        "of the URDF's joint; write --axis-signs=-1,1,1,1,1,1",
    )  # fmt: skip
    parser.add_argument(
        "--axis-offsets-deg", metavar="D1,..,D6", type=_six,
        help="of a program: degrees that are added to each axis, where its zero is another",
    )  # fmt: skip
    parser.add_argument(
        "--pulses-per-deg", metavar="P1,..,P6", type=_six,
        help="of a Yaskawa program, needed: pulses of each axis per degree, from the controller",
    )  # fmt: skip
    parser.add_argument(
        "--j3-from-upper-arm", action="store_true",
        help="of a FANUC program: J3 is counted from the upper arm, as the URDF's joint is "
        "(default: from the horizontal, as FANUC's controllers show it)",
    )  # fmt: skip


def _six(text: str) -> list[float]:
    """Six finite numbers with commas between them.

    Raises:
        ArgumentTypeError: the text is something else.
    """
    found = numbers(text)
    if len(found) != 6:
        raise argparse.ArgumentTypeError(f"must be six numbers with commas, got {text!r:.60}")
    return found


def check_programs(args: argparse.Namespace, case: Case) -> None:
    """Refuse programs that cannot be written, before anything is built.

    Raises:
        CoverableError: a file's ending is that of no program, the arm has none of that kind, or
            arguments do not go together.
    """
    from feasibility.programs.controller_axes import ProgramError, check_program
    from robots.errors import RobotError

    languages = {language_of(file) for file in args.program}
    for flag, text in (("--on", args.on), ("--off", args.off)):
        if text and len(languages) != 1:
            names = alternatives(sorted(each.name for each in languages)) if languages else ""
            fault = f"is a line of one language, and the programs are {names}" if names else ""
            wanted = "give --program FILE, one language at a time"
            raise CoverableError(Fault(flag, fault or "is of no program", expected=wanted))
    if not languages:
        return
    try:
        robot = case.robot.build(case.surface.frame)
    except RobotError:  # told with all else that is wrong, when the case is built
        return
    for language in languages:
        try:
            check_program(language, robot, _settings(args))
        except ProgramError as error:
            faults = [fault.renamed(ARGUMENTS) for fault in error.faults]
            raise ProgramError(faults, error.source) from error


def period_of(args: argparse.Namespace) -> float:
    """S between samples: as asked for, else what the programs take, if there is no other file."""

    if args.period is not None:
        return float(args.period)
    slow = [language_of(file).period for file in args.program]
    return PERIOD if args.out or not slow else min(slow)


def _settings(args: argparse.Namespace) -> ProgramSettings:
    """What the arguments say of the controller."""
    from feasibility.programs.controller_axes import ProgramSettings

    return ProgramSettings(
        args.axis_signs, args.axis_offsets_deg, args.pulses_per_deg, not args.j3_from_upper_arm,
        args.on, args.off,
    )  # fmt: skip


def write_runs(
    args: argparse.Namespace, opened: OpenCase, along: PlannedPasses | None, *runs: Trajectory,
    numbered: bool = False,
) -> None:  # fmt: skip
    """Write the wanted trajectories and programs, and report them on stderr.

    Args:
        args, opened, along: what was asked for.
        runs: a file each.
        numbered: put their numbers, in the order in which they are run, into the names.

    Raises:
        FileError: a file cannot be written.
    """
    from feasibility.programs.writing import save_program, working_places
    from feasibility.results.trajectory_files import save_trajectory

    work = None if along is None else working_places(along.places, along.passes.stretches)
    robot, cells = opened.setup.robot, opened.setup.cells
    wanted = [("out", "trajectory", out) for out in args.out]
    wanted += [("program", "program", file) for file in args.program]
    for flag, what, name in wanted:
        if not runs:
            print_err(f"--{flag}: nothing written to {shown_path(name)}: there is no motion")
        for number, run in enumerate(runs, start=1):
            path, which = Path(name), what
            if numbered:
                path = path.with_name(f"{path.stem}_{number}{path.suffix}")
                which = f"{what} {number} of {len(runs)}"
            if flag == "out":
                save_trajectory(path, run, robot)
            else:
                settings = _settings(args)
                save_program(path, robot, run, opened.case.name, settings, cells.surface, work)
            print_err(f"{which}: {shown_path(path)}")
