"""The compiled search against the literal reading of Algorithms 1 and 2, call by call."""

from __future__ import annotations

import numpy as np
import pytest
from meshed_patches import in_cells_of

from feasibility import Search, Task
from feasibility.paper.algorithm_2 import tree_search
from feasibility.paper.continuity import JSpace, Outcome
from feasibility.paper.literal import LiteralSearch
from feasibility.paper.tree_and_graph import Tree
from robots import load_robot
from surfaces import Cells, bspline, cylinder, hyperboloid, piecewise, plane, sphere, torus

PUMA = load_robot("puma560", limits="set-1")
DOME = sphere(1.0, (50, 75), (40, 85), side="inside").cells(3, 3)
WALL = cylinder(1.0, (20, 60), (0.2, 0.6), side="inside").cells(3, 3)
WAIST = hyperboloid(0.8, 0.6, (20, 60), (0.1, 0.4), side="inside").cells(3, 2)
TABLE = plane((0.5, 0.8), (-0.2, 0.2), position=(0, 0, 0.1), side="outside").cells(3, 3)
RING = torus(0.8, 0.3, (20, 60), (-20, 20), side="inside").cells(3, 3)
MESH = in_cells_of(DOME, 6)
HALVES = piecewise(
    [sphere(1.0, polar, (40, 85)) for polar in ((50, 62), (62, 75))], side="inside"
).cells((2, 3))
NET = [[(x, y, 0.35 + x * (0.25 * y - 0.1 * x)) for y in (-0.2, 0, 0.2)] for x in (0.5, 0.65, 0.8)]
SPLINE = bspline(NET, degree=(2, 2), side="outside").cells(2, 2)

# Over these the tool rolls as the arm turns.
CAP = sphere(0.5, (15, 40), (-40, 40), position=(0.3, 0, -0.3), side="outside").cells(3, 3)
TYRE = torus(0.25, 0.15, (-40, 40), (60, 100), position=(0.35, 0, 0.05), side="outside").cells(3, 3)
PIPE = cylinder(
    0.4, (-25, 25), (-0.2, 0.2), position=(0.6, 0, -0.3), rpy_deg=(0, -90, 0), side="outside"
).cells(3, 3)
PLATE = plane((0.5, 0.7), (-0.1, 0.1), position=(0, 0, 0.1), side="outside").cells(2, 2)
CAP_MESH = in_cells_of(CAP, 6)


def both(cells: Cells, task: Task, search: Search) -> tuple[JSpace, LiteralSearch, int]:
    """The compiled and the literal search from the same start, and the cell it is over."""
    literal = LiteralSearch.of(PUMA, cells, task, search)
    space = JSpace(PUMA, cells, task, literal.start, search, literal.steps)
    return space, literal, space.cell_of(np.zeros(PUMA.n, dtype=np.int32))


def assert_agree(tree: Tree, literal: LiteralSearch, by_call: bool = True) -> None:
    """The same tree, the same graph, the same path in each call, as many J-cells looked at.

    Not `by_call` where the range of a roll ends by less beside a J-cell than the triangles are off.
    """
    found = literal.algorithm_2()
    assert tree.capped == 0, "a capped call is no answer; take smaller cells"
    assert {a: tree.parent.get(a) for a in tree.jcell} == found.T
    assert {frozenset(pair) for pair in tree.edges} == set(found.G)
    assert tree.calls == len(found.calls) > 1
    if not by_call:
        return
    for pair, path in tree.edges.items():
        assert [tuple(row) for row in path.tolist()] == list(found.G[frozenset(pair)])
    # Each call looks at its own first J-cell too; so do the E-cells of TREESEARCH.
    assert tree.checked == found.checked - len(found.calls) - len(found.T) - 1


@pytest.mark.parametrize(
    ("cells", "cone_deg", "step_deg", "moves"),
    [
        (DOME, 45, 0.3, "single"),
        (DOME, 45, 2.0, "all"),
        (WALL, 20, 0.3, "single"),
        (WAIST, 30, 0.3, "single"),
        (WAIST, 10, 0.6, "single"),
        (TABLE, 25, 1.0, "single"),
        (RING, 45, 0.5, "single"),
        (MESH, 45, 0.5, "single"),
        (MESH, 20, 2.0, "all"),
        (HALVES, 45, 1.5, "single"),
        (SPLINE, 30, 1.5, "single"),
    ],
)
def test_both_readings_agree_call_by_call(
    cells: Cells, cone_deg: float, step_deg: float, moves: str
) -> None:
    task = Task(standoff=0.005, cone_deg=cone_deg)
    search = Search(method="greedy", step_deg=step_deg, moves=moves)  # type: ignore[arg-type]
    space, literal, at = both(cells, task, search)
    assert_agree(tree_search(space, cells, at), literal)


@pytest.mark.parametrize(
    ("cells", "asked"),
    [
        (CAP, {"roll_deg": (40, 80), "roll_reference": (1, 0, 0)}),
        (CAP, {"approach": (0.3, 0, -1), "cone_deg": 20}),
        (PIPE, {"roll_deg": (-10, 10)}),
        (PLATE, {"roll_deg": (-8, 8)}),
        (TYRE, {"roll_deg": (-13, 13)}),
        (CAP_MESH, {"roll_deg": (-20, 20), "roll_reference": (1, 0, 0)}),
        (CAP_MESH, {"approach": (0.3, 0, -1), "cone_deg": 10}),
    ],
)
def test_both_readings_agree_where_approach_or_roll_are_asked_for(
    cells: Cells, asked: dict[str, object]
) -> None:
    task = Task(**{"standoff": 0.005, "cone_deg": 45, **asked})  # type: ignore[arg-type]
    search = Search(method="greedy", step_deg=0.5)
    space, literal, at = both(cells, task, search)
    tree = tree_search(space, cells, at)
    assert_agree(tree, literal, by_call=cells is not TYRE)
    free = JSpace(PUMA, cells, Task(0.005, 45), literal.start, search)
    other = tree_search(free, cells, at)
    assert other.checked != tree.checked, "the limits did not matter here; take tighter ones"


def test_a_single_call_says_the_same() -> None:
    task, search = Task(standoff=0.005, cone_deg=8), Search(method="greedy", step_deg=0.5)
    space, literal, at = both(DOME, task, search)
    outcomes = []
    for neighbour in DOME.neighbours.of(at).tolist():
        compiled = space.continuity((0,) * PUMA.n, neighbour)
        path = literal.algorithm_1((0,) * PUMA.n, neighbour)
        assert (compiled.outcome is Outcome.FOUND) == bool(path)
        assert [tuple(row) for row in compiled.jcells.tolist()] == list(path)
        outcomes.append(bool(path))
    assert len(outcomes) == 8


def test_a_start_off_the_manifold_is_refused() -> None:
    task, search = Task(0.005, 45), Search(method="greedy", step_deg=1.0)
    literal = LiteralSearch.of(PUMA, DOME, task, search, start=np.zeros(6))
    with pytest.raises(ValueError, match="no feasible J-cell"):
        literal.algorithm_2()
    far = sphere(1.0, (50, 75), (40, 85), position=(9, 0, 0)).cells(2, 2)
    with pytest.raises(ValueError, match="no start was found"):
        LiteralSearch.of(PUMA, far, task, search)


def test_a_subclass_makes_searches_of_its_own() -> None:
    """Whoever overrides a step of the algorithms is to measure that, and not the base class."""

    class Turned(LiteralSearch):
        """Looks at the J-cells in another order."""

    search = Search(method="greedy", step_deg=1.0)
    assert type(Turned.of(PUMA, DOME, Task(0.005, 45), search)) is Turned
