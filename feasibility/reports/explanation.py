"""An explanation as a table for people, as one page beside the view, and as one JSON object."""

from __future__ import annotations

import html
import math
import re
import shlex
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from feasibility.collisions.asked_bodies import said_of
from feasibility.collisions.words import checked
from feasibility.reports.changes import settings, worded
from feasibility.reports.explanation_words import (
    best_changes,
    headline,
    helpful,
    helpless,
    idle_limits,
    in_the_way,
    joint_rows,
    rates_sentence,
    row_of,
    what_it_opens,
    widening,
)
from feasibility.reports.objects_and_csv import walk_csv
from feasibility.reports.pages import framed, page, table
from feasibility.reports.text_and_tables import aligned, filled
from feasibility.results.plain import plain
from feasibility.sensitivity.quantities import Quantity
from feasibility.sensitivity.thresholds import (
    Change,
    ChangePair,
    Dropped,
    Explanation,
    Finding,
    Threshold,
)
from feasibility.verdict import Answer, Verdict, Walk
from feasibility.version import version

if TYPE_CHECKING:
    from feasibility.cases.case import Case
    from feasibility.viewer.viewer import View

FEASIBLE_HEADS = ("tightened alone", "now", "feasible to", "beyond that")
HEADS = ("one change", "now", "feasible from", "short of that")
JOINTS = ("joint", "limits", "used")


def as_text(explanation: Explanation, case_name: str, case: Case | None = None) -> str:
    """The thresholds for people: the most useful change first.

    Args:
        explanation: what was found.
        case_name: what the case is called.
        case: the case, for the `--set` that makes the change; see `settings`.
    """
    verdict = explanation.verdict
    lines = [filled("", f"{case_name}: {headline(explanation)}")]
    if len(verdict.cells) == 0:
        return "\n".join([*lines, f"  {_said(explanation)}"])
    command = to_try(explanation, case_name, case)
    lines += [f"  try  {command}"] if command else []
    lines += ["", *(filled("  ", text) for text in _findings(explanation))]
    for heads, rows in _tables(explanation):
        lines += ["", *_aligned([heads, *rows])]
    for text in _remarks(explanation):
        lines += ["", filled("  ", text)]
    return "\n".join([*lines, "", f"  {_said(explanation)}"])


def as_html(explanation: Explanation, case_name: str, view: View, case: Case | None = None) -> str:
    """One page: the most useful change, and tables beside the view of the case as given."""
    command = to_try(explanation, case_name, case)
    parts = [f"<p>To try: <code>{html.escape(command)}</code></p>"] if command else []
    parts += [f"<p>{html.escape(text)}</p>" for text in _findings(explanation)]
    for heads, rows in _tables(explanation):
        parts.append(table(heads, [map(html.escape, row) for row in rows]))
    parts += [f"<p>{html.escape(text)}</p>" for text in _remarks(explanation)]
    frame = framed(view, "the case as given")
    body = f'<div class="beside">{frame}<div>{"".join(parts)}</div></div>\n'
    title = f"{case_name}: {headline(explanation)}"
    return page(title, body, "", _said(explanation))


def _said(explanation: Explanation) -> str:
    """What is said of collisions."""
    return said_of(explanation.verdict.robot, explanation.verdict.task.collision)


def to_try(explanation: Explanation, case_name: str, case: Case | None = None) -> str:
    """The command that decides the case with the most useful change; empty where none helps."""
    values = settings(best_changes(explanation), explanation.verdict, case)
    words = [part for value in values for part in ("--set", value)]
    return shlex.join(["coverable", "check", case_name, *words]) if values else ""


def _tables(explanation: Explanation) -> list[tuple[Sequence[str], list[Sequence[str]]]]:
    """Headings and rows of each table that is not empty: thresholds, and joints."""
    heads = FEASIBLE_HEADS if explanation.verdict.feasible else HEADS
    rows: list[Sequence[str]] = [row_of(threshold) for threshold in helpful(explanation)]
    what, joints = joint_rows(explanation)
    tables = [(heads, rows), ((*JOINTS[:2], f"used by {what}"), list[Sequence[str]](joints))]
    return [(heads, rows) for heads, rows in tables if rows]


def _aligned(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows with columns of equal width; the last one may be long, and is wrapped."""
    last = [row[-1] for row in rows]
    starts = aligned([tuple(row[:-1]) for row in rows])
    return [filled(f"  {start}  ", text) for start, text in zip(starts, last, strict=True)]


def _findings(explanation: Explanation) -> list[str]:
    """What the verdict rests on."""
    alone = explanation.alone
    return [explanation.verdict.message] + ([] if alone is None else [_seeded(alone)])


def _remarks(explanation: Explanation) -> list[str]:
    """What is written below the tables."""
    verdict = explanation.verdict
    helps = helpful(explanation)
    opens = [(row_of(t).change, what_it_opens(t, verdict)) for t in helps]
    texts = [f"{change}: {text}." for change, text in opens if text]
    texts.append(idle_limits(explanation))
    texts.append(rates_sentence(explanation))
    texts.append(widening(verdict.certificate))
    texts += in_the_way(explanation)
    if not helps and not best_changes(explanation) and explanation.thresholds:
        texts.append("None of the single changes that were tried makes it feasible.")
    if explanation.pair is not None:
        texts.append(_pair(explanation.pair))
    texts += helpless(explanation)
    if explanation.dropped is not None:
        texts.append(_dropped(verdict, explanation.dropped))
    if explanation.left_out:
        texts.append(_unknown(explanation))
    return [text for text in texts if text]


def _pair(pair: ChangePair) -> str:
    """The two changes that do it together."""
    both = " and ".join(map(worded, pair.changes))
    waypoints = len(pair.witness.q)
    return f"Two changes together make it feasible: {both}; {waypoints:,} waypoints, replayed."


def _seeded(alone: Verdict) -> str:
    """Why `check` may say something else."""
    return (
        f"The motion was found from those of changed cases; `check` alone, with seed {alone.seed}, "
        f"says: {alone.answer} ({alone.evidence})."
    )


def witnesses(explanation: Explanation) -> dict[str, str]:
    """The covering motions as CSV like that of `check --witness`, by file name.

    At each threshold, such as 'cone.csv', 'joint1-upper-limit.csv', 'shift-along-minus-y.csv';
    with two changes together ('pair.csv'), and without the cells to drop ('dropped.csv').
    """
    pair, dropped = explanation.pair, explanation.dropped
    walks: list[tuple[str, Walk | None]] = [
        (threshold.quantity.name, threshold.feasible.witness)
        for threshold in explanation.thresholds
        if threshold.feasible is not None
    ]
    walks.append(("pair", None if pair is None else pair.witness))
    walks.append(("dropped", None if dropped is None else dropped.witness))
    found: dict[str, str] = {}
    for name, walk in walks:
        if walk is not None:
            words = name.replace("+", "plus ").replace("-", "minus ")
            slug = re.sub(r"[^a-z0-9_]+", "-", words.lower()).strip("-")
            slug += f"-{len(found)}" if not slug or f"{slug}.csv" in found else ""
            found[f"{slug}.csv"] = walk_csv(explanation.verdict.robot, walk)
    return found


def _unknown(explanation: Explanation) -> str:
    """Which thresholds the time limit left no time for."""
    names, number = ", ".join(explanation.left_out), len(explanation.left_out)
    if not explanation.thresholds:
        return f"The time limit ran out before any threshold was searched; unknown: {names}."
    return f"The time limit ran out; {number} thresholds are unknown: {names}."


def _dropped(verdict: Verdict, dropped: Dropped) -> str:
    """Which cells would have to be given up, unless the search for them was cut short."""
    cells, number = len(verdict.cells), len(dropped.cells)
    if verdict.answer is Answer.UNDECIDED and dropped.witness is None:
        found = f"{verdict.n_covered} of {cells} cells"
        return f"The best motion so far covers {found}; what would have to be dropped is unknown."
    if number == cells:
        return f"No cell is covered; all {cells} would have to be dropped."
    missed = "cell" if number == 1 else f"{number:,} cells"
    which = f"the {missed} that the best motion misses ({100.0 * dropped.share:.3g} % of the area)"
    if dropped.witness is None:
        return f"Dropping {which} may leave one motion, but none could be certified."
    return (
        f"Dropping {which} leaves one motion over the other {cells - number:,}: "
        f"{len(dropped.witness.q):,} waypoints, replayed."
    )


def as_json(explanation: Explanation, case_name: str, case: Case | None = None) -> dict[str, Any]:
    """The explanation as the object that `coverable explain --json` prints; see `as_text`."""
    verdict = explanation.verdict
    dropped = explanation.dropped
    return {
        "case": case_name,
        "verdict": str(verdict.answer),
        "evidence": str(verdict.evidence),
        "cells": len(verdict.cells),
        "covered": verdict.n_covered,
        "thresholds": [_threshold(t, verdict) for t in explanation.thresholds],
        "useful": {
            "sentence": headline(explanation),
            "set": settings(best_changes(explanation), verdict, case),
        },
        "pair": explanation.pair and [_change(change) for change in explanation.pair.changes],
        "joints": [dict(zip(JOINTS, row, strict=True)) for row in joint_rows(explanation)[1]],
        "rates": _rates(explanation),
        "not_looked_at": list(explanation.left_out),
        "dropped": dropped
        and {
            "cells": [list(verdict.cells.unravel(int(k))) for k in dropped.cells],
            "area_m2": dropped.area,
            "share": dropped.share,
            "waypoints": dropped.witness and len(dropped.witness.q),
        },
        "collisions": checked(verdict.task.collision),
        "evaluations": explanation.evaluations,
        "seconds": round(explanation.seconds, 6),
        "robot": verdict.robot.name,
        "seed": int(verdict.seed),
        "version": version(),
    }


def _change(change: Change) -> dict[str, Any]:
    """One of two changes as an object; keys say the unit."""
    quantity = change.quantity
    return {
        "quantity": quantity.name,
        "key": quantity.key,
        **_number(quantity, "given", quantity.given),
        **_number(quantity, "value", change.value),
    }


def _rates(explanation: Explanation) -> dict[str, Any] | None:
    """Largest speed and smallest singular value; null where they are not known."""
    rates = explanation.rates
    if rates is None:
        return None
    places = [stop.why for stop in rates.witness.stops]
    return {
        "largest_speed_m_per_s": plain(rates.largest),
        "witness_speed_m_per_s": plain(rates.witness.speed),
        "min_singular_value": plain(rates.witness.sigma),
        "stops_in_place": places.count("in place"),
        "corners": places.count("corner"),
    }


def _threshold(threshold: Threshold, verdict: Verdict) -> dict[str, Any]:
    """One threshold as an object; keys say the unit."""
    quantity = threshold.quantity
    found = _number(quantity, "given", quantity.given)
    found |= _number(quantity, "furthest", quantity.end)
    if threshold.resolution is not None:
        found |= _number(quantity, "resolution", threshold.resolution)
    return {
        "quantity": quantity.name,
        "key": quantity.key,
        "kind": str(quantity.kind),
        **found,
        "feasible": _finding(quantity, threshold.feasible),
        "other": _finding(quantity, threshold.other),
        "tried": threshold.tried,
        "opens": what_it_opens(threshold, verdict) or None,
    }


def _finding(quantity: Quantity, finding: Finding | None) -> dict[str, Any] | None:
    """A verdict at one value; null where there is none."""
    if finding is None:
        return None
    return {
        **_number(quantity, "value", finding.value),
        "verdict": str(finding.answer),
        "evidence": str(finding.evidence),
        "detail": finding.detail,
    }


def _number(quantity: Quantity, name: str, value: float) -> dict[str, float]:
    """A number under a key with its unit, without the rounding errors of conversions."""
    if not quantity.unit:
        return {}
    if quantity.unit == "rad":
        return {f"{name}_deg": round(math.degrees(value), 6)}
    return {f"{name}_m": round(value, 9)}
