"""The verifier of cut trees: true proofs are accepted, damaged ones refused with the reason."""

from dataclasses import replace
from unittest.mock import Mock

import mesh_patches
import numpy as np
import pinocchio as pin
import proof_cases
import pytest
from arm_urdfs import joint
from gantry import gantry
from proof_cases import elbow, elbow_case, free_elbow_case, rail_case, split, stored_case, strip
from random_arms import planar_arm, robot_of
from samples import EVERYTHING, sampled, seeds

from coverable import Axis, Task, bspline, load_robot, mesh, piecewise, plane, poses
from feasibility.certification.cut_proofs.proof_verification import too_far, verify_on, verify_proof
from feasibility.cut_tree import Cut, CutTree, Leaf
from robots.kinematics import Kinematics
from surfaces.meshes.triangle_mesh import TriangleMesh

FEW = 8_000


def verified(case, root=None, most=FEW, **changes):
    """What becomes of a case with another root of its tree."""
    tree = case.tree if root is None else replace(case.tree, root=root)
    return verify_proof(*case._replace(**{"tree": tree, **changes}), most=most)


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
    for opened, value in case.tree.opened:
        low[opened], high[opened] = value - 1e-3, value + 2 * np.pi + 1e-3
    assert ((q >= low) & (q <= high)).all()
    point, _ = Kinematics(case.robot).tool(q)
    surface, task = case.cells.surface, case.task
    height = float(surface.closest(point).height) - surface.side_sign * task.standoff
    assert abs(height) <= task.effective_tolerance + 2e-3


@pytest.mark.parametrize("make", [elbow_case, free_elbow_case, rail_case])
def test_trees_made_by_hand_are_accepted(make):
    """Also of a toolpath through the centres, whose surface are the curves between them."""
    case = make()
    found = verify_proof(*case)
    assert found.accepted, found.refusal
    assert 0 < found.boxes < 2000
    path = poses(case.cells.centres, case.cells.normals, side="inside")
    assert verified(case, cells=path).accepted
    assert "leaf" in verified(case, Leaf(2), cells=path).refusal


@sampled("index", range(len(proof_cases.STORED) - 1) if EVERYTHING else proof_cases.QUICK)
def test_stored_trees_are_accepted(index):
    ticks = []
    found = verify_proof(*stored_case(index), tick=lambda: ticks.append(1))
    assert found.accepted, found.refusal
    assert len(ticks) > 3


@pytest.mark.parametrize("q2", [0.5, -0.5, 2.0, -2.5])
def test_a_cut_is_true_where_the_arm_comes_nowhere(q2):
    """Elbow up alone comes to the strip at q2 > 0, within 1.8 < |q2| < 2.1 or so."""
    found = verified(elbow_case(), split(q2, 4, 0))
    assert found.accepted == (abs(q2) < 1.0), found.refusal


def test_a_cut_is_false_where_a_motion_goes_through_it():
    """Elbow up alone: both leaves are true, and the middle of the strip is reached on the cut."""
    robot = elbow(q1=proof_cases.ACROSS + 0.3).with_limits({"j2": (1.0, 2.5)})
    found = verified(elbow_case(), split(-proof_cases.ACROSS, 4, 0, 0), robot=robot)
    assert "the cut j1 = -47.2 deg is wrong: the tool can be on the surface" in found.refusal


def test_a_cell_out_of_reach_is_a_leaf_alone():
    """Also where the slide has no limits: it is bounded by what the arm can reach."""
    high, near = rail_case(y=0.6), rail_case()
    assert verified(high, Leaf(2)).accepted
    free = {"robot": high.robot.with_limits({"j1": (-np.inf, np.inf)})}
    assert verified(high, Leaf(2), **free).accepted
    found = verified(near, Leaf(2), **free)
    assert "leaf 1 (cell [2, 0]) is wrong: the tool can be at its target" in found.refusal
    assert_points_refute(near._replace(**free), found.refusal)
    cells = plane((-2, 6), (0.29, 0.31), side="inside").cells(2, 1)  # one is at 4 m
    assert not verified(near, Leaf(1), cells=cells, **free).accepted
    slides = [joint(1, "prismatic", axis=(1, 0, 0)), joint(2, "prismatic", axis=(-1, 0, 0))]
    robot = robot_of(slides).with_limits(np.tile([-np.inf, np.inf], (2, 1)))
    found = verify_proof(robot, strip(), proof_cases.FLAT, CutTree(Leaf(0)))
    assert found.refusal == "j1 and j2 slide without limits, which no bound covers"


def test_windings_are_not_one():
    """Limits wider than a turn: below 0 are elbows up too, one turn down."""
    case = elbow_case()
    wide = case._replace(robot=case.robot.with_limits({"j2": (-2 * np.pi, 2 * np.pi)}))
    assert "leaf 1 (cell [0, 4]) is wrong" in verified(wide).refusal
    assert verified(wide, tree=CutTree(free_elbow_case().tree.root, opened=((1, np.pi),))).accepted
    assert "leaf 1" in verified(wide, split(np.pi, split(0.0, 4, 0), 4)).refusal
    assert verified(wide, split(np.pi, split(-np.pi, 0, split(0.0, 4, 0)), 4)).accepted


def test_an_opening_has_to_be_empty():
    case = free_elbow_case()
    q2 = float(np.arccos((1.0 - 1.64) / 1.6))  # an elbow that reaches the strip's middle
    found = verified(case, tree=replace(case.tree, opened=((1, q2),)))
    assert f"the opening j2 = {np.degrees(q2):.1f} deg is wrong" in found.refusal
    assert "leaf" in verified(case, tree=replace(case.tree, opened=())).refusal
    late = CutTree(split(4.5 * np.pi, 4, 0), opened=((1, np.pi),))  # below the cut are all turns
    assert "leaf" in verified(case, tree=late).refusal


def test_a_cut_outside_the_limits_leaves_an_empty_side():
    case = elbow_case()
    assert verified(case, split(4.0, case.tree.root, 2)).accepted
    assert not verified(case, split(-4.0, case.tree.root, 2)).accepted


def with_first_leaf(node, leaf):
    """The tree with the leaf below all cuts exchanged."""
    if isinstance(node, Leaf):
        return leaf
    return replace(node, below=with_first_leaf(node.below, leaf))


@sampled("index", proof_cases.QUICK[: len(seeds(2, all=3))])
def test_exchanged_cells_and_cuts_of_other_joints_are_refused_where_a_motion_refutes_them(index):
    case, refused = stored_case(index), [0, 0]
    leaves = [with_first_leaf(case.tree.root, Leaf(k)) for k in range(0, len(case.cells), 4)]
    others = [replace(case.tree.root, joint=j) for j in range(case.robot.n)]
    for k, roots in enumerate((leaves, others)):
        for root in roots:
            found = verified(case, root)
            if not found.accepted:  # a few others are true as well
                assert_points_refute(case, found.refusal)
            refused[k] += "q = [" in found.refusal and ("leaf 1 (cell [" in found.refusal or k)
    assert min(refused) > 0


def random_tree(rng, robot, cells, depth=0):
    if depth == 3 or rng.random() < 0.35 * depth:
        return Leaf(int(rng.integers(cells)))
    joint = int(rng.integers(robot.n))
    value = float(rng.uniform(robot.lower[joint], robot.upper[joint]))
    return Cut(joint, value, *(random_tree(rng, robot, cells, depth + 1) for _ in range(2)))


@sampled("seed", seeds(2, all=30))
def test_no_tree_is_accepted_where_a_motion_covers_all(seed):
    """Elbow up alone covers the strip, with the first joint's limits a little wider."""
    rng, arm = np.random.default_rng(seed), elbow(q1=proof_cases.ACROSS + 0.3)
    for _ in range(19):
        tree = CutTree(random_tree(rng, arm, 5))
        assert not verify_proof(arm, strip(), proof_cases.FLAT, tree).accepted
    robot, cells, task, _ = stored_case(len(proof_cases.STORED) - 1)
    tree = CutTree(random_tree(rng, robot, len(cells)))
    assert not verify_proof(robot, cells, task, tree, most=1000).accepted


DEEP, WIDE = Leaf(0), Leaf(0)
for _ in range(5000):
    DEEP = split(0.0, DEEP, 1)
for _ in range(40):
    WIDE = split(0.0, WIDE, WIDE)
SHAPES = {
    "a cut goes through joint 2, which is none": CutTree(split(0.0, 0, 1, 2)),
    "a cut goes through joint None": CutTree(split(0.0, 0, 1, None)),
    "a cut goes through joint -1": CutTree(split(0.0, 0, 1, -1)),
    "a cut goes through joint (0.0, 1.0)": CutTree(split(0.0, 0, 1, (0.0, 1.0))),
    "a cut has the value nan": CutTree(split(np.nan, 0, 1)),
    "a cut has the value inf": CutTree(split(np.inf, 0, 1)),
    "a cut has the value 1000000": CutTree(split(10**400, 0, 1)),
    "a leaf names cell a whole number of thousands of digits": CutTree(Leaf(10**5000)),
    "a leaf names cell 5; there are 5": CutTree(Leaf(5)),
    "a leaf names cell -1": CutTree(Leaf(-1)),
    "a leaf names cell 1.5": CutTree(Leaf(1.5)),
    "a leaf names cell True": CutTree(Leaf(True)),
    "neither a cut nor a leaf but NoneType": CutTree(split(0.0, None, 1)),
    "expected a CutTree, got str": "tree",
    "opened joint 2 is none of the 2": CutTree(Leaf(0), opened=((2, 0.0),)),
    "joint j2 is opened at nan": CutTree(Leaf(0), opened=((1, np.nan),)),
    "joint j2 is opened twice": CutTree(Leaf(0), opened=((1, 0.0), (1, 1.0))),
    "opened joints are no pairs": CutTree(Leaf(0), opened=(1,)),
    "more than 10,000 nodes": CutTree(WIDE),
    "has more than 10,000 nodes": CutTree(DEEP),
}


@pytest.mark.parametrize("words", SHAPES)
def test_what_is_no_tree_is_refused(words):
    found = verify_proof(elbow(), strip(), proof_cases.FLAT, SHAPES[words])
    assert words in found.refusal
    assert found.boxes == 0


def test_a_slide_is_not_opened():
    found = verified(rail_case(), tree=CutTree(Leaf(0), opened=((0, 0.0),)))
    assert found.refusal == "joint j1 slides and cannot be opened: there are no turns of it"


def test_arms_that_are_no_chain_are_not_proved_of():
    """Two joints side by side, of which the second carries the tool."""
    case, model = elbow_case(), pin.Model()
    for name in ("j1", "j2"):
        model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), name)
    model.addFrame(pin.Frame("l3", 2, 0, pin.SE3.Identity(), pin.FrameType.BODY))
    found = verified(case, robot=replace(case.robot, model=model))
    assert "form no serial chain" in found.refusal
    assert found.boxes == 0


@pytest.mark.parametrize("most", [200, 500])
def test_the_budget_ends_a_proof_that_would_succeed(most):
    found = verified(stored_case(0), most=most)
    assert "boxes it is still open" in found.refusal
    assert found.boxes < most + 2048


def test_what_tick_raises_ends_the_verification():
    with pytest.raises(KeyboardInterrupt):
        verify_proof(*stored_case(0), tick=Mock(side_effect=KeyboardInterrupt))


def strip_of(kind):
    if kind == "mesh":
        u, v, faces = mesh_patches.grid(1, 10)
        corners = np.stack([0.99 + 0.02 * u, -0.25 + 0.5 * v, 0.0 * u], axis=1)
        return mesh(TriangleMesh(corners, faces), side="inside").cells(count=5)
    if kind == "spline":
        x, y = np.meshgrid([0.99, 1.01], np.linspace(-0.25, 0.25, 4), indexing="ij")
        return bspline(np.stack([x, y, 0.0 * x], 2), degree=(1, 3), side="inside").cells(1, 5)
    pieces = [plane((0.99, 1.01), span, side="inside") for span in ((-0.25, 0.0), (0.0, 0.25))]
    return piecewise(pieces, side="inside").cells((1, 3))


@pytest.mark.parametrize("kind", ["mesh", "spline", "pieces"])
def test_proofs_over_other_kinds_of_surface(kind):
    cells = strip_of(kind)
    right, left = (int(end(cells.centres[:, 1])) for end in (np.argmax, np.argmin))
    root = split(0.0, right, left)
    found = verified(elbow_case(), root, cells=cells)
    assert found.accepted, found.refusal
    assert "leaf 1" in verified(elbow_case(), root, cells=cells, robot=elbow(q1=1.2)).refusal


def test_surfaces_whose_bounds_miss_them_prove_nothing():
    """The parts of a smaller patch hold no place of the larger one's rim."""
    case = elbow_case()
    own = case.cells.surface.parts(1e-4, 0.1)
    smaller = plane((0.99, 1.01), (-0.2, 0.25), side="inside").parts(1e-4, 0.1)
    shifted = replace(own, centre=own.centre + 1e-3)
    assert verify_on(*case, own).accepted
    for parts in (smaller, shifted):
        assert "the surface's bounds do not hold the surface" in verify_on(*case, parts).refusal


def test_too_far_is_what_lies_further_than_the_links_are_long():
    arm, rail = planar_arm(3), Axis("rail", "prismatic", (1, 0, 0), limits=(-2, 4))
    (end,), _ = Kinematics(arm).tools(np.zeros((1, 3)))
    for share in (0.999, 1.001):
        assert too_far(arm, np.add(end, (0.01 * share, 0, 0)), 0.01) == (share > 1.0)
    for robot in (load_robot("xarm7"), load_robot("ur5", axes=[rail])):
        q = np.random.default_rng(0).uniform(-2, 2, (10, robot.n))
        tips, _ = Kinematics(robot).tools(q.clip(robot.lower, robot.upper))
        assert not any(too_far(robot, tip, 0.0) for tip in tips)
        far = plane((3.9, 6.9), (-0.5, 0.5), "outside").cells(4, 1)
        found = verify_proof(robot, far, Task(0.0, 180.0), CutTree(Leaf(3)))
        assert (found.accepted, found.boxes) == (True, 0)


def test_where_a_surface_has_no_bounds_nothing_is_proved():
    """But that a cell's own target is out of reach."""
    case = elbow_case()
    points, (along, *_), _ = case.task.targets(case.cells)
    cells = poses(points[:2], [[0, 0, 1]] * 2, approaches=[[0, 1, 0], along])
    assert verified(case, Leaf(0), cells=cells).accepted
    free = {"cells": cells, "robot": free_elbow_case().robot}
    assert verified(case, tree=CutTree(Leaf(0), opened=((1, 0.0),)), **free).accepted
    assert "is wrong" in verified(case, Leaf(1), cells=cells).refusal
    refusal = verified(case, split(0.0, 0, 0), cells=cells).refusal
    assert "the surface has no bounds to prove anything with" in refusal


TABLE = plane((0.35, 0.55), (-0.1, 0.1), side="outside", position=(0, 0, 0.2)).cells(1, 1)
DOWN = Task(0.005, 2.0, roll_deg=(-2, 2), roll_reference=(1, 0, 0))
HELD = load_robot("ur5").with_limits(
    {"wrist_3_joint": np.radians([20.0, 60.0]), "shoulder_pan_joint": (-1.5, 1.5),
     "shoulder_lift_joint": (-2.5, -0.5), "elbow_joint": (0.5, 2.5)}
)  # fmt: skip


@pytest.mark.parametrize("roll", [(-2, 2), None, (-180, 60)])
def test_a_cell_that_the_roll_alone_prevents_is_proved(roll):
    """With the last joint held, the tool comes to the table, but never along x."""
    task = replace(DOWN, roll_deg=roll)
    found = verify_proof(HELD, TABLE, task, CutTree(Leaf(0)), most=200_000)
    assert found.accepted == (roll == (-2, 2)), found.refusal
    assert found.accepted or "is wrong: the tool can be at its target" in found.refusal


@pytest.mark.parametrize(("range_deg", "proved"), [((-80, 80), True), ((-100, 100), False)])
def test_of_wide_ranges_nothing_is_cut_off(range_deg, proved):
    """A gantry whose last joint rolls the tool by 94.5 to 97.4 degrees."""
    limits = {"j6": (1.65, 1.70), **{f"j{k}": (-0.3, 0.3) for k in range(1, 6)}}
    cells = plane((-0.1, 0.1), (-0.1, 0.1), side="outside").cells(1, 1)
    task = Task(0.005, 2.0, roll_deg=range_deg, roll_reference=(1, 0, 0))
    found = verify_proof(gantry().with_limits(limits), cells, task, CutTree(Leaf(0)))
    assert found.accepted == proved, found.refusal
