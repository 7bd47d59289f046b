"""Many cases on the command line: `study` and `compare`."""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from feasibility.cli.check_command import check_outputs, json_text
from feasibility.cli.console import Bar, interruptible, say, tell
from feasibility.safe_files import FileError, shown_path, write_whole

if TYPE_CHECKING:
    from feasibility.search import Progress
    from feasibility.studies import Row, Study

UNDECIDED = 3


def study(args: argparse.Namespace, began: float) -> int:
    """`coverable study FILE --out OUT`: every case of a study, kept as they come.

    Args:
        args: file, out, workers, dask, json, csv, html.
        began: `time.perf_counter()` when the command began.

    Returns:
        0; 3 where some cases failed.
    """
    from feasibility.reports import study as report
    from feasibility.studies import Store, load_study, open_workers, run_tasks

    outputs = {"--out": args.out, "--csv": args.csv, "--html": args.html}
    check_files(args.file, outputs)
    asked = load_study(args.file)
    with Store(args.out) as store:
        before = len(store)
        if before:
            tell(f"{shown_path(args.out)} holds {before} finished cases; going on from there")
        try:
            with _shown("deciding cases") as progress, open_workers(args.workers, args.dask) as by:
                rows = run_tasks(asked.tasks, by, store, progress)
        except KeyboardInterrupt:
            tell(f"{len(store)} cases are kept in {shown_path(args.out)}; run again to go on")
            raise
    say(json_text(report.as_json(asked, rows)) if args.json else report.as_text(asked, rows))
    _write(args.csv, report.as_csv(asked, rows), "table")
    if args.html is not None:
        _write(args.html, _page(asked, rows), "page")
    return UNDECIDED if any(row.status == "failed" for row in rows) else 0


def compare(args: argparse.Namespace, began: float) -> int:
    """`coverable compare CASE --robots a,b,c`: one case, one arm after the other.

    Args:
        args: case, settings, robots, critical, workers, dask, json, csv, html.
        began: `time.perf_counter()` when the command began.
    """
    from feasibility.cases import load_case
    from feasibility.reports import comparison as report
    from feasibility.studies import compare as run
    from feasibility.studies import open_workers

    check_files(args.case, {"--csv": args.csv, "--html": args.html})
    case = load_case(args.case, args.settings)
    robots = [name.strip() for name in args.robots.split(",") if name.strip()]
    with _shown("comparing robots") as progress, open_workers(args.workers, args.dask) as by:
        found = run(case, robots, by, critical=args.critical, progress=progress)
    say(json_text(report.as_json(found)) if args.json else report.as_text(found))
    _write(args.csv, report.as_csv(found), "table")
    _write(args.html, report.as_html(found), "page")
    return 0


def check_files(given: str, outputs: Mapping[str, str | None]) -> None:
    """Refuse outputs that could not be written, or are what is read, before the work.

    Args:
        given: the study or the case, a file or the name of a built-in one.
        outputs: files by their flag, None where there is none.

    Raises:
        FileError: with everything that is wrong.
    """
    faults = []
    try:
        check_outputs(outputs)
    except FileError as error:
        faults.append(str(error))
    for flag, path in outputs.items():
        both_exist = path is not None and os.path.isfile(given) and os.path.exists(path)
        if path is not None and both_exist and os.path.samefile(given, path):
            faults.append(f"{flag} {shown_path(path)}: is what is read; give another name")
    if faults:
        raise FileError(faults)


def _page(asked: Study, rows: tuple[Row, ...]) -> str:
    """A study as one page, with the poses of the surface where they vary."""
    from feasibility.reports import study_page
    from feasibility.viewer import view_study

    drawn = None
    if any(label.startswith(("surface.position", "surface.rpy_deg")) for label in asked.labels):
        with interruptible() as settle, Bar() as bar:
            drawn = view_study(asked.tasks, rows, asked.name, progress=bar.callback)
            settle()
    return study_page.as_html(asked, rows, drawn)


def _write(path: str | None, text: str, what: str) -> None:
    """Write a file that was asked for, and say so."""
    if path is not None:
        write_whole(path, lambda stream: stream.write(text.encode()))
        tell(f"{what}: {shown_path(path)}")


@contextmanager
def _shown(what: str) -> Iterator[Progress]:
    """A progress bar with rate and time left, and a Ctrl-C that is never lost."""
    began, first = time.monotonic(), -1
    with interruptible() as settle, Bar() as bar:

        def report(done: int, total: int | None, text: str) -> None:
            nonlocal first
            settle()
            first = done if first < 0 else first  # what an earlier run has done says no rate
            if bar.callback is not None:
                bar(done, total, f"{what}{_pace(done - first, done, total, began)}")

        yield report
        settle()


def _pace(here: int, done: int, total: int | None, began: float) -> str:
    """', 12.3/s, 2 min left'; empty until something is done."""
    took = time.monotonic() - began
    if here <= 0 or total is None or took <= 0.0:
        return ""
    left = (total - done) * took / here
    words = f"{left:.0f} s" if left < 100 else f"{left / 60:.0f} min"
    return f", {here / took:.1f}/s, {words} left"
