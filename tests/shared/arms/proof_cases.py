"""Questions whose cut trees are known: arms of two joints by hand, stored ones for PUMA and UR5."""

import json
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from arm_urdfs import joint
from asked import built, of_problem
from random_arms import robot_of

from coverable import Cells, Robot, Task, plane
from feasibility.cut_tree import Cut, CutTree, Leaf

STORED = json.loads((Path(__file__).parents[2] / "bounds" / "cut_trees.json").read_text("utf-8"))
"""Problems of an oracle; the last one is feasible and has no tree."""
QUICK = [number for number, row in enumerate(STORED) if row["quick"]]
FLAT = Task(standoff=0.0, cone_deg=20.0)
ACROSS = float(np.arccos(0.68))
"""Angle between the first link (1 m) and the line to a tool point 1 m away; second link 0.8 m."""


class Proved(NamedTuple):
    robot: Robot
    cells: Cells
    task: Task
    tree: CutTree


def elbow(q1: float = ACROSS + 0.1, q2: str = "revolute") -> Robot:
    """Two links, 1 m and 0.8 m, in the plane z = 0, the tool axis along z."""
    second = joint(2, q2, (1.0, 0.0, 0.0), limits=(-3.0, 3.0))
    return robot_of([joint(1, limits=(-q1, q1)), second, joint(3, "fixed", (0.8, 0.0, 0.0))])


def strip() -> Cells:
    """Five cells side by side 1 m from the base, at angles from -0.2 to 0.2."""
    return plane((0.99, 1.01), (-0.25, 0.25), side="inside").cells(1, 5)


def split(value: float, below: Cut | int, above: Cut | int, joint: int = 1) -> Cut:
    """A cut, of the second joint by default, with cuts or the cells of leaves at its sides."""
    sides = (Leaf(side) if isinstance(side, int) else side for side in (below, above))
    return Cut(joint, value, *sides)


def elbow_case() -> Proved:
    """Elbow up misses cell 0, elbow down cell 4, and q2 = 0 sweeps a circle beyond the strip."""
    return Proved(elbow(), strip(), FLAT, CutTree(split(0.0, 4, 0)))


def free_elbow_case() -> Proved:
    """The same with a second joint that turns freely: opened at pi, cut at two pi."""
    tree = CutTree(split(2.0 * np.pi, 4, 0), opened=((1, np.pi),))
    return Proved(elbow(q2="continuous"), strip(), FLAT, tree)


def rail_case(limit: float = 0.42, y: float = 0.3) -> Proved:
    """A link of 0.5 m on a rail along x; with the rail at 0 the tool passes beside the strip."""
    robot = robot_of(
        [joint(1, "prismatic", axis=(1.0, 0.0, 0.0), limits=(-1.0, 1.0)),
         joint(2, limits=(0.0, 3.1)), joint(3, "fixed", (0.5, 0.0, 0.0))]
    )  # fmt: skip
    cells = plane((-0.05, 0.05), (y - 0.01, y + 0.01), side="inside").cells(5, 1)
    tree = CutTree(split(0.0, 0, 4, 0))
    return Proved(robot.with_limits({"j1": (-limit, limit)}), cells, FLAT, tree)


def tree_of(plain: list) -> Cut | Leaf:
    """A tree from lists: [cell], or [joint, value, below, above]."""
    if len(plain) == 1:
        return Leaf(plain[0])
    joint, value, below, above = plain
    return Cut(joint, value, tree_of(below), tree_of(above))


@cache
def stored_case(index: int) -> Proved:
    """One of the stored trees with its question; the last question without a tree."""
    row = STORED[index]
    robot, cells, task, _ = built(of_problem(row["arm"], row))
    tree = CutTree(Leaf(0) if row["tree"] is None else tree_of(row["tree"]))
    return Proved(robot, cells, task, tree)
