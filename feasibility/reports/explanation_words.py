"""Thresholds in words: a sentence each, a row each, and the one change that helps most."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from coverable.errors import at_least, counted
from feasibility.cut_words import what_opens
from feasibility.reports.changes import LIMITS, shown, worded
from feasibility.reports.text_and_tables import placement_text
from feasibility.sensitivity.quantities import Kind, Quantity
from feasibility.sensitivity.thresholds import Change, Explanation, Finding, Threshold
from feasibility.verdict import ROOM, Certificate, Evidence, Verdict
from robots.kinematics import Kinematics

SPARE = 1.0 / 3.0  # [1] of a joint's range: a limit that may tighten by more does not matter
FURTHEST = "the furthest value tried"


class ThresholdRow(NamedTuple):
    """One threshold, as a table shows it."""

    change: str
    now: str
    value: str
    beyond: str
    """What is known on the other side of the threshold."""


# -- which thresholds are worth a line ------------------------------------------------------------


def helpful(explanation: Explanation) -> list[Threshold]:
    """The thresholds with a feasible side that say something, the most useful one first.

    Of a feasible case those with the least to spare; of another those that ask for the least.
    """
    found = [t for t in explanation.thresholds if t.feasible is not None and t.quantity.unit]
    said = (t for t in found if matters(t, explanation.verdict))
    return sorted(said, key=lambda t: (t.turns_away, t.effort))


def matters(threshold: Threshold, verdict: Verdict) -> bool:
    """Does it say something? Not of a limit that a feasible case is far from using."""
    quantity, found = threshold.quantity, threshold.feasible
    if not verdict.feasible or quantity.kind not in LIMITS or found is None:
        return True
    robot = verdict.robot
    width = float(robot.upper[quantity.joint] - robot.lower[quantity.joint])
    return bool(threshold.other is not None and threshold.margin <= SPARE * width)


def best_changes(explanation: Explanation) -> tuple[Change, ...]:
    """What makes a case feasible with the least effort: one change, or two; empty if none does.

    A cone that lets the tool point away from the surface is none that anybody wants.
    """
    if explanation.verdict.feasible:
        return ()
    objects = [t for t in explanation.thresholds if t.quantity.obstacle]
    for threshold in (*helpful(explanation), *objects):
        if threshold.feasible is not None and not threshold.turns_away:
            return (Change(threshold.quantity, threshold.feasible.value),)
    return () if explanation.pair is None else explanation.pair.changes


def headline(explanation: Explanation) -> str:
    """The one most useful thing to know."""
    verdict, dropped = explanation.verdict, explanation.dropped
    if len(verdict.cells) == 0:
        return "there are no cells to cover, so there is nothing to explain."
    if verdict.feasible:
        rows = helpful(explanation)
        least = f" The least to spare: {_spare(rows[0])}." if rows else ""
        return f"feasible.{least}"
    changes = best_changes(explanation)
    if changes:
        one = "One change makes it feasible" if len(changes) == 1 else "Two changes together do"
        return f"{verdict.answer}. {one}: {' and '.join(map(worded, changes))}."
    why = "No change was found to help" if explanation.thresholds else "Nothing was looked at"
    if helpful(explanation):
        why += ", but for a cone in which the tool may point away from the surface"
    if dropped is not None and dropped.witness is not None:
        rest = len(verdict.cells) - len(dropped.cells)
        without = f"without {counted(len(dropped.cells), 'cell')} one motion covers the other"
        return f"{verdict.answer}. {why}; {without} {rest:,}."
    if verdict.covered.all() and verdict.treated is not None:
        why = "No change was looked for: a motion covers every cell, but treats too little"
    return f"{verdict.answer}. {why}."


def _spare(threshold: Threshold) -> str:
    """How far a feasible case can be tightened along one quantity."""
    row, quantity = row_of(threshold), threshold.quantity
    if quantity.kind is Kind.SHIFT:
        return f"{row.change} by {row.value}"
    side = "up" if quantity.end > quantity.given else "down"
    return f"{row.change} {side} to {row.value} ({row.now} now)"


def row_of(threshold: Threshold) -> ThresholdRow:
    """One threshold as a row of a table."""
    quantity, found, other = threshold.quantity, threshold.feasible, threshold.other
    now = "-" if quantity.kind is Kind.SHIFT else shown(quantity, quantity.given)
    if found is None:
        return ThresholdRow(
            quantity.label, now, "-", "" if other is None else _against(quantity, other)
        )
    value = shown(quantity, found.value, True)
    beyond = FURTHEST if other is None and found.value == quantity.end else ""
    if other is not None:
        beyond = _against(quantity, other)
    return ThresholdRow(quantity.label, now, value, beyond)


def idle_limits(explanation: Explanation) -> str:
    """The limits that a feasible case is far from using, in one line; empty without any."""
    idle = [
        t.quantity
        for t in explanation.thresholds
        if t.feasible is not None and not matters(t, explanation.verdict)
    ]
    names = _joints(explanation.verdict, idle)
    return f"Limits that do not matter: {', '.join(names)}." if names else ""


def rates_sentence(explanation: Explanation) -> str:
    """How fast the tool may be, and how near singularities the motion comes; empty if not known."""
    rates, asked = explanation.rates, explanation.verdict.task
    if rates is None:
        return ""
    text = ""
    if math.isfinite(rates.largest):
        text = (
            f"Inside the joints' velocities a motion over all cells may have up to "
            f"{at_least(rates.largest, 3)} m/s all along, but for stops in place and at corners"
        )
        if asked.speed is not None:
            text += f" ({asked.speed:g} m/s is required)"
        if rates.witness.speed < rates.largest:
            text += f"; the covering motion above {at_least(rates.witness.speed, 3)} m/s"
        text += ". "
    least = f"smallest singular value is at least {at_least(rates.witness.sigma, 3)}, near cell"
    return f"{text}The covering motion's {least} {_nearest_singular(explanation)}."


def _nearest_singular(explanation: Explanation) -> str:
    """The cell at which the covering motion is nearest to a singularity."""
    verdict, rates = explanation.verdict, explanation.rates
    if verdict.witness is None or rates is None:
        return str(list(verdict.cells.unravel(0)))
    row = int(np.argmin(rates.witness.segment.sampled_sigma))
    point, _ = Kinematics(verdict.robot).tool(verdict.witness.q[row])
    off = np.linalg.norm(verdict.task.targets(verdict.cells).points - point, axis=1)
    return str(list(verdict.cells.unravel(int(off.argmin()))))


def in_the_way(explanation: Explanation) -> list[str]:
    """Which objects are in the way of a case that is not feasible: a line for each tried."""
    lines = []
    for threshold in explanation.thresholds:
        quantity, found = threshold.quantity, threshold.feasible
        if quantity.kind is not Kind.WITHOUT or threshold.tried:
            continue
        name = f"{quantity.name[0].upper()}{quantity.name[1:]}"
        if found is not None:
            lines.append(f"{name}: feasible, {found.detail}.")
        elif threshold.other is not None:
            lines.append(f"{name}: {_against(quantity, threshold.other)}.")
    return lines


def helpless(explanation: Explanation) -> list[str]:
    """What was found not to help: a line for what is proved, for values proved, for the rest."""
    others = [t for t in explanation.thresholds if t.feasible is None and t.quantity.unit]
    rest = [t for t in others if not t.ruled_out]
    groups = {
        "Proved not to help alone": [t for t in others if t.ruled_out],
        "Proved infeasible at each value tried": [t for t in rest if t.each_proved],
        "Not found to help alone": [t for t in rest if not t.each_proved],
    }
    return [
        f"{head}: {'; '.join(_in_short(explanation.verdict, group))}."
        for head, group in groups.items()
        if group
    ]


def _in_short(verdict: Verdict, group: Sequence[Threshold]) -> Iterator[str]:
    """Quantities with the furthest value that was tried, those of one kind together."""
    for threshold in group:
        quantity = threshold.quantity
        if quantity.kind not in (*LIMITS, Kind.SHIFT):
            yield f"{quantity.label} to {shown(quantity, quantity.end)}"
    limits = [t.quantity for t in group if t.quantity.kind in LIMITS]
    if limits:
        yield f"wider limits of {', '.join(_joints(verdict, limits))}"
    shifts = [t.quantity for t in group if t.quantity.kind is Kind.SHIFT]
    if shifts:
        axes = ", ".join(q.which for q in shifts)
        yield f"surface.position {axes} by up to {shown(shifts[0], shifts[0].end)}"


def _joints(verdict: Verdict, limits: Iterable[Quantity]) -> list[str]:
    """Joints with the sides of their limits: 'joint1', 'joint2 (upper)'."""
    sides: dict[int, list[str]] = {}
    for quantity in limits:
        sides.setdefault(quantity.joint, []).append(quantity.which)
    names = verdict.robot.joint_names
    return [names[j] + ("" if len(both) == 2 else f" ({both[0]})") for j, both in sides.items()]


# -- joints ---------------------------------------------------------------------------------------


def joint_rows(explanation: Explanation) -> tuple[str, list[list[str]]]:
    """Which motion, and for each joint its limits and the range that this motion uses."""
    verdict, dropped = explanation.verdict, explanation.dropped
    walk, what = verdict.witness, "the covering motion"
    if walk is None and dropped is not None and dropped.witness is not None:
        rest = counted(len(verdict.cells) - len(dropped.cells), "cell")
        walk, what = dropped.witness, f"the motion over {rest}"
    if walk is None:
        return "", []
    robot, rows = verdict.robot, []
    used = np.stack([walk.q.min(axis=0), walk.q.max(axis=0)], axis=1)
    limits = np.stack([robot.lower, robot.upper], axis=1)
    for k, name in enumerate(robot.joint_names):
        rows.append([name, *(_range(pair[k], bool(robot.prismatic[k])) for pair in (limits, used))])
    return what, rows


def _range(ends: Iterable[float], slides: bool) -> str:
    """'-90 .. 10 deg', or 'free'."""
    low, high = (end if slides else math.degrees(end) for end in ends)
    if not math.isfinite(low) and not math.isfinite(high):
        return "free"
    digits = 4 if slides else 1
    return f"{round(low, digits):.10g} .. {round(high, digits):.10g} {'m' if slides else 'deg'}"


def what_it_opens(threshold: Threshold, verdict: Verdict) -> str:
    """How the motion of a changed case gets past the proof of this one; empty without cuts."""
    found, proof = threshold.feasible, verdict.proof
    if found is None or found.witness is None or proof is None or proof.kind != "cut":
        return ""
    return what_opens(proof, found.witness.q, verdict.robot, verdict.cells)


def _against(quantity: Quantity, other: Finding) -> str:
    """Why a value is not feasible."""
    if other.value == quantity.given and (
        other.evidence is not Evidence.PROOF or other.cell is None
    ):
        return f"{other.answer} at the given {shown(quantity, other.value)}"
    if quantity.kind is Kind.WITHOUT:
        return other.detail
    return f"at {shown(quantity, other.value, False)} {other.detail}"


# -- the placement margin ---------------------------------------------------------------------


def widening(certificate: Certificate | None) -> str:
    """The placement margin, and what would widen it; empty where it is not known."""
    margin = None if certificate is None else certificate.placement_margin
    if margin is None:
        return ""
    wider = ROOM[margin.bound_by][1].format(margin.what)
    return f"{placement_text(certificate)}; {wider} would widen it"
