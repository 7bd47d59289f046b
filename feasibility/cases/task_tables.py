"""The [task] and [search] tables of a case."""

from __future__ import annotations

from typing import Any

from feasibility.cases.table_reader import Fault, Section
from feasibility.search import Search
from feasibility.task import Task


def read_task(table: Any, faults: list[Fault]) -> Task | None:
    """Read the [task] table; None where it has faults."""
    section = Section("task", table, faults)
    before = len(faults)
    blank: dict[str, Any] = {"standoff": 0.0, "cone_deg": 0.0}
    values = {
        "standoff": section.number("standoff", "a number >= 0 (metres)", required=True),
        "cone_deg": section.number("cone_deg", "a number in 0 .. 180 (degrees)", required=True),
        "tolerance": section.number("tolerance", "a number > 0 (metres)"),
    }
    values = {key: value for key, value in values.items() if value is not None}
    for key, value in values.items():
        try:
            Task(**{**blank, key: value})
        except ValueError as error:
            section.fault(key, str(error).removeprefix(f"{key} "))
    if section.has("approach") and section.table["approach"] != "normal":
        section.fault(
            "approach",
            'a direction other than "normal" is not supported yet; leave it out: the surface '
            "normal is used",
        )
    section.later("roll_deg", "leave it out: the roll about the approach direction is free")
    section.done()
    return Task(**{**blank, **values}) if len(faults) == before else None


def read_search(table: Any, faults: list[Fault]) -> Search | None:
    """Read the [search] table; None where it has faults."""
    section = Section("search", table, faults)
    before = len(faults)
    values: dict[str, Any] = {
        "method": section.choice("method", ("complete", "greedy")),
        "seed": section.whole("seed", "a whole number >= 0"),
        "time_limit": section.number("time_limit", "a number > 0 (seconds)"),
        "step_deg": section.number("step_deg", "a number in 0.0001 .. 30 (degrees)"),
        "moves": section.choice("moves", ("single", "all")),
        "starts": _starts(section),
        "cap": section.whole("cap", "a whole number >= 1"),
    }
    values = {key: value for key, value in values.items() if value is not None}
    for key, value in values.items():
        try:
            Search(**{key: value})
        except ValueError as error:
            section.fault(key, str(error).removeprefix(f"{key} "))
    section.done()
    return Search(**values) if len(faults) == before else None


def _starts(section: Section) -> int | str | None:
    """How many starts."""
    if section.has("starts") and section.table["starts"] == "all":
        return "all"
    return section.whole("starts", '"all" or a whole number >= 1')
