"""Searches and proofs with a limited effort, what they found, and what is quicker than a search.

Configurations from a case nearby are projected onto the cells of this one by Newton steps, a few
evaluations a cell.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from coverable_arrays import Array, Ints
from coverable_kernels import entry
from feasibility.clock import OutOfTime
from feasibility.demands import BY_REPLAY, TOGETHER, further, unjudged
from feasibility.roadmap import (
    Exploration,
    SearchArrays,
    Work,
    moved_clear,
    project_onto_cell,
    within,
)
from feasibility.roadmap.blockers import Blockers, blockers_of
from feasibility.sensitivity.quantities import Quantity, Variant
from feasibility.verdict import Answer, Evidence, Verdict, Walk

MOST_BOXES = 10_000  # of joint values, for all proofs with collisions of one explanation
NEARBY_STEPS = np.int64(15)  # Newton steps from the configuration of a case nearby
NO_CELL = -1

Steps = tuple[Quantity, int]
"""A quantity, and how many steps from the value given."""


@dataclass
class LimitedExploration(Exploration):
    """An exploration that stops after a number of evaluations of the arm, on any machine."""

    most: float = np.inf

    def tick(self, text: str, more: int = 0) -> None:
        """Stop at the limit.

        Raises:
            OutOfTime: it is reached, or the deadline has passed.
        """
        super().tick(text, more)
        self.clock.evaluations = self.most - float(self.work.counts[0])
        if self.clock.evaluations < 0:
            raise OutOfTime

    def add_seeds(self, cell: int, guesses: Iterable[Array]) -> int:
        """Add seeds, unless the limit is reached; see `Exploration.add_seeds`."""
        self.tick("looking for configurations")
        return super().add_seeds(cell, guesses)


@dataclass(frozen=True, eq=False, slots=True)
class LimitedAttempt:
    """What a search found."""

    answer: Answer
    evidence: Evidence
    detail: str
    q: Array
    """(N, n) a configuration of the best component over each cell; NaN where it has none."""
    walk: Walk | None
    """A covering motion; None unless feasible."""
    angle: float | None = None
    """rad, the replay's bound on the angle between tool axis and approach direction along the walk;
    None until the replay has accepted it; until then the attempt is not reported to anyone."""

    @property
    def found(self) -> bool:
        """True with a covering motion."""
        return self.walk is not None


def held(
    given: Variant, attempt: LimitedAttempt, steps: Steps | None = None, whole: bool = True
) -> LimitedAttempt:
    """An attempt whose motion holds what no replay judges, such as a speed; else undecided.

    Args:
        given: the case.
        attempt: of it, or of one nearby.
        steps: the quantity and its steps, of a case nearby.
        whole: whether what several motions hold together is judged too, such as the coverage,
            which takes long to measure.
    """
    if attempt.walk is None or not unjudged(given.robot, given.task, BY_REPLAY):
        return attempt
    variant = given if steps is None else steps[0].applied(given, steps[1])
    found = further(*variant, [attempt.walk], judged=() if whole else TOGETHER)
    if found.accepted:
        return attempt
    detail = f"{attempt.detail}, but {found.refusal}"
    return LimitedAttempt(Answer.UNDECIDED, Evidence.BUDGET, detail, attempt.q, None)


def attempt_of(verdict: Verdict) -> LimitedAttempt:
    """What `check` found, as an attempt."""
    angle = None if verdict.certificate is None else verdict.certificate.max_angle
    q, said = known_configurations(verdict), (verdict.answer, verdict.evidence, verdict.message)
    return LimitedAttempt(*said, q, verdict.witness, angle)


def known_configurations(verdict: Verdict) -> Array:
    """(N, n) a configuration over each cell that the best motion covers; NaN over the others."""
    q = np.full((len(verdict.cells), verdict.robot.n), np.nan)
    if verdict.witness is not None:
        at = np.flatnonzero(verdict.witness.cell >= 0)[::-1]
        q[verdict.witness.cell[at]] = verdict.witness.q[at]
        return q
    for cell, found in verdict.graph.nodes(data="q"):
        if found is not None:
            q[cell] = found
    return q


class CollisionProofs:
    """Proofs that the arm collides over a cell, of the case given and of those nearby."""

    def __init__(self, given: Variant) -> None:
        """Prepare the case as given."""
        self._given = given
        self._left = MOST_BOXES
        self._key: tuple[str, int] | None = None
        self._latest: Blockers | None = None

    def at(self, steps: Steps | None) -> Blockers | None:
        """Those of a case nearby, or of the one given; None where collisions are not checked."""
        if self._given.task.collision is None:
            return None
        key = ("", 0) if steps is None else (steps[0].name, steps[1])
        if self._key != key:
            variant = self._given if steps is None else steps[0].applied(self._given, steps[1])
            robot, cells, task = variant
            if self._latest is not None:
                self._left = max(self._latest.left, 0)
            self._key = key
            self._latest = blockers_of(robot, cells, task, self._left)
        return self._latest


def configurations(exploration: Exploration) -> Array:
    """(N, n) a configuration of the best component over each cell; NaN where it has none."""
    roadmap = exploration.roadmap
    q = np.full((len(exploration.cells), exploration.robot.n), np.nan)
    # The first one over a cell is written last.
    for node in np.flatnonzero(roadmap.roots_of_nodes() == exploration.best)[::-1].tolist():
        q[roadmap.cell[node]] = roadmap.q[node]
    return q


def certifiable(arrays: SearchArrays) -> bool:
    """Could a motion be certified everywhere, if there were one?

    Not in a cone of 0 degrees, where the offset surface folds, or where the deviation bounds exceed
    the tolerance or the cone.
    """
    smooth = bool(np.isfinite(arrays.derivative_bounds).all())
    known = bool(within(arrays).all())
    return smooth and known and arrays.cone_chord > 0.0


def project_all(arrays: SearchArrays, work: Work, order: Ints, q: Array) -> int:
    """Project row q[k] (n,) onto the self-motion manifold over cell k, for the cells of `order`.

    Where collisions are checked, it is moved clear of them too.

    Returns:
        How many cells of `order` succeeded before the first failure; q (N, n) is changed in place.
    """
    if not len(arrays.collisions):
        return int(_project_all(arrays, work, order, q))
    for k, cell in enumerate(order.tolist()):
        projected = _project_all(arrays, work, order[k : k + 1], q) == 1
        if not projected or not moved_clear(arrays, work, cell, q[cell]):
            return k
    return len(order)


@entry
def _project_all(arrays, work, order, q):  # type: ignore[no-untyped-def]
    """See `project_all`; collisions are not looked at."""
    for k in range(order.shape[0]):
        row = q[order[k]]
        for j in range(row.shape[0]):
            row[j] = min(max(row[j], arrays.lower[j]), arrays.upper[j])
        if not project_onto_cell(arrays, work, order[k], row, NEARBY_STEPS):
            return k
    return order.shape[0]
