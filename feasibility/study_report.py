"""A study's table as text for people, as one JSON object, and as CSV."""

from __future__ import annotations

import csv
import io
import json
from collections import Counter
from collections.abc import Sequence
from typing import Any

from feasibility.study import Row
from feasibility.study_file import Study
from feasibility.version import version

BEST = 10  # rows of the text
VERDICTS = ("feasible", "infeasible", "undecided")
COLUMNS = ("verdict", "evidence", "cells", "covered", "share", "edges", "pairs")
MARGINS = ("limit_deg", "limit_m", "cone_deg", "reach_m")


def as_json(study: Study, rows: Sequence[Row]) -> dict[str, Any]:
    """All rows, each with its parameters and its result."""
    return {
        "study": study.name,
        "description": study.description,
        "parameters": list(study.labels),
        "tasks": len(rows),
        "verdicts": counts(rows),
        "failed": sum(row.status == "failed" for row in rows),
        "rows": [
            {
                "parameters": dict(row.parameters),
                "status": row.status,
                "seconds": round(row.seconds, 6),
                **row.result,
            }
            for row in rows
        ],
        "version": version(),
    }


def as_csv(study: Study, rows: Sequence[Row]) -> str:
    """One line for each task: its parameters, then what came of it; empty where there is nothing.

    It says nothing that depends on the run, so the same study always gives the same text.
    """
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow([*study.labels, *COLUMNS, *(f"margin_{name}" for name in MARGINS), "cause"])
    for row in rows:
        margins = row.result.get("margins") or {}
        table.writerow(
            [
                *(_cell(row.parameters[label]) for label in study.labels),
                *(_cell(row.result.get(name)) for name in COLUMNS),
                *(_cell(margins.get(name)) for name in MARGINS),
                dominant(row) or "",
            ]
        )
    return text.getvalue()


def _cell(value: Any) -> Any:
    """A value for CSV: numbers in full, tables as JSON."""
    if value is None:
        return ""
    return json.dumps(value) if isinstance(value, (dict, list)) else value


def as_text(study: Study, rows: Sequence[Row]) -> str:
    """What came of the study: verdicts, by robot where several are compared, and the best rows."""
    found = counts(rows)
    lines = [f"{study.name}: {len(rows)} cases: {_counted(found)}."]
    causes = Counter(cause for row in rows if (cause := dominant(row)))
    if causes:
        told = ", ".join(f"{name} in {count}" for name, count in causes.most_common())
        lines.append(f"  why cells are missed, mostly: {told}.")
    failed = [row for row in rows if row.status == "failed"]
    if failed:
        lines.append(f"  {len(failed)} failed; the first: {failed[0].result['message']}")
    lines += _by_value(study, rows)
    ranked = sorted(rows, key=merit)[: min(BEST, len(rows))]
    lines += ["", "best:"]
    lines += [f"  {_row_text(study, row)}" for row in ranked]
    return "\n".join(lines)


def counts(rows: Sequence[Row]) -> dict[str, int]:
    """How many rows have each verdict."""
    found = Counter(str(row.result["verdict"]) for row in rows)
    return {verdict: found.get(verdict, 0) for verdict in VERDICTS}


def dominant(row: Row) -> str | None:
    """The cause of most of the missed cells."""
    return next(iter(row.result.get("causes") or {}), None)


def merit(row: Row) -> tuple[bool, float, float]:
    """Smaller is better: feasible, then the covered share, then the least margin to the limits."""
    margins = row.result.get("margins") or {}
    limit = margins.get("limit_deg")
    room = 0.0 if not margins else 360.0 if limit is None else float(limit)
    share = float(row.result.get("share", 0.0))
    return row.result["verdict"] != "feasible", -share, -room


def _counted(found: dict[str, int]) -> str:
    """'3 feasible, 1 infeasible'."""
    return ", ".join(f"{count} {name}" for name, count in found.items() if count) or "none"


def _by_value(study: Study, rows: Sequence[Row]) -> list[str]:
    """One line for each value of the keys that have few values."""
    lines: list[str] = []
    for label in study.labels:
        groups: dict[str, list[Row]] = {}
        for row in rows:
            groups.setdefault(_short(row.parameters[label]), []).append(row)
        if not 2 <= len(groups) <= BEST:
            continue
        lines += ["", f"by {label}:"]
        width = max(map(len, groups))
        for value, group in groups.items():
            best = max(float(row.result.get("share", 0.0)) for row in group)
            lines.append(
                f"  {value:{width}}  {_counted(counts(group))}; best share {100.0 * best:.1f} %"
            )
    return lines


def _row_text(study: Study, row: Row) -> str:
    """One row on one line."""
    says = ", ".join(f"{label} = {_short(row.parameters[label])}" for label in study.labels)
    share = 100.0 * float(row.result.get("share", 0.0))
    text = f"{row.result['verdict']}, {share:.1f} %"
    limit = (row.result.get("margins") or {}).get("limit_deg")
    if limit is not None:
        text += f", {limit:.1f} deg from the limits"
    return f"{text}: {says}"


def _short(value: Any) -> str:
    """A value in few characters."""
    if isinstance(value, float):
        return f"{value:.4g}"
    return value if isinstance(value, str) else json.dumps(value)
