"""What the commands that search have in common: the case, its notes, progress and Ctrl-C."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from feasibility.cli.console import Bar, interruptible, tell

if TYPE_CHECKING:
    from feasibility.cases import Case, Setup


@dataclass(frozen=True, slots=True)
class Asked:
    """A case that is being asked about."""

    case: Case
    setup: Setup
    progress: Callable[[int, int | None, str], None]
    """To be called as progress(done, total, text)."""
    began: float
    """`time.perf_counter()` when the command began."""

    def so_far(self) -> float:
        """Seconds since then: ask before the search, and it is what loading took."""
        return time.perf_counter() - self.began


@contextmanager
def asked(
    args: argparse.Namespace,
    began: float,
    *,
    check_first: Callable[[], None] | None = None,
    only_complete: str = "",
) -> Iterator[Asked]:
    """Load `args.case` with `args.settings`, say its notes, and show progress meanwhile.

    Args:
        args: arguments of the command.
        began: `time.perf_counter()` when the command began.
        check_first: called when the case is read, before anything is built.
        only_complete: why the greedy search will not do; empty where it does.

    Raises:
        CaseError: the case cannot be used.
    """
    with interruptible() as settle:
        from feasibility.cases import CaseError, Fault, load_case
        from feasibility.notices import compiling_notice

        settle()
        case = load_case(args.case, args.settings)
        if check_first is not None:
            check_first()
        if only_complete and case.search.method != "complete":
            raise CaseError(Fault("search.method", only_complete), case.name)
        with compiling_notice():  # cutting a mesh has kernels of its own
            setup = case.build()
        settle()
        for note in setup.robot.notes:
            tell(f"note: {setup.robot.name}: {note}")
        for note in setup.cells.notes:
            tell(f"note: {case.surface.label}: {note}")
        with Bar() as bar:

            def progress(done: int, total: int | None, text: str) -> None:
                settle()  # stop even if Python has dropped the Ctrl-C
                if bar.callback is not None:
                    bar(done, total, text)

            yield Asked(case, setup, progress, began)
        settle()
