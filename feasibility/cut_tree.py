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

How a tree was found does not matter. A tree that is one leaf proves a cell uncoverable.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array


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
        for node in self.nodes():
            if isinstance(node, Leaf):
                yield node

    def folded(self, q: Array) -> Array:
        """Configurations (..., n) with opened joints turned into t .. t + 2 pi."""
        q = np.array(q, dtype=float)
        for joint, value in self.opened:
            q[..., joint] = value + np.mod(q[..., joint] - value, 2.0 * np.pi)
        return q

    def path_to(self, q: Array) -> tuple[tuple[Cut, bool], ...]:
        """The cuts from the root to the leaf whose region holds q (n,).

        Each with whether q is above it. All of a motion is in the same region.
        """
        found, node, q = [], self.root, self.folded(q)
        while isinstance(node, Cut):
            above = bool(q[node.joint] > node.value)
            found.append((node, above))
            node = node.above if above else node.below
        return tuple(found)

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
        node, q = self.root, self.folded(walk)
        while isinstance(node, Cut):
            above = q[:, node.joint] > node.value
            if above.any() and not above.all():
                return node
            node = node.above if above.all() else node.below
        return node

    def parting(self, q: Array, other: Array) -> Cut | None:
        """The cut between two configurations (n,) that no motion joins; None in one region."""
        for (cut, above), (_, beyond) in zip(self.path_to(q), self.path_to(other), strict=False):
            if above != beyond:
                return cut
        return None

    def nodes(self) -> Iterator[Cut | Leaf]:
        """Every node, a cut before the nodes below and above it."""
        left = [self.root]
        while left:
            node = left.pop()
            yield node
            if isinstance(node, Cut):
                left += [node.above, node.below]
