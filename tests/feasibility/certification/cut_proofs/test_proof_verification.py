"""The verifier of cut trees: true proofs are accepted, damaged ones refused with the reason."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from proof_cases import (
    ACROSS,
    elbow,
    elbow_case,
    feasible_case,
    free_elbow_case,
    rail_case,
    stored,
    stored_case,
    strip,
)

import feasibility
from feasibility import Task
from feasibility.certification import verify_proof
from feasibility.cut_tree import Cut, CutTree, Leaf
from robots import Kinematics
from surfaces import plane

FEW = 8_000
QUICK = [number for number, row in enumerate(stored()) if row[1] in (32, 185, 187, 189, 190)]


def with_root(case, **changes):
    """The case with its root cut changed."""
    return case._replace(tree=replace(case.tree, root=replace(case.tree.root, **changes)))


def first_leaf(node):
    """The leaf below all cuts."""
    return node if isinstance(node, Leaf) else first_leaf(node.below)


def with_first_leaf(node, leaf):
    """The tree with that leaf exchanged."""
    if isinstance(node, Leaf):
        return leaf
    return replace(node, below=with_first_leaf(node.below, leaf))


def configuration(refusal):
    """The configuration that a refusal names, empty where it names none."""
    words = refusal.partition("q = [")[2].rstrip("]").split(",")
    return np.array([float(word) for word in words if word])


def assert_points_refute(case, refusal):
    """A configuration named by a refusal is inside the limits, with the tool near the surface."""
    q = configuration(refusal)
    if not len(q):
        assert "boxes it is still open" in refusal
        return
    low, high = case.robot.lower - 1e-3, case.robot.upper + 1e-3
    for joint, value in case.tree.opened:
        low[joint], high[joint] = value - 1e-3, value + 2 * np.pi + 1e-3
    assert ((q >= low) & (q <= high)).all()
    point, _ = Kinematics(case.robot).tool(q)
    surface, task = case.cells.surface, case.task
    height = float(surface.closest(point).height) - surface.side_sign * task.standoff
    assert abs(height) <= task.effective_tolerance + 2e-3


@pytest.mark.parametrize("make", [elbow_case, free_elbow_case, rail_case])
def test_trees_made_by_hand_are_accepted(tmp_path, make):
    check = verify_proof(*make(tmp_path))
    assert check.accepted, check.refusal
    assert 0 < check.boxes < 2000


@pytest.mark.parametrize("index", QUICK)
def test_stored_trees_are_accepted(index):
    ticks = []
    check = verify_proof(*stored_case(index), tick=lambda: ticks.append(1))
    assert check.accepted, check.refusal
    assert check.boxes < 60_000
    assert len(ticks) > 3


def test_a_cut_along_two_joints_is_accepted_where_it_is_true(tmp_path):
    case = with_root(elbow_case(tmp_path), weights=(0.3, 1.0))
    assert verify_proof(*case).accepted
    assert verify_proof(*with_root(case, weights=(0.6, 2.0))).accepted
    assert verify_proof(*with_root(case, weights=(0.0, 2.0))).accepted
    assert verify_proof(*with_root(case, weights=(2.0, 1.0))).accepted  # the limits see to it
    crossing = verify_proof(*with_root(case, weights=(3.0, 1.0)))
    assert "cut 3 j1 + j2 = 0 deg" in crossing.refusal
    assert "the tool can be on the surface at q = [" in crossing.refusal
    turned = Cut((0.0, -2.0), 0.0, below=Leaf(0), above=Leaf(4))
    assert verify_proof(*case._replace(tree=CutTree(turned))).accepted


def test_cuts_along_two_joints_bound_the_regions_below(tmp_path):
    case = elbow_case(tmp_path)
    along = Cut((1.0, 1.0), 5.0, below=case.tree.root, above=Leaf(2))
    assert verify_proof(*case._replace(tree=CutTree(along))).accepted
    wrong = replace(along, value=0.3, above=Leaf(2), below=case.tree.root)
    assert not verify_proof(*case._replace(tree=CutTree(wrong))).accepted


def test_a_cell_out_of_reach_is_a_leaf_alone(tmp_path):
    high = rail_case(tmp_path, y=0.6)
    assert verify_proof(*high._replace(tree=CutTree(Leaf(2)))).accepted
    free = high._replace(
        robot=high.robot.with_limits({"j1": (-np.inf, np.inf)}), tree=CutTree(Leaf(2))
    )
    assert verify_proof(*free).accepted
    near = rail_case(tmp_path)
    near = near._replace(robot=near.robot.with_limits({"j1": (-np.inf, np.inf)}))
    check = verify_proof(*near._replace(tree=CutTree(Leaf(2))))
    assert "leaf 1 (cell [2, 0]) is wrong: the tool can be at its target" in check.refusal
    assert_points_refute(near, check.refusal)


def test_two_free_slides_are_refused(tmp_path):
    from arm_urdfs import arm, joint, load_text

    text = arm([joint(1, "prismatic", axis=(1, 0, 0)), joint(2, "prismatic", axis=(-1, 0, 0))])
    robot = load_text(tmp_path, text, tool_frame="l2").with_limits(
        np.tile([-np.inf, np.inf], (2, 1))
    )
    check = verify_proof(robot, strip(), Task(0.0, 20.0), CutTree(Leaf(0)))
    assert check.refusal == "j1 and j2 slide without limits, which no bound covers"


def test_windings_are_not_one(tmp_path):
    """Limits wider than a turn: below 0 are elbows up too, one turn down."""
    case = elbow_case(tmp_path)
    wide = case._replace(robot=case.robot.with_limits({"j2": (-2 * np.pi, 2 * np.pi)}))
    assert "leaf 1 (cell [0, 4]) is wrong" in verify_proof(*wide).refusal
    root = free_elbow_case(tmp_path).tree.root
    opened = CutTree(root, opened=((1, np.pi),))
    assert verify_proof(*wide._replace(tree=opened)).accepted
    cuts = CutTree(Cut((0.0, 1.0), np.pi, _split(0.0, 4, 0), Leaf(4)))
    refused = verify_proof(*wide._replace(tree=cuts))
    assert "leaf 1" in refused.refusal  # below 0 are still two kinds
    below = Cut((0.0, 1.0), -np.pi, Leaf(0), _split(0.0, 4, 0))
    full = CutTree(Cut((0.0, 1.0), np.pi, below, Leaf(4)))
    assert verify_proof(*wide._replace(tree=full)).accepted


def _split(value, below, above):
    return Cut((0.0, 1.0), value, Leaf(below), Leaf(above))


def test_an_opening_has_to_be_empty(tmp_path):
    case = free_elbow_case(tmp_path)
    q2 = float(np.arccos((1.0 - 1.64) / 1.6))  # an elbow that reaches the strip's middle
    moved = case._replace(tree=replace(case.tree, opened=((1, q2),)))
    check = verify_proof(*moved)
    assert f"the opening j2 = {np.degrees(q2):.1f} deg is wrong" in check.refusal
    closed = case._replace(tree=replace(case.tree, opened=()))
    assert "leaf" in verify_proof(*closed).refusal


def value_of_a_motion(case):
    """Where the cut's joint is while the tool is at some cell's target."""
    cell = 0
    while True:
        anywhere = case._replace(tree=CutTree(Leaf(cell)))
        q = configuration(verify_proof(*anywhere, most=FEW).refusal)
        if len(q):
            return float(q[case.tree.root.joint])
        cell += 1


DAMAGES = {
    "sides swapped": lambda case: with_root(
        case, below=case.tree.root.above, above=case.tree.root.below
    ),
    "cut into the motions": lambda case: with_root(case, value=value_of_a_motion(case)),
    "cone of 100 degrees": lambda case: case._replace(task=replace(case.task, cone_deg=100.0)),
    "tolerance of a metre": lambda case: case._replace(task=replace(case.task, tolerance=1.0)),
    "limits of all turns": lambda case: case._replace(
        robot=case.robot.with_limits(np.tile([-3.3, 3.3], (case.robot.n, 1)))
    ),
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("index", QUICK[:3])
def test_damaged_trees_are_refused_with_the_reason(index, damage):
    case = DAMAGES[damage](stored_case(index))
    check = verify_proof(*case, most=FEW)
    assert not check.accepted
    assert check.refusal.startswith(("the cut joint", "leaf "))
    assert_points_refute(case, check.refusal)


@pytest.mark.parametrize("index", QUICK[:3])
def test_exchanged_cells_are_refused_where_they_can_be_covered(index):
    case = stored_case(index)
    refused = 0
    for cell in range(0, len(case.cells), 3):
        other = case._replace(tree=CutTree(with_first_leaf(case.tree.root, Leaf(cell))))
        check = verify_proof(*other, most=FEW)
        if not check.accepted:
            assert "leaf 1 (cell [" in check.refusal
            assert_points_refute(other, check.refusal)
            refused += 1
    assert refused > 0


@pytest.mark.parametrize("index", QUICK[:3])
def test_cuts_on_another_joint_are_refused_where_a_motion_crosses(index):
    case = stored_case(index)
    refused = 0
    for joint in range(case.robot.n - 1):
        other = with_root(case, weights=tuple(np.eye(case.robot.n)[joint].tolist()))
        check = verify_proof(*other, most=FEW)
        refused += "q = [" in check.refusal
        if not check.accepted:  # a few others are true as well
            assert_points_refute(other, check.refusal)
    assert refused > 0


SHAPES = {
    "a cut has 1 weights for 2 joints": CutTree(Cut((1.0,), 0.0, Leaf(0), Leaf(1))),
    "a cut has no weights for 2 joints": CutTree(Cut(None, 0.0, Leaf(0), Leaf(1))),
    "a cut weighs no joint": CutTree(Cut((0.0, 0.0), 0.0, Leaf(0), Leaf(1))),
    "not all of them numbers": CutTree(Cut((np.nan, 1.0), 0.0, Leaf(0), Leaf(1))),
    "value nan, not all of them": CutTree(Cut((0.0, 1.0), np.nan, Leaf(0), Leaf(1))),
    "value inf, not all of them": CutTree(Cut((0.0, 1.0), np.inf, Leaf(0), Leaf(1))),
    "value 1000000": CutTree(Cut((0.0, 1.0), 10**400, Leaf(0), Leaf(1))),
    "a leaf names cell a whole number of thousands of digits": CutTree(Leaf(10**5000)),
    "a leaf names cell 5; there are 5": CutTree(Leaf(5)),
    "a leaf names cell -1": CutTree(Leaf(-1)),
    "a leaf names cell 1.5": CutTree(Leaf(1.5)),
    "a leaf names cell True": CutTree(Leaf(True)),
    "neither a cut nor a leaf but NoneType": CutTree(Cut((0.0, 1.0), 0.0, None, Leaf(1))),
    "expected a CutTree, got str": "tree",
    "opened joint 2 is none of the 2": CutTree(Leaf(0), opened=((2, 0.0),)),
    "joint j2 is opened at nan": CutTree(Leaf(0), opened=((1, np.nan),)),
    "joint j2 is opened twice": CutTree(Leaf(0), opened=((1, 0.0), (1, 1.0))),
    "opened joints are no pairs": CutTree(Leaf(0), opened=(1,)),
}


@pytest.mark.parametrize("words", SHAPES)
def test_what_is_no_tree_is_refused(tmp_path, words):
    check = verify_proof(elbow(tmp_path), strip(), Task(0.0, 20.0), SHAPES[words])
    assert not check.accepted
    assert words in check.refusal
    assert check.boxes == 0


def test_a_slide_is_not_opened_nor_a_free_joint_weighed_beside_others(tmp_path):
    rail = rail_case(tmp_path)
    check = verify_proof(*rail._replace(tree=CutTree(Leaf(0), opened=((0, 0.0),))))
    assert check.refusal == "joint j1 slides and cannot be opened: there are no turns of it"
    free = elbow(tmp_path, q2="continuous")
    check = verify_proof(
        free, strip(), Task(0.0, 20.0), CutTree(Cut((1.0, 1.0), 0.0, Leaf(0), Leaf(1)))
    )
    assert check.refusal == "a cut weighs j2, which has no limits, together with others"


def test_trees_of_any_size_end(tmp_path):
    deep = Leaf(0)
    for _ in range(5000):
        deep = Cut((0.0, 1.0), 0.0, deep, Leaf(1))
    case = elbow(tmp_path), strip(), Task(0.0, 20.0)
    assert "more than 1,000 cuts deep" in verify_proof(*case, CutTree(deep)).refusal
    wide = Leaf(0)
    for _ in range(40):
        wide = Cut((0.0, 1.0), 0.0, wide, wide)
    assert "more than 10,000 nodes" in verify_proof(*case, CutTree(wide)).refusal


def test_a_cut_outside_the_limits_leaves_an_empty_side(tmp_path):
    case = elbow_case(tmp_path)
    beyond = Cut((0.0, 1.0), 4.0, case.tree.root, Leaf(2))
    assert verify_proof(*case._replace(tree=CutTree(beyond))).accepted
    beyond = replace(beyond, value=-4.0)
    assert not verify_proof(*case._replace(tree=CutTree(beyond))).accepted


def test_the_budget_ends_a_proof_that_would_succeed():
    check = verify_proof(*stored_case(0), most=500)
    assert "after 5" in check.refusal or "boxes it is still open" in check.refusal
    assert check.boxes < 500 + 2048


def test_what_tick_raises_ends_the_verification():
    def stop():
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        verify_proof(*stored_case(0), tick=stop)


def random_tree(rng, robot, cells, depth=0):
    """Any tree: random joints, values inside the limits, cells."""
    if depth == 3 or rng.random() < 0.35 * depth:
        return Leaf(int(rng.integers(cells)))
    weights = np.eye(robot.n)[rng.integers(robot.n)]
    if rng.random() < 0.2:
        weights = weights + np.eye(robot.n)[rng.integers(robot.n)]
    spread = robot.upper - robot.lower
    value = float(weights @ (robot.lower + rng.random(robot.n) * spread))
    sides = (random_tree(rng, robot, cells, depth + 1) for _ in range(2))
    return Cut(tuple(weights.tolist()), value, *sides)


MORE = range(4, 30)  # make campaign NAME=larger_samples


@pytest.mark.parametrize("seed", range(4))
def test_no_tree_is_accepted_where_a_motion_covers_all(tmp_path, seed):
    """Elbow up alone covers the strip, with the first joint's limits a little wider."""
    rng = np.random.default_rng(seed)
    arm, cells, task = elbow(tmp_path, q1=ACROSS + 0.3), strip(), Task(0.0, 20.0)
    for _ in range(19):
        assert not verify_proof(arm, cells, task, CutTree(random_tree(rng, arm, 5))).accepted
    robot, cells, task = feasible_case()
    tree = CutTree(random_tree(rng, robot, len(cells)))
    assert not verify_proof(robot, cells, task, tree, most=1000).accepted


def test_surfaces_whose_bounds_miss_them_prove_nothing(tmp_path):
    """The parts of a smaller patch hold no place of the larger one's rim."""
    from feasibility.certification.cut_proofs.proof_verification import verify_on

    case = elbow_case(tmp_path)
    parts = plane((0.99, 1.01), (-0.2, 0.25), side="inside").parts(1e-4, 0.1)
    check = verify_on(*case, parts)
    assert "the surface's bounds do not hold the surface" in check.refusal
    shrunk = case.cells.surface.parts(1e-4, 0.1)
    assert verify_on(*case, shrunk).accepted
    shifted = replace(shrunk, centre=shrunk.centre + 1e-3)
    assert "the surface's bounds do not hold" in verify_on(*case, shifted).refusal


def test_the_verifier_shares_no_code_with_the_search():
    """Neither the paper's nor the complete one, nor their compiled kinematics."""
    shown = subprocess.run(
        [sys.executable, "-c", LOADING], capture_output=True, text=True, check=True, cwd=ROOT
    )
    loaded = set(shown.stdout.split())
    assert "feasibility.certification.cut_proofs.proof_verification" in loaded
    search = ("feasibility.roadmap", "feasibility.paper", "feasibility.search", "robots.chain")
    assert not [name for name in loaded if f"{name}.".startswith(tuple(f"{s}." for s in search))]


ROOT = Path(feasibility.__file__).parents[1]
LOADING = """
import sys
import numpy as np
import feasibility
from feasibility import Task
from feasibility.certification import verify_proof
from feasibility.cut_tree import CutTree, Leaf
from robots import load_robot
from surfaces import plane
cells = plane((5.0, 6.0), (0.0, 1.0)).cells(1, 2)
check = verify_proof(load_robot("puma560"), cells, Task(0.0, 20.0), CutTree(Leaf(0)))
assert check.accepted
print(*sys.modules)
"""
