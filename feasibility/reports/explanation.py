"""An explanation as sentences for people, and as one JSON object."""

from __future__ import annotations

import math
import re
from typing import Any

from feasibility.cut_words import what_opens
from feasibility.reports.parts import csv_text, filled
from feasibility.sensitivity import Dropped, Explanation, Finding, Kind, Quantity, Threshold
from feasibility.verdict import UNCHECKED, Answer, Evidence, Verdict
from feasibility.version import version

HEADS = {
    Answer.FEASIBLE: "feasible. How far it can be tightened, one parameter at a time:",
    Answer.INFEASIBLE: "infeasible. What would make it feasible, one change at a time:",
    Answer.UNDECIDED: "undecided. What was found to make it feasible, one change at a time:",
}
SEEDED = "[1]"  # behind thresholds that a search without known motions did not find


def as_text(explanation: Explanation, case_name: str) -> str:
    """The thresholds for people: what helps first, then what does not."""
    verdict = explanation.verdict
    head = HEADS[verdict.answer] if explanation.thresholds else f"{verdict.answer}."
    lines = [f"{case_name}: {head}", filled("  ", verdict.message)]
    if explanation.alone is not None:
        lines.append(filled("  ", _seeded(explanation.alone)))
    if len(verdict.cells) == 0:
        return f"{case_name}: there are no cells to cover, so there is nothing to explain."
    helps = [t for t in explanation.thresholds if t.feasible is not None]
    others = [t for t in explanation.thresholds if t.feasible is None]
    if not verdict.feasible:
        helps.sort(key=_effort)
    lines += [""] if helps or others else []
    lines += [filled("  - ", sentence(threshold, verdict)) for threshold in helps]
    if not helps and others:
        lines.append(filled("  ", "No single change that was tried was found to make it feasible."))
    if others:
        lines += ["", "What does not help alone:"]
        ruled_out = [_helpless_label(t.quantity) for t in others if t.ruled_out]
        if ruled_out:
            lines.append(filled("  - ", f"proved: {'; '.join(ruled_out)}."))
        for threshold in (t for t in others if not t.ruled_out):
            lines.append(filled("  - ", sentence(threshold, verdict)))
    if any(t.feasible is not None and t.feasible.unaided is False for t in helps):
        lines += ["", filled("  ", f"{SEEDED} {_from_nearby(verdict)}")]
    if explanation.dropped is not None:
        lines += ["", filled("  ", _dropped(verdict, explanation.dropped))]
    if explanation.left_out:
        lines += ["", filled("  ", _unknown(explanation))]
    return "\n".join([*lines, "", f"  {UNCHECKED}"])


def helpful(explanation: Explanation) -> list[str]:
    """The thresholds at which a feasible value was found, a sentence each."""
    verdict = explanation.verdict
    return [sentence(t, verdict) for t in explanation.thresholds if t.feasible is not None]


def _seeded(alone: Verdict) -> str:
    """Why `check` may say something else."""
    return (
        f"The motion was found beside the case as given; `check` alone, with seed {alone.seed}, "
        f"says: {alone.answer} ({alone.evidence})."
    )


def _from_nearby(verdict: Verdict) -> str:
    """What the mark behind a threshold stands for."""
    return (
        "from a motion nearby, replayed; the search of `check` alone, with seed "
        f"{verdict.seed}, did not find one there."
    )


def witnesses(explanation: Explanation) -> dict[str, str]:
    """The covering motion at each threshold as CSV like that of `check --witness`, by file name.

    Such as 'cone.csv', 'joint1-upper-limit.csv', 'shift-along-minus-y.csv'.
    """
    names = explanation.verdict.robot.joint_names
    found: dict[str, str] = {}
    for threshold in explanation.thresholds:
        walk = None if threshold.feasible is None else threshold.feasible.witness
        if walk is not None:
            plain = threshold.quantity.name.replace("+", "plus ").replace("-", "minus ")
            slug = re.sub(r"[^a-z0-9_]+", "-", plain.lower()).strip("-")
            rows = zip(walk.cell.tolist(), walk.q.tolist(), strict=True)
            lines = (["" if cell < 0 else cell, *map(repr, q)] for cell, q in rows)
            slug += f"-{len(found)}" if not slug or f"{slug}.csv" in found else ""
            found[f"{slug}.csv"] = csv_text([["cell", *names], *lines])
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
    if verdict.answer is Answer.UNDECIDED and dropped.waypoints is None:
        found = f"{verdict.n_covered} of {cells} cells"
        return f"The best motion so far covers {found}; what would have to be dropped is unknown."
    if number == cells:
        return f"No cell is covered; all {cells} would have to be dropped."
    missed = "cell" if number == 1 else f"{number:,} cells"
    which = f"the {missed} that the best motion misses ({100.0 * dropped.share:.3g} % of the area)"
    if dropped.waypoints is None:
        return f"Dropping {which} may leave one motion, but none was certified."
    return (
        f"Dropping {which} leaves one motion over the other {cells - number:,}: "
        f"{dropped.waypoints:,} waypoints, replayed."
    )


def _effort(threshold: Threshold) -> float:
    """The share of its range that a change needs; the smallest is listed first."""
    quantity, found = threshold.quantity, threshold.feasible
    span = abs(quantity.end - quantity.given)
    return abs(found.value - quantity.given) / span if found is not None and span > 0.0 else 1.0


def sentence(threshold: Threshold, verdict: Verdict) -> str:
    """One threshold as a sentence.

    Args:
        threshold: what was found.
        verdict: of the case as given; where it is feasible the threshold is a margin.
    """
    tightened = verdict.feasible
    quantity, found = threshold.quantity, threshold.feasible
    if found is None:
        return _helpless(threshold)
    value, now = shown(quantity, found.value, True), shown(quantity, quantity.given)
    text = (_margin if tightened else _remedy)(quantity, value, now)
    if threshold.span is not None:
        text += f", and on to {shown(quantity, threshold.span.feasible.value)}"
        if threshold.span.other is not None:
            text += f" ({_against(quantity, threshold.span.other)})"
    if threshold.other is not None:
        text += f"; {_against(quantity, threshold.other)}"
    elif tightened and found.value == quantity.end:
        text += ", the furthest value tried"
    opens = what_it_opens(threshold, verdict)
    text += f"; {opens}" if opens else ""
    return text + ("." if found.unaided is not False else f" {SEEDED}.")


def what_it_opens(threshold: Threshold, verdict: Verdict) -> str:
    """How the motion of a changed case gets past the proof of this one; empty without cuts."""
    found, proof = threshold.feasible, verdict.proof
    if found is None or found.witness is None or proof is None or proof.kind != "cut":
        return ""
    return what_opens(proof, found.witness.q, verdict.robot, verdict.cells)


def _margin(quantity: Quantity, value: str, now: str) -> str:
    """How far a feasible case can be tightened."""
    if quantity.kind is Kind.SHIFT:
        return f"the surface can shift by {value} {quantity.name.removeprefix('shift ')}"
    if quantity.kind is Kind.STANDOFF:
        return f"the standoff can {_change(quantity)} to {value} ({now} now)"
    name = "alpha" if quantity.kind is Kind.CONE else f"the {quantity.name}"
    return f"{name} can tighten to {value} ({now} now)"


def _remedy(quantity: Quantity, value: str, now: str) -> str:
    """What would make a case feasible."""
    if quantity.kind is Kind.CONE:
        return f"feasible from alpha = {value} on ({now} now)"
    if quantity.kind in (Kind.LOWER, Kind.UPPER):
        joint, side, _ = quantity.name.rsplit(" ", 2)
        direction = "down" if side == "lower" else "up"
        return f"{joint} would need {direction} to {value}; it stops at {now}"
    if quantity.kind is Kind.STANDOFF:
        return f"feasible when the standoff {_change(quantity)}s to {value} ({now} now)"
    return f"feasible when the surface shifts by {value} {quantity.name.removeprefix('shift ')}"


def _helpless(threshold: Threshold) -> str:
    """No value was found to help."""
    quantity, other = threshold.quantity, threshold.other
    text = _helpless_label(quantity)
    if threshold.tried:
        text += f" ({threshold.tried})"
    if other is not None:
        text += f": {_against(quantity, other)}"
    return text + "."


def _helpless_label(quantity: Quantity) -> str:
    """A quantity and the range that was searched."""
    return {
        Kind.CONE: "a wider cone, up to ",
        Kind.LOWER: f"the {quantity.name}, down to ",
        Kind.UPPER: f"the {quantity.name}, up to ",
        Kind.STANDOFF: f"a {quantity.name}, as far as ",
        Kind.SHIFT: f"a {quantity.name}, up to ",
    }[quantity.kind] + shown(quantity, quantity.end)


def _change(quantity: Quantity) -> str:
    """Whether a standoff becomes larger or smaller."""
    return "grow" if quantity.end > quantity.given else "shrink"


def _against(quantity: Quantity, other: Finding) -> str:
    """Why a value is not feasible."""
    if other.value == quantity.given and (
        other.evidence is not Evidence.PROOF or other.cell is None
    ):
        return f"{other.answer} at the given {shown(quantity, other.value)}"
    return f"at {shown(quantity, other.value, False)} {other.detail}"


def shown(quantity: Quantity, value: float, feasible: bool | None = None) -> str:
    """A value with its unit: degrees or millimetres, to two digits.

    A feasible limit or cone is rounded to where it allows more, one that is not to where it allows
    less, so that what was found holds for the printed number too.
    """
    value, unit = (math.degrees(value), "deg") if quantity.unit == "rad" else (1e3 * value, "mm")
    if feasible is None or not quantity.monotone:
        return f"{round(value, 2):.10g} {unit}"
    up = feasible != (quantity.kind is Kind.LOWER)
    cents = round(100.0 * value, 4)  # what conversions leave behind is no reason to round
    return f"{(math.ceil(cents) if up else math.floor(cents)) / 100.0:.10g} {unit}"


def as_json(explanation: Explanation, case_name: str) -> dict[str, Any]:
    """The explanation as the object that `coverable explain --json` prints."""
    verdict = explanation.verdict
    dropped = explanation.dropped
    return {
        "case": case_name,
        "verdict": str(verdict.answer),
        "evidence": str(verdict.evidence),
        "cells": len(verdict.cells),
        "covered": verdict.n_covered,
        "thresholds": [_threshold(t, verdict) for t in explanation.thresholds],
        "not_looked_at": list(explanation.left_out),
        "dropped": dropped
        and {
            "cells": [list(verdict.cells.unravel(int(k))) for k in dropped.cells],
            "area_m2": dropped.area,
            "share": dropped.share,
            "waypoints": dropped.waypoints,
        },
        "collisions": [],
        "evaluations": explanation.evaluations,
        "seconds": round(explanation.seconds, 6),
        "robot": verdict.robot.name,
        "seed": int(verdict.seed),
        "version": version(),
    }


def _threshold(threshold: Threshold, verdict: Verdict) -> dict[str, Any]:
    """One threshold as an object; keys say the unit."""
    quantity, span = threshold.quantity, threshold.span
    found = _number(quantity, "given", quantity.given)
    found |= _number(quantity, "furthest", quantity.end)
    if threshold.resolution is not None:
        found |= _number(quantity, "resolution", threshold.resolution)
    return {
        "quantity": quantity.name,
        "kind": str(quantity.kind),
        **found,
        "feasible": _finding(quantity, threshold.feasible),
        "other": _finding(quantity, threshold.other),
        "until": span
        and {
            "feasible": _finding(quantity, span.feasible),
            "other": _finding(quantity, span.other),
        },
        "tried": threshold.tried,
        "opens": what_it_opens(threshold, verdict) or None,
        "sentence": sentence(threshold, verdict),
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
        "unaided": finding.unaided,
    }


def _number(quantity: Quantity, name: str, value: float) -> dict[str, float]:
    """A number under a key with its unit, without the rounding errors of conversions."""
    if quantity.unit == "rad":
        return {f"{name}_deg": round(math.degrees(value), 6)}
    return {f"{name}_m": round(value, 9)}
