"""Cut trees: proofs that no single motion covers every cell.

Every node of the tree has a region of the joint space; that of the root is given by the joint
limits. An inner node, a `Cut`, says that inside its region the weighted sum of joint values w . q
is nowhere t while the tool is on the surface, within tolerance and cone. So no motion crosses
there, and the two sides, w . q <= t and w . q >= t, are the regions of its children. A `Leaf` says
that inside its region one cell cannot be covered.

**Theorem.** If there is such a tree, no motion covers every cell. *Proof.* Along a motion inside
the region of a cut, w . q - t is continuous and never zero: its sign stays, and the motion lies in
the region of one child. By induction it lies in the region of a leaf, whose cell it does not cover.
QED

How a tree was found does not matter. A tree that is one leaf proves a cell uncoverable.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True)
class Leaf:
    """A region in which one cell cannot be covered."""

    cell: int
    """Flat index of the cell."""


@dataclass(frozen=True, slots=True)
class Cut:
    """A region that no motion crosses at w . q = t."""

    weights: tuple[float, ...]
    """(n,) w; a single 1.0 among zeros for a cut q_j = t."""
    value: float
    """t, rad (m where the joints slide)."""
    below: Cut | Leaf
    """The side w . q <= t."""
    above: Cut | Leaf
    """The side w . q >= t."""

    @property
    def joint(self) -> int | None:
        """The joint j of a cut q_j = t; None where several joints have a weight."""
        weighted = np.flatnonzero(self.weights)
        single = len(weighted) == 1 and self.weights[weighted[0]] == 1.0
        return int(weighted[0]) if single else None


@dataclass(frozen=True, slots=True)
class CutTree:
    """A proof that no single motion covers every cell; see the module's text."""

    root: Cut | Leaf
    opened: tuple[tuple[int, float], ...] = ()
    """(joint, t) of joints that turn freely, or through more than a turn, and can nowhere be at
    t + 2 pi k while the tool is on the surface: the root's region has t .. t + 2 pi for them, which
    stands for every winding."""

    @property
    def kind(self) -> str:
        """'cell' where one leaf is the whole proof, 'cut' otherwise."""
        return "cell" if isinstance(self.root, Leaf) and not self.opened else "cut"

    def nodes(self) -> Iterator[Cut | Leaf]:
        """Every node, a cut before the nodes below and above it."""
        left = [self.root]
        while left:
            node = left.pop()
            yield node
            if isinstance(node, Cut):
                left += [node.above, node.below]
