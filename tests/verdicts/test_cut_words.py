"""Cut trees: which cut parts two configurations, and what trees say in words."""

from __future__ import annotations

import numpy as np
import pytest
from asked import question
from samples import sampled, seeds

from feasibility.cut_tree import Cut, CutTree, Leaf
from feasibility.cut_words import lines, nowhere, place_of, sentence, what_opens
from robots import load_robot
from surfaces import plane

PUMA = load_robot("puma560")
CELLS = plane((0, 1), (0, 1)).cells(5, 5)


def cut(joint: int, value_deg: float, below: Cut | Leaf, above: Cut | Leaf) -> Cut:
    return Cut(tuple(np.eye(6)[joint]), np.radians(value_deg), below, above)


THREE = CutTree(
    cut(2, -82.0, cut(4, 0.04, Leaf(21), Leaf(20)), cut(1, 12.5, Leaf(0), Leaf(21))),
    opened=((5, np.radians(178.0)),),
)


def test_a_tree_is_indented_lines() -> None:
    assert lines(THREE, PUMA, CELLS) == [
        "joint6 can nowhere be at 178 deg (or whole turns away).",
        "Nowhere on the surface can joint3 be -82 deg.",
        "  below: nowhere there can joint5 be 0 deg.",
        "    below: cell [4, 1] cannot be covered.",
        "    above: cell [4, 0] cannot be covered.",
        "  above: nowhere there can joint2 be 12.5 deg.",
        "    below: cell [0, 0] cannot be covered.",
        "    above: cell [4, 1] cannot be covered.",
    ]
    assert sentence(THREE, PUMA, CELLS) == (
        "joint6 can nowhere be at 178 deg (or whole turns away); 3 cuts that no motion crosses "
        "(joint3 = -82 deg, joint5 = 0 deg, joint2 = 12.5 deg) leave 4 regions of the joint "
        "space, and in each a cell cannot be covered ([4, 1], [4, 0], [0, 0])"
    )


def test_slides_are_in_millimetres_and_sums_name_their_joints() -> None:
    robot = question("on a rail").robot
    (slide,) = np.flatnonzero(robot.prismatic)
    weights = np.zeros(robot.n)
    weights[slide] = 1.0
    on_rail = Cut(tuple(weights), 0.1234, Leaf(0), Leaf(1))
    assert place_of(on_rail, robot) == f"{robot.joint_names[slide]} = 123.4 mm"
    weights[slide + 1] = -0.5
    assert place_of(Cut(tuple(weights), 0.1, Leaf(0), Leaf(1)), robot) == (
        f"{robot.joint_names[slide]} - 0.5 {robot.joint_names[slide + 1]} = "
        "0.1 (joints in radians and metres)"
    )
    turning = Cut((0.6, 0.0, 0.8, 0, 0, 0), np.radians(-40.0), Leaf(0), Leaf(1))
    text = "nowhere on the surface can 0.6 joint1 + 0.8 joint3 be -40 deg"
    assert nowhere(turning, PUMA) == text


def test_a_deep_tree_is_said_without_deep_calls() -> None:
    node: Cut | Leaf = Leaf(0)
    for k in range(3000):
        node = cut(0, 0.01 * k, node, Leaf(1))
    tree = CutTree(node)
    assert len(lines(tree, PUMA, CELLS)) == 6001
    assert "and 297 more" in sentence(tree, PUMA, CELLS)


@sampled
@pytest.mark.parametrize("seed", seeds(2, all=20))
def test_configurations_are_parted_by_the_last_cut_that_both_meet(seed: int) -> None:
    """Against walking down the tree by hand."""
    rng = np.random.default_rng(seed)
    for _ in range(50):
        q, other = np.radians(rng.uniform(-180.0, 180.0, (2, 6)))
        low, beyond = q[2] > np.radians(-82.0), other[2] > np.radians(-82.0)
        joint, value = (1, 12.5) if low else (4, 0.04)
        if low != beyond:
            expected = THREE.root
        elif (q[joint] > np.radians(value)) != (other[joint] > np.radians(value)):
            expected = THREE.root.above if low else THREE.root.below
        else:
            expected = None
        assert THREE.parting(q, other) is expected
        assert THREE.parting(other, q) is expected


def test_opened_joints_are_wound_into_one_turn() -> None:
    q = np.zeros((3, 6))
    q[:, 5] = np.radians([-190.0, 170.0, 530.0])
    folded = THREE.folded(q)
    assert np.degrees(folded[:, 5]) == pytest.approx([530.0, 530.0, 530.0])
    assert (folded[:, :5] == 0.0).all()


def walk_of(*rows_deg: dict[int, float]) -> np.ndarray:
    """(m, 6) rad, each row zero but for some joints."""
    walk = np.zeros((len(rows_deg), 6))
    for row, joints in zip(walk, rows_deg, strict=True):
        for joint, value in joints.items():
            row[joint] = np.radians(value)
    return walk


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (({2: -90}, {2: -80}), "the motion then crosses joint3 = -82 deg, which no motion can now"),
        (({2: -90, 4: -1}, {2: -90, 4: 1}), "the motion then crosses joint5 = 0 deg, which no"),
        (({2: -80, 1: 10}, {2: -80, 1: 15}), "the motion then crosses joint2 = 12.5 deg, which no"),
        (({5: 170}, {5: 190}), "joint6 then passes 178 deg, which it cannot now"),
        (({5: 530}, {5: 550}), "joint6 then passes 178 deg, which it cannot now"),
        (({2: -90, 4: -5}, {2: -85, 4: -5}), "cell [4, 1] can then be covered below joint5 = 0"),
        (
            ({1: 10},),
            "cell [0, 0] can then be covered below joint2 = 12.5 deg, where it cannot now",
        ),
        (({1: 13, 5: 360},), "cell [4, 1] can then be covered above joint2 = 12.5 deg"),
    ],
)
def test_what_a_motion_of_a_changed_case_opens(rows: tuple[dict[int, float]], said: str) -> None:
    assert what_opens(THREE, walk_of(*rows), PUMA, CELLS).startswith(said)
