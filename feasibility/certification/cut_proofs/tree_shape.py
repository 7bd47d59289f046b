"""What is a cut tree at all? Everything else is refused with the reason, before any proof."""

from __future__ import annotations

from coverable.errors import is_number, is_whole, shown
from feasibility.cut_tree import Cut, CutTree, Leaf
from robots.robot import Robot

MOST_NODES = 10_000
MOST_CUTS_DEEP = 1_000


def malformed(robot: Robot, n_cells: int, tree: CutTree) -> str:
    """Why this is no cut tree for the robot and so many cells; empty when it is one."""
    if not isinstance(tree, CutTree):
        return f"expected a CutTree, got {type(tree).__name__}"
    return _fault_of_opened(robot, tree.opened) or _fault_of_nodes(robot, n_cells, tree)


def _fault_of_opened(robot: Robot, opened: object) -> str:
    """Why joints cannot be opened like that; empty when they can."""
    if not isinstance(opened, tuple) or not all(
        isinstance(pair, tuple) and len(pair) == 2 for pair in opened
    ):
        return "opened joints are no pairs of a joint and a value"
    seen = set()
    for joint, value in opened:
        if not is_whole(joint, 0, robot.n - 1):
            return f"opened joint {shown(joint)} is none of the {robot.n} joints"
        name = robot.joint_names[joint]
        if not is_number(value):
            return f"joint {name} is opened at {shown(value)}, which is no number"
        if robot.prismatic[joint]:
            return f"joint {name} slides and cannot be opened: there are no turns of it"
        if joint in seen:
            return f"joint {name} is opened twice"
        seen.add(joint)
    return ""


def _fault_of_nodes(robot: Robot, n_cells: int, tree: CutTree) -> str:
    """Why the nodes form no tree for this robot and so many cells; empty when they do."""
    waiting: list[tuple[object, int]] = [(tree.root, 0)]
    count = 0
    while waiting:
        node, depth = waiting.pop()
        count += 1
        if count > MOST_NODES:
            return f"the tree has more than {MOST_NODES:,} nodes"
        if depth > MOST_CUTS_DEEP:
            return f"the tree is more than {MOST_CUTS_DEEP:,} cuts deep"
        if isinstance(node, Leaf):
            if not is_whole(node.cell, 0, n_cells - 1):
                return f"a leaf names cell {shown(node.cell)}; there are {n_cells}, counted from 0"
        elif isinstance(node, Cut):
            fault = _fault_of_cut(robot, node)
            if fault:
                return fault
            waiting += [(node.above, depth + 1), (node.below, depth + 1)]
        else:
            return f"a node is neither a cut nor a leaf but {type(node).__name__}"
    return ""


def _fault_of_cut(robot: Robot, cut: Cut) -> str:
    """Why a cut does not fit the robot; empty when it does."""
    if not is_whole(cut.joint, 0, robot.n - 1):
        return f"a cut goes through joint {shown(cut.joint)}, which is none of the {robot.n} joints"
    if not is_number(cut.value):
        return f"a cut has the value {shown(cut.value)}, which is no number"
    return ""
