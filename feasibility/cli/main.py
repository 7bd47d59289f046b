"""The command `coverable`: arguments in, exit status out.

Heavy libraries are imported by the commands that need them, so that `--help` is quick.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
import time
from collections.abc import Sequence
from importlib import import_module
from typing import NoReturn

from coverable.errors import CoverableError
from feasibility.cli.command_parts import BAD_INPUT, STATUS, MakeClock, TooLate, json_text
from feasibility.cli.console import prepare, print_err, print_out
from feasibility.interrupts import INTERRUPTED, MESSAGE, enforcing, leave_at_once

TRACEBACK = "COVERABLE_TRACEBACK"
MODULES = {
    "check": ("check",),
    "case_commands": ("show", "live", "divide", "explain"),
    "path": ("path",),
    "verify": ("verify",),
    "study_compare": ("study", "compare"),
    "place": ("place",),
    "listing": ("cases", "robots", "keys"),
    "warm_up": (),  # which runs the others
}
"""The commands of each module; only that of the command that is asked for is loaded."""


class _Parser(argparse.ArgumentParser):
    """An argument parser whose faults are one line."""

    def error(self, message: str) -> NoReturn:
        """Print one line and leave with status 2."""
        print_err(f"{self.prog}: {message}; see `{self.prog} --help`")
        raise SystemExit(BAD_INPUT)


class _Version(argparse.Action):
    """Print the version, which is looked up only then."""

    def __call__(self, parser: argparse.ArgumentParser, *rest: object) -> NoReturn:
        """Print it and leave."""
        from feasibility.version import version

        print_out(f"coverable {version()}")
        raise SystemExit(0)


def parser_of(command: str = "") -> argparse.ArgumentParser:
    """The arguments of the command line: of a command and those beside it, or of all."""
    parser = _Parser(
        prog="coverable",
        description="Can this arm move its tool continuously over this whole surface, holding the "
        "standoff and the cone, inside its joint limits?",
        epilog="start with: coverable check paper/4a --html view.html",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    subcommands = parser.add_subparsers(metavar="COMMAND", dest="command", required=True)
    for module in [name for name, words in MODULES.items() if command in words] or MODULES:
        import_module(f"feasibility.cli.{module}").add(subcommands)
    return parser


def main(argv: Sequence[str] | None = None, clock: MakeClock | None = None) -> int:
    """Run the command line.

    Args:
        argv: the arguments; default those of the process.
        clock: makes the clock of the command from its time limit and progress; default `Clock`.

    Returns:
        The exit status; nothing is raised.
    """
    began = time.perf_counter()
    try:
        with enforcing():
            prepare()
            words = sys.argv[1:] if argv is None else argv
            parser = parser_of(next(iter(words), ""))
            args, unknown = parser.parse_known_args(words)
            if unknown:
                parser.prog = f"coverable {args.command}"  # whose help names what there is
                parser.error(f"unrecognized arguments: {' '.join(unknown)}")
            args.clock = clock
            try:
                return int(args.run(args, began))
            except TooLate as late:
                return _too_late(args, late)
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 0
    except KeyboardInterrupt:
        print_err(MESSAGE)
        return INTERRUPTED
    except Exception as error:  # noqa: BLE001 - the last line before the user
        if _with_traceback():
            import traceback

            print_err("".join(traceback.format_exception(error)))
        print_err(f"coverable: {_message(error)}")
        return BAD_INPUT


def _too_late(args: argparse.Namespace, late: TooLate) -> int:
    """Say that the time ran out before the work itself began; returns the exit status."""
    from feasibility.reports import too_late as report

    if args.json:
        seconds = time.perf_counter() - late.began
        print_out(json_text(report.as_json(late.case, late.text, seconds)))
    else:
        print_out(report.as_text(late.case, late.text))
    for output in late.outputs:
        print_err(f"nothing written to {output}")
    return STATUS["undecided"]


def _message(error: Exception) -> str:
    """What went wrong, and what to do about it where that is known."""
    if isinstance(error, CoverableError):
        return str(error)
    if isinstance(error, MemoryError):
        return "there is not enough memory; use fewer cells"
    if isinstance(error, OSError) and not _has_working_directory():
        return "the working directory has been deleted; change to one that exists"
    if isinstance(error, OSError):
        file = f"{error.filename}: " if error.filename else ""
        return f"{file}{error.strerror or error}"
    if isinstance(error, ImportError):
        return (
            f"a library is missing or broken ({error}); install coverable into a fresh virtual "
            "environment"
        )
    text = " ".join(str(error).split())
    return (
        f"this is a bug in coverable: {type(error).__name__}: {text}\n"
        f"Run the command again with {TRACEBACK}=1, and report what it prints."
    )


def _has_working_directory() -> bool:
    """Can relative paths be followed?"""
    try:
        os.getcwd()
    except OSError:
        return False
    return True


def _with_traceback() -> bool:
    """Does the user want to see tracebacks?"""
    return os.environ.get(TRACEBACK, "") not in ("", "0")


def run() -> NoReturn:
    """The console script: like `main`, and ends the process at once.

    Every file is closed by then. Taking numba and Pinocchio apart in order would take another third
    of a second, also after Ctrl-C.
    """
    leave_at_once()
    status = main()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(status)
