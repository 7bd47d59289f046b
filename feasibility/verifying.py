"""`verify`: what somebody claims, judged without any search.

A motion that anybody made is replayed over the surface, and all else that the case demands is
judged (`demands`); a verdict's witness likewise; its proof is checked cut by cut, and leaf by leaf.
Nothing is believed of where they come from.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints, Mask
from coverable.errors import ArgumentError, CoverableError
from feasibility.certification.bisection import runs
from feasibility.certification.cut_proofs.proof_verification import verify_proof
from feasibility.certification.faults import Judged, MotionFault
from feasibility.certification.motion_replay import replay_over_surface
from feasibility.certification.pose_replay import marks_in_order
from feasibility.clock import Clock, OutOfTime
from feasibility.collisions.asked_bodies import said_of
from feasibility.collisions.settings import Collision
from feasibility.cut_tree import CutTree
from feasibility.demands.every_demand import BY_REPLAY, NAMES, OF_TREE, further, unjudged
from feasibility.problem import Problem
from feasibility.results.result_file import Result
from feasibility.search_settings import Search
from feasibility.task import Task
from feasibility.verdict import Answer, Certificate, Evidence, Verdict, Walk
from robots.robot import Robot
from surfaces.cells import Cells

if TYPE_CHECKING:
    from feasibility.demands.area import TreatedArea

NOT_IN_TIME = (
    "not verified in time: the limit of {:g} s ran out; --set search.time_limit=... gives more time"
)


Claim = Literal["motion", "witness", "tree", "proof"]


class NothingToVerifyError(CoverableError):
    """A verdict that holds neither a motion nor a proof: why."""


@dataclass(frozen=True, eq=False, slots=True)
class Verification(Judged):
    """What became of a claim."""

    claim: Claim
    """A motion that anybody made; a verdict's own; the tree of the paper's search, which holds by
    the paper's definitions; or a cut tree."""
    robot: Robot
    cells: Cells
    task: Task
    faults: tuple[MotionFault, ...]
    """Why it does not hold; none where it does."""
    certificate: Certificate | None = None
    """Of a motion: bounds over all of it where it holds, else what was measured."""
    q: Array | None = None
    """(m, n) its rows, rad or m."""
    reached: Mask | None = None
    """(N,) cells that a motion reaches."""
    proof: CutTree | None = None
    boxes: int = 0
    """Of a proof: how many boxes of joints and surface, or of tilt and roll, were looked at."""
    treated: TreatedArea | None = None
    """Of a motion that holds otherwise: what it treats, where the case requires a coverage."""
    not_judged: tuple[str, ...] = ()
    """What the case demands that was not looked at: of a motion that is refused for something else,
    of a tree what the paper's search knows nothing of, and of a proof what it does not need, for
    what no motion does with less demanded, none does with more. A motion, witness or tree that
    holds was judged in everything."""
    late: bool = False
    """Did the time run out before there was an answer? Then it does not hold."""

    holds = Judged.accepted
    """True where the claim is confirmed."""

    @property
    def collision(self) -> Collision | None:
        """What bodies were judged to stay clear of; None where that was not looked at."""
        return None if "collisions" in self.not_judged else self.task.collision

    def __repr__(self) -> str:
        """One line."""
        what = f"{len(self.cells)} cells by {self.robot.name}"
        said = f"{self.claim} {'holds' if self.holds else 'does not hold'}: {what}."
        checked = f"{said_of(self.robot, self.collision).capitalize()}."
        return " ".join(filter(None, [said, self.refusal, checked]))


Made = Callable[..., Verification]
"""Of the faults, and what else is known."""


def verify(
    claim: Robot | Verdict | Result,
    cells: Cells | None = None,
    task: Task | None = None,
    q: ArrayLike | None = None,
    *,
    working: ArrayLike | None = None,
    marks: ArrayLike | None = None,
    clock: Clock | None = None,
) -> Verification:
    """Does this motion cover the cells; does what this verdict says of them hold?

    `verify(robot, cells, task, q)` judges a motion q (m, n) that anybody made, straight in joint
    space between its rows (rad or m, unwrapped): at every instant the tool point is within the
    tolerance of the target over a place of the surface, the axis within the cone there, that place
    moves continuously, the joints are inside their limits; every cell is reached; and all else that
    is demanded holds: bodies stay clear, it begins at the arm's start, it keeps the speed and its
    distance from singularities, it treats enough of the area. `verify` of a verdict, or of a result
    that was loaded, judges its witness or its proof.

    Args:
        claim: the arm; or a verdict or result.
        cells: the surface, cut into E-cells.
        task: standoff, cone and tolerance.
        q: the motion.
        working: (m,) true in rows at which the tool works. Between two of them it has to be right
            over the surface; elsewhere, lifted or beyond the border, it may be anywhere but through
            the surface, and reaches no cell. Of passes those places have to be reached at
            which it works. True everywhere by default.
        marks: (m,) the cell whose target each row is at, -1 for none, as a `Walk` and a trajectory
            have it: where to look first, of a toolpath that crosses itself or turns sharply. They
            are not believed, and what does not hold by them may hold without.
        clock: its limit counts, and it reports progress; running out is no "holds". Of a motion,
            and of the first steps of a proof, the limit is kept in commands alone.

    Raises:
        TypeError: an argument is something else.
        ArgumentError: q holds no numbers, or `working` or `marks` do not fit to it.
        NothingToVerifyError: the verdict has neither a motion nor a proof.

    Example:
        >>> from coverable import check
        >>> from coverable import load_robot
        >>> from coverable import plane
        >>> patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> robot, cells = load_robot("ur5"), patch.cells(3, 3)
        >>> task = Task(standoff=0.02, cone_deg=30)
        >>> verdict = check(robot, cells, task)
        >>> verify(robot, cells, task, verdict.witness.q).holds, verify(verdict).holds
        (True, True)
        >>> verify(robot, cells, task, verdict.witness.q[:4]).holds
        False
    """
    clock = Clock() if clock is None else clock
    if isinstance(claim, Robot):
        problem = Problem.of(claim, cells, task)  # pyrefly: ignore[bad-argument-type]  # refuses None
        rows = _rows(q)
        at_work = None if working is None else _one_a_row("working", working, rows, "b")
        said = None if marks is None else _one_a_row("marks", marks, rows, "i")
        judged = partial(_of_motion, problem, rows, said, at_work)
        return _in_time("motion", problem, judged, clock)
    if any(given is not None for given in (cells, task, q, working, marks)):
        raise TypeError("a verdict knows its robot, cells and task: give it alone")
    search = claim.case.search if isinstance(claim, Result) else None
    verdict = claim.verdict if isinstance(claim, Result) else claim
    if not isinstance(verdict, Verdict):
        raise TypeError(f"expected a Robot, a Verdict or a Result, got {verdict!r:.60}")
    return _of_verdict(verdict, search, clock)


def _rows(q: Any) -> Array:
    """A motion as an array.

    Raises:
        ArgumentError: it is none.
    """
    try:
        return np.array(q, dtype=float)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f"q must be an array (m, n) of numbers, got {q!r:.60}") from error


def _one_a_row(name: str, values: ArrayLike, rows: Array, kind: Literal["b", "i"]) -> Any:
    """True and false, or whole numbers, for each row of a motion.

    Raises:
        ArgumentError: they are something else.
    """
    found = np.asarray(values)
    if found.dtype.kind != kind or found.shape != rows.shape[:1]:
        what = {"b": "true and false", "i": "whole numbers"}[kind]
        given = f"got {found.dtype} of shape {found.shape}"
        raise ArgumentError(f"{name} must be an array ({len(rows)},) of {what}, {given}")
    return found


def _in_time(
    claim: Claim, problem: Problem, judged: Callable[[Made], Verification], clock: Clock
) -> Verification:
    """What became of a claim within the limit; a claim that could not be judged does not hold."""
    made = partial(Verification, claim, problem.robot, problem.cells, problem.task)
    try:
        with clock.start().enforced():
            return judged(made)
    except OutOfTime:
        late = MotionFault(NOT_IN_TIME.format(clock.limit))
        left = unjudged(problem.robot, problem.task, ())
        return made((late,), not_judged=left, late=True)


def _of_motion(
    problem: Problem, q: Any, marks: Ints | None, working: Mask | None, made: Made
) -> Verification:
    """The replay of a motion over the surface, and the other demands' judges."""
    robot, cells, task = problem.robot, problem.cells, problem.task
    if marks is not None:
        marks = np.where((marks >= 0) & (marks < len(cells)), marks, -1)
    judge = partial(
        replay_over_surface, robot, cells, task, q, bodies=problem.bodies, working=working
    )
    found = judge(marks=marks)
    malformed = math.isnan(found.certificate.min_limit_margin)
    if not (found.accepted or malformed or working is not None):
        # Where a toolpath crosses itself, or turns sharply, places to try first decide.
        guess = marks_in_order(robot, cells, task, q) if marks is None else None
        other = found if guess is marks else judge(marks=guess)
        found = other if other.accepted else found
    made = partial(made, certificate=found.certificate, q=q, reached=found.reached)
    if not found.accepted:
        judged = () if malformed else BY_REPLAY
        return made(found.faults, not_judged=unjudged(robot, task, judged))
    if not len(cells):
        return made(())
    # How fast the tool is, and what it treats, counts where it works.
    whole = further(robot, cells, task, [_unmarked(q)], judged=set(NAMES) - {"start"})
    parts = [slice(None)] if working is None else runs(working)
    at_work = further(robot, cells, task, [_unmarked(q[part]) for part in parts], judged=("start",))
    return made((*whole.faults, *at_work.faults), treated=at_work.treated)


def _unmarked(q: Array) -> Walk:
    """A motion that does not say where it is."""
    return Walk(q, np.full(len(q), -1, dtype=np.int64))


def _of_verdict(verdict: Verdict, search: Search | None, clock: Clock) -> Verification:
    """A verdict's witness, tree or proof."""
    robot, cells, task, walk = verdict.robot, verdict.cells, verdict.task, verdict.witness
    if not len(cells):
        walk = _unmarked(np.empty((0, robot.n)))
    claim: Claim = "witness"
    problem = Problem.of(robot, cells, task)
    greedy = search if search is not None and search.method == "greedy" else None
    judged: Callable[[Made], Verification]
    if verdict.feasible and walk is not None:
        judged = partial(_of_motion, problem, walk.q, walk.cell, None)
    elif verdict.feasible and verdict.tree is not None and greedy is not None:
        claim, judged = "tree", partial(_of_tree, verdict, greedy)
    elif verdict.answer is Answer.INFEASIBLE and verdict.proof is not None:
        claim, judged = "proof", partial(_of_proof, problem, verdict.proof, clock)
    else:
        raise NothingToVerifyError(_nothing(verdict))
    return _in_time(claim, problem, judged, clock)


def _of_tree(verdict: Verdict, search: Search, made: Made) -> Verification:
    """The tree of the paper's search, by the paper's definitions, which know not every demand."""
    from feasibility.paper.tree_replay import replay_stored

    found = replay_stored(verdict, search)
    left = unjudged(verdict.robot, verdict.task, OF_TREE)
    faults = [found.refusal] if found.faults else []
    if left:
        faults.append(f"{', '.join(left)}: not judged, since the greedy search knows nothing of it")
    return made(tuple(map(MotionFault, faults)), found.certificate, not_judged=left)


def _of_proof(problem: Problem, proof: CutTree, clock: Clock, made: Made) -> Verification:
    """The proof that no motion covers every cell."""
    robot, cells, task = problem.robot, problem.cells, problem.task
    checked = verify_proof(robot, cells, task, proof, lambda: clock.tick(0, None, "verifying"))
    left, faults = unjudged(robot, task, BY_REPLAY), tuple(map(MotionFault, checked.faults))
    return made(faults, proof=proof, boxes=checked.boxes, not_judged=left)


def _nothing(verdict: Verdict) -> str:
    """Why there is nothing to verify."""
    said = f"nothing to verify: the answer is {verdict.answer} with evidence {verdict.evidence}"
    if verdict.evidence is Evidence.PROOF:
        return f"{said}, but its proof was not kept; run the check again"
    if verdict.answer is Answer.FEASIBLE and verdict.method == "greedy":
        return f"{said}: a tree of the greedy search is verified from its result file"
    if verdict.answer is Answer.FEASIBLE:
        return f"{said}, but no motion is stored; run the check again"
    return (
        f"{said}: a search that ended without a motion, and no proof that there is none; only a "
        "witness or a proof can be verified without searching"
    )
