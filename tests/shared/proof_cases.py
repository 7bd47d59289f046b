"""Questions whose cut trees are known: arms of two joints by hand, stored ones for PUMA and UR5."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from arm_urdfs import arm, joint, load_text
from oracle_build import built
from random_cases import read

from feasibility import Task
from feasibility.cut_tree import Cut, CutTree, Leaf
from robots import Robot, load_robot
from surfaces import Cells, plane

TREES = Path(__file__).parent / "cut_trees.json"
FLAT = Task(standoff=0.0, cone_deg=20.0)
ACROSS = float(np.arccos(0.68))
"""Angle between the first link (1 m) and the line to a tool point 1 m away; second link 0.8 m."""


class Proved(NamedTuple):
    """A question and the tree that answers it with no."""

    robot: Robot
    cells: Cells
    task: Task
    tree: CutTree


def elbow(folder: Path, q1: float = ACROSS + 0.1, q2: str = "revolute") -> Robot:
    """Two links, 1 m and 0.8 m, in the plane z = 0, the tool axis along z."""
    text = arm(
        [
            joint(1, "revolute", limits=(-q1, q1)),
            joint(2, q2, (1.0, 0.0, 0.0), limits=(-3.0, 3.0)),
            joint(3, "fixed", (0.8, 0.0, 0.0)),
        ]
    )
    return load_text(folder, text, tool_frame="l3")


def strip() -> Cells:
    """Five cells side by side 1 m from the base, at angles from -0.2 to 0.2."""
    return plane((0.99, 1.01), (-0.25, 0.25), side="inside").cells(1, 5)


def elbow_case(folder: Path) -> Proved:
    """Elbow up misses cell 0, elbow down cell 4, and q2 = 0 sweeps a circle beyond the strip."""
    tree = CutTree(Cut((0.0, 1.0), 0.0, below=Leaf(4), above=Leaf(0)))
    return Proved(elbow(folder), strip(), FLAT, tree)


def free_elbow_case(folder: Path) -> Proved:
    """The same with a second joint that turns freely: opened at pi, cut at two pi."""
    tree = CutTree(Cut((0.0, 1.0), 2.0 * np.pi, below=Leaf(4), above=Leaf(0)), opened=((1, np.pi),))
    return Proved(elbow(folder, q2="continuous"), strip(), FLAT, tree)


def rail_case(folder: Path, limit: float = 0.42, y: float = 0.3) -> Proved:
    """A link of 0.5 m on a rail along x; with the rail at 0 the tool passes beside the strip."""
    text = arm(
        [
            joint(1, "prismatic", axis=(1.0, 0.0, 0.0), limits=(-1.0, 1.0)),
            joint(2, "revolute", limits=(0.0, 3.1)),
            joint(3, "fixed", (0.5, 0.0, 0.0)),
        ]
    )
    robot = load_text(folder, text, tool_frame="l3").with_limits({"j1": (-limit, limit)})
    cells = plane((-0.05, 0.05), (y - 0.01, y + 0.01), side="inside").cells(5, 1)
    return Proved(robot, cells, FLAT, CutTree(Cut((1.0, 0.0), 0.0, below=Leaf(0), above=Leaf(4))))


def to_plain(node: Cut | Leaf) -> Any:
    """A tree as lists: [cell], or [weights, value, below, above]."""
    if isinstance(node, Leaf):
        return [node.cell]
    return [list(node.weights), node.value, to_plain(node.below), to_plain(node.above)]


def from_plain(plain: Any) -> Cut | Leaf:
    """The tree that `to_plain` wrote."""
    if len(plain) == 1:
        return Leaf(plain[0])
    weights, value, below, above = plain
    return Cut(tuple(weights), value, from_plain(below), from_plain(above))


@cache
def stored() -> tuple[tuple[str, int, Any], ...]:
    """Arm, number of the oracle's case, tree as lists."""
    return tuple(tuple(row) for row in json.loads(TREES.read_text(encoding="utf-8")))


@cache
def stored_case(index: int) -> Proved:
    """One of the stored trees with its question."""
    name, number, plain = stored()[index]
    robot, cells, task = built(read(name)[number][0], load_robot(name))
    return Proved(robot, cells, task, CutTree(from_plain(plain)))


@cache
def feasible_case() -> tuple[Robot, Cells, Task]:
    """A case of the PUMA's that is feasible."""
    problem, _ = next(case for case in read("puma560") if case[1].feasible)
    return built(problem, load_robot("puma560"))
