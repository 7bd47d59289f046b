"""Searches and proofs that cost less than a verdict, made again and again by `explain`.

- `follow`: do configurations from a case nearby still project onto every cell's self-motion
  manifold? (A few evaluations a cell; a hint, not an answer.)
- `rule`: is one cell proved uncoverable, or what covers it?
- `attempt`: a search that starts from known configurations and stops at a number of evaluations.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from coverable_arrays import Array, Ints, Mask
from feasibility.certification import replay
from feasibility.clock import Clock, OutOfTime
from feasibility.roadmap import (
    Ruling,
    SearchArrays,
    arrays_of,
    close,
    collisions_of,
    covering_walk,
    evenly,
    explore,
    project_onto_cell,
    root_box,
    rule,
    work_for,
    wound,
)
from feasibility.roadmap.forward import run_in_order
from feasibility.sensitivity.limited_search import (
    NO_CELL,
    CollisionProofs,
    LimitedAttempt,
    LimitedExploration,
    Steps,
    certifiable,
    configurations,
    held,
    project_all,
)
from feasibility.sensitivity.quantities import OF_COLLISIONS, Kind, Quantity, Variant
from feasibility.verdict import Answer, Evidence

MORE_SEEDS = 2  # missed cells that an attempt starts from, besides the first
MOST_SUSPECTS = 12  # cells that are taken for hard
AGAIN = 2.0  # times what spreading from the first seed took: all that a short attempt may take
GUESSES = 16  # random configurations that are projected onto a cell that no known one covers
GUESS_STEPS = np.int64(20)  # Newton steps of each
KEPT = 2_000_000  # numbers in arrays of values nearby, which are needed again and again
LEAST_BOXES = 120  # for one cell, however expensive proofs have been


class Prober:
    """Searches one case and those nearby, and counts what that costs."""

    def __init__(
        self, variant: Variant, seed: int, clock: Clock, tick: Callable[[], None] | None = None
    ) -> None:
        """Prepare the case as given; `tick` is called before each piece of work."""
        self.given = variant
        self.seed = seed
        self.clock = clock
        self.arrays = arrays_of(*variant)
        self._made = dict[tuple[str, int], SearchArrays]()
        self._collisions = CollisionProofs(variant)
        beyond = replace(variant.task, standoff=variant.task.standoff + 1.0)
        self.outwards = beyond.targets(variant.cells).points - self.arrays.points
        """(N, 3) how the target points move with the standoff."""
        self.work = work_for(variant.robot.n)
        self.spent_before = 0
        self.tick = tick or (lambda: None)
        self.reach = variant.robot.reach
        self.suspects: list[int] = []
        """Cells that were hard to cover so far, the latest first."""
        degree = np.diff(variant.cells.neighbours.indptr)
        inner = degree >= np.median(degree)
        self._spread = np.concatenate(
            [evenly(np.flatnonzero(~inner)), evenly(np.flatnonzero(inner))]
        )
        self.allowance = 0.5
        """Share of the boxes requested that a proof gets: less for each that failed lately."""

    @property
    def spent(self) -> int:
        """Evaluations of the arm so far; a box of a proof counts as one."""
        return self.spent_before + int(self.work.counts[0])

    def arrays_at(self, quantity: Quantity, k: int) -> SearchArrays:
        """The arrays with a quantity k steps from the value given, without making it anew."""
        if quantity.kind in (Kind.CONE, Kind.STANDOFF) or self._changes_much(quantity):
            return self._made_anew(quantity, k)
        arrays = self.centres_at(quantity, k)
        if quantity.kind is Kind.SHIFT:
            targets = self.arrays.targets.copy()
            targets[:, 0, :3] += quantity.value(k) * np.array(quantity.axis)  # the constant ones
            # Arrays that may be written to are of another type, for which kernels compile anew.
            targets.flags.writeable = self.arrays.targets.flags.writeable
            return arrays._replace(targets=targets)
        return arrays

    def _changes_much(self, quantity: Quantity) -> bool:
        """Does a quantity change how the tool is held, or what the arm has to stay clear of?"""
        if quantity.kind in (Kind.ROLL, Kind.TILT):
            return True
        shifted = quantity.kind is Kind.SHIFT and self.given.task.collision is not None
        return shifted or quantity.kind in OF_COLLISIONS

    def _made_anew(self, quantity: Quantity, k: int) -> SearchArrays:
        """All arrays with a quantity k steps from the value given; the latest are kept."""
        made = self._made
        if (quantity.name, k) not in made:
            variant = quantity.applied(self.given, k)
            if quantity.kind in OF_COLLISIONS:  # nothing else changes
                robot, cells, task = variant
                other = collisions_of(robot, cells.surface, task)
                arrays = self.arrays._replace(collisions=other)
            else:
                arrays = arrays_of(*variant)
            most = KEPT // (arrays.collisions.size + arrays.targets.size + 1)
            while made and len(made) >= most:
                del made[next(iter(made))]
            made[quantity.name, k] = arrays
        return made[quantity.name, k]

    def centres_at(self, quantity: Quantity, k: int) -> SearchArrays:
        """The same over the cells' centres, cheaper: what lies between them may be unchanged."""
        value = quantity.value(k) if k else quantity.given
        if quantity.kind is Kind.CONE:
            former, chord = self.arrays, float(2.0 * np.sin(0.5 * value))
            if not (value < np.pi and 0.0 < former.cone_chord < np.inf):
                return self.arrays_at(quantity, k)
            lost = former.cone_chord - former.inner_cone_chord
            inner = chord - lost * min(1.0, chord / former.cone_chord)
            return former._replace(cone_chord=chord, inner_cone_chord=inner)
        if quantity.kind is Kind.STANDOFF:
            grown = (value - quantity.given) * self.outwards
            return self.arrays._replace(points=self.arrays.points + grown)
        if self._changes_much(quantity):
            return self._made_anew(quantity, k)
        if quantity.kind is Kind.SHIFT:
            shift = value * np.array(quantity.axis)
            return self.arrays._replace(points=self.arrays.points + shift)
        ends = [self.arrays.lower.copy(), self.arrays.upper.copy()]
        ends[quantity.kind is Kind.UPPER][quantity.joint] = value
        return self.arrays._replace(lower=ends[0], upper=ends[1])

    def order(self) -> Ints:
        """(N,) all cells, the hard ones first, then those at the boundary of the surface."""
        hard = np.array(self.suspects, dtype=np.int64)
        rest = self._spread[~np.isin(self._spread, hard)]
        return np.concatenate([hard, rest])

    def suspect(self, cell: int) -> None:
        """Try this cell first from now on."""
        if cell in self.suspects:
            self.suspects.remove(cell)
        self.suspects.insert(0, cell)
        del self.suspects[MOST_SUSPECTS:]

    def follow(self, arrays: SearchArrays, q: Array) -> tuple[int, Array]:
        """Project configurations q (N, n) of a case nearby onto the manifolds of this one.

        Returns:
            The first cell where that failed, or `NO_CELL`; and the configurations (N, n), which
            are over their cells as far as the failure.
        """
        self.tick()
        found = q.copy()
        order = self.order()
        projected = int(project_all(arrays, self.work, order, found))
        if projected == len(order):
            return NO_CELL, found
        self.suspect(int(order[projected]))
        return int(order[projected]), found

    def rule(
        self, arrays: SearchArrays, cell: int, boxes: int, at: Steps | None = None
    ) -> tuple[Ruling, Array | None]:
        """The reach bound on one cell, then branch and bound with so many boxes, or fewer.

        Where the tool collides over the cell in every pose, the arm does not matter; where the arm
        can be there, but no configuration was found to be clear, its collisions are looked into.

        Args:
            arrays: see `arrays_at`.
            cell: the cell.
            boxes: of branch and bound.
            at: the quantity and the steps that the arrays are for; None for the case as given.

        Returns:
            The ruling; and, unless it is PROVED or OPEN, a configuration (n,) on the cell's
            manifold, None where Newton's steps end elsewhere.
        """
        self.tick()
        if self.beyond_reach(arrays)[cell]:
            self.suspect(cell)
            return Ruling.PROVED, None
        blockers = self._collisions.at(at)
        if blockers is not None and blockers.tool_collides(arrays, cell):
            self.suspect(cell)
            return Ruling.PROVED, None
        boxes = max(int(self.allowance * boxes), min(boxes, LEAST_BOXES))
        ruling, q = rule(arrays, self.work, cell, root_box(arrays), boxes)
        if ruling is Ruling.OPEN:
            self.allowance *= 0.5  # until a proof of this arm succeeds
            return ruling, None
        if ruling is Ruling.PROVED:
            self.allowance = 1.0
            self.suspect(cell)
            return ruling, None
        if not np.isfinite(q).all():
            return ruling, None
        row = np.full((len(arrays.points), len(q)), np.nan)
        row[cell] = wound(arrays, q)
        projected = int(project_all(arrays, self.work, np.array([cell]), row)) == 1
        if projected or blockers is None:
            return ruling, row[cell] if projected else None
        blocked = blockers.arm_collides(arrays, self.work, cell, self.tick)
        return Ruling.PROVED if blocked else ruling, None

    def beyond_reach(self, arrays: SearchArrays) -> Mask:
        """(N,) cells that are further away than the arm reaches.

        Revolute joints reach alike in any limits; a prismatic joint that is longer than in the case
        as given is not ruled out here.
        """
        slides = self.given.robot.prismatic
        longer = (arrays.lower < self.arrays.lower) | (arrays.upper > self.arrays.upper)
        if (slides & longer).any():
            return np.zeros(len(arrays.points), dtype=bool)
        distance = self.given.robot.distance_from_base(arrays.points)
        return distance > self.reach + arrays.tolerance

    def attempt(
        self,
        arrays: SearchArrays,
        seeds: Array,
        most: float,
        deep: bool,
        needed: Mask | None = None,
        hard: int = NO_CELL,
    ) -> LimitedAttempt:
        """Search for a covering motion, from known configurations first.

        Args:
            arrays: see `arrays_at`.
            seeds: (N, n) configurations to start from, one for each cell; NaN where there is none.
            most: evaluations of the arm after which the search is stopped.
            deep: go on with the full search where the seeds do not lead to a covering motion.
            needed: (N,) cells that are to be covered; all by default.
            hard: a cell that random configurations are tried at before the full search begins.

        Returns:
            Feasible with a motion that is still to be `confirmed`; infeasible where the full search
            ended in time; undecided otherwise.
        """
        self.tick()
        robot, cells, _ = self.given
        robot = robot.with_limits(np.column_stack([arrays.lower, arrays.upper]))
        needed = np.ones(len(cells), dtype=bool) if needed is None else needed
        clock = self.clock.part(1.0, lambda *_: self.tick())
        exploration = LimitedExploration(robot, cells, arrays, self.seed, clock, most=most)
        ended, run = False, None
        try:
            self._add_seeds(exploration, seeds, deep)
            if hard != NO_CELL and not exploration.complete:
                self._project(exploration, hard)
            if deep and not exploration.complete:
                explore(exploration)
                ended = True
            if cells.in_order and needed.all() and exploration.complete:
                close(exploration)
                run = run_in_order(exploration)
        except OutOfTime:
            pass
        finally:
            self.spent_before += int(exploration.work.counts[0])
        q = configurations(exploration)
        walk = None if run is None else run.walk
        if not cells.in_order and needed.any() and exploration.covered[needed].all():
            walk = covering_walk(exploration.roadmap, exploration.best)
        if walk is not None:
            detail = f"one motion of {len(walk.q)} waypoints"
            return LimitedAttempt(Answer.FEASIBLE, Evidence.WITNESS, detail, q, walk)
        proved = [k for k, ruling in exploration.rulings.items() if ruling is Ruling.PROVED]
        if proved:
            self.suspect(proved[0])
            detail = f"cell {list(cells.unravel(proved[0]))} is proved uncoverable"
            return LimitedAttempt(Answer.INFEASIBLE, Evidence.PROOF, detail, q, None)
        best = f"the best motion covers {int(exploration.covered.sum())} of {len(cells)} cells"
        if run is not None:
            best = f"the best run in order ends over pose {run.furthest}"
        if ended and certifiable(arrays):
            detail = f"the search ended without a covering motion; {best}"
            return LimitedAttempt(Answer.INFEASIBLE, Evidence.EXHAUSTED, detail, q, None)
        detail = f"not found with {int(exploration.work.counts[0])} evaluations of the arm; {best}"
        if self.clock.out_of_time:
            detail = "unknown, because the time limit ran out"
        return LimitedAttempt(Answer.UNDECIDED, Evidence.BUDGET, detail, q, None)

    def confirmed(
        self, variant: Variant, attempt: LimitedAttempt, needed: Mask | None = None
    ) -> LimitedAttempt:
        """An attempt once its motion is judged: still feasible, or undecided if refused."""
        if attempt.walk is None or attempt.angle is not None:
            return attempt
        self.tick()
        whole = needed is None
        needed = np.ones(len(variant.cells), dtype=bool) if needed is None else needed
        replayed = replay(*variant, attempt.walk, needed)
        if not replayed.accepted:
            detail = f"a motion was found, but the replay refuses it: {replayed.refusal}"
            return LimitedAttempt(Answer.UNDECIDED, Evidence.BUDGET, detail, attempt.q, None)
        detail, angle = f"{attempt.detail}, replayed", replayed.certificate.max_angle
        return held(variant, replace(attempt, detail=detail, angle=angle), whole=whole)

    def _add_seeds(self, exploration: LimitedExploration, seeds: Array, deep: bool) -> None:
        """Add seeds until one component covers every cell, hard cells first."""
        known = np.asarray(np.isfinite(seeds).all(axis=1))
        first = [cell for cell in self.suspects if known[cell]][:1]
        for cell in first or np.flatnonzero(known)[:1].tolist():
            exploration.add_seeds(cell, np.clip(seeds[[cell]], exploration.low, exploration.high))
        if not deep:
            exploration.most = min(exploration.most, AGAIN * float(exploration.work.counts[0]))
        for _ in range(MORE_SEEDS):
            missed = np.flatnonzero(known & ~exploration.covered)
            if exploration.complete or not len(missed):
                return
            cell = int(missed[len(missed) // 2])
            known[cell] = False
            exploration.add_seeds(cell, seeds[[cell]])

    def _project(self, exploration: LimitedExploration, cell: int) -> None:
        """Add as seeds the random configurations that project onto one cell, the hardest.

        Where none does, little hope is left: half of the evaluations will do.
        """
        guesses = exploration.guesses(GUESSES)
        case = exploration.arrays, exploration.work, cell
        projected = [project_onto_cell(*case, guess, GUESS_STEPS) for guess in guesses]
        if any(projected):
            exploration.add_seeds(cell, guesses[projected])
        elif not exploration.roadmap.over[cell]:
            exploration.most = 0.5 * (exploration.most + float(exploration.work.counts[0]))
