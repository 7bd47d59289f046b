"""`check`: search for a covering motion, have it replayed, and make the verdict."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from coverable.errors import ArgumentError
from feasibility.attempts import Method, attempts_at
from feasibility.certification.faults import Replay
from feasibility.clock import Clock, OutOfTime
from feasibility.demands.every_demand import OF_TREE, RATES, check_requirements, further, unjudged
from feasibility.problem import Problem
from feasibility.search_settings import Progress, Search
from feasibility.task import Task
from feasibility.verdict import Answer, Cause, Decision, Evidence, Verdict, Walk, deferred
from robots.robot import Robot
from surfaces.cells import Cells

if TYPE_CHECKING:
    from feasibility.collisions.settings import Collision
    from feasibility.demands.area import TreatedArea
    from feasibility.search_result import SearchResult

NO_CELLS = "There are no cells, so there is nothing to cover; the arm was not looked at."


def check(
    robot: Robot,
    cells: Cells,
    task: Task,
    search: Search | None = None,
    progress: Progress | None = None,
    seeds: Walk | None = None,
    clock: Clock | None = None,
    collision: Collision | None = None,
) -> Verdict:
    """Can this arm move its tool over all of these cells in one continuous motion?

    Args:
        robot: the arm, with its limits.
        cells: the surface, cut into E-cells.
        task: standoff, cone and tolerance.
        search: method and settings; the complete search by default.
        progress: called as progress(done, total, text) some times a second: cells covered by the
            best motion so far, all cells, and what is going on. What it raises ends the search.
        seeds: a motion over these cells, or over those of a case nearby, that the complete search
            begins from: the `witness` of another verdict, say. Its marks of cells may be missing.
        clock: of the command that this is a part of: its limit and its progress callback count, not
            those given here.
        collision: what the arm has to stay clear of, in place of `task.collision`; where neither is
            given, collisions are not checked.

    Returns:
        The verdict. An infeasible surface is a result, not an error. The first call on a machine
        compiles the kernels, which takes a while and says so on stderr.

    Raises:
        TypeError: an argument is something else, such as a surface that is not cut into cells.
        RobotError: the arm is no serial chain of one-dof joints.
        SurfaceError: the greedy search needs a surface, which poses have not.
        ArgumentError: the arm's start is not on the motion set; there is a footprint, but no
            surface; the seeds fit neither arm nor cells; seeds, collisions or cells with approaches
            of their own are given to the greedy search; a pair names something that is not there;
            or the surface has no reference direction for the roll.

    Example:
        >>> from coverable import load_robot
        >>> from coverable import plane
        >>> patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> verdict = check(load_robot("ur5"), patch.cells(3, 3), Task(standoff=0.02, cone_deg=30))
        >>> verdict.feasible, verdict.n_covered
        (True, 9)
    """
    search = Search() if search is None else search
    settings = (search, "search", Search, "a Search, such as Search(seed=1)")
    if collision is not None and isinstance(task, Task):
        task = replace(task, collision=collision)
    problem = Problem.of(robot, cells, task, settings)
    check_requirements(robot, task, search)
    method: Method
    if search.method == "greedy":
        if seeds is not None:
            raise ArgumentError("seeds are for the complete search; the greedy one has a start")
        from feasibility.paper.greedy import greedy_search

        method = partial(greedy_search, start=robot.start)
    else:
        from feasibility.roadmap.complete import complete_search

        method = partial(complete_search, seeds=seeds)
    clock = Clock(search.time_limit, progress) if clock is None else clock
    verdict = _decided(problem, search, clock.allow(search.evaluations), method)
    return _all_judged(_measured(_at_rates(verdict, clock), clock))


def _all_judged(verdict: Verdict) -> Verdict:
    """The verdict; undecided where its motion does not hold, or nobody judged, what is demanded."""
    if not verdict.feasible or not len(verdict.cells):
        return verdict
    robot, cells, task = verdict.robot, verdict.cells, verdict.task
    if verdict.witness is None:
        left = unjudged(robot, task, OF_TREE)
        refusal = f"not judged of it: {', '.join(left)}" if left else ""
    else:
        refusal = further(robot, cells, task, [verdict.witness], (*RATES, "coverage")).refusal
    if not refusal:
        return verdict
    return replace(
        verdict, answer=Answer.UNDECIDED, evidence=Evidence.BUDGET, witness=None, certificate=None,
        message=f"{verdict.message} But {refusal}.",
    )  # fmt: skip


def _at_rates(verdict: Verdict, clock: Clock) -> Verdict:
    """The verdict at the speed, and as far from singularities, as the task asks."""
    if not verdict.task.requires_rates:
        return verdict
    from feasibility.demands.fast_motions import at_rates

    began = time.monotonic()
    found = at_rates(verdict, clock)
    if found is verdict:
        return verdict
    took = time.monotonic() - began
    spent = {key: verdict.timing[key] + took for key in ("certify_s", "total_s")}
    return replace(found, timing={**verdict.timing, **spent})


def greedy_check(
    robot: Robot,
    cells: Cells,
    task: Task,
    search: Search | None = None,
    progress: Progress | None = None,
    start: ArrayLike | None = None,
) -> Verdict:
    """The verdict of the paper's search, from one start configuration if one is given.

    Args:
        robot, cells, task: see `check`.
        search: step, moves, starts, cap and seed.
        progress: called as progress(cells touched by the running tree, cells, text).
        start: (n,) the start configuration over one of the cells, rad or m; without it, `check`.

    Raises:
        ArgumentError: `start` is not a feasible configuration over one of the cells; or the task
            demands what only the complete search knows.
    """
    from feasibility.paper.greedy import greedy_search

    search = Search(method="greedy") if search is None else search
    problem = Problem.of(robot, cells, task)
    check_requirements(robot, task, search)
    clock = Clock(search.time_limit, progress)
    method = partial(greedy_search, start=robot.start if start is None else start)
    return _all_judged(_measured(_decided(problem, search, clock, method), clock))


def _decided(problem: Problem, search: Search, clock: Clock, method: Method) -> Verdict:
    """Search, certify, and make the verdict."""
    called = time.monotonic()
    tried, remark = attempts_at(problem, search, clock, method)
    problem, found, replayed = tried[0].problem, tried[0].found, tried[0].replayed
    bodies = problem.bodies
    answer, evidence, message = _answer(problem, found, replayed)
    feasible = answer is Answer.FEASIBLE
    return Verdict(
        answer=answer,
        evidence=evidence,
        message=message + remark,
        robot=problem.robot,
        cells=problem.cells,
        task=problem.task,
        method=search.method,
        seed=search.seed,
        graph=deferred(found.make_graph),
        covered=found.covered,
        causes=deferred(lambda: _causes(found, clock)),
        components=found.components,
        postures=found.postures,
        tree=deferred(found.make_tree),
        start=found.start,
        witness=found.motion if feasible else None,
        certificate=replayed.certificate if feasible and replayed is not None else None,
        proof=found.proof if evidence is Evidence.PROOF else None,
        timing={
            "load_s": float(np.fmax(clock.loaded, called)) - called,
            "search_s": sum(one.search_s for one in tried),
            "certify_s": sum(one.certify_s for one in tried),
            "total_s": time.monotonic() - called,
        },
        n_edges=found.n_edges,
        unchecked_links=() if bodies is None else bodies.unchecked,
        pairs_left_out=() if bodies is None else bodies.left_out,
        statistics={**found.counts, "fk": sum(one.found.counts["fk"] for one in tried)},
    )


def _causes(found: SearchResult, clock: Clock) -> tuple[Cause, ...]:
    """Why cells are missed; nothing where the time ran out before that was looked into."""
    try:
        with clock.enforced():
            return found.make_causes()
    except OutOfTime:
        return ()


def _measured(verdict: Verdict, clock: Clock) -> Verdict:
    """The verdict with what its motion treats, which may be too little for its coverage."""
    task = verdict.task
    if not verdict.feasible or task.footprint is None:
        return verdict
    if task.coverage is None:
        return replace(verdict, treated=deferred(lambda: _treated(verdict, clock)))
    treated = _treated(verdict, clock)
    from feasibility.demands.treated_words import with_coverage

    said = Decision(verdict.answer, verdict.evidence, verdict.message)
    decision = with_coverage(said, task, treated)
    kept: dict[str, Any] = {"treated": treated, **decision._asdict()}
    if decision.answer is not Answer.FEASIBLE:
        kept |= {"witness": None, "certificate": None}
    return replace(verdict, **kept)


def _treated(verdict: Verdict, clock: Clock) -> TreatedArea | None:
    """What the motion treats; None where there is no motion, or no time to measure it."""
    from feasibility.demands.area import treated_by_walk

    if verdict.witness is None:
        return None
    try:
        with clock.enforced():
            return treated_by_walk(verdict.robot, verdict.cells, verdict.task, verdict.witness)
    except OutOfTime:
        return None


def _answer(problem: Problem, found: SearchResult, replayed: Replay | None) -> Decision:
    """Answer, evidence, and the sentences that say what was done."""
    if len(problem.cells) == 0:
        return Decision(Answer.FEASIBLE, Evidence.WITNESS, NO_CELLS)
    if replayed is not None and replayed.accepted:
        waypoints = str(replayed.certificate.waypoints)
        message = found.accepted.replace("{waypoints}", waypoints)
        return Decision(Answer.FEASIBLE, Evidence.WITNESS, message)
    if replayed is not None:
        message = found.refused.replace("{refusal}", replayed.refusal)
        return Decision(Answer.UNDECIDED, Evidence.BUDGET, message)
    if found.proof is not None:
        return Decision(Answer.INFEASIBLE, Evidence.PROOF, found.proved)
    if found.unfinished:
        return Decision(Answer.UNDECIDED, Evidence.BUDGET, found.unfinished)
    return Decision(Answer.INFEASIBLE, Evidence.EXHAUSTED, found.exhausted)
