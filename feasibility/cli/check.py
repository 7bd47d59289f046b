"""`coverable check`: decide one case."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from coverable.errors import CoverableError
from feasibility.cli.command_parts import (
    STATUS,
    add_case,
    add_command,
    add_html,
    json_text,
    open_case,
)
from feasibility.cli.console import print_err, print_out

if TYPE_CHECKING:
    from feasibility.cases.case import Case
    from feasibility.cli.command_parts import OpenCase
    from feasibility.verdict import Verdict, Walk

INSIDE = "-"  # in place of a file: in the object that is printed
STATUSES = "exit status: 0 feasible, 1 infeasible, 3 undecided, 2 bad input, 130 interrupted"
SEEDS_NEED_COMPLETE = "--seeds needs 'complete': the greedy search has a start, and no seeds"


def add(subcommands: argparse._SubParsersAction) -> None:
    """Add the command."""
    parser = add_command(
        subcommands, "check", check, add_case, add_html,
        help="decide one case",
        description="Decide one case, and report the evidence for the answer.",
        epilog=STATUSES,
    )  # fmt: skip
    parser.add_argument(
        "--witness",
        metavar="FILE",
        help="write the covering motion as CSV, or for a name in .compas as the JSON of "
        "compas_fab (feasible only); with --json, - puts it into the "
        "object",
    )
    parser.add_argument("--save", metavar="RESULT", help="write a result file for `coverable show`")
    parser.add_argument(
        "--seeds", metavar="MOTION",
        help="begin the search from a motion over this surface, or one nearby: CSV as of --witness",
    )  # fmt: skip


def check(args: argparse.Namespace, began: float) -> int:
    """`coverable check CASE`: run the search, print the verdict, write the files asked for."""
    within = args.witness == INSIDE
    if within and not args.json:
        raise CoverableError("--witness -: goes with --json; give the name of a file without it")
    witness = None if within else args.witness
    outputs = {"--save": args.save, "--html": args.html, "--witness": witness}
    with open_case(args, began, outputs) as opened:
        from feasibility.checking import check as run

        case, seeds = opened.case, _seeds(args, opened)
        loaded = opened.so_far()
        verdict = run(*opened.setup, seeds=seeds, clock=opened.clock)
        verdict.causes  # noqa: B018 - looked into within the time limit
        verdict.treated  # noqa: B018 - measured within the time limit
    if args.json:
        from feasibility.reports.verdict_json import as_json, witness_json

        found = as_json(verdict, loaded)
        print_out(json_text(found | ({"witness": witness_json(verdict)} if within else {})))
    else:
        from feasibility.reports.verdict import as_text

        print_out(as_text(verdict, case, loaded))
    if any(outputs.values()):
        _write(args, witness, verdict, case)
    return STATUS[str(verdict.answer)]


def _write(args: argparse.Namespace, witness: str | None, verdict: Verdict, case: Case) -> None:
    """The files that were asked for."""
    from feasibility.cli.output_files import write_text
    from feasibility.read_files import shown_path

    if args.save is not None:
        from feasibility.results.result_file import save_result

        save_result(verdict, case, args.save)
        print_err(f"result: {shown_path(args.save)} (`coverable show` opens it)")
    if args.html is not None:
        from feasibility.viewer.viewer import view

        write_text(args.html, view(verdict, case.name).html(), "view")
    if witness is not None:
        from feasibility.reports.verdict_json import motion_text

        motion = motion_text(verdict, Path(witness).suffix)
        if motion is None:
            why = "has no stored motion" if verdict.feasible else f"is {verdict.answer}"
            print_err(f"--witness: nothing written to {shown_path(witness)}: this case {why}")
        else:
            write_text(witness, motion, "witness")


def _seeds(args: argparse.Namespace, opened: OpenCase) -> Walk | None:
    """The motion of `--seeds`, without its marks: it may be of another case."""
    if args.seeds is None:
        return None
    import numpy as np

    from coverable.errors import Fault
    from feasibility.cases.table_reader import CaseError
    from feasibility.results.motion_file import load_motion
    from feasibility.verdict import Walk

    if opened.case.search.method != "complete":
        raise CaseError(Fault("search.method", SEEDS_NEED_COMPLETE), opened.case.name)
    motion = load_motion(args.seeds, opened.setup.robot)
    return Walk(q=motion.q, cell=np.full(len(motion.q), -1))
