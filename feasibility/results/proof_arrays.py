"""A cut tree as arrays of a result file, and read back without trusting them.

The nodes stand in the order of `CutTree.nodes`, each before those below and above it, so a tree is
put together from its last node to its first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from coverable.arrays import Ints
from feasibility.cut_tree import Cut, CutTree, Leaf
from feasibility.results.archive import Archive

MOST_NODES = 100_000
DEEPEST = 200  # cuts from the root to a leaf
NONE = -1


def pack_proof(tree: CutTree) -> dict[str, NDArray]:
    """The arrays of a tree.

    Returns:
        For k nodes `proof_joint` and `proof_value` (k,), -1 and zero for a leaf; `proof_sides`
        (k, 2), the nodes below and above; `proof_cell` (k,), of a leaf; and for the opened joints
        `proof_opened` (o,) and `proof_opened_at` (o,) rad.
    """
    nodes = list(tree.nodes())
    number = {id(node): k for k, node in enumerate(nodes)}
    joint, value = np.full(len(nodes), NONE, dtype=np.int64), np.zeros(len(nodes))
    sides = np.full((len(nodes), 2), NONE, dtype=np.int64)
    cell = np.full(len(nodes), NONE, dtype=np.int64)
    for k, node in enumerate(nodes):
        if isinstance(node, Leaf):
            cell[k] = node.cell
            continue
        joint[k], value[k] = node.joint, node.value
        sides[k] = number[id(node.below)], number[id(node.above)]
    return {
        "proof_joint": joint,
        "proof_value": value,
        "proof_sides": sides,
        "proof_cell": cell,
        "proof_opened": np.array([joint for joint, _ in tree.opened], dtype=np.int64),
        "proof_opened_at": np.array([value for _, value in tree.opened], dtype=float),
    }


def unpack_proof(archive: Archive, count: int, n: int) -> CutTree:
    """The tree that `pack_proof` wrote.

    Args:
        archive: the file.
        count: number of cells.
        n: number of joints.

    Raises:
        ArchiveError: it is no tree over these joints and cells.
    """
    cell = archive.array("proof_cell", np.int64, (None,))
    k = len(cell)
    joint = _joints(archive, k, n)
    value = archive.array("proof_value", np.float64, (k,))
    sides = archive.array("proof_sides", np.int64, (k, 2))
    opened = archive.array("proof_opened", np.int64, (None,))
    at = archive.array("proof_opened_at", np.float64, (len(opened),))
    fault = _fault(cell, joint, sides, opened, count, n)
    if fault:
        raise archive.error(f"its proof is damaged: {fault}")
    nodes: list[Cut | Leaf] = [Leaf(0)] * k
    for i in range(k - 1, -1, -1):
        below, above = sides[i].tolist()
        if below == NONE:
            nodes[i] = Leaf(int(cell[i]))
        else:
            nodes[i] = Cut(int(joint[i]), float(value[i]), nodes[below], nodes[above])
    return CutTree(nodes[0], tuple(zip(opened.tolist(), at.tolist(), strict=True)))


def _joints(archive: Archive, k: int, n: int) -> Ints:
    """(k,) the joint of each cut; -1 of leaves. Up to format 4 a cut had a weight for each joint.

    Raises:
        ArchiveError: there are none, or a cut goes along several joints.
    """
    if "proof_joint" in archive:
        return archive.array("proof_joint", np.int64, (k,))
    weights = archive.array("proof_weights", np.float64, (k, n))
    weighed = (weights != 0.0).any(axis=1)
    if (weights[weighed].max(axis=1) != 1.0).any() or (weights != 0.0).sum(axis=1).max() > 1:
        raise archive.error(
            "its proof cuts along sums of several joints, which are read no more; run the check "
            "again"
        )
    return np.where(weighed, weights.argmax(axis=1), NONE)


def _fault(
    cell: Ints,
    joint: Ints,
    sides: Ints,
    opened: Ints,
    count: int,
    n: int,
) -> str:
    """What is wrong with a tree; empty where nothing is."""
    k = len(cell)
    if not 1 <= k <= MOST_NODES:
        return f"it has {k} nodes, not 1 to {MOST_NODES:,}"
    leaf = cell != NONE
    if (leaf != (sides == NONE).all(axis=1)).any():
        return "a node is neither a cut with two sides nor a leaf with a cell"
    if ((cell[leaf] < 0) | (cell[leaf] >= count)).any():
        return f"a leaf names no cell of {count}"
    cuts = np.flatnonzero(~leaf)
    if (sides[cuts] <= cuts[:, None]).any() or (sides[cuts] >= k).any():
        return "a side of a cut is no later node"
    used = np.bincount(sides[cuts].ravel(), minlength=k)
    if used[0] != 0 or (used[1:] != 1).any():
        return "a node is not the side of exactly one cut"
    if ((joint[cuts] < 0) | (joint[cuts] >= n)).any() or (joint[leaf] != NONE).any():
        return f"a cut goes through none of {n} joints, or a leaf through one"
    depth = np.zeros(k, dtype=np.int64)
    for i in cuts.tolist():
        depth[sides[i]] = depth[i] + 1
    if depth.max() > DEEPEST:
        return f"it is {depth.max()} cuts deep, more than {DEEPEST}"
    if ((opened < 0) | (opened >= n)).any() or len(set(opened.tolist())) < len(opened):
        return f"it opens what are no joints of {n}, or one of them twice"
    return ""
