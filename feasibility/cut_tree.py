"""Cut trees: proofs that no single motion covers every cell.

Every node of the tree has a region of the joint space; that of the root is given by the joint
limits. An inner node, a `Cut`, says that inside its region one joint is nowhere at t while the tool
is on the surface, within tolerance and cone. So no motion crosses there, and the two sides,
q_j <= t and q_j >= t, are the regions of its children. A `Leaf` says that inside its region one
cell cannot be covered.

**Theorem.** If there is such a tree, no motion covers every cell. *Proof.* Along a motion inside
the region of a cut, q_j - t is continuous and never zero: its sign stays, and the motion lies in
the region of one child. By induction it lies in the region of a leaf, whose cell it does not cover.
QED

How a tree was found does not matter. A tree that is one leaf proves a cell uncoverable. What is no
tree of the arm and its cells is refused with the reason, before any proof.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array
from coverable.errors import is_number, is_whole, shown
from robots.robot import Robot


@dataclass(frozen=True, slots=True)
class Leaf:
    """A region in which one cell cannot be covered."""

    cell: int
    """Flat index of the cell."""


@dataclass(frozen=True, slots=True)
class Cut:
    """A region that no motion crosses at q_j = t."""

    joint: int
    """j"""
    value: float
    """t, rad (m where the joint slides)."""
    below: Cut | Leaf
    """The side q_j <= t."""
    above: Cut | Leaf
    """The side q_j >= t."""


@dataclass(frozen=True, slots=True)
class CutTree:
    """A proof that no single motion covers every cell; see the module's text."""

    root: Cut | Leaf
    opened: tuple[tuple[int, float], ...] = ()
    """(joint, t) of joints that turn freely, or through more than a turn, and can nowhere be at
    t + 2 pi k while the tool is on the surface: the root's region has t .. t + 2 pi for them, for
    all windings alike."""

    @property
    def kind(self) -> str:
        """'cell' where the proof is one leaf, 'cut' otherwise."""
        return "cell" if isinstance(self.root, Leaf) and not self.opened else "cut"

    @property
    def n_cuts(self) -> int:
        """Number of cuts, those that open joints on their circle not counted."""
        return sum(isinstance(node, Cut) for node in self.nodes())

    def leaves(self) -> Iterator[Leaf]:
        """The leaves, those below a cut before those above it."""
        return (node for node in self.nodes() if isinstance(node, Leaf))

    def folded(self, q: Array) -> Array:
        """Configurations (..., n) with opened joints turned into t .. t + 2 pi."""
        q = np.array(q, dtype=float)
        for joint, value in self.opened:
            q[..., joint] = value + np.mod(q[..., joint] - value, 2.0 * np.pi)
        return q

    def path_to(self, *q: Array) -> tuple[list[tuple[Cut, bool]], Cut | Leaf]:
        """The cuts from the root down that configurations (n,) are on one side of together.

        Each with whether they are above it; all of a motion is. And the first cut that they are on
        both sides of, or the leaf whose region holds them all.
        """
        found, node, rows = list[tuple[Cut, bool]](), self.root, self.folded(np.stack(q))
        while isinstance(node, Cut):
            above = rows[:, node.joint] > node.value
            if above.any() != above.all():
                break
            found.append((node, bool(above.all())))
            node = node.above if above.all() else node.below
        return found, node

    def opened_by(self, walk: Array) -> Cut | Leaf | tuple[int, float]:
        """What a motion (m, n) of a changed case shows to be true no more.

        Straight lines between its rows.

        Returns:
            The first cut that it crosses, or the (joint, t) of `opened` that it passes; a leaf
            where it crosses none: its region holds all of the motion.
        """
        for joint, value in self.opened:
            turns = np.floor((walk[:, joint] - value) / (2.0 * np.pi))
            if turns.min() < turns.max():
                return joint, value
        return self.path_to(*walk)[1]

    def nodes(self) -> Iterator[Cut | Leaf]:
        """Every node, a cut before the nodes below and above it."""
        left = [self.root]
        while left:
            node = left.pop()
            yield node
            if isinstance(node, Cut):
                left += [node.above, node.below]


MOST_NODES = 10_000


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
    joints = [joint for joint, _ in opened]
    for joint, value in opened:
        if not is_whole(joint, 0, robot.n - 1):
            return f"opened joint {shown(joint)} is none of the {robot.n} joints"
        name = robot.joint_names[joint]
        if not is_number(value):
            return f"joint {name} is opened at {shown(value)}, which is no number"
        if robot.prismatic[joint]:
            return f"joint {name} slides and cannot be opened: there are no turns of it"
        if joints.count(joint) > 1:
            return f"joint {name} is opened twice"
    return ""


def _fault_of_nodes(robot: Robot, n_cells: int, tree: CutTree) -> str:
    """Why the nodes form no tree for this robot and so many cells; empty when they do."""
    for count, node in enumerate(tree.nodes()):
        if count == MOST_NODES:
            return f"the tree has more than {MOST_NODES:,} nodes"
        if isinstance(node, Leaf):
            if not is_whole(node.cell, 0, n_cells - 1):
                return f"a leaf names cell {shown(node.cell)}; there are {n_cells}, counted from 0"
        elif not isinstance(node, Cut):
            return f"a node is neither a cut nor a leaf but {type(node).__name__}"
        elif not is_whole(node.joint, 0, robot.n - 1):
            what = f"which is none of the {robot.n} joints"
            return f"a cut goes through joint {shown(node.joint)}, {what}"
        elif not is_number(node.value):
            return f"a cut has the value {shown(node.value)}, which is no number"
    return ""
