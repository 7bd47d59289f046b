"""Cells shared out among the fewest components, each cell in exactly one patch.

How few components have all the cells is a set cover, solved to the proven optimum. Patches then
grow over the surface, all at the same speed, from the cells that only one of these components has;
so most patches are in one piece.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Ints, Mask, Protected
from coverable.errors import ArgumentError
from feasibility.division.set_covering import set_cover
from surfaces.adjacency import components

TIME_LIMIT = 10.0  # [s]


@dataclass(frozen=True, eq=False, slots=True)
class Partition(Protected):
    """Each cell in exactly one patch, each patch inside one component."""

    rows: Ints
    """(P,) the component of each patch, a row of the table; the largest patch first."""
    patch: Ints
    """(N,) the patch of each cell; -1 for cells that nothing covers."""
    bound: int
    """No partition has fewer patches."""

    def __len__(self) -> int:
        """Number of patches."""
        return len(self.rows)


def fewest_patches(covers: Mask, pairs: Ints, time_limit: float = TIME_LIMIT) -> Partition:
    """Share cells out among as few components as possible.

    Args:
        covers: (K, N) True where component k covers cell c.
        pairs: (M, 2) cells that touch.
        time_limit: s; running out leaves a gap between the number of patches and its bound.

    Raises:
        ArgumentError: the shapes do not fit together, or a pair names a cell that does not exist.

    Example:
        >>> covers = np.array([[1, 1, 0], [0, 1, 1]], dtype=bool)
        >>> found = fewest_patches(covers, np.array([[0, 1], [1, 2]]))
        >>> len(found), found.bound, found.patch.tolist()
        (2, 2, [0, 0, 1])
    """
    covers = np.asarray(covers, dtype=bool)
    pairs = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
    if covers.ndim != 2:
        raise ArgumentError(f"covers must be (K, N), got {covers.shape}")
    if not ((pairs >= 0) & (pairs < covers.shape[1])).all():
        raise ArgumentError(f"pairs must name cells 0 .. {covers.shape[1] - 1}")
    chosen = set_cover(covers[:, covers.any(axis=0)], time_limit)
    rows = np.array(chosen.rows, dtype=np.int64)
    label = _grown(covers[rows], pairs)
    names, first, sizes = np.unique(label[label >= 0], return_index=True, return_counts=True)
    order = np.lexsort((first, -sizes))  # the largest first, then the one that begins first
    rank = np.full(len(rows) + 1, -1, dtype=np.int64)  # the last one is that of label -1
    rank[names[order]] = np.arange(len(names))
    return Partition(rows[names[order]], rank[label], chosen.bound)


def _grown(covers: Mask, pairs: Ints) -> Ints:
    """(N,) a row of `covers` (K, N) for each cell that one has, -1 elsewhere.

    Labels grow from the cells that have no choice. What no label grows into is begun by the row
    that has most of it.
    """
    label = np.full(covers.shape[1], -1, dtype=np.int64)
    alone = covers.sum(axis=0) == 1
    label[alone] = np.nonzero(covers[:, alone].T)[1]
    near: list[list[int]] = [[] for _ in label]
    for i, j in pairs.tolist():
        near[i].append(j)
        near[j].append(i)
    queue = deque(np.flatnonzero(label >= 0).tolist())
    while True:
        while queue:
            i = queue.popleft()
            for j in near[i]:
                if label[j] < 0 and covers[label[i], j]:
                    label[j] = label[i]
                    queue.append(j)
        free = covers & (label < 0)
        if not free.any():
            return label
        k = int(free.sum(axis=1).argmax())
        first = int(free[k].argmax())
        label[first] = k
        queue.append(first)


def pieces_in(cells: Mask, pairs: Ints) -> int:
    """Number of pieces that cells (N,) make; pairs (M, 2) are of cells that touch."""
    piece = components(pairs[cells[pairs].all(axis=1)], len(cells))
    return len(np.unique(piece[cells]))
