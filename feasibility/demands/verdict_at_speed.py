"""The verdict at a speed, and at a distance from singularities.

A motion that covers everything is known; the question is whether one does so at the speed. Where
the known one is too slow, motions that hold the speed are put together anew, from all that are
known and more that are made (`rated_graph`). What is found is replayed like any motion. That
nothing is found proves nothing: the answer is undecided then.
"""

from dataclasses import replace

import numpy as np

from coverable.arrays import Mask
from coverable.errors import at_least, counted
from feasibility.certification.rate_replay import RateReplay, replay_rates
from feasibility.clock import Clock, OutOfTime
from feasibility.demands.every_demand import required_words
from feasibility.demands.fast_motions import best_motion, largest_speed
from feasibility.demands.motion_rates import RatedGraph, grow, rated_graph, replay_at_rates
from feasibility.verdict import (
    Answer,
    Cause,
    CauseKind,
    Certificate,
    Evidence,
    Verdict,
    Walk,
    deferred,
)

FEW = 5  # cells that are named
TOO_SLOW = "covered, but not as fast or as far from singularities as required"
"""A key of the statistics of a verdict that is undecided for it."""


def at_rates(verdict: Verdict, clock: Clock) -> Verdict:
    """The verdict at the speed, or the same where it is not feasible or no speed is required."""
    task, walk = verdict.task, verdict.witness
    if not task.requires_rates or not verdict.feasible or walk is None or not len(verdict.cells):
        return verdict
    replayed = replay_rates(verdict.robot, verdict.cells, task, walk)
    if replayed.accepted:
        return _accepted(verdict, walk, verdict.certificate, "")
    rated, late = rated_graph(verdict), ""
    covered, made = best_motion(rated, rated.enough)
    try:
        if not covered.all():
            with clock.enforced():
                grow(rated, clock)
            covered, made = best_motion(rated, rated.enough)
    except OutOfTime:
        late = " The time limit ran out before all that might be faster was tried."
    if covered.all():
        other = made()
        every = np.ones(len(verdict.cells), dtype=bool)
        certificate, refusal = replay_at_rates(verdict.robot, verdict.cells, task, other, every)
        if not refusal:
            note = " It is not the first motion that was found."
            return _accepted(verdict, other, certificate, note)
    return _not_found(verdict, rated, replayed, covered, late)


def _accepted(verdict: Verdict, walk: Walk, certificate: Certificate | None, note: str) -> Verdict:
    """The verdict with a motion that is fast enough, and what the judge measured of it."""
    task = verdict.task
    replayed = replay_rates(verdict.robot, verdict.cells, task, walk, closely=True)
    places = [stop.cell for stop in replayed.stops if stop.why == "in place"]
    corners = len(replayed.stops) - len(places)
    words = ""
    if task.speed is not None:
        waits = f"{counted(len(places), 'wait')} in place"
        if places:
            unique = list(dict.fromkeys(places))
            waits += f" at cell{'s' if len(unique) > 1 else ''} {verdict.cells.named(unique, FEW)}"
            waits += f", {replayed.waiting:.2g} s together,"
        stops = f", but for {waits} and {counted(corners, 'corner')}"
        words = (
            f" The tool can have {task.speed:g} m/s all along it inside the joints' velocities"
            f"{stops if replayed.stops else ''}."
        )
    if task.min_manipulability is not None:
        words += f" Its smallest singular value is at least {at_least(replayed.sigma, 3)}."
    fast = task.speed is not None
    kept = certificate and replace(
        certificate,
        max_speed=replayed.speed if fast and np.isfinite(replayed.speed) else None,
        min_singular_value=None if task.min_manipulability is None else replayed.sigma,
        stops_in_place=len(places) if fast else None,
        corners=corners if fast else None,
    )
    message = verdict.message
    if note and verdict.certificate is not None:
        old, new = f"{verdict.certificate.waypoints} waypoints", f"{len(walk.q)} waypoints"
        message = message.replace(old, new, 1)
    start = int(walk.cell[0])
    return replace(
        verdict, witness=walk, certificate=kept, message=message + words + note,
        start=start if start >= 0 else verdict.start,
    )  # fmt: skip


def _not_found(
    verdict: Verdict, rated: RatedGraph, replayed: RateReplay, reached: Mask, late: str
) -> Verdict:
    """Undecided: what is wrong with the motion that is known, and how much is possible."""
    task, total = verdict.task, len(verdict.cells)
    best = largest_speed(rated)
    message = (
        f"One continuous motion covers every cell, but none was found that does so "
        f"{required_words(task)}: on the one that is known {'; '.join(replayed.refusals)}. "
        f"The best of those known covers {int(reached.sum())} of {total} cells."
    )
    if task.speed is not None and best > 0.0:
        message += f" All of them can be covered at {best:.3g} m/s."
    return replace(
        verdict, answer=Answer.UNDECIDED, evidence=Evidence.BUDGET, message=message + late,
        covered=reached, witness=None, certificate=None,
        causes=deferred(lambda: _causes(rated, reached)),
        statistics={**verdict.statistics, TOO_SLOW: True},
    )  # fmt: skip


def _causes(rated: RatedGraph, reached: Mask) -> tuple[Cause, ...]:
    """Why cells are missed: what the best motion to each that is not fast enough would need."""
    enough = set(rated.enough)
    best = rated.fastest_to_cells(edge for edge in rated.rated if edge not in enough)
    kind, found = CauseKind.DISCONNECTED, list[Cause]()
    for cell in np.flatnonzero(~reached).tolist():
        detail = "the motions to it are as required, but not connected to the best one"
        if cell in best:
            detail = rated.fault(best[cell], f" at cell {list(rated.cells.unravel(cell))}")
        found.append(Cause(cell, kind, False, detail))
    return tuple(found)
