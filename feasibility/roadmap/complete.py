"""The complete search as a method of `check`: explore, close graph G, and say what was found."""

from __future__ import annotations

from collections.abc import Collection
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from feasibility.certification.faults import Replay
from feasibility.clock import Clock, OutOfTime
from feasibility.collisions.kernels.clearance import blamed
from feasibility.notices import REASONS, compiling_notice
from feasibility.problem import Problem
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.search import exploration_of, seed_middle
from feasibility.roadmap.walk import covering_walk
from feasibility.roadmap.warmup import warm_up
from feasibility.search_result import SearchResult
from feasibility.search_settings import Search
from feasibility.verdict import Cause, Walk

if TYPE_CHECKING:
    import networkx as nx

    from feasibility.roadmap.proving import Proving


def complete_search(
    problem: Problem,
    search: Search,
    clock: Clock,
    seeds: Walk | None = None,
    suspects: Collection[int] = (),
    judging: bool = True,
) -> SearchResult:
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
        from feasibility.roadmap.seeds import check_seeds

        check_seeds(problem, seeds)
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
) -> SearchResult:
    """`complete_search`, from a cell that the arm's start is over."""
    with clock.enforced():  # loading kernels takes a second or two
        warm_up()
        problem.cells.curves  # noqa: B018 - part of the cells, made once
    clock.start()
    exploration = exploration_of(
        problem.robot, problem.cells, problem.task, search.seed, clock, problem.searched,
        problem.tried,
    )  # fmt: skip
    exploration.early = search.early
    proving: Proving | None = None
    late, known, run = "", None, None
    try:
        if seeds is not None and judging:
            from feasibility.roadmap.seeds import known_motion

            with clock.enforced():
                known = known_motion(problem, seeds)
        if begin is not None and known is None:
            from feasibility.roadmap.seeds import begin_at_start

            begin_at_start(exploration, begin, problem.bodies)
        ruled_out = False
        if suspects:
            from feasibility.roadmap.rounds import suspect

            ruled_out = suspect(exploration, suspects)
        if seeds is not None and not (search.early and known is not None) and not ruled_out:
            from feasibility.roadmap.seeds import seed_cells

            seed_cells(exploration, seeds)
        done = known is not None or ruled_out or exploration.complete
        if not done and not seed_middle(exploration):
            from feasibility.roadmap.proving import Proving, between_rounds
            from feasibility.roadmap.rounds import go_on

            proving = Proving(exploration, problem.task)
            go_on(exploration, partial(between_rounds, proving, problem.searched))
        if not search.early or problem.cells.in_order:
            exploration.close_pairs(exploration.pairs, exploration.best)
        if problem.cells.in_order and exploration.complete and known is None:
            from feasibility.roadmap.ordered_run import run_in_order

            run = run_in_order(exploration)
    except OutOfTime:
        late = clock.limits
    exploration.clock = Clock()  # graph and causes are made later, when somebody reads them
    judged = None if seeds is None or known is None else (seeds, known)
    found = _found(problem, exploration, proving, late, judged)
    return found if run is None else run.added_to(found, problem, exploration)


def _found(
    problem: Problem,
    exploration: Exploration,
    proving: Proving | None,
    late: str,
    judged: tuple[Walk, Replay] | None = None,
) -> SearchResult:
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
    return SearchResult(
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
        replay=None if walk is None else lambda: known or problem.replayed(walk),
        accepted="One continuous motion of {waypoints} waypoints visits every cell centre; "
        f"Pinocchio's replay holds it {problem.within}, between waypoints too.",
        refused="A motion over every cell was found, but the independent replay refuses it: "
        "{refusal}.",
        **said,
        make_graph=partial(graph_of, exploration),
        make_causes=lambda: _causes(problem, exploration),
    )


def graph_of(exploration: Exploration) -> nx.Graph:
    """Graph G of the best component: every cell, and one motion for each connected pair.

    Nodes carry what `cell_graph` gives them, and `q` (n,), a configuration over the cell's
    centre, None for cells that the component misses. Edges carry `motion` (k, n), from the smaller
    cell index to the larger.
    """
    from feasibility.cell_graph import cell_graph

    roadmap, best = exploration.roadmap, exploration.best
    graph = cell_graph(exploration.cells, exploration.covered)
    mine = np.flatnonzero(roadmap.roots_of_nodes() == best)
    for x in mine[::-1].tolist():  # a cell's first node counts
        graph.nodes[roadmap.cell[x]]["q"] = roadmap.q[x].copy()
    for e, (x, y, _) in enumerate(roadmap.edges):
        i, j = roadmap.cell[x], roadmap.cell[y]
        if i != j and roadmap.root_of(x) == best and not graph.has_edge(i, j):  # the first counts
            motion = roadmap.motion(e)
            graph.add_edge(i, j, motion=motion if i < j else motion[::-1])
    return graph


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
