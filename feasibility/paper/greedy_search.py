"""The verdict of the paper's search: Algorithm 2 from every start, the best tree, its replay.

What the greedy search finds depends on where it starts, and its "no" speaks for this search alone.
"Feasible" rests on tree T, which is one continuous motion, and not on the connectivity of G.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from coverable_errors import ArgumentError
from feasibility.notices import compiling_notice
from feasibility.paper.algorithm_2 import Tree, tree_search
from feasibility.paper.continuity import JSpace
from feasibility.paper.jcell_steps import Steps
from feasibility.paper.starts import DRY_SEEDS, starts
from feasibility.paper.tree_replay import Path, Replay, replay
from feasibility.search import Progress, Search
from feasibility.task import Task
from feasibility.verdict import Answer, Cause, CauseKind, Evidence, Verdict, deferred
from robots import Chain, Robot
from surfaces.patches import GridCells

if TYPE_CHECKING:
    import networkx as nx

FEW_SEEDS = 10  # random configurations to try over each cell once the middle one had no start


@dataclass(slots=True)
class _Run:
    """All trees of one greedy search: the best, and the sums over them."""

    best: Tree | None = None
    trees: int = 0
    calls: int = 0
    checked: int = 0
    fk: float = 0.0
    capped: int = 0
    complete: bool = True

    def add(self, tree: Tree) -> None:
        """Count one more tree, and keep it if it touches more cells than the best so far."""
        self.trees += 1
        self.calls += tree.calls
        self.checked += tree.checked
        self.fk += tree.fk
        self.capped += tree.capped
        self.complete &= tree.complete
        rank = (len(tree.jcell), len(tree.edges))
        if self.best is None or rank > (len(self.best.jcell), len(self.best.edges)):
            self.best = tree

    def statistics(self) -> dict[str, float]:
        """The sums, and calls and edges of the best tree."""
        return {
            "starts": self.trees,
            "calls": self.calls,
            "checked": self.checked,
            "fk": round(self.fk),
            "capped": self.capped,
            "best_calls": 0 if self.best is None else self.best.calls,
            "best_capped": 0 if self.best is None else self.best.capped,
        }


def greedy_check(
    robot: Robot,
    cells: GridCells,
    task: Task,
    search: Search | None = None,
    progress: Progress | None = None,
    start: ArrayLike | None = None,
) -> Verdict:
    """The verdict of the paper's search: feasible when one tree T touches every cell.

    To touch a cell is to enter it; its centre need not be visited, so there is no `witness`, but
    `tree_walk` makes one motion of T. Before "feasible" is said, Pinocchio replays every path of T.

    Args:
        robot, cells: the arm, and the E-cells.
        task, search: the task (see `Steps.tolerance` where it has none), and the settings.
        progress: called as progress(cells touched by the running tree, cells, text).
        start: (n,) the one start configuration to use, rad or m; without it, start configurations
            are searched over the middle cell, or the next that has some; one for each branch.

    Raises:
        ArgumentError: `start` is not a feasible configuration over one of the cells.
    """
    search = Search(method="greedy") if search is None else search
    called = time.perf_counter()
    chain, steps = Chain.checked(robot), Steps.of(robot, cells.closed_form, task, search)
    with compiling_notice():
        JSpace(robot, cells, task, np.zeros(robot.n), search, chain, steps).load()
    began = time.perf_counter()
    deadline = math.inf if search.time_limit is None else began + search.time_limit
    run = _Run()
    for q in _starts(robot, cells, task, search, deadline, start):
        space = JSpace(robot, cells, task, q, search, chain, steps)
        at = space.cell_of(np.zeros(robot.n, dtype=np.int32))
        if at >= 0:
            run.add(tree_search(space, cells, at, deadline, progress))
        elif start is not None:
            raise ArgumentError(
                "start must satisfy limits, cone and tolerance over one of the cells"
            )
        if _touches_all(run, cells) or not run.complete:
            break
    touched_all = _touches_all(run, cells)
    run.complete &= touched_all or time.perf_counter() <= deadline
    searched = time.perf_counter()
    replayed = _replayed(robot, cells, task, steps, run) if touched_all else None
    ended = time.perf_counter()
    answer, evidence, message = _answer(cells, search, steps, run, replayed)
    return Verdict(
        answer=answer,
        evidence=evidence,
        message=message,
        robot=robot,
        cells=cells,
        task=task,
        method="greedy",
        seed=search.seed,
        graph=deferred(lambda: _graph(cells, run.best)),
        covered=_touched(cells, run.best),
        causes=_causes(robot, cells, task, steps, run),
        components=() if run.best is None else (np.array(sorted(run.best.jcell), dtype=np.int64),),
        tree=deferred(lambda: _tree(run.best)),
        start=None if run.best is None else run.best.start,
        certificate=replayed.certificate if replayed is not None else None,
        timing={
            "load_s": began - called,
            "search_s": searched - began,
            "certify_s": ended - searched,
            "total_s": ended - called,
        },
        n_edges=0 if run.best is None else len(run.best.edges),
        statistics=run.statistics(),
    )


def _starts(
    robot: Robot,
    cells: GridCells,
    task: Task,
    search: Search,
    deadline: float,
    start: ArrayLike | None,
) -> Iterator[NDArray[np.float64]]:
    """Start configurations (n,), as many as the search asks for.

    The start cell is the one in the middle of the list (cell 45 of 90), from where this search
    touches more cells of the paper's cases than from the first; or the next to it with a start.
    """
    if start is not None:
        yield np.array(start, dtype=float)
        return
    points, approaches = task.targets(cells)
    middle = len(cells) // 2
    within = np.flatnonzero(_beyond(robot, points) <= 0.0).tolist()
    for cell in sorted(within, key=lambda cell: abs(cell - middle)):
        found = 0
        patience = DRY_SEEDS if cell == middle else FEW_SEEDS
        for q in starts(robot, points[cell], approaches[cell], task.cone, search.seed, patience):
            yield q
            found += 1
            if found == search.starts:
                break
        if found or time.perf_counter() > deadline:
            return


def _touches_all(run: _Run, cells: GridCells) -> bool:
    """True when the best tree touches every cell."""
    return len(cells) == 0 or (run.best is not None and len(run.best.jcell) == len(cells))


def _replayed(robot: Robot, cells: GridCells, task: Task, steps: Steps, run: _Run) -> Replay:
    """Replay of all paths of the best tree by Pinocchio."""
    tree = run.best
    parents = {} if tree is None else tree.parent
    paths = [Path(a, b, tree.motion(a, b)) for b, a in parents.items() if tree is not None]
    return replay(robot, cells, task, steps, paths)


def _answer(
    cells: GridCells, search: Search, steps: Steps, run: _Run, replayed: Replay | None
) -> tuple[Answer, Evidence, str]:
    """Answer, evidence, and the sentences that say how it was found."""
    number = 0 if run.best is None else len(run.best.jcell)
    step = f"{search.step_deg:g}"
    settings = (
        f"{search.moves} moves of {step} degrees, tolerance {1e3 * steps.tolerance:.3g} mm; "
        f"{run.calls} calls of Algorithm 1 from {run.trees} start"
        f"{'' if run.trees == 1 else 's'}"
    )
    if replayed is not None and not replayed.faults:
        return (
            Answer.FEASIBLE,
            Evidence.WITNESS,
            f"The greedy search touches every cell with one tree of motions, and Pinocchio's "
            f"replay accepts it ({settings}). Touching a cell is entering it: centres need not be "
            f"visited.",
        )
    if replayed is not None:
        faults = "; ".join(replayed.faults)
        return (
            Answer.UNDECIDED,
            Evidence.BUDGET,
            f"The greedy search touches every cell, but Pinocchio's replay refuses it: {faults} "
            f"({settings}).",
        )
    if not run.complete:
        return (
            Answer.UNDECIDED,
            Evidence.BUDGET,
            f"The time limit of {search.time_limit:g} s ran out ({settings}); the best tree "
            f"touches {number} of {len(cells)} cells.",
        )
    why = f"the best tree touches {number} of {len(cells)} cells"
    if run.best is None:
        why = "no configuration was found over any cell"
    if not math.isfinite(steps.sag):
        why = "the motion between J-cells cannot be bounded here (the offset surface folds)"
    elif steps.sag >= steps.tolerance or not steps.in_cone:
        why = "the step is too coarse for the tolerance or the cone"
    capped = ""
    if run.capped:
        capped = f"; {run.capped} calls stopped at the cap, which is unknown rather than no"
    return (
        Answer.INFEASIBLE,
        Evidence.EXHAUSTED,
        f"A covering motion was not found by the greedy search: {why} ({settings}{capped}). "
        f"Another start or method may find one.",
    )


def _beyond(robot: Robot, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far (k,) m points (k, 3) lie beyond the arm's reach; negative inside it."""
    return np.linalg.norm(points - Chain.of(robot).translations[0], axis=1) - robot.reach


def _touched(cells: GridCells, tree: Tree | None) -> NDArray[np.bool_]:
    """(N,) cells of the tree."""
    touched = np.zeros(len(cells), dtype=bool)
    if tree is not None:
        touched[list(tree.jcell)] = True
    return touched


def _graph(cells: GridCells, tree: Tree | None) -> nx.Graph:
    """Graph G of the best tree: `q` on the cells it touches, `motion` on the edges."""
    import networkx as nx

    graph: nx.Graph = nx.Graph()
    graph.add_nodes_from(range(len(cells)), q=None)
    if tree is not None:
        for cell, jcell in tree.jcell.items():
            graph.nodes[cell]["q"] = tree.space.q(jcell)
        for a, b in tree.edges:
            low, high = min(a, b), max(a, b)
            graph.add_edge(low, high, motion=tree.motion(low, high))
    return graph


def _tree(tree: Tree | None) -> nx.DiGraph | None:
    """Tree T, its edges from parent to child, with `motion` in that direction."""
    import networkx as nx

    if tree is None:
        return None
    graph: nx.DiGraph = nx.DiGraph()
    for cell, jcell in tree.jcell.items():
        graph.add_node(cell, q=tree.space.q(jcell))
    for child, parent in tree.parent.items():
        graph.add_edge(parent, child, motion=tree.motion(parent, child))
    return graph


def _causes(
    robot: Robot, cells: GridCells, task: Task, steps: Steps, run: _Run
) -> tuple[Cause, ...]:
    """Why each cell outside the best tree is missed, as far as this search can tell."""
    beyond = _beyond(robot, task.targets(cells).points) - steps.tolerance
    causes = []
    for cell in np.flatnonzero(~_touched(cells, run.best)).tolist():
        if beyond[cell] > 0.0:
            kind, proved = CauseKind.OUT_OF_REACH, True
            detail = f"its centre's target is {beyond[cell]:.3f} m beyond the arm's reach"
        else:
            kind, proved = CauseKind.DISCONNECTED, False
            detail = "not reached by the greedy search from its starts"
        causes.append(Cause(cell, kind, proved, detail))
    return tuple(causes)
