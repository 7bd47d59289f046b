"""The question asked: `check` runs the method, has its motion replayed, and words the verdict."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from feasibility.search import Progress, Search
from feasibility.target_curves import blocked_curves
from feasibility.task import Task
from feasibility.verdict import Answer, Evidence, Verdict, Walk, deferred
from robots import Robot
from surfaces import Cells

if TYPE_CHECKING:
    import networkx as nx

    from feasibility.certification import Replay
    from feasibility.roadmap import Exploration


NARROWER = 0.9  # [1] of tolerance and cone, when the replay refuses what just kept to them


def check(
    robot: Robot,
    cells: Cells,
    task: Task,
    search: Search | None = None,
    progress: Progress | None = None,
) -> Verdict:
    """Can this arm move its tool over all of these cells in one continuous motion?

    Args:
        robot: the arm, with its limits.
        cells: the surface, cut into E-cells.
        task: standoff, cone and tolerance.
        search: method and settings; the complete search by default.
        progress: called as progress(done, total, text) some times a second: cells covered by the
            best motion so far, all cells, and what is going on. What it raises ends the search.

    Returns:
        The verdict. An infeasible surface is a result, not an error. The first call on a machine
        compiles the kernels, which takes a while and says so on stderr.

    Raises:
        TypeError: an argument is something else, such as a surface that is not cut into cells.
        RobotError: the arm is no serial chain of one-dof joints.
        SurfaceError: the greedy search does not know this kind of surface.

    Example:
        >>> from robots import load_robot
        >>> from surfaces import plane
        >>> patch = plane((0.4, 0.6), (-0.1, 0.1), position=(0, 0, 0.3), side="outside")
        >>> verdict = check(load_robot("ur5"), patch.cells(3, 3), Task(standoff=0.02, cone_deg=30))
        >>> verdict.feasible, verdict.n_covered
        (True, 9)
    """
    search = Search() if search is None else search
    _refuse_other_types(robot, cells, task, search)
    if search.method == "greedy":
        from feasibility.paper import greedy_check
        from surfaces.patches import closed_form_grid

        return greedy_check(robot, closed_form_grid(cells), task, search, progress)
    return _complete_check(robot, cells, task, search, progress)


def _refuse_other_types(*given: object) -> None:
    """Refuse what is no robot, cells, task or search, all of it at once."""
    expected = (
        ("robot", Robot, 'a Robot, such as robots.load_robot("ur5")'),
        ("cells", Cells, "a surface cut into cells, such as surface.cells(9, 10)"),
        ("task", Task, "a Task, such as Task(standoff=0.02, cone_deg=20)"),
        ("search", Search, "a Search, such as Search(seed=1)"),
    )
    faults = [
        f"{name}: expected {words}, got {value!r:.60}"
        for value, (name, kind, words) in zip(given, expected, strict=True)
        if not isinstance(value, kind)
    ]
    if faults:
        raise TypeError("; ".join(faults))


@dataclass(frozen=True, slots=True)
class _Attempt:
    """One search, and the replay of what it found."""

    exploration: Exploration
    in_time: bool
    walk: Walk | None
    replayed: Replay | None
    search_s: float
    certify_s: float

    @property
    def accepted(self) -> bool:
        """Does the replay hold the motion?"""
        return self.replayed is not None and self.replayed.accepted

    @property
    def narrowly_refused(self) -> bool:
        """Does the replay refuse the motion for its numbers, and not as none at all?"""
        if self.replayed is None or self.replayed.accepted:
            return False
        return bool(np.isfinite(self.replayed.certificate.max_position_error))


def _complete_check(
    robot: Robot, cells: Cells, task: Task, search: Search, progress: Progress | None
) -> Verdict:
    """Run the complete search, replay its walk, and word the verdict."""
    from feasibility.notices import compiling_notice
    from feasibility.roadmap import warm_up

    called = time.monotonic()
    with compiling_notice():
        from feasibility.roadmap import Exploration, causes_of, problem_of

        warm_up()
    cells.curves  # noqa: B018 - part of the cells, made once
    began = time.monotonic()
    deadline = np.inf if search.time_limit is None else began + search.time_limit

    def attempt(within: Task) -> _Attempt:
        start = time.monotonic()
        problem = problem_of(robot, cells, within)
        exploration = Exploration(robot, cells, problem, search.seed, deadline, progress)
        return _attempt(exploration, task, start)

    tried = [attempt(task)]
    if tried[0].narrowly_refused:
        # The replay measures what strays between its samples, and may find a little more.
        tried.append(attempt(_narrowed(task)))
    found = tried[-1] if tried[-1].accepted else tried[0]
    exploration, walk, replayed = found.exploration, found.walk, found.replayed
    answer, evidence, message = _answer(exploration, task, replayed, found.in_time)
    feasible = answer is Answer.FEASIBLE
    exploration.deadline, exploration.progress = np.inf, None
    return Verdict(
        answer=answer,
        evidence=evidence,
        message=message,
        robot=robot,
        cells=cells,
        task=task,
        method="complete",
        seed=search.seed,
        graph=deferred(lambda: graph_of(exploration)),
        covered=exploration.covered,
        causes=deferred(lambda: causes_of(exploration)),
        components=tuple(np.flatnonzero(exploration.covers(root)) for root in exploration.roots()),
        start=int(walk.cell[0]) if walk is not None else None,
        witness=walk if feasible else None,
        certificate=replayed.certificate if feasible and replayed is not None else None,
        timing={
            "load_s": began - called,
            "search_s": sum(one.search_s for one in tried),
            "certify_s": sum(one.certify_s for one in tried),
            "total_s": time.monotonic() - called,
        },
        n_edges=exploration.n_edges,
        statistics={
            "fk": sum(int(one.exploration.work.counts[0]) for one in tried),
            "nodes": int(exploration.roadmap.counters[0]),
            "motions": int(exploration.roadmap.counters[1]),
            "boxes": exploration.boxes,
            "rounds": exploration.rounds,
        },
    )


def _attempt(exploration: Exploration, task: Task, began: float) -> _Attempt:
    """Search since `began` (s), and replay the motion found against a task."""
    from feasibility.certification import replay
    from feasibility.roadmap import OutOfTime, close, covering_walk, explore

    in_time = True
    try:
        explore(exploration)
        close(exploration)
    except OutOfTime:
        in_time = False
    searched = time.monotonic()
    walk: Walk | None = None
    replayed: Replay | None = None
    robot, cells = exploration.robot, exploration.cells
    if exploration.complete and len(cells):
        walk = covering_walk(exploration.roadmap, exploration.best)
        # Every cell, whatever the search believes that it covers.
        replayed = replay(robot, cells, task, walk, np.ones(len(cells), dtype=bool))
    return _Attempt(
        exploration, in_time, walk, replayed, searched - began, time.monotonic() - searched
    )


def _narrowed(task: Task) -> Task:
    """A task that leaves the replay some room."""
    tolerance = task.effective_tolerance
    return replace(task, tolerance=NARROWER * tolerance, cone_deg=NARROWER * task.cone_deg)


def _answer(
    exploration: Exploration, task: Task, replayed: Replay | None, in_time: bool
) -> tuple[Answer, Evidence, str]:
    """Answer, evidence and the sentences that say what was done."""
    from feasibility.roadmap import Ruling

    total = len(exploration.cells)
    covered = int(exploration.covered.sum())
    tolerance = task.effective_tolerance
    within = f"within {1e3 * tolerance:g} mm and {task.cone_deg:g} deg"
    proved = sum(ruling is Ruling.PROVED for ruling in exploration.rulings.values())
    if total == 0:
        return Answer.FEASIBLE, Evidence.WITNESS, "There are no cells to cover."
    if replayed is not None and replayed.accepted:
        return (
            Answer.FEASIBLE,
            Evidence.WITNESS,
            f"One continuous motion of {replayed.certificate.waypoints} waypoints visits every "
            f"cell centre; Pinocchio's replay holds it {within}, between waypoints too.",
        )
    if replayed is not None:
        return (
            Answer.UNDECIDED,
            Evidence.BUDGET,
            f"A motion over every cell was found, but the independent replay refuses it: "
            f"{replayed.refusal}.",
        )
    if proved:
        return (
            Answer.INFEASIBLE,
            Evidence.PROOF,
            f"{proved} cell{'s are' if proved > 1 else ' is'} proved uncoverable {within} "
            f"(reach bound and branch and bound, {exploration.boxes} boxes); the best single motion "
            f"covers {covered} of {total}.",
        )
    if not in_time:
        return (
            Answer.UNDECIDED,
            Evidence.BUDGET,
            f"The time limit ran out; the best single motion so far covers {covered} of {total} "
            f"cells.",
        )
    if not exploration.problem.cone_chord > 0.0:
        return (
            Answer.UNDECIDED,
            Evidence.BUDGET,
            "A cone of 0 degrees leaves a motion no room between samples, so none can be "
            "certified; allow a small angle.",
        )
    closed = blocked_curves(exploration.cells, task)
    if closed:
        return (Answer.UNDECIDED, Evidence.BUDGET, closed)
    missed = int((~exploration.reached).sum())
    what = (
        f"{missed} cell{'s were' if missed > 1 else ' was'} never reached, without a proof"
        if missed
        else "every cell is reached, but by no single component"
    )
    return (
        Answer.INFEASIBLE,
        Evidence.EXHAUSTED,
        f"The search ended without a covering motion {within}: {what}; the best covers {covered} "
        f"of {total} cells ({exploration.roadmap.counters[0]} nodes, {exploration.rounds} rounds, seed "
        f"{exploration.seed}).",
    )


def graph_of(exploration: Exploration) -> nx.Graph:
    """Graph G of the best component: every cell, and one motion for each pair that has any.

    Nodes carry `q` (n,), a configuration over the cell's centre, None for cells that the component
    misses. Edges carry `motion` (k, n), from the smaller cell index to the larger.
    """
    import networkx as nx

    from feasibility.roadmap import NODES, edge_motion, pair_edges, root_of

    roadmap, best = exploration.roadmap, exploration.best
    graph: nx.Graph = nx.Graph()
    graph.add_nodes_from(range(len(exploration.cells)), q=None)
    for x in range(roadmap.counters[NODES] - 1, -1, -1):
        if root_of(roadmap, roadmap.component[x]) == best:
            graph.nodes[int(roadmap.cell[x])]["q"] = roadmap.q[x].copy()
    for (i, j), e in pair_edges(exploration).items():
        motion = edge_motion(roadmap, e)
        if roadmap.cell[roadmap.ends[e, 0]] != i:
            motion = motion[::-1]
        graph.add_edge(i, j, motion=motion)
    return graph
