"""The compiled search against the literal reading of Algorithms 1 and 2, call by call."""

import numpy as np
import pytest
from mesh_patches import in_cells_of
from samples import sampled, spread

import coverable
from coverable import Search, Task, cylinder, hyperboloid, piecewise, plane, sphere, torus
from feasibility.paper.continuity import JSpace
from feasibility.paper.greedy import tree_search
from feasibility.paper.literal import LiteralSearch

PUMA = coverable.load_robot("puma560", limits="set-1")
NET = [[(x, y, 0.35 + x * (0.25 * y - 0.1 * x)) for y in (-0.2, 0, 0.2)] for x in (0.5, 0.65, 0.8)]
AT = {"side": "outside", "position": (0.3, 0, -0.3)}
PATCHES = {
    "dome": lambda: sphere(1.0, (50, 75), (40, 85), side="inside").cells(3, 3),
    "wall": lambda: cylinder(1.0, (20, 60), (0.2, 0.6), side="inside").cells(3, 3),
    "waist": lambda: hyperboloid(0.8, 0.6, (20, 60), (0.1, 0.4), side="inside").cells(3, 2),
    "table": lambda: plane((0.5, 0.8), (-0.2, 0.2), "outside", (0, 0, 0.1)).cells(3, 3),
    "ring": lambda: torus(0.8, 0.3, (20, 60), (-20, 20), side="inside").cells(3, 3),
    "mesh": lambda: in_cells_of(PATCHES["dome"](), 6),
    "halves": lambda: piecewise(
        [sphere(1.0, polar, (40, 85)) for polar in ((50, 62), (62, 75))], side="inside"
    ).cells((2, 3)),
    "spline": lambda: coverable.bspline(NET, degree=(2, 2), side="outside").cells(2, 2),
    # Over these the tool rolls as the arm turns.
    "cap": lambda: sphere(0.5, (15, 40), (-40, 40), **AT).cells(3, 3),
    "tyre": lambda: torus(
        0.25, 0.15, (-40, 40), (60, 100), position=(0.35, 0, 0.05), side="outside"
    ).cells(3, 3),
    "pipe": lambda: cylinder(
        0.4, (-25, 25), (-0.2, 0.2), "outside", (0.6, 0, -0.3), (0, -90, 0)
    ).cells(3, 3),
    "plate": lambda: plane((0.5, 0.7), (-0.1, 0.1), "outside", (0, 0, 0.1)).cells(2, 2),
    "meshed cap": lambda: in_cells_of(PATCHES["cap"](), 6),
}


def both(cells, task, search):
    literal = LiteralSearch.of(PUMA, cells, task, search)
    space = JSpace(PUMA, cells, task, literal.start, search, literal.steps)
    return space, literal, space.cell_of(np.zeros(PUMA.n, dtype=np.int32))


def assert_agree(tree, literal, by_call=True):
    found = literal.algorithm_2()
    assert tree.capped == 0, "a capped call is no answer; take smaller cells"
    assert {a: tree.parent.get(a) for a in tree.jcell} == found.T
    assert {frozenset(pair) for pair in tree.edges} == set(found.G)
    assert tree.calls == len(found.calls) > 1
    if by_call:
        for pair, path in tree.edges.items():
            assert [tuple(row) for row in path.tolist()] == list(found.G[frozenset(pair)])
        # Each call looks at its own first J-cell too; so do the E-cells of TREESEARCH.
        assert tree.checked == found.checked - len(found.calls) - len(found.T) - 1


FINE = [("dome", 45, 0.3, "single"), ("mesh", 45, 0.5, "single"), ("ring", 45, 0.5, "single")]
ASKED = [
    ("dome", 45, 1.0, "single"), ("dome", 45, 2.0, "all"), ("wall", 20, 0.5, "single"),
    ("waist", 30, 0.5, "single"), ("waist", 10, 0.6, "single"), ("table", 25, 1.0, "single"),
    ("ring", 45, 1.0, "single"), ("mesh", 45, 1.0, "single"), ("mesh", 20, 2.0, "all"),
    ("halves", 45, 1.5, "single"), ("spline", 30, 1.5, "single"),
]  # fmt: skip


@sampled(("name", "cone_deg", "step_deg", "moves"), [*spread(ASKED, 7), *spread(FINE, 0)])
def test_both_readings_agree_call_by_call(name, cone_deg, step_deg, moves):
    cells = PATCHES[name]()
    search = Search(method="greedy", step_deg=step_deg, moves=moves)
    space, literal, at = both(cells, Task(0.005, cone_deg), search)
    assert_agree(tree_search(space, cells, at), literal)


@pytest.mark.parametrize(("name", "asked"), [
    ("cap", {"roll_deg": (40, 80), "roll_reference": (1, 0, 0)}),
    ("cap", {"approach": (0.3, 0, -1), "cone_deg": 20}), ("pipe", {"roll_deg": (-10, 10)}),
    ("plate", {"roll_deg": (-8, 8)}), ("tyre", {"roll_deg": (-13, 13)}),
    ("meshed cap", {"roll_deg": (-20, 20), "roll_reference": (1, 0, 0)}),
    ("meshed cap", {"approach": (0.3, 0, -1), "cone_deg": 10}),
])  # fmt: skip
def test_both_readings_agree_where_approach_or_roll_are_asked_for(name, asked):
    cells, task = PATCHES[name](), Task(**{"standoff": 0.005, "cone_deg": 45, **asked})
    search = Search(method="greedy", step_deg=1.0 if "meshed" in name else 0.5)
    space, literal, at = both(cells, task, search)
    tree = tree_search(space, cells, at)
    assert_agree(tree, literal, by_call=name != "tyre")
    free = JSpace(PUMA, cells, Task(0.005, 45), literal.start, search)
    other = tree_search(free, cells, at)
    assert other.checked != tree.checked, "the limits did not matter here; take tighter ones"
