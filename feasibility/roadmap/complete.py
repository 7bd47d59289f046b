"""The complete search as a method of `check`: explore, close graph G, and say what was found."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from coverable.errors import ArgumentError, Checks, Fault
from feasibility.clock import Clock, OutOfTime
from feasibility.collisions.kernels.clearance import blamed, segment_clear
from feasibility.found import Found
from feasibility.notices import REASONS, compiling_notice
from feasibility.problem import Problem
from feasibility.roadmap.exploration import Exploration, wound
from feasibility.roadmap.search import close, exploration_of, seed_middle
from feasibility.roadmap.walk import covering_walk
from feasibility.roadmap.warmup import warm_up
from feasibility.search_settings import Search
from feasibility.verdict import Cause, Replay, Walk
from robots.kinematics import Kinematics

if TYPE_CHECKING:
    import networkx as nx

    from feasibility.collisions.problem_bodies import Bodies
    from feasibility.roadmap.forward.ordered_run import OrderedRun
    from feasibility.roadmap.proving import Proving

IN_PLACE = 0.1  # [1] share of the tolerance within which a tool point stays over a pose


def complete_search(
    problem: Problem,
    search: Search,
    clock: Clock,
    seeds: Walk | None = None,
    suspects: Collection[int] = (),
    judging: bool = True,
) -> Found:
    """Search until one component of the roadmap covers every cell, or rounds gain nothing more.

    Args:
        problem: arm, cells and task.
        search: the seed is used, and the time limit for its message.
        clock: started once the kernels are loaded, unless it runs already; reports the cells of the
            best component.
        seeds: a motion to begin from, see `check`.
        suspects: cells to look at first, whether one is proved uncoverable.
        judging: may the seeds be the answer, where they are accepted as they are?

    Raises:
        ArgumentError: the seeds do not fit the arm or the cells, or the arm's start is not on the
            motion set.
        OutOfTime: a command's time ran out before the search began.
    """
    if seeds is not None:
        _check_seeds(problem, seeds)
    begin = None
    if problem.robot.start is not None:
        from feasibility.targets.starting import start_cell

        begin = start_cell(problem.robot, problem.cells, problem.task)
    with compiling_notice():
        return _search(problem, search, clock, seeds, begin, suspects, judging)


def _search(
    problem: Problem,
    search: Search,
    clock: Clock,
    seeds: Walk | None,
    begin: int | None,
    suspects: Collection[int],
    judging: bool,
) -> Found:
    """`complete_search`, from a cell that the arm's start is over."""
    with clock.enforced():  # loading kernels takes a second or two
        warm_up()
        problem.cells.curves  # noqa: B018 - part of the cells, made once
    clock.start()
    exploration = exploration_of(
        problem.robot, problem.cells, problem.task, search.seed, clock, problem.searched
    )
    exploration.early = search.early
    proving: Proving | None = None
    late, known, run = "", None, None
    try:
        if seeds is not None and judging:
            with clock.enforced():
                known = _known(problem, seeds)
        if begin is not None and known is None:
            _begin(exploration, begin, problem.bodies)
        ruled_out = False
        if suspects:
            from feasibility.roadmap.rounds import suspect

            ruled_out = suspect(exploration, suspects)
        if seeds is not None and not (search.early and known is not None) and not ruled_out:
            _seed_cells(exploration, seeds)
        done = known is not None or ruled_out or exploration.complete
        if not done and not seed_middle(exploration):
            from feasibility.roadmap.proving import Proving, between_rounds
            from feasibility.roadmap.rounds import go_on

            proving = Proving(exploration, problem.task)
            go_on(exploration, partial(between_rounds, proving, problem.searched))
        if not search.early or problem.cells.in_order:
            close(exploration)
        if problem.cells.in_order and exploration.complete and known is None:
            from feasibility.roadmap.forward.ordered_run import run_in_order

            run = run_in_order(exploration)
    except OutOfTime:
        late = clock.limits
    exploration.clock = Clock()  # graph and causes are made later, when somebody reads them
    judged = None if seeds is None or known is None else (seeds, known)
    found = _found(problem, exploration, proving, late, judged)
    return found if run is None else _in_order(found, run, problem, exploration)


def _check_seeds(problem: Problem, seeds: Walk) -> None:
    """Refuse a motion of another arm, or over other cells.

    Raises:
        ArgumentError: it is one.
    """
    n, total = problem.robot.n, len(problem.cells)
    checks = Checks("seeds")
    if seeds.q.ndim != 2 or seeds.q.shape[1] != n or not np.isfinite(seeds.q).all():
        checks.wrong("q", seeds.q.shape, f"must be (m, {n}) finite numbers, one column per joint")
    if seeds.cell.shape != seeds.q.shape[:1] or (seeds.cell >= total).any():
        checks.wrong("cell", seeds.cell.shape, f"must be (m,) cells below {total}, or negative")
    checks.done()


def _known(problem: Problem, seeds: Walk) -> Replay | None:
    """The replay of the seeds, where they cover all cells already, marked and accepted."""
    marked = np.isin(np.arange(len(problem.cells)), seeds.cell)
    start = problem.robot.start
    if start is not None and not (len(seeds.q) and np.array_equal(seeds.q[0], start)):
        return None
    found = _replayed(problem, seeds) if marked.all() else None
    return found if found is not None and found.accepted else None


def _begin(exploration: Exploration, cell: int, bodies: Bodies | None) -> None:
    """Begin the search at the arm's start, which is over a cell.

    Raises:
        ArgumentError: bodies are nearer to each other there than they may be; or it is not over the
            first pose of a toolpath.
    """
    if exploration.cells.in_order and cell != 0:
        what = f"is over pose {cell}; a toolpath is run from its first pose, so begin there"
        raise ArgumentError([Fault("start", what)])
    arrays, start = exploration.arrays, np.array(exploration.robot.start)
    if bodies is not None and not segment_clear(arrays.collisions, start, start) > 0.0:
        raise ArgumentError([Fault("start", _collides(exploration, bodies, start))])
    exploration.begin_at(cell, start)


def _collides(exploration: Exploration, bodies: Bodies, start: NDArray[np.float64]) -> str:
    """Why a start (n,) is refused: for the shapes, or for the bodies around them alone."""
    from feasibility.certification.collisions.collision_replay import collision_replay

    judged = collision_replay(exploration.robot, bodies, start[None])
    if not judged.accepted:
        found = "; ".join(fault.text for fault in judged.faults)
        return f"collides, or is too near ({found}); choose another start"
    pair = bodies.pairs[int(blamed(exploration.arrays.collisions))]
    return (
        f"is clear, but the convex bodies that the search puts around {pair.first} and "
        f"{pair.second} are larger than their shapes, and collide; choose another start"
    )


def _seed_cells(exploration: Exploration, seeds: Walk) -> None:
    """Seed the cells that a known motion passes, as long as the best component misses some.

    Where it has no marks, the rows with the tool point nearest to each cell are taken.
    """
    rows = {int(seeds.cell[row]): row for row in np.flatnonzero(seeds.cell >= 0)[::-1].tolist()}
    if not rows and len(seeds.q):
        tips, _ = Kinematics(exploration.robot).tools(seeds.q)
        for cell, point in enumerate(exploration.arrays.points):
            rows[cell] = int(np.linalg.norm(tips - point, axis=1).argmin())
    for cell, row in rows.items():
        if exploration.complete:
            return
        if not exploration.covered[cell]:
            exploration.add_seeds(cell, wound(exploration.arrays, seeds.q[row])[None])


def _found(
    problem: Problem,
    exploration: Exploration,
    proving: Proving | None,
    late: str,
    judged: tuple[Walk, Replay] | None = None,
) -> Found:
    """The best component, and the sentences about it.

    `late` says which limit ran out, if one did; `judged` is a known motion that covers all cells.
    """
    total = len(problem.cells)
    complete = exploration.complete and total > 0 and not problem.cells.in_order
    start = exploration.begun
    walk, known = (None, None) if judged is None else judged
    if complete:
        walk, known = covering_walk(exploration.roadmap, exploration.best, start), None
    said: dict[str, Any] = {}
    if walk is None:
        from feasibility.roadmap.outcome import outcome_of

        said = outcome_of(problem, exploration, proving, late)
    return Found(
        covered=exploration.covered if walk is None else np.ones(total, dtype=bool),
        components=tuple(np.flatnonzero(exploration.covers(r)) for r in exploration.roots()),
        postures=np.array([exploration.posture(r) for r in exploration.roots()]).reshape(
            -1, problem.robot.n
        ),
        start=None if walk is None else int(walk.cell[0]),
        n_edges=exploration.n_edges,
        counts={
            "fk": int(exploration.work.counts[0]),
            "nodes": len(exploration.roadmap.cell),
            "motions": len(exploration.roadmap.edges),
            "boxes": exploration.boxes + (0 if proving is None else proving.boxes),
            "rounds": exploration.rounds,
        },
        motion=walk,
        hindered=_hindered(exploration),
        replay=None if walk is None else lambda: known or _replayed(problem, walk),
        accepted="One continuous motion of {waypoints} waypoints visits every cell centre; "
        f"Pinocchio's replay holds it {problem.within}, between waypoints too.",
        refused="A motion over every cell was found, but the independent replay refuses it: "
        "{refusal}.",
        **said,
        make_graph=partial(_graph, exploration),
        make_causes=lambda: _causes(problem, exploration),
    )


def _graph(exploration: Exploration) -> nx.Graph:
    """Graph G, made when it is first read."""
    from feasibility.roadmap.graph_g import graph_of

    return graph_of(exploration)


def _hindered(exploration: Exploration) -> bool:
    """Was any motion refused because of collisions?"""
    buffer = exploration.arrays.collisions
    return len(buffer) > 0 and blamed(buffer) >= 0


def _causes(problem: Problem, exploration: Exploration) -> tuple[Cause, ...]:
    """Why cells are missed."""
    if exploration.complete:
        return ()
    from feasibility.roadmap.causes.diagnosis import causes_of
    from feasibility.roadmap.outcome import proof_of

    with compiling_notice(notice=REASONS):
        return causes_of(exploration, proof_of(exploration), problem.pairs)


def _in_order(found: Found, run: OrderedRun, problem: Problem, exploration: Exploration) -> Found:
    """The same of a toolpath, all of whose poses one component covers."""
    from feasibility.roadmap.forward.ordered_run import changes_in_place

    total, walk = len(problem.cells), run.walk
    counts = {**found.counts, "fk": int(exploration.work.counts[0])}
    if walk is None:
        return replace(
            found, counts=counts, covered=run.covered(total), unfinished="",
            exhausted=run.failed_words(total), make_causes=lambda: run.causes(total),
        )  # fmt: skip
    near = IN_PLACE * problem.task.effective_tolerance
    counts["in_place"] = changes_in_place(problem.robot, exploration.arrays.points, walk, near)
    return replace(
        found, counts=counts, start=0, motion=walk, replay=partial(_replayed, problem, walk),
        accepted=f"One motion of {{waypoints}} waypoints runs the {total} poses in order, without "
        f"going back; {counts['in_place']} times it changes the posture in place. Pinocchio's "
        f"replay holds it {problem.within}, between waypoints too.",
    )  # fmt: skip


def _replayed(problem: Problem, walk: Walk) -> Replay:
    """Replay the walk: it must visit every cell, whatever the search recorded as covered."""
    from feasibility.certification.motion_replay import replay

    needed = np.ones(len(problem.cells), dtype=bool)
    return replay(problem.robot, problem.cells, problem.task, walk, needed)
