"""What commands have in common: arguments, and the case they work on.

Each module of commands has a function `add(subcommands)` that declares the arguments of its
commands beside the functions that run them, as `run(arguments, began)` with the time at which the
program began.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from feasibility.cli.console import Bar, print_err, print_out
from feasibility.read_files import shown_path
from feasibility.search_settings import Progress

if TYPE_CHECKING:
    from feasibility.cases.case import Case, Setup
    from feasibility.clock import Clock

Command = Callable[[argparse.Namespace, float], int]
MakeClock = Callable[[float | None, Progress | None], "Clock"]

STATUS = {"feasible": 0, "infeasible": 1, "undecided": 3}
BAD_INPUT = 2


def add_command(
    subcommands: argparse._SubParsersAction,
    name: str,
    run: Command,
    *arguments: Callable[[argparse.ArgumentParser], None],
    **texts: Any,
) -> argparse.ArgumentParser:
    """Add a command that prints people's text, or JSON with `--json`.

    Args:
        subcommands: of the command line.
        name: of the command.
        run: what it does with its arguments; returns the exit status.
        arguments: functions that add some, such as `add_case`.
        texts: `help`, `description`, `epilog`, see `argparse`.
    """
    parser: argparse.ArgumentParser = subcommands.add_parser(name, allow_abbrev=False, **texts)
    parser.add_argument("--json", action="store_true", help="print one JSON object")
    parser.set_defaults(run=run)
    for add in arguments:
        add(parser)
    return parser


def add_case(parser: argparse.ArgumentParser) -> None:
    """The arguments that every command about one case has."""
    parser.add_argument("case", metavar="CASE", help="a case file, or a built-in case")
    parser.add_argument(
        "--set", dest="settings", metavar="KEY=VALUE", action="append", default=[],
        help="replace a key of the case, such as task.cone_deg=10; an empty value removes it; "
        "can be repeated",
    )  # fmt: skip


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
    found = numbers(text)
    if len(found) != 1 or not found[0] > 0.0:
        raise argparse.ArgumentTypeError(f"must be a finite number > 0, got {text!r}")
    return found[0]


def numbers(text: str) -> list[float]:
    """Finite numbers with commas between them; none where the text is something else."""
    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        return []
    return found if all(map(math.isfinite, found)) else []


@dataclass(frozen=True, slots=True)
class OpenCase:
    """A case that a command works on."""

    case: Case
    setup: Setup
    progress: Bar
    """To be called as progress(done, total, text)."""
    clock: Clock
    """Of the whole command, for the case's time limit; it reports to `progress`."""
    began: float
    """`time.perf_counter()` when the command began."""

    def so_far(self) -> float:
        """Seconds since then: called before the search, the time that loading took."""
        return time.perf_counter() - self.began


class TooLate(Exception):
    """The time limit ran out before there was an answer of any other kind."""

    def __init__(self, case: Case, text: str, outputs: list[str], began: float) -> None:
        """What to say: the case, what was not done, and the files that are not written."""
        super().__init__(text)
        self.case, self.text, self.outputs, self.began = case, text, outputs, began


@contextmanager
def open_case(
    args: argparse.Namespace,
    began: float,
    outputs: Mapping[str, str | None],
    only_complete: str = "",
    check_case: Callable[[Case], None] = lambda case: None,
    time_limit: float | None = None,
) -> Generator[OpenCase]:
    """Load `args.case` with `args.settings`, print its notes, and show progress meanwhile.

    Args:
        args: arguments of the command.
        began: `time.perf_counter()` when the command began.
        outputs: files by their flag, see `check_outputs`; checked before anything is built.
        only_complete: why the command refuses the greedy search; empty where it does not.
        check_case: called with the case before anything is built; raises to refuse it.
        time_limit: seconds, in place of the case's.

    Raises:
        CaseError: the case cannot be used.
        FileError: an output cannot be written.
        TooLate: the time limit ran out first, here or in the block.
    """
    with Bar() as progress:
        from coverable.errors import Fault
        from feasibility.cases.case import load_case
        from feasibility.cases.table_reader import CaseError
        from feasibility.cases.units import unit_notes
        from feasibility.clock import OutOfTime
        from feasibility.collisions.asked_bodies import gather
        from feasibility.notices import CUTTING, MORE, compiling_notice

        case = load_case(args.case, args.settings)
        if any(outputs.values()):
            from feasibility.cli.output_files import check_outputs

            check_outputs(outputs, args.case)
        if only_complete and case.search.method != "complete":
            raise CaseError(Fault("search.method", only_complete), case.name)
        check_case(case)
        limit = case.search.time_limit if time_limit is None else time_limit
        clock = command_clock(args, limit, progress, began)
        doing = "the arm was loaded and the surface cut into cells"
        try:
            with compiling_notice(notice=CUTTING), clock.enforced():
                setup = case.build()
                task, surface = setup.task, setup.cells.surface
                bodies = gather(setup.robot, surface, task.collision, task.standoff)
            for note in unit_notes(case.to_tables(), setup.robot.length_unit):
                print_err(f"note: {note}")
            for note in setup.robot.notes:
                print_err(f"note: {setup.robot.name}: {note}")
            for note in setup.cells.notes:
                print_err(f"note: {case.surface.label}: {note}")
            for note in bodies.notes if bodies is not None else ():
                print_err(f"note: collisions: {note}")
            doing = "the search was prepared"
            with compiling_notice(notice=MORE.format(args.command)):
                yield OpenCase(case, setup, progress, clock, began)
        except OutOfTime as late:
            text = f"The time limit of {clock.limit:g} s ran out while {doing}"
            files = [f"{flag}: {shown_path(path)}" for flag, path in outputs.items() if path]
            raise TooLate(case, f"{text}; nothing was searched.", files, began) from late


def command_clock(
    args: argparse.Namespace, limit: float | None, progress: Progress, began: float
) -> Clock:
    """The clock of a command, which runs since `time.perf_counter()` was `began`."""
    from feasibility.clock import Clock

    make: MakeClock = getattr(args, "clock", None) or Clock
    return make(limit, progress).begin(time.monotonic() - (time.perf_counter() - began))


def json_text(value: dict[str, Any]) -> str:
    """One JSON object without NaN."""
    return json.dumps(value, allow_nan=False, indent=2)


def tell(args: argparse.Namespace, report: Any, *known: Any) -> None:
    """Print what a module of reports makes of an answer: text, or with --json an object; --csv."""
    print_out(json_text(report.as_json(*known)) if args.json else report.as_text(*known))
    if getattr(args, "csv", None) is not None:
        from feasibility.cli.output_files import write_text

        write_text(args.csv, report.as_csv(*known), "table")
