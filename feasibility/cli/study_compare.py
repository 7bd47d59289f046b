"""`coverable study` and `coverable compare`: many cases on many processes."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from feasibility.cli.command_parts import (
    STATUS,
    add_case,
    add_command,
    add_csv,
    add_html,
    add_workers,
    tell,
)
from feasibility.cli.console import Bar, print_err, with_rate
from feasibility.cli.output_files import check_outputs, write_text
from feasibility.interrupts import at_leave
from feasibility.read_files import shown_path

if TYPE_CHECKING:
    from feasibility.studies.file import Study
    from feasibility.studies.store import Row
    from feasibility.viewer.viewer import View


def add(subcommands: argparse._SubParsersAction) -> None:
    """Add both commands."""
    parser = add_command(
        subcommands, "study", study, add_csv, add_workers,
        help="many cases in parallel, each stored when it is finished",
        description="Decide every case of a study file. Finished cases are stored in one file; "
        "after an interruption, run the command again to continue.",
        epilog="exit status: 0; 3 where some cases failed; 2 bad input, 130 interrupted",
    )  # fmt: skip
    parser.add_argument("file", metavar="FILE", help="a study file (TOML)")
    parser.add_argument("--out", metavar="FILE", required=True, help="stores the finished cases")
    add_html(parser, "one page with tables, charts and poses")
    parser = add_command(
        subcommands, "compare", compare, add_case, add_html, add_csv, add_workers,
        help="one case, several arms side by side",
        description="Decide the same case for several arms.",
    )  # fmt: skip
    parser.add_argument(
        "--robots", metavar="NAMES", required=True,
        help="names of arms, and paths of URDFs: ur5,panda,my_arm.urdf",
    )  # fmt: skip
    parser.add_argument(
        "--critical", action="store_true", help="also find the smallest cone of each arm (slow)"
    )


def study(args: argparse.Namespace, began: float) -> int:
    """`coverable study FILE --out OUT`: every case of a study, stored as they finish.

    Returns:
        0; 3 where some cases failed.
    """
    from feasibility.reports import study as report
    from feasibility.studies.file import load_study
    from feasibility.studies.run import run_tasks
    from feasibility.studies.store import Store
    from feasibility.studies.workers import open_workers

    outputs = {"--out": args.out, "--csv": args.csv, "--html": args.html}
    check_outputs(outputs, args.file)
    loaded = load_study(args.file)
    stored_in = shown_path(args.out)
    with Store(args.out) as store, at_leave(store.close):
        before = len(store)
        if before:
            print_err(f"{stored_in} holds {before} finished cases; continuing from there")

        def say() -> None:
            store.close()  # and what was being written is not
            with Store(args.out) as kept:
                print_err(f"{len(kept)} cases are stored in {stored_in}; run again to continue")

        with Bar() as bar, open_workers(args.workers, args.dask) as workers, at_leave(say):
            rows = run_tasks(loaded.tasks, workers, store, with_rate(bar, "deciding cases"))
    tell(args, report, loaded, rows)
    if args.html is not None:
        page = report.as_html(loaded, rows, _poses(loaded, rows))
        write_text(args.html, page, "page")
    failed = any(row.status == "failed" for row in rows)
    return STATUS["undecided"] if failed else 0


def compare(args: argparse.Namespace, began: float) -> int:
    """`coverable compare CASE --robots a,b,c`: one case, one arm after the other."""
    from feasibility.cases.case import load_case
    from feasibility.reports import comparison as report
    from feasibility.studies.robot_comparison import compare as run
    from feasibility.studies.workers import open_workers

    check_outputs({"--csv": args.csv, "--html": args.html}, args.case)
    case = load_case(args.case, args.settings)
    robots = [name.strip() for name in args.robots.split(",") if name.strip()]
    with Bar() as bar, open_workers(args.workers, args.dask) as workers:
        progress = with_rate(bar, "comparing robots")
        found = run(case, robots, workers, args.critical, progress)
    tell(args, report, found)
    if args.html is not None:
        write_text(args.html, report.as_html(found), "page")
    return 0


def _poses(study: Study, rows: tuple[Row, ...]) -> View | None:
    """The poses of the surface, where a study varies them."""
    from feasibility.viewer.placement_view import view_study

    if not any(label.startswith(("surface.position", "surface.rpy_deg")) for label in study.labels):
        return None
    with Bar() as bar:
        return view_study(study.tasks, rows, study.name, progress=bar)
