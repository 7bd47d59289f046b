"""`verify`: what somebody claims, judged without any search.

A motion that anybody made is replayed over the surface; a verdict's witness likewise; its proof is
checked cut by cut, and leaf by leaf. Nothing is believed of where they come from.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, overload

import numpy as np
from numpy.typing import ArrayLike

from coverable_arrays import Array, Ints, Mask
from coverable_errors import ArgumentError, CoverableError
from feasibility.certification import (
    MotionFault,
    replay_over_surface,
    verify_proof,
)
from feasibility.certification.rates import check_rates, replay_rates
from feasibility.collisions import said_of
from feasibility.cut_tree import CutTree
from feasibility.problem import Problem
from feasibility.results import Result
from feasibility.search import Search
from feasibility.task import Task
from feasibility.verdict import Answer, Certificate, Evidence, Verdict, Walk
from robots import Robot
from surfaces import Cells

AT_START = 1e-9  # [rad] or [m]: a first row this near to the start is at it


class NothingToVerifyError(CoverableError):
    """A verdict that holds neither a motion nor a proof: why."""


@dataclass(frozen=True, eq=False, slots=True)
class Verification:
    """What became of a claim."""

    claim: Literal["motion", "witness", "tree", "proof"]
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

    @property
    def holds(self) -> bool:
        """True where the claim is confirmed."""
        return not self.faults

    @property
    def refusal(self) -> str:
        """Why it does not hold, where and by how much; empty where it does."""
        return "; ".join(map(str, self.faults))

    def __repr__(self) -> str:
        """One line."""
        what = f"{len(self.cells)} cells by {self.robot.name}"
        said = f"{self.claim} {'holds' if self.holds else 'does not hold'}: {what}."
        checked = f"{said_of(self.robot, self.task.collision).capitalize()}."
        return " ".join(filter(None, [said, self.refusal, checked]))


@overload
def verify(claim: Robot, cells: Cells, task: Task, q: ArrayLike) -> Verification: ...


@overload
def verify(
    claim: Verdict | Result, *, tick: Callable[[], object] | None = None
) -> Verification: ...


def verify(
    claim: Robot | Verdict | Result,
    cells: Cells | None = None,
    task: Task | None = None,
    q: ArrayLike | None = None,
    *,
    tick: Callable[[], object] | None = None,
) -> Verification:
    """Does this motion cover the cells; does what this verdict says of them hold?

    `verify(robot, cells, task, q)` judges a motion q (m, n) that anybody made, straight in joint
    space between its rows (rad or m, unwrapped): at every instant the tool point is within the
    tolerance of the target over a place of the surface, the axis within the cone there, that place
    moves continuously, the joints are inside their limits; bodies stay clear where the task asks
    for it; and every cell is reached. `verify` of a verdict, or of a result that was loaded, judges
    its witness or its proof.

    Args:
        claim: the arm; or a verdict or result.
        cells: the surface, cut into E-cells.
        task: standoff, cone and tolerance.
        q: the motion.
        tick: of a proof, which may take long: called now and then; what it raises ends the check.

    Raises:
        TypeError: an argument is something else.
        ArgumentError: q holds no numbers.
        NothingToVerifyError: the verdict has neither a motion nor a proof.

    Example:
        >>> from feasibility import check
        >>> from robots import load_robot
        >>> from surfaces import plane
        >>> patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> robot, cells = load_robot("ur5"), patch.cells(3, 3)
        >>> task = Task(standoff=0.02, cone_deg=30)
        >>> verdict = check(robot, cells, task)
        >>> verify(robot, cells, task, verdict.witness.q).holds, verify(verdict).holds
        (True, True)
        >>> verify(robot, cells, task, verdict.witness.q[:4]).holds
        False
    """
    if isinstance(claim, Robot):
        problem = Problem.of(claim, cells, task)  # type: ignore[arg-type]  # refuses None
        return _of_motion("motion", problem, _rows(q))
    if cells is not None or task is not None or q is not None:
        raise TypeError("a verdict knows its robot, cells and task: give it alone")
    search = claim.case.search if isinstance(claim, Result) else None
    verdict = claim.verdict if isinstance(claim, Result) else claim
    if not isinstance(verdict, Verdict):
        raise TypeError(f"expected a Robot, a Verdict or a Result, got {verdict!r:.60}")
    return _of_verdict(verdict, search, tick)


def _rows(q: Any) -> Array:
    """A motion as an array.

    Raises:
        ArgumentError: it is none.
    """
    try:
        return np.array(q, dtype=float)
    except (TypeError, ValueError) as error:
        raise ArgumentError(f"q must be an array (m, n) of numbers, got {q!r:.60}") from error


def _of_motion(
    claim: Literal["motion", "witness"], problem: Problem, q: Any, marks: Ints | None = None
) -> Verification:
    """The replay of a motion over the surface."""
    robot, cells, task = problem.robot, problem.cells, problem.task
    found = replay_over_surface(robot, cells, task, q, bodies=problem.bodies, marks=marks)
    faults = (*found.faults, *_begun_elsewhere(robot, q))
    if found.accepted and len(cells):
        faults = (*faults, *_too_fast(problem, Walk(q, np.full(len(q), -1, dtype=np.int64))))
    return Verification(claim, robot, cells, task, faults, found.certificate, q, found.reached)


def _too_fast(problem: Problem, walk: Walk) -> tuple[MotionFault, ...]:
    """What is wrong with speeds and singular values, where the task limits them."""
    task = problem.task
    if not task.requires_rates:
        return ()
    check_rates(problem.robot, task)
    judged = replay_rates(problem.robot, problem.cells, task, walk)
    return tuple(MotionFault(-1, 0.0, text) for text in judged.refusals)


def _begun_elsewhere(robot: Robot, q: Any) -> tuple[MotionFault, ...]:
    """The fault of a motion that does not begin at the arm's start."""
    if robot.start is None or len(q) == 0 or np.shape(q[0]) != robot.start.shape:
        return ()
    off = float(np.abs(q[0] - robot.start).max())
    if off <= AT_START:
        return ()
    return (MotionFault(0, 0.0, f"it begins {off:.3g} rad or m off the start"),)


def _of_verdict(
    verdict: Verdict, search: Search | None, tick: Callable[[], object] | None
) -> Verification:
    """A verdict's witness, tree or proof."""
    robot, cells, task = verdict.robot, verdict.cells, verdict.task
    problem = Problem.of(robot, cells, task)
    if verdict.answer is Answer.FEASIBLE and len(cells) == 0:
        return _of_motion("witness", problem, np.empty((0, robot.n)))
    if verdict.answer is Answer.FEASIBLE and verdict.witness is not None:
        return _of_motion("witness", problem, verdict.witness.q, verdict.witness.cell)
    if verdict.answer is Answer.FEASIBLE and verdict.tree is not None and search is not None:
        from feasibility.paper import replay_stored

        found = replay_stored(verdict, search)
        faults = () if found.accepted else (MotionFault(-1, 0.0, found.refusal),)
        return Verification("tree", robot, cells, task, faults, found.certificate)
    if verdict.evidence is Evidence.PROOF and verdict.proof is not None:
        checked = verify_proof(robot, cells, task, verdict.proof, tick)
        faults = () if checked.accepted else (MotionFault(-1, 0.0, checked.refusal),)
        return Verification(
            "proof", robot, cells, task, faults, proof=verdict.proof, boxes=checked.boxes
        )
    raise NothingToVerifyError(_nothing(verdict))


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
