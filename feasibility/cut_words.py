"""Cut trees in words: where the joints cannot be, and which cell is lost on either side."""

from __future__ import annotations

import math

from coverable.arrays import Array
from coverable.errors import listed
from feasibility.cut_tree import Cut, CutTree, Leaf
from robots.robot import Robot
from surfaces.cells import Cells

INDENT = "  "
MOST_NAMED = 4  # cuts that one sentence names


def joint_value(robot: Robot, joint: int, value: float) -> str:
    """A joint's value with its unit, to a tenth, without a trailing zero.

    Example:
        >>> from coverable import load_robot
        >>> joint_value(load_robot("ur5"), 2, -1.4312)
        '-82 deg'
    """
    size, unit = (1e3 * value, "mm") if robot.prismatic[joint] else (math.degrees(value), "deg")
    return f"{round(size, 1) + 0.0:.10g} {unit}"


def place_of(cut: Cut, robot: Robot) -> str:
    """Where a cut is: "joint3 = -82 deg"."""
    return f"{robot.joint_names[cut.joint]} = {joint_value(robot, cut.joint, cut.value)}"


def nowhere(cut: Cut, robot: Robot, where: str = "on the surface") -> str:
    """What a cut says: "nowhere on the surface can joint3 be -82 deg"."""
    value = joint_value(robot, cut.joint, cut.value)
    return f"nowhere {where} can {robot.joint_names[cut.joint]} be {value}"


def opened(tree: CutTree, robot: Robot) -> list[str]:
    """What is said about joints that turn freely, or by more than a turn."""
    return [
        f"{robot.joint_names[joint]} can nowhere be at {joint_value(robot, joint, value)} "
        "(or whole turns away)"
        for joint, value in tree.opened
    ]


def sentence(tree: CutTree, robot: Robot, cells: Cells) -> str:
    """A cut tree in one sentence, without a full stop.

    Example:
        >>> from coverable import load_robot
        >>> from coverable import plane
        >>> tree = CutTree(Cut(2, -1.4312, Leaf(13), Leaf(2)))
        >>> sentence(tree, load_robot("ur5"), plane((0, 1), (0, 1)).cells(5, 3))
        ... # doctest: +NORMALIZE_WHITESPACE
        'below elbow_joint = -82 deg cell [4, 1] cannot be covered, above it cell [0, 2] cannot,
         and nowhere on the surface can elbow_joint be -82 deg'
    """
    root = tree.root
    if isinstance(root, Leaf):
        text = f"cell {_cell(root, cells)} cannot be covered"
    elif isinstance(root.below, Leaf) and isinstance(root.above, Leaf):
        text = (
            f"below {place_of(root, robot)} cell {_cell(root.below, cells)} cannot be covered, "
            f"above it cell {_cell(root.above, cells)} cannot, and {nowhere(root, robot)}"
        )
    else:
        text = _of_many(tree, robot, cells)
    return "; ".join([*opened(tree, robot), text])


def lines(tree: CutTree, robot: Robot, cells: Cells) -> list[str]:
    """A cut tree as lines, those of a region indented by two blanks more than its cut's."""
    made = [f"{text}." for text in opened(tree, robot)]
    if isinstance(tree.root, Leaf) or tree.n_cuts == 1:
        text = sentence(CutTree(tree.root), robot, cells)
        return [*made, f"{text[0].upper()}{text[1:]}."]
    # On a stack, not by calls: a tree may be deep.
    left: list[tuple[str, int, Cut | Leaf]] = [("", 0, tree.root)]
    while left:
        head, depth, node = left.pop()
        if isinstance(node, Leaf):
            text = f"cell {_cell(node, cells)} cannot be covered"
        else:
            text = nowhere(node, robot, "there" if head else "on the surface")
            left += [("above: ", depth + 1, node.above), ("below: ", depth + 1, node.below)]
        text = f"{head}{text}" if head else f"{text[0].upper()}{text[1:]}"
        made.append(f"{INDENT * depth}{text}.")
    return made


def what_opens(tree: CutTree, walk: Array, robot: Robot, cells: Cells) -> str:
    """What a covering motion (m, n) of a changed case does that the tree rules out in this one."""
    found = tree.opened_by(walk)
    if isinstance(found, Cut):
        return f"the motion then crosses {place_of(found, robot)}, which no motion can now"
    if isinstance(found, tuple):
        joint, value = found
        name = robot.joint_names[joint]
        return f"{name} then passes {joint_value(robot, joint, value)}, which it cannot now"
    text = f"cell {_cell(found, cells)} can then be covered"
    path, _ = tree.path_to(walk[0])
    if path:
        cut, above = path[-1]
        text += f" {'above' if above else 'below'} {place_of(cut, robot)}, where it cannot now"
    return text


def _of_many(tree: CutTree, robot: Robot, cells: Cells) -> str:
    """A tree of several cuts in one sentence: the cuts, and the cells that are lost."""
    cuts = [place_of(node, robot) for node in tree.nodes() if isinstance(node, Cut)]
    named = listed(list(dict.fromkeys(cuts)), MOST_NAMED)
    leaves = list(tree.leaves())
    lost = cells.named(list(dict.fromkeys(leaf.cell for leaf in leaves)), MOST_NAMED)
    return (
        f"{len(cuts)} cuts that no motion crosses ({named}) leave {len(leaves)} regions of the "
        f"joint space, and in each a cell cannot be covered ({lost})"
    )


def _cell(leaf: Leaf, cells: Cells) -> list[int]:
    """The cell of a leaf, as reports name it."""
    return list(cells.unravel(leaf.cell))
