"""Summaries of a study's rows: verdicts, causes, values by group, and the best rows."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Sequence
from typing import Any

from feasibility.reports.text import counted, percent
from feasibility.studies import Row, Study, merit

MOST = 10  # best rows that are listed, and values of a key up to which each has a line
VERDICTS = ("feasible", "infeasible", "undecided")


def headline(study: Study, rows: Sequence[Row]) -> str:
    """The result in one sentence."""
    return f"{study.name}: {counted(len(rows), 'case')}: {verdicts_text(rows)}."


def counts(rows: Sequence[Row]) -> dict[str, int]:
    """How many rows have each verdict."""
    found = Counter(str(row.result["verdict"]) for row in rows)
    return {verdict: found.get(verdict, 0) for verdict in VERDICTS}


def verdicts_text(rows: Sequence[Row]) -> str:
    """'3 feasible, 1 infeasible'."""
    return ", ".join(f"{n} {verdict}" for verdict, n in counts(rows).items() if n) or "none"


def failures(rows: Sequence[Row]) -> str:
    """How many rows failed, and why the first one did; empty where none did."""
    failed = [row for row in rows if row.status == "failed"]
    return f"{len(failed)} failed; the first: {failed[0].result['message']}" if failed else ""


def dominant(row: Row) -> str | None:
    """The cause of most of the missed cells."""
    return next(iter(row.result.get("causes") or {}), None)


def causes(rows: Sequence[Row]) -> list[tuple[str, int]]:
    """Dominant causes, each with its number of rows, the most frequent first."""
    found = Counter(cause for row in rows if (cause := dominant(row)))
    return [(cause.replace("_", " "), number) for cause, number in found.most_common()]


def best_share(rows: Sequence[Row]) -> float | None:
    """The largest share of the area covered in one motion, 0..1; None where all failed."""
    return max((float(row.result["share"]) for row in rows if "share" in row.result), default=None)


def best_rows(study: Study, rows: Sequence[Row]) -> list[list[str]]:
    """The best rows: verdict, share, margin to the joint limits, and what varies."""
    table = []
    for row in sorted(rows, key=lambda row: merit(row.result))[:MOST]:
        limit = (row.result.get("margins") or {}).get("limit_deg")
        cells = [str(row.result["verdict"]), _or_dash(row.result.get("share"))]
        cells.append("-" if limit is None else f"{limit:.1f} deg")
        table.append([*cells, *(short(row.parameters[label]) for label in study.labels)])
    return table


def groups_of(study: Study, rows: Sequence[Row]) -> dict[str, dict[str, list[Row]]]:
    """Rows by value, for each key that takes a few values; numbers in their order."""
    found: dict[str, dict[str, list[Row]]] = {}
    for label in study.labels:
        groups: dict[str, list[Row]] = {}
        values = [row.parameters[label] for row in rows]
        order: Sequence[int] = range(len(rows))
        if are_numbers(values):
            order = sorted(order, key=values.__getitem__)
        for k in order:
            groups.setdefault(short(values[k]), []).append(rows[k])
        if 2 <= len(groups) <= MOST:
            found[label] = groups
    return found


def group_table(label: str, groups: dict[str, list[Row]]) -> list[list[str]]:
    """One line for each value of a key, below the names of the columns."""
    table = [[f"by {label}:", *VERDICTS, "best share"]]
    for value, group in groups.items():
        table.append([value, *map(str, counts(group).values()), _or_dash(best_share(group))])
    used = [
        k for k, head in enumerate(table[0])
        if head not in VERDICTS or any(line[k] != "0" for line in table[1:])
    ]  # fmt: skip
    return [[line[k] for k in used] for line in table]


def are_numbers(values: Sequence[Any]) -> bool:
    """Are all values numbers?"""
    return all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)


def short(value: Any) -> str:
    """A value in few characters."""
    if isinstance(value, float):
        return f"{value:.4g}"
    return value if isinstance(value, str) else json.dumps(value)


def _or_dash(share: Any) -> str:
    """A share, which a failed row does not have."""
    return "-" if share is None else percent(float(share))
