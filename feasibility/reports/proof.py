"""A cut tree as JSON."""

from __future__ import annotations

import math
from typing import Any

from feasibility.cut_tree import Cut, CutTree, Leaf
from robots.robot import Robot
from surfaces.cells import Cells


def proof_json(tree: CutTree | None, robot: Robot, cells: Cells) -> dict[str, Any] | None:
    """The tree as JSON; null where there is none.

    A cut has its joint and `value_deg` (`value_m` of one that slides), and what is below and above
    it. A leaf names its cell.
    """
    return None if tree is None else tree_json(tree, robot, cells)


def tree_json(tree: CutTree, robot: Robot, cells: Cells) -> dict[str, Any]:
    """The same of a tree that there is."""
    return {
        "kind": tree.kind,
        "opened": {robot.joint_names[joint]: float(value) for joint, value in tree.opened},
        "tree": _node(tree.root, robot, cells),
    }


def _node(node: Cut | Leaf, robot: Robot, cells: Cells) -> dict[str, Any]:
    """One node and those under it; trees are shallow, as the search and result files have them."""
    if isinstance(node, Leaf):
        return {"cell": list(cells.unravel(node.cell))}
    sides = {
        "below": _node(node.below, robot, cells),
        "above": _node(node.above, robot, cells),
    }
    slides = bool(robot.prismatic[node.joint])
    key, value = ("value_m", node.value) if slides else ("value_deg", math.degrees(node.value))
    return {"joint": robot.joint_names[node.joint], key: float(value), **sides}
