"""A study's table as text for people, as one JSON object, as CSV, and as one page."""

from __future__ import annotations

import html
import json
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from coverable.errors import counted
from feasibility.cases.collision_table import CollisionPart
from feasibility.collisions.words import CHECKABLE, UNCHECKED, checked, checked_words
from feasibility.reports.objects_and_csv import MARGINS, csv_text
from feasibility.reports.pages import COLOURS, PLAIN, bar, framed, page, table
from feasibility.reports.study_plot import are_numbers, charts, short, worded
from feasibility.reports.text_and_tables import aligned, bodiless, percent
from feasibility.studies.file import Study
from feasibility.studies.run import StudyTask
from feasibility.studies.store import Row
from feasibility.studies.study_outcome import merit
from feasibility.version import version

if TYPE_CHECKING:
    from feasibility.viewer.viewer import View

COLUMNS = ("verdict", "evidence", "cells", "covered", "share", "edges", "pairs")
MOST = 10  # best rows that are listed, and values of a key up to which each has a line
NOTE = """Share: of the area, in one continuous motion. "Feasible" is said only with a motion
that an independent replay accepted."""


def as_json(study: Study, rows: Sequence[Row]) -> dict[str, Any]:
    """All rows, each with its parameters and its result."""
    return {
        "study": study.name,
        "description": study.description,
        "parameters": list(study.labels),
        "collisions": checked_in_all(study),
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
    """One line for each task: its parameters, then its outcome; empty where there is nothing.

    No column depends on the run, so the same study always gives the same text.
    """
    heads = [*study.labels, *COLUMNS, *(f"margin_{name}" for name in MARGINS), "cause"]
    lines = [heads]
    for row in rows:
        margins = row.result.get("margins") or {}
        values = [row.parameters[label] for label in study.labels]
        values += [row.result.get(name) for name in COLUMNS]
        values += [margins.get(name) for name in MARGINS]
        values.append(dominant(row))
        lines.append([json.dumps(v) if isinstance(v, (dict, list)) else v for v in values])
    return csv_text(lines)


def as_text(study: Study, rows: Sequence[Row]) -> str:
    """The outcome of the study: verdicts, by value where there are few, and the best rows."""
    lines = [study.description] if study.description else []
    lines += [headline(study, rows), f"  {_said(study, rows)}"]
    if found := causes(rows):
        listed = ", ".join(f"{cause} in {number}" for cause, number in found)
        lines.append(f"  most frequent cause of missed cells: {listed}.")
    if failed := failures(rows):
        lines.append(f"  {failed}")
    best = [["verdict", "share", "from limits", *study.labels], *best_rows(study, rows)]
    for label, groups in groups_of(study, rows).items():
        lines += ["", *_indented(group_table(label, groups))]
    lines += ["", "the best:", *_indented(best)]
    return "\n".join(lines)


def _indented(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows with columns of equal width."""
    return [f"  {line}".rstrip() for line in aligned(rows)]


def as_html(study: Study, rows: Sequence[Row], poses: View | None = None) -> str:
    """One page that fetches nothing.

    Args:
        study: the question.
        rows: their outcomes.
        poses: a view of the surface's poses, where they vary; see `viewer.view_study`.
    """
    parts = [f"<p>{html.escape(study.description)}</p>\n"] if study.description else []
    parts += [f"<p>{html.escape(headline(study, rows))}</p>\n", _verdict_bar(rows)]
    if found := causes(rows):
        lines = [
            [html.escape(cause), str(n), bar((n / len(rows), PLAIN, ""))] for cause, n in found
        ]
        parts.append("<h2>Why cells are missed</h2>\n")
        parts.append(table(["cause of most missed cells", "cases", ""], lines))
    if failed := failures(rows):
        parts.append(f"<p>{html.escape(failed)}</p>\n")
    heads = ["verdict", "covered", "from limits", *map(worded, study.labels)]
    parts.append(f"<h2>The best of {len(rows)}</h2>\n")
    parts.append(table(map(html.escape, heads), map(_escaped, best_rows(study, rows))))
    parts += [_by_value(label, groups) for label, groups in groups_of(study, rows).items()]
    pictures = charts(study.labels, rows)
    figures = [
        f"<figure>{chart.svg}<figcaption>{html.escape(chart.caption)}</figcaption></figure>\n"
        for chart in pictures.drawn
    ]
    if figures:
        parts.append(f'<h2>Covered share</h2>\n<div class="charts">{"".join(figures)}</div>\n')
    if pictures.left_out:
        parts.append(f"<p>Pairs of numbers without a map: {pictures.left_out}.</p>\n")
    if poses is not None:
        parts.append(f"<h2>Poses</h2>\n{framed(poses, 'poses of the surface')}")
    return page(f"Study: {study.name}", "".join(parts), NOTE, _said(study, rows))


def checked_in_all(study: Study) -> list[str]:
    """What every case of a study checks, in the words of JSON."""
    every = [checked(_settings(task)) for task in study.tasks]
    return [name for name in CHECKABLE if every and all(name in one for one in every)]


def collision_words(study: Study) -> str:
    """The sentence that says what is checked, of all cases or of how many."""
    found = Counter(checked_words(_settings(task)) for task in study.tasks)
    total = found.total()
    if len(found) <= 1:
        return next(iter(found), UNCHECKED)
    return "; ".join(f"in {number} of {total} cases {text}" for text, number in found.items())


def _said(study: Study, rows: Sequence[Row]) -> str:
    """What is said of collisions."""
    return collision_words(study) + bodiless(row.result.get("unchecked_links", ()) for row in rows)


def _settings(task: StudyTask) -> CollisionPart | None:
    """The collisions of a checked case: enough to say what is checked."""
    table = task.tables.get("collision")
    if not table:
        return None
    return CollisionPart(
        self_=table.get("self", True),
        surface=table.get("surface", True),
        clearance=float(table.get("clearance", 0.0)),
        tool_clearance=float(table.get("tool_clearance", 0.0)),
        scene=tuple(table.get("scene", ())),
    )


def _verdict_bar(rows: Sequence[Row]) -> str:
    """How many cases have each verdict, as one bar."""
    found = [(number, verdict) for verdict, number in counts(rows).items() if number]
    parts = [(n / len(rows), COLOURS[verdict], f"{n} {verdict}") for n, verdict in found]
    keys = "".join(
        f'<span><i style="background: {colour}"></i>{text}</span>' for _, colour, text in parts
    )
    return f'<div class="wide">{bar(*parts)}</div>\n<p class="keys">{keys}</p>\n'


def _by_value(label: str, groups: dict[str, list[Row]]) -> str:
    """One line for each value of a key."""
    (_, *heads), *lines = group_table(label, groups)
    bars = [bar((best_share(group) or 0.0, PLAIN, "")) for group in groups.values()]
    rows = [[*_escaped(line), bar] for line, bar in zip(lines, bars, strict=True)]
    name = html.escape(worded(label))
    return f"<h2>By {name}</h2>\n" + table([name, *heads, ""], rows)


def _escaped(cells: Sequence[str]) -> list[str]:
    """Plain texts as HTML."""
    return [html.escape(cell) for cell in cells]


def headline(study: Study, rows: Sequence[Row]) -> str:
    """The result in one sentence."""
    return f"{study.name}: {counted(len(rows), 'case')}: {verdicts_text(rows)}."


def counts(rows: Sequence[Row]) -> dict[str, int]:
    """How many rows have each verdict."""
    found = Counter(str(row.result["verdict"]) for row in rows)
    return {verdict: found.get(verdict, 0) for verdict in COLOURS}


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
    lines = []
    for row in sorted(rows, key=lambda row: merit(row.result))[:MOST]:
        limit = (row.result.get("margins") or {}).get("limit_deg")
        cells = [str(row.result["verdict"]), _or_dash(row.result.get("share"))]
        cells.append("-" if limit is None else f"{limit:.1f} deg")
        lines.append([*cells, *(short(row.parameters[label]) for label in study.labels)])
    return lines


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
    lines = [[f"by {label}:", *COLOURS, "best share"]]
    for value, group in groups.items():
        lines.append([value, *map(str, counts(group).values()), _or_dash(best_share(group))])
    used = [
        k for k, head in enumerate(lines[0])
        if head not in COLOURS or any(line[k] != "0" for line in lines[1:])
    ]  # fmt: skip
    return [[line[k] for k in used] for line in lines]


def _or_dash(share: Any) -> str:
    """A share, which a failed row does not have."""
    return "-" if share is None else percent(float(share))
