"""One case on the command line: loading it, its notes, progress, and Ctrl-C."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from feasibility.cli.console import Bar, print_err, progress_bar
from feasibility.cli.outputs import check_outputs

if TYPE_CHECKING:
    from feasibility.cases import Case, Setup


@dataclass(frozen=True, slots=True)
class OpenCase:
    """A case that a command works on."""

    case: Case
    setup: Setup
    progress: Bar
    """To be called as progress(done, total, text)."""
    began: float
    """`time.perf_counter()` when the command began."""

    def so_far(self) -> float:
        """Seconds since then: called before the search, the time that loading took."""
        return time.perf_counter() - self.began


@contextmanager
def open_case(
    args: argparse.Namespace,
    began: float,
    outputs: Mapping[str, str | None],
    only_complete: str = "",
) -> Iterator[OpenCase]:
    """Load `args.case` with `args.settings`, print its notes, and show progress meanwhile.

    Args:
        args: arguments of the command.
        began: `time.perf_counter()` when the command began.
        outputs: files by their flag, see `check_outputs`; checked before anything is built.
        only_complete: why the command refuses the greedy search; empty where it does not.

    Raises:
        CaseError: the case cannot be used.
        FileError: an output cannot be written.
    """
    with progress_bar() as progress:
        from coverable_errors import Fault
        from feasibility.cases import CaseError, load_case
        from feasibility.notices import compiling_notice

        progress.settle()
        case = load_case(args.case, args.settings)
        check_outputs(outputs, args.case)
        if only_complete and case.search.method != "complete":
            raise CaseError(Fault("search.method", only_complete), case.name)
        with compiling_notice():  # cutting a mesh into cells has kernels of its own
            setup = case.build()
        progress.settle()
        for note in setup.robot.notes:
            print_err(f"note: {setup.robot.name}: {note}")
        for note in setup.cells.notes:
            print_err(f"note: {case.surface.label}: {note}")
        yield OpenCase(case, setup, progress, began)
