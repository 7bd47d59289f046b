"""`coverable cases`, `robots` and `keys`: what there is, and what a case file can say."""

from __future__ import annotations

import argparse
import math
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from feasibility.cli.command_parts import add_command, json_text, tell
from feasibility.cli.console import print_out

if TYPE_CHECKING:
    from robots.known_arms import RobotInfo
    from robots.robot import Robot

WIDE = 240  # columns of a file, so that nothing is wrapped
JOINT_HEADINGS = ["robot", "tool", "limits (deg unless in m)", "limit sets"]
HEADINGS = ["robot", "joints", "reach", "payload", "from", "licence", "files"]


def add(subcommands: argparse._SubParsersAction) -> None:
    """Add the commands."""
    parser = add_command(
        subcommands, "cases", cases, help="list the built-in cases, or make one of a REACH study"
    )
    parser.add_argument(
        "study", metavar="STUDY", nargs="?",
        help="a study of REACH (.yaml): print the case that asks for its targets in one motion",
    )  # fmt: skip
    parser = add_command(subcommands, "robots", robots, help="list the robots by name")
    parser.add_argument(
        "names", metavar="NAME", nargs="*",
        help="only these, with tool, limits and limit sets; one that git has to fetch is fetched",
    )  # fmt: skip
    parser = add_command(subcommands, "keys", keys, help="print the reference of the case file")
    parser.add_argument(
        "table", metavar="TABLE", nargs="*",
        help="robot, surface, task, collision or search; or a kind of surface, such as mesh or "
        "surface mesh",
    )  # fmt: skip


def cases(args: argparse.Namespace, began: float) -> int:
    """`coverable cases [STUDY]`: the built-in cases, or that of a REACH study."""
    if args.study is not None:
        from feasibility.studies.reach_study import reach_case

        text = reach_case(args.study)
        print_out(json_text({"case": text}) if args.json else text.rstrip())
        return 0
    rows = case_rows()
    print_out(json_text({"cases": rows}) if args.json else cases_table(rows))
    return 0


def robots(args: argparse.Namespace, began: float) -> int:
    """`coverable robots [NAME ...]`: the robots that a case can name."""
    rows = robot_rows(args.names)
    table = limits_table if args.names else robots_table
    print_out(json_text({"robots": rows}) if args.json else table(rows))
    return 0


def keys(args: argparse.Namespace, began: float) -> int:
    """`coverable keys [TABLE]`: what a case file can say."""
    from feasibility.reports import keys as report

    found = report.keys_under(".".join(args.table) if args.table else None)
    tell(args, report, found)
    return 0


def case_rows() -> list[dict[str, Any]]:
    """The built-in cases, one object each."""
    from feasibility.cases.case import builtin_cases

    return [
        {
            "name": name,
            "robot": case.robot.name,
            "limits": case.robot.limits,
            "surface": case.surface.kind,
            "position": list(case.surface.position),
            "cone_deg": case.task.cone_deg,
            "standoff": case.task.standoff,
            "cells": case.surface.counts,
            "description": case.description,
        }
        for name, case in builtin_cases().items()
    ]


def robot_rows(names: Sequence[str] = ()) -> list[dict[str, Any]]:
    """The robots of the library, one object each; of those that are fetched no URDF is read.

    Args:
        names: only these, all of whose URDFs are read.

    Raises:
        RobotError: a name is unknown, or its arm cannot be fetched.
    """
    from robots.known_arms import list_robots
    from robots.library import find_robot, load_robot

    if names:
        return [_robot_row(find_robot(name), load_robot(name)) for name in names]
    listed = list_robots(catalogue=True)
    return [_robot_row(info, None if info.module else load_robot(info.name)) for info in listed]


def _robot_row(info: RobotInfo, robot: Robot | None) -> dict[str, Any]:
    """One robot; joints and tool come from its URDF, where it is here."""
    from robots.catalogue import is_here

    reach = info.reach if robot is None else robot.reach
    return {
        "name": info.name,
        "group": info.group,
        "description": info.description,
        "source": info.source,
        "licence": info.licence,
        "here": not info.module or is_here(info.module),
        "tool_frame": info.tool_frame if robot is None else robot.tool_frame,
        "degrees_of_freedom": info.joints if robot is None else robot.n,
        "reach_m": reach if reach is not None and math.isfinite(reach) else None,
        "payload_kg": info.payload,
        "limit_sets": [] if robot is None else sorted(robot.limit_sets),
        "joints": None if robot is None else _joints(robot),
    }


def _joints(robot: Robot) -> list[dict[str, Any]]:
    """The free joints, base to tip."""
    ends = (robot.lower.tolist(), robot.upper.tolist())
    every = zip(robot.joint_names, robot.joint_kinds, *ends, strict=True)
    return [{"name": name, "kind": kind, **_limits(kind, *pair)} for name, kind, *pair in every]


def _limits(kind: str, low: float, high: float) -> dict[str, Any]:
    """Limits of one joint in degrees or metres; null where it turns freely."""
    unit = "m" if kind == "prismatic" else "deg"
    ends = (low, high) if kind == "prismatic" else (math.degrees(low), math.degrees(high))
    found = [round(end, 9) if math.isfinite(end) else None for end in ends]
    return {f"limits_{unit}": None if found == [None, None] else found}


def cases_table(rows: Sequence[dict[str, Any]]) -> str:
    """The built-in cases for people."""
    return _table(
        ["case", "robot", "limits", "surface", "cells", "cone", "description"],
        [
            [
                *(row[key] for key in ("name", "robot", "limits", "surface")),
                " x ".join(map(str, row["cells"])),
                f"{row['cone_deg']:g} deg",
                row["description"],
            ]
            for row in rows
        ],
    )


def robots_table(rows: Sequence[dict[str, Any]]) -> str:
    """The robots for people, by group."""
    from robots.known_arms import GROUPS

    tables = []
    for group, title in GROUPS.items():
        lines = [
            [
                row["name"],
                _kinds(row["joints"]) if row["joints"] else str(row["degrees_of_freedom"]),
                _reach(row),
                "" if row["payload_kg"] is None else f"{row['payload_kg']:g} kg",
                row["source"],
                row["licence"],
                "here" if row["here"] else "to be fetched",
            ]
            for row in rows
            if row["group"] == group
        ]
        tables.append(f"{title[0].upper()}{title[1:]}\n\n{_table(HEADINGS, lines)}")
    return "\n\n".join(tables)


def _reach(row: dict[str, Any]) -> str:
    """'1.41 m', 'any' on a rail without ends, nothing where it is not known."""
    if row["reach_m"] is not None:
        return f"{row['reach_m']:.2f} m"
    return "any" if row["joints"] else ""


def limits_table(rows: Sequence[dict[str, Any]]) -> str:
    """Some robots for people: tool, limits in order of the joints, limit sets."""
    lines = [
        [
            row["name"],
            row["tool_frame"],
            ", ".join(map(_limits_text, row["joints"])),
            ", ".join(row["limit_sets"]),
        ]
        for row in rows
    ]
    return _table(JOINT_HEADINGS, lines)


def _kinds(joints: Sequence[dict[str, Any]]) -> str:
    """'6' or '6 (3 continuous)'."""
    kinds = Counter(joint["kind"] for joint in joints)
    special = [f"{kinds[kind]} {kind}" for kind in ("continuous", "prismatic") if kinds[kind]]
    return f"{len(joints)}" + (f" ({', '.join(special)})" if special else "")


def _limits_text(joint: dict[str, Any]) -> str:
    """'-170..170', '0..0.4 m' or 'free'."""
    unit = " m" if "limits_m" in joint else ""
    limits = joint["limits_m" if unit else "limits_deg"]
    if limits is None:
        return "free"
    low, high = ("" if end is None else f"{end:.3g}" if unit else f"{end:.0f}" for end in limits)
    return f"{low}..{high}{unit}"


def _table(headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table whose columns are as wide as they need to be, on a terminal as wide as it is."""
    import io
    import sys

    from rich import box
    from rich.console import Console
    from rich.table import Table

    terminal = sys.stdout is not None and sys.stdout.isatty()
    text = io.StringIO()
    console = Console(file=text, width=None if terminal else WIDE, color_system=None)
    table = Table(box=box.ASCII2 if terminal else None, pad_edge=False, show_edge=False)
    for heading in headings:
        table.add_column(heading, overflow="fold")
    for row in rows:
        table.add_row(*row)
    console.print(table, highlight=False, markup=False)
    return "\n".join(line.rstrip() for line in text.getvalue().splitlines())
