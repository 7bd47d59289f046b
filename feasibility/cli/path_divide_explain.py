"""From verdict to work, on the command line: `path`, `divide` and `explain`."""

from __future__ import annotations

import argparse
from dataclasses import replace
from typing import TYPE_CHECKING

from feasibility.cli.check_command import STATUS, check_outputs, json_text, write_view
from feasibility.cli.console import say, tell
from feasibility.cli.session import asked
from feasibility.safe_files import shown_path

if TYPE_CHECKING:
    from feasibility.paths import Order
    from feasibility.sensitivity import Explanation
    from feasibility.verdict import Verdict
    from feasibility.viewer import View

WHY_COMPLETE = {
    "path": "a path needs 'complete', because the greedy search does not visit the cells' centres",
    "divide": "a division needs 'complete', because the greedy search keeps one motion only",
    "explain": "thresholds need 'complete', because the greedy search's no depends on its start",
}


def path(args: argparse.Namespace, began: float) -> int:
    """`coverable path CASE`: a coverage motion in a chosen order, timed and written to files."""
    outputs = {"--html": args.html} | {f"--out[{k}]": out for k, out in enumerate(args.out)}

    def check_first() -> None:
        from feasibility.results import check_ending

        check_outputs(outputs)
        for out in args.out:
            check_ending(out)

    with asked(
        args, began, check_first=check_first, only_complete=WHY_COMPLETE["path"]
    ) as question:
        from feasibility.checking import check
        from feasibility.paths import coverage_path
        from feasibility.reports import path as report
        from feasibility.timing import motion_limits, trajectory

        robot, loaded = question.setup.robot, question.so_far()
        limits = motion_limits(robot, args.speed, args.velocity, args.acceleration)
        verdict = check(*question.setup, progress=question.progress)
        if not verdict.feasible:
            return _no_path(args, question.case.name, verdict, loaded)
        question.progress(0, None, "laying the path")
        order: Order = args.order or ("rows" if len(verdict.cells.shape) == 2 else "shortest")
        found = coverage_path(verdict, order)
        question.progress(0, None, "timing the path")
        run = trajectory(
            found,
            args.speed,
            velocity=args.velocity,
            acceleration=args.acceleration,
            period=args.period,
        )
    say(
        json_text(report.as_json(found, run, limits))
        if args.json
        else report.as_text(found, run, limits)
    )
    for out in args.out:
        from feasibility.results import save_trajectory

        save_trajectory(out, run)
        tell(f"trajectory: {shown_path(out)}")
    if args.html is not None:
        from feasibility.viewer import view_path

        write_view(view_path(found, run, question.case.name), args.html)
    return 0


def _no_path(args: argparse.Namespace, name: str, verdict: Verdict, loaded: float) -> int:
    """Say why there is no path; the exit status is the verdict's."""
    from feasibility.reports import no_path_json

    reason = f"no path over this surface is known. {verdict!r}"
    tell(f"coverable path: {name}: {reason}")
    if str(verdict.answer) == "undecided" and "time limit" in verdict.message:
        tell("`--set search.time_limit=...` gives the search more time.")
    tell("`coverable explain` says what would help, `coverable divide` how to split it.")
    for flag, files in (("--out", args.out), ("--html", [args.html])):
        for file in files:
            if file is not None:
                tell(f"{flag}: nothing written to {shown_path(file)}")
    if args.json:
        say(json_text(no_path_json(verdict, reason, loaded)))
    return STATUS[str(verdict.answer)]


def divide(args: argparse.Namespace, began: float) -> int:
    """`coverable divide CASE`: the fewest sub-patches, each covered by one continuous motion."""
    with asked(
        args,
        began,
        check_first=lambda: check_outputs({"--html": args.html}),
        only_complete=WHY_COMPLETE["divide"],
    ) as question:
        from feasibility.division import divide as run
        from feasibility.reports import STATUS as DIVIDED
        from feasibility.reports import division as report

        loaded = question.so_far()
        division = run(*question.setup, progress=question.progress)
    if args.json:
        say(json_text(report.as_json(division, loaded)))
    else:
        say(report.as_text(division, question.case.name, loaded))
    if args.html is not None:
        from feasibility.viewer import view_division

        write_view(view_division(division, question.case.name), args.html)
    return DIVIDED[report.answer_of(division)]


def explain(args: argparse.Namespace, began: float) -> int:
    """`coverable explain CASE`: what would make it feasible, or how far it may be tightened."""
    with asked(
        args,
        began,
        check_first=lambda: check_outputs({"--html": args.html}),
        only_complete=WHY_COMPLETE["explain"],
    ) as question:
        from feasibility.reports import explanation as report
        from feasibility.sensitivity import explain as run

        explanation = run(*question.setup, progress=question.progress)
    name = question.case.name
    say(
        json_text(report.as_json(explanation, name))
        if args.json
        else report.as_text(explanation, name)
    )
    if args.html is not None:
        write_view(_explained(explanation, name), args.html)
    return STATUS[str(explanation.verdict.answer)]


def _explained(explanation: Explanation, name: str) -> View:
    """The verdict's picture, with what helps beside it."""
    from feasibility.reports import sentence
    from feasibility.viewer import view

    drawn = view(explanation.verdict, name)
    feasible = explanation.verdict.feasible
    helps = [sentence(t, feasible) for t in explanation.thresholds if t.feasible is not None]
    text = " · ".join([drawn.legend.text, *helps])
    return replace(drawn, legend=replace(drawn.legend, text=text))
