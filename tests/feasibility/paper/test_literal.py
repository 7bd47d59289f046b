"""The compiled search against the literal reading of Algorithms 1 and 2, call by call."""

from __future__ import annotations

import numpy as np
import pytest

from feasibility import Search, Task
from feasibility.paper.algorithm_2 import tree_search
from feasibility.paper.continuity import JSpace, Outcome
from feasibility.paper.jcell_steps import Steps
from feasibility.paper.literal import LiteralSearch
from feasibility.paper.starts import starts
from robots import Robot, load_robot
from surfaces import Cells, cylinder, hyperboloid, plane, sphere

PUMA = load_robot("puma560", limits="set-1")
DOME = sphere(1.0, (50, 75), (40, 85), side="inside").cells(3, 3)
WALL = cylinder(1.0, (20, 60), (0.2, 0.6), side="inside").cells(3, 3)
WAIST = hyperboloid(0.8, 0.6, (20, 60), (0.1, 0.4), side="inside").cells(3, 2)
TABLE = plane((0.5, 0.8), (-0.2, 0.2), position=(0, 0, 0.1), side="outside").cells(3, 3)


def both(
    robot: Robot, cells: Cells, task: Task, search: Search
) -> tuple[JSpace, LiteralSearch, int]:
    """The compiled and the literal search from the same start, and the cell it is over."""
    points, approaches, _ = task.targets(cells)
    steps = Steps.of(robot, cells.closed_form, task, search)  # type: ignore[attr-defined]
    cell = len(cells) // 2
    start = next(starts(robot, points[cell], approaches[cell], task.cone, search.seed))
    space = JSpace(robot, cells, task, start, search, steps)  # type: ignore[arg-type]
    at = space.cell_of(np.zeros(robot.n, dtype=np.int32))
    return space, LiteralSearch(robot, cells, task, start, steps), at


@pytest.mark.parametrize(
    ("cells", "cone_deg", "step_deg", "moves"),
    [
        (DOME, 45, 0.3, "single"),
        (DOME, 45, 2.0, "all"),
        (WALL, 20, 0.3, "single"),
        (WAIST, 30, 0.3, "single"),
        (WAIST, 10, 0.6, "single"),
        (TABLE, 25, 1.0, "single"),
    ],
)
def test_both_readings_agree_call_by_call(
    cells: Cells, cone_deg: float, step_deg: float, moves: str
) -> None:
    task = Task(standoff=0.005, cone_deg=cone_deg)
    search = Search(method="greedy", step_deg=step_deg, moves=moves)  # type: ignore[arg-type]
    space, literal, at = both(PUMA, cells, task, search)
    tree = tree_search(space, cells, at)  # type: ignore[arg-type]
    found = literal.algorithm_2()
    assert tree.capped == 0, "a capped call is no answer; take smaller cells"
    assert {a: tree.parent.get(a) for a in tree.jcell} == found.T
    assert {frozenset(pair) for pair in tree.edges} == set(found.G)
    for pair, path in tree.edges.items():
        assert [tuple(row) for row in path.tolist()] == list(found.G[frozenset(pair)])
    assert tree.calls == len(found.calls) > 1
    # Each call looks at its own first J-cell too; so do the E-cells of TREESEARCH.
    assert tree.checked == found.checked - len(found.calls) - len(found.T) - 1


def test_a_single_call_says_the_same() -> None:
    task, search = Task(standoff=0.005, cone_deg=8), Search(method="greedy", step_deg=0.5)
    space, literal, at = both(PUMA, DOME, task, search)
    outcomes = []
    for neighbour in DOME.neighbours.of(at).tolist():
        compiled = space.continuity((0,) * PUMA.n, neighbour)
        path = literal.algorithm_1((0,) * PUMA.n, neighbour)
        assert (compiled.outcome is Outcome.FOUND) == bool(path)
        assert [tuple(row) for row in compiled.jcells.tolist()] == list(path)
        outcomes.append(bool(path))
    assert len(outcomes) == 8


def test_a_start_off_the_manifold_is_refused() -> None:
    steps = Steps.of(PUMA, DOME.closed_form, Task(0.005, 45), Search(method="greedy", step_deg=1.0))
    literal = LiteralSearch(PUMA, DOME, Task(0.005, 45), np.zeros(6), steps)
    with pytest.raises(ValueError, match="no feasible J-cell"):
        literal.algorithm_2()
