"""Cut trees: which cut parts two configurations, and what trees say in words."""

import numpy as np
import pytest
from asked import question

from coverable import load_robot, plane
from feasibility.cut_tree import Cut, CutTree, Leaf
from feasibility.cut_words import lines, nowhere, place_of, sentence, what_opens
from feasibility.problem import Problem
from feasibility.roadmap.exploration import Exploration
from feasibility.roadmap.motions.search_arrays import arrays_of
from feasibility.roadmap.outcome import unfinished_words
from feasibility.roadmap.proving import Proving
from feasibility.roadmap.rounds import explore

PUMA = load_robot("puma560")
CELLS = plane((0, 1), (0, 1)).cells(5, 5)


def cut(joint: int, value_deg: float, below: Cut | Leaf, above: Cut | Leaf) -> Cut:
    return Cut(joint, np.radians(value_deg), below, above)


THREE = CutTree(
    cut(2, -82.0, cut(4, 0.04, Leaf(21), Leaf(20)), cut(1, 12.5, Leaf(0), Leaf(21))),
    opened=((5, np.radians(178.0)),),
)


def walk_of(*rows_deg: dict[int, float]) -> np.ndarray:
    """(m, 6) rad, each row zero but for some joints."""
    walk = np.zeros((len(rows_deg), 6))
    for row, joints in zip(walk, rows_deg, strict=True):
        for joint, value in joints.items():
            row[joint] = np.radians(value)
    return walk


OPENED = (
    ({2: -90}, {2: -80}), ({2: -90, 4: -1}, {2: -90, 4: 1}), ({2: -80, 1: 10}, {2: -80, 1: 15}),
    ({5: 170}, {5: 190}), ({5: 530}, {5: 550}), ({2: -90, 4: -5}, {2: -85, 4: -5}), ({1: 10},),
    ({1: 13, 5: 360},),
)  # fmt: skip
"""Motions of a changed case, which cross a cut, pass an opened joint or cover a leaf."""


def test_trees_and_their_cuts_in_words(approved) -> None:
    robot = question("on a rail").robot
    (slide,) = np.flatnonzero(robot.prismatic)
    approved("cut_words", "\n".join([
        *lines(THREE, PUMA, CELLS),
        sentence(THREE, PUMA, CELLS),
        place_of(Cut(int(slide), 0.1234, Leaf(0), Leaf(1)), robot),
        nowhere(cut(0, -40.0, Leaf(0), Leaf(1)), PUMA),
        *(f"{rows}: {what_opens(THREE, walk_of(*rows), PUMA, CELLS)}" for rows in OPENED),
    ]))  # fmt: skip


def test_a_deep_tree_is_said_without_deep_calls() -> None:
    node: Cut | Leaf = Leaf(0)
    for k in range(3000):
        node = cut(0, 0.01 * k, node, Leaf(1))
    tree = CutTree(node)
    assert len(lines(tree, PUMA, CELLS)) == 6001
    assert "and 297 more" in sentence(tree, PUMA, CELLS)


def test_opened_joints_are_wound_into_one_turn() -> None:
    q = np.zeros((3, 6))
    q[:, 5] = np.radians([-190.0, 170.0, 530.0])
    folded = THREE.folded(q)
    assert np.degrees(folded[:, 5]) == pytest.approx([530.0, 530.0, 530.0])
    assert (folded[:, :5] == 0.0).all()


def test_points_of_the_motion_set_on_every_cut_leave_it_undecided() -> None:
    """Along the curves alone no motion is found; the proof fails, and says where the arm can be."""
    _, _, robot, cells, task, _ = question("between the curves")
    exploration = Exploration(robot, cells, arrays_of(robot, cells, task), 0)
    explore(exploration, None)
    proving = Proving(exploration, task)
    proving.attempt(200_000)
    assert not exploration.complete
    assert exploration.cut_tree is None
    words = unfinished_words(Problem.of(robot, cells, task), exploration, proving, "")
    assert "has configurations on the surface between the parts" in words
    assert " deg" in words
