"""A cut tree as arrays of a result file, and read back without trusting them.

The nodes stand in the order of `CutTree.nodes`, each before those below and above it, so a tree is
put together from its last node to its first.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from coverable_arrays import Array, Ints
from feasibility.cut_tree import Cut, CutTree, Leaf
from feasibility.results.archive import Archive

MOST_NODES = 100_000
DEEPEST = 200  # cuts from the root to a leaf
NONE = -1


def pack_proof(tree: CutTree, n: int) -> dict[str, NDArray]:
    """The arrays of a tree over n joints.

    Returns:
        For k nodes `proof_weights` (k, n) and `proof_value` (k,), zero for a leaf; `proof_sides`
        (k, 2), the nodes below and above; `proof_cell` (k,), of a leaf; and for the opened joints
        `proof_opened` (o,) and `proof_opened_at` (o,) rad.
    """
    nodes = list(tree.nodes())
    number = {id(node): k for k, node in enumerate(nodes)}
    weights, value = np.zeros((len(nodes), n)), np.zeros(len(nodes))
    sides = np.full((len(nodes), 2), NONE, dtype=np.int64)
    cell = np.full(len(nodes), NONE, dtype=np.int64)
    for k, node in enumerate(nodes):
        if isinstance(node, Leaf):
            cell[k] = node.cell
            continue
        weights[k], value[k] = node.weights, node.value
        sides[k] = number[id(node.below)], number[id(node.above)]
    return {
        "proof_weights": weights,
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
    weights = archive.array("proof_weights", np.float64, (k, n))
    value = archive.array("proof_value", np.float64, (k,))
    sides = archive.array("proof_sides", np.int64, (k, 2))
    joints = archive.array("proof_opened", np.int64, (None,))
    at = archive.array("proof_opened_at", np.float64, (len(joints),))
    fault = _fault(cell, weights, sides, joints, count, n)
    if fault:
        raise archive.error(f"its proof is damaged: {fault}")
    nodes: list[Cut | Leaf] = [Leaf(0)] * k
    for i in range(k - 1, -1, -1):
        below, above = sides[i].tolist()
        if below == NONE:
            nodes[i] = Leaf(int(cell[i]))
        else:
            nodes[i] = Cut(tuple(weights[i].tolist()), float(value[i]), nodes[below], nodes[above])
    return CutTree(nodes[0], tuple(zip(joints.tolist(), at.tolist(), strict=True)))


def _fault(
    cell: Ints,
    weights: Array,
    sides: Ints,
    joints: Ints,
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
    if not weights[cuts].any(axis=1).all() or weights[leaf].any():
        return "a cut has no weight, or a leaf has one"
    depth = np.zeros(k, dtype=np.int64)
    for i in cuts.tolist():
        depth[sides[i]] = depth[i] + 1
    if depth.max() > DEEPEST:
        return f"it is {depth.max()} cuts deep, more than {DEEPEST}"
    if ((joints < 0) | (joints >= n)).any() or len(set(joints.tolist())) < len(joints):
        return f"it opens what are no joints of {n}, or one of them twice"
    return ""
