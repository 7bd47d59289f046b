"""The [task] and [search] tables of a case."""

from __future__ import annotations

from typing import Any

from coverable_errors import MISSING, Fault
from feasibility.cases.table_reader import Section
from feasibility.search import Search
from feasibility.task import Task


def read_task(table: Any, faults: list[Fault]) -> Task | None:
    """Read the [task] table; None where it has faults."""
    section = Section("task", table, faults)
    required = {"standoff": MISSING, "cone_deg": MISSING}
    values = required | section.take("standoff", "cone_deg", "tolerance")
    if section.take("approach").get("approach", "normal") != "normal":
        section.fault(
            "approach",
            'a direction other than "normal" is not supported yet; leave it out: the surface '
            "normal is used",
        )
    section.later("roll_deg", "leave it out: the roll about the approach direction is free")
    section.refuse_others()
    return section.make(Task, values)


def read_search(table: Any, faults: list[Fault]) -> Search | None:
    """Read the [search] table; None where it has faults."""
    section = Section("search", table, faults)
    values = section.take(*Search.__dataclass_fields__)
    section.refuse_others()
    return section.make(Search, values)
