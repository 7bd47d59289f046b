"""A study's table as text for people, as one JSON object, and as CSV."""

from __future__ import annotations

import csv
import io
import json
from collections import Counter
from collections.abc import Sequence
from typing import Any

from feasibility.studies import Row, Study
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
    """What came of the study: verdicts, by value where there are few, and the best rows."""
    lines = [headline(study, rows)]
    if study.description:
        lines.insert(0, study.description)
    causes = Counter(cause for row in rows if (cause := dominant(row)))
    if causes:
        told = ", ".join(f"{name.replace('_', ' ')} in {n}" for name, n in causes.most_common())
        lines.append(f"  why cells are missed, mostly: {told}.")
    failed = [row for row in rows if row.status == "failed"]
    if failed:
        lines.append(f"  {len(failed)} failed; the first: {failed[0].result['message']}")
    for label, groups in groups_of(study, rows).items():
        lines += ["", *_aligned(group_table(label, groups))]
    lines += ["", "the best:", *_aligned(_best_table(study, rows))]
    return "\n".join(lines)


def headline(study: Study, rows: Sequence[Row]) -> str:
    """What a person would say of it."""
    cases = "1 case" if len(rows) == 1 else f"{len(rows)} cases"
    return f"{study.name}: {cases}: {counted(counts(rows))}."


def counts(rows: Sequence[Row]) -> dict[str, int]:
    """How many rows have each verdict."""
    found = Counter(str(row.result["verdict"]) for row in rows)
    return {verdict: found.get(verdict, 0) for verdict in VERDICTS}


def counted(found: dict[str, int]) -> str:
    """'3 feasible, 1 infeasible'."""
    return ", ".join(f"{count} {name}" for name, count in found.items() if count) or "none"


def dominant(row: Row) -> str | None:
    """The cause of most of the missed cells."""
    return next(iter(row.result.get("causes") or {}), None)


def merit(row: Row) -> tuple[bool, float, float]:
    """Smaller is better: feasible, then the covered share, then the least margin to the limits."""
    margins = row.result.get("margins") or {}
    limit = margins.get("limit_deg")
    room = 0.0 if not margins else 360.0 if limit is None else float(limit)
    share = float(row.result.get("share", -1.0))  # unknown is worse than nothing
    return row.result["verdict"] != "feasible", -share, -room


def best_share(rows: Sequence[Row]) -> float | None:
    """The largest share of the area covered in one motion, 0..1; None where all failed."""
    return max((float(row.result["share"]) for row in rows if "share" in row.result), default=None)


def share_text(row: Row) -> str:
    """The share of a row; a failed one has none."""
    return f"{100.0 * float(row.result['share']):.1f} %" if "share" in row.result else "-"


def groups_of(study: Study, rows: Sequence[Row]) -> dict[str, dict[str, list[Row]]]:
    """Rows by value, for each key that takes a few values; numbers in their order."""
    found: dict[str, dict[str, list[Row]]] = {}
    for label in study.labels:
        groups: dict[str, list[Row]] = {}
        values = [row.parameters[label] for row in rows]
        numbers = all(isinstance(v, int | float) and not isinstance(v, bool) for v in values)
        order = sorted(range(len(rows)), key=values.__getitem__) if numbers else range(len(rows))
        for k in order:
            groups.setdefault(short(values[k]), []).append(rows[k])
        if 2 <= len(groups) <= BEST:
            found[label] = groups
    return found


def short(value: Any) -> str:
    """A value in few characters."""
    if isinstance(value, float):
        return f"{value:.4g}"
    return value if isinstance(value, str) else json.dumps(value)


def group_table(label: str, groups: dict[str, list[Row]]) -> list[list[str]]:
    """One line for each value of a key, below the names of the columns."""
    table = [[f"by {label}:", *VERDICTS, "best share"]]
    for value, group in groups.items():
        best = best_share(group)
        numbers = [str(number) for number in counts(group).values()]
        table.append([value, *numbers, "-" if best is None else f"{100.0 * best:.1f} %"])
    used = [
        k for k, head in enumerate(table[0])
        if head not in VERDICTS or any(line[k] != "0" for line in table[1:])
    ]  # fmt: skip
    return [[line[k] for k in used] for line in table]


def _best_table(study: Study, rows: Sequence[Row]) -> list[list[str]]:
    """The best rows, below the names of the columns."""
    ranked = sorted(rows, key=merit)[:BEST]
    limits = [(row.result.get("margins") or {}).get("limit_deg") for row in ranked]
    far = ["-" if limit is None else f"{limit:.1f} deg" for limit in limits]
    table = [["verdict", "share", "from limits", *study.labels]]
    for row, limit in zip(ranked, far, strict=True):
        values = [short(row.parameters[label]) for label in study.labels]
        table.append([str(row.result["verdict"]), share_text(row), limit, *values])
    return table


def _aligned(table: Sequence[Sequence[str]]) -> list[str]:
    """Columns of equal width."""
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return [
        "  " + "  ".join(f"{cell:<{w}}" for cell, w in zip(line, widths, strict=True)).rstrip()
        for line in table
    ]
