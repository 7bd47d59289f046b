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
from typing import NoReturn

from coverable_errors import CoverableError
from feasibility.cli import check_command, listing, path_divide_explain, place, study_compare
from feasibility.cli.console import prepare, say, tell
from feasibility.cli.outputs import BAD_INPUT

INTERRUPTED = 130
TRACEBACK = "COVERABLE_TRACEBACK"
NO_CACHE = "cannot cache function"  # numba's words


class _Parser(argparse.ArgumentParser):
    """An argument parser whose faults are one line."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and leave with status 2."""
        tell(f"{self.prog}: {message}; see `{self.prog} --help`")
        raise SystemExit(BAD_INPUT)


class _Version(argparse.Action):
    """Print the version; it is looked up only when asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *rest: object) -> NoReturn:
        """Say it and leave."""
        from feasibility.version import version

        say(f"coverable {version()}")
        raise SystemExit(0)


def _parser() -> argparse.ArgumentParser:
    """The arguments of the command line."""
    parser = _Parser(
        prog="coverable",
        description="Can this arm move its tool continuously over this whole surface, holding the "
        "standoff and the cone, inside its joint limits?",
        epilog="start with: coverable check paper/4a --html view.html",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and exit")
    subcommands = parser.add_subparsers(metavar="COMMAND", required=True)
    for commands in (check_command, path_divide_explain, study_compare, place, listing):
        commands.add(subcommands)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        argv: the arguments; default those of the process.

    Returns:
        The exit status; nothing is raised.
    """
    began = time.perf_counter()
    prepare()
    try:
        args = _parser().parse_args(argv)
        return int(args.run(args, began))
    except SystemExit as end:
        return end.code if isinstance(end.code, int) else 0
    except KeyboardInterrupt:
        tell("coverable: interrupted")
        return INTERRUPTED
    except Exception as error:  # noqa: BLE001 - the last line before the user
        return _failed(error)


def _failed(error: Exception) -> int:
    """Say what went wrong in one message; a traceback only where it is asked for."""
    if os.environ.get(TRACEBACK, "") not in ("", "0"):
        import traceback

        tell("".join(traceback.format_exception(error)))
    if isinstance(error, CoverableError):
        tell(f"coverable: {error}")
    elif isinstance(error, MemoryError):
        tell("coverable: there is not enough memory; use fewer cells")
    elif isinstance(error, OSError):
        file = f"{error.filename}: " if error.filename else ""
        tell(f"coverable: {file}{error.strerror or error}")
    elif isinstance(error, ImportError):
        tell(
            f"coverable: a library is missing or broken ({error}); install coverable into a fresh "
            "virtual environment"
        )
    elif isinstance(error, RuntimeError) and NO_CACHE in str(error):
        tell(
            "coverable: the compiled search kernels can be kept nowhere: neither the folder of the "
            "installation nor the cache in the home folder can be written to; set NUMBA_CACHE_DIR "
            "to a folder of yours"
        )
    else:
        text = " ".join(str(error).split())
        tell(
            f"coverable: this is a bug in coverable: {type(error).__name__}: {text}\n"
            f"Run the command again with {TRACEBACK}=1, and report what it prints."
        )
    return BAD_INPUT


def _say_nothing(_: sys.UnraisableHookArgs) -> None:
    """Nobody can do anything about it."""


def run() -> NoReturn:
    """The console script: like `main`, and ends the process at once.

    Every file is closed by then. Taking numba and Pinocchio apart in order would take another third
    of a second, also after Ctrl-C.
    """
    if os.environ.get(TRACEBACK, "") in ("", "0"):
        sys.unraisablehook = _say_nothing  # such as the half-made objects of a Ctrl-C, taken apart
    status = main()
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(status)
