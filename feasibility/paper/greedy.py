"""The paper's search: Algorithm 2 from every start, and the best of its trees.

What the greedy search finds depends on where it starts, and its "no" speaks for this search alone.
"Feasible" rests on tree T, which is one continuous motion, and not on the connectivity of G.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from coverable.errors import ArgumentError, counted
from feasibility.certification.faults import Replay
from feasibility.clock import Clock
from feasibility.notices import GREEDY, compiling_notice
from feasibility.paper.continuity import CallOutcome, JSpace
from feasibility.paper.jcell_steps import Steps
from feasibility.paper.starts import candidates
from feasibility.paper.tree_and_graph import Tree, graph_of, tree_of
from feasibility.paper.tree_replay import Path, replay_tree
from feasibility.problem import Problem
from feasibility.search_result import SearchResult
from feasibility.search_settings import Search
from feasibility.verdict import Cause, CauseKind
from surfaces.cells import Cells


def tree_search(space: JSpace, cells: Cells, start: int, clock: Clock | None = None) -> Tree:
    """Algorithm 2: grow T and G from the start configuration of `space`, which lies over `start`.

    The recursion of the paper's TREESEARCH is the list `waiting`: the cells from ec_1 to the one in
    hand, each with those of its neighbours, clockwise, that are still to be tried. A pair that
    failed from one side is tried again from the other, as printed.

    Args:
        space: the J-cells around jc_1.
        cells: the E-cells.
        start: flat index of ec_1.
        clock: when to give up; it reports how many cells are touched, after each new one.
    """
    clock = Clock() if clock is None else clock
    tree = Tree(space, start)
    tree.jcell[start] = np.zeros(len(space.start), dtype=np.int32)
    waiting: list[tuple[int, Iterator[int]]] = [(start, iter(cells.neighbours.of(start).tolist()))]
    while waiting:
        cell, neighbours = waiting[-1]
        entered = next((k for k in neighbours if _try_edge(tree, cell, k, clock)), None)
        if not tree.complete:
            break
        if entered is None:
            waiting.pop()
            continue
        waiting.append((entered, iter(cells.neighbours.of(entered).tolist())))
        clock.report(len(tree.jcell), len(cells), "greedy search")
    return tree


def _try_edge(tree: Tree, cell: int, neighbour: int, clock: Clock) -> bool:
    """Call Algorithm 1 for one pair that has no edge yet; True when it leads to a new cell of T."""
    if not tree.complete or (cell, neighbour) in tree.edges or (neighbour, cell) in tree.edges:
        return False
    if (min(cell, neighbour), max(cell, neighbour)) in tree.space.steps.barred:
        return False
    found = tree.space.continuity(tree.jcell[cell], neighbour, clock)
    tree.calls += 1
    tree.checked += found.checked
    tree.capped += found.outcome is CallOutcome.CAPPED
    tree.complete = found.outcome is not CallOutcome.OUT_OF_TIME and not clock.out_of_time
    if found.outcome is not CallOutcome.FOUND:
        return False
    tree.edges[cell, neighbour] = found.jcells
    if neighbour in tree.jcell:
        return False
    tree.jcell[neighbour] = found.jcells[-1]
    tree.parent[neighbour] = cell
    return True


KNOWS_NO_COLLISIONS = (
    "the greedy search, which is the paper's, knows no collisions: leave out [collision], or take "
    "the complete search"
)

KNOWS_NO_POSES = (
    "the greedy search, which is the paper's, moves over a surface with one approach for all of it "
    'or its normals: set task.approach, or use search.method = "complete"'
)


@dataclass(slots=True)
class _Run:
    """All trees of one greedy search: the best, and the sums over them."""

    best: Tree
    """Empty until the first is added."""
    trees: int = 0
    calls: int = 0
    checked: int = 0
    capped: int = 0
    complete: bool = True

    def add(self, tree: Tree) -> None:
        """Count one more tree, and keep it if it touches more cells than the best so far."""
        self.trees += 1
        self.calls += tree.calls
        self.checked += tree.checked
        self.capped += tree.capped
        self.complete &= tree.complete
        self.best = max(self.best, tree, key=lambda one: (len(one.jcell), len(one.edges)))


def greedy_search(
    problem: Problem, search: Search, clock: Clock, start: ArrayLike | None = None
) -> SearchResult:
    """The paper's search: one tree T that touches every cell is a covering motion.

    To touch a cell is to enter it; its centre need not be visited, so no motion over the centres is
    found, but `tree_walk` makes one motion of T.

    Args:
        problem: arm, E-cells and task (see `Steps.tolerance` for a task without one).
        search: step, moves, starts, cap and seed.
        clock: started once the kernels are loaded; reports the cells touched by the running tree.
        start: (n,) the one start configuration to use, rad or m; without it, start configurations
            are searched over the middle cell, or the next that has some; one for each branch.

    Raises:
        SurfaceError: nothing is known of the surface between its places.
        ArgumentError: `start` is not a feasible configuration over one of the cells; or collisions
            are to be checked, or cells have approaches of their own.
    """
    robot, cells, task = problem.robot, problem.cells, problem.task
    if problem.bodies is not None:
        raise ArgumentError(KNOWS_NO_COLLISIONS)
    if task.approach is None and cells.approaches is not None:
        raise ArgumentError(KNOWS_NO_POSES)
    with compiling_notice(notice=GREEDY):
        steps = Steps.of(robot, cells, task, search)
        space = JSpace(robot, cells, task, np.zeros(robot.n), search, steps)
        space.load()
    clock.start()
    run = _Run(Tree(space, start=None))
    given = None if start is None else [np.array(start, dtype=float)]
    for q in (
        candidates(robot, cells, task, search, steps.usable, clock) if given is None else given
    ):
        space = JSpace(robot, cells, task, q, search, steps)
        at = space.cell_of(np.zeros(robot.n, dtype=np.int32))
        if at >= 0:
            run.add(tree_search(space, cells, at, clock))
        elif start is not None:
            raise ArgumentError(
                "start must satisfy limits, cone and tolerance over one of the cells"
            )
        if len(run.best.jcell) == len(cells) or not run.complete:
            break
    run.complete &= len(run.best.jcell) == len(cells) or not clock.out_of_time
    return _found(problem, search, steps, run)


def _found(problem: Problem, search: Search, steps: Steps, run: _Run) -> SearchResult:
    """The best tree, and its wording."""
    cells, best, count = problem.cells, run.best, len(problem.cells)
    settings = (
        f"{search.moves} moves of {search.step_deg:g} degrees, tolerance "
        f"{1e3 * steps.tolerance:.3g} mm; {run.calls} calls of Algorithm 1 from "
        f"{counted(run.trees, 'start')}"
    )

    def replay() -> Replay:
        """Every path of the tree, by Pinocchio."""
        begun = list(best.jcell.items())[:1]
        paths = [Path(cell, cell, best.space.q(jcell)[None]) for cell, jcell in begun]
        paths += [Path(a, b, best.motion(a, b)) for b, a in best.parent.items()]
        return replay_tree(problem.robot, cells, problem.task, steps, paths)

    capped = f"; {run.capped} calls stopped at the cap, which is unknown rather than no"
    capped *= run.capped > 0
    unfinished = ""
    if not run.complete:
        unfinished = (
            f"The time limit of {search.time_limit:g} s ran out ({settings}); "
            f"{_touched(run, count)}."
        )
    return SearchResult(
        covered=np.isin(np.arange(count), list(best.jcell)),
        components=(np.array(sorted(best.jcell), dtype=np.int64),) if best.jcell else (),
        start=best.start,
        n_edges=len(best.edges),
        counts={
            "starts": run.trees,
            "calls": run.calls,
            "checked": run.checked,
            "fk": run.checked + run.calls,
            "capped": run.capped,
            "best_calls": best.calls,
            "best_capped": best.capped,
        },
        replay=replay if len(best.jcell) == count else None,
        accepted="The greedy search touches every cell with one tree of motions, and Pinocchio's "
        f"replay accepts it ({settings}). Touching a cell is entering it: centres need not be "
        "visited.",
        refused="The greedy search touches every cell, but Pinocchio's replay refuses it: "
        f"{{refusal}} ({settings}).",
        unfinished=unfinished,
        exhausted=f"A covering motion was not found by the greedy search: "
        f"{_why_not(run, steps, count)} ({settings}{capped}). Another start or method may "
        "find one.",
        make_graph=lambda: graph_of(best, cells),
        make_causes=lambda: _causes(problem, steps, run),
        make_tree=lambda: tree_of(best),
    )


def _touched(run: _Run, count: int) -> str:
    """How many cells the best tree touches, for a message."""
    return f"the best tree touches {len(run.best.jcell)} of {count} cells"


def _why_not(run: _Run, steps: Steps, count: int) -> str:
    """What kept the best tree from touching all cells."""
    usable = steps.usable
    if not np.isfinite(steps.sag).any():
        return "the motion between J-cells cannot be bounded here (the offset surface folds)"
    if not usable.any():
        return f"the step is too coarse for {steps.allowed}"
    if not run.best.jcell:
        return "no configuration was found over any cell"
    words, closed = _touched(run, count), count - int(usable.sum())
    if closed:
        words += (
            f"; over {closed} of them, where the surface is creased or most curved, the step is "
            f"too coarse for {steps.allowed}"
        )
    if steps.barred:
        words += (
            f"; {len(steps.barred)} pairs of cells on both sides of a crease were left out, "
            "because no motion is certified to cross it"
        )
    return words


def _causes(problem: Problem, steps: Steps, run: _Run) -> tuple[Cause, ...]:
    """Why each cell outside the best tree is missed, as far as this search knows."""
    robot, points = problem.robot, problem.task.targets(problem.cells).points
    beyond = robot.distance_from_base(points) - robot.reach - steps.tolerance
    causes = []
    for cell in sorted(set(range(len(problem.cells))) - set(run.best.jcell)):
        if beyond[cell] > 0.0:
            kind, proved = CauseKind.OUT_OF_REACH, True
            detail = f"its centre's target is {beyond[cell]:.3f} m beyond the arm's reach"
        else:
            kind, proved = CauseKind.DISCONNECTED, False
            detail = "not reached by the greedy search from its starts"
        causes.append(Cause(cell, kind, proved, detail))
    return tuple(causes)
