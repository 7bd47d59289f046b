"""Which cells of a grid touch: 8 neighbours in clockwise order, across seams and poles too."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Mask

# Clockwise from the upper left; row = u grows downwards, column = v grows to the right.
_CLOCKWISE = (
    ((-1, -1), (-1, 0), (-1, 1)),
    ((0, 1),),
    ((1, 1), (1, 0), (1, -1)),
    ((0, -1),),
)  # above, right, below, left


class Neighbours(NamedTuple):
    """Neighbours of N cells, in compressed rows: see `of` for those of one cell."""

    indptr: Ints
    """(N + 1,) where each cell's list begins, and the end of the last."""
    indices: Ints
    """Flat cell indices, each cell's list clockwise from its upper left neighbour."""

    @staticmethod
    def listed(owner: Ints, other: Ints, key: Array | Ints, count: int) -> Neighbours:
        """From directed pairs (M,) of `count` cells, those of each owner in the order of a key."""
        indptr = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=count))])
        indices = other[np.lexsort((key, owner))]
        for array in (indptr, indices):
            array.flags.writeable = False
        return Neighbours(indptr, indices)

    def of(self, k: int) -> Ints:
        """The neighbours of cell k, clockwise."""
        return self.indices[self.indptr[k] : self.indptr[k + 1]]

    @property
    def links(self) -> Ints:
        """The row of `pairs` that each entry of `indices` belongs to."""
        count = len(self.indptr) - 1
        owner = np.repeat(np.arange(count, dtype=np.int64), np.diff(self.indptr))
        keys = np.minimum(owner, self.indices) * count + np.maximum(owner, self.indices)
        return np.unique(keys, return_inverse=True)[1]

    @property
    def pairs(self) -> Ints:
        """(M, 2) pairs i < j of cells that touch, each once, sorted."""
        count = len(self.indptr) - 1
        owner = np.repeat(np.arange(count, dtype=np.int64), np.diff(self.indptr))
        forward = owner < self.indices
        keys = np.sort(owner[forward] * count + self.indices[forward])
        return np.column_stack(np.divmod(keys, max(count, 1)))


def components(pairs: Ints, count: int) -> Ints:
    """(count,) connected component of each of `count` nodes, numbered in the order of the nodes.

    Args:
        pairs: (m, 2) nodes that are joined.
        count: number of nodes.
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    joined = coo_array((np.ones(len(pairs), bool), pairs.T.reshape(2, -1)), shape=(count, count))
    return connected_components(joined, directed=False)[1].astype(np.int64)


def grid_neighbours(
    rows: int,
    columns: int,
    closed: tuple[bool, bool] = (False, False),
    poles: tuple[bool, bool] = (False, False),
) -> Neighbours:
    """Neighbours in a grid of rows x columns cells, numbered row by row.

    No cell neighbours itself, and none is listed twice, however few cells go round.

    Args:
        rows: number of rows (u).
        columns: number of columns (v).
        closed: whether the first and last row, and the first and last column, are joined.
        poles: whether the first and the last row close around a pole. Its cells then touch those
            on the other side: half the columns further, or the two about that place if their
            number is odd, and one more on each side.
    """
    i, j = np.divmod(np.arange(rows * columns, dtype=np.int64), max(columns, 1))

    def step(offset: tuple[int, int]) -> Ints:
        """Flat index one offset further, across closed seams; -1 where the grid ends."""
        row, column = i + offset[0], j + offset[1]
        if closed[0]:
            row = row % max(rows, 1)
        if closed[1]:
            column = column % max(columns, 1)
        there = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        return np.where(there, row * columns + column, -1)

    top, right, bottom, left = ([step(offset) for offset in slots] for slots in _CLOCKWISE)
    if poles[0]:
        top = _over_pole(i, j, columns, top, i == 0, upper=True)
    if poles[1]:
        bottom = _over_pole(i, j, columns, bottom, i == rows - 1, upper=False)
    table = np.stack([*top, *right, *bottom, *left], axis=1)
    valid = (table >= 0) & (table != np.arange(rows * columns)[:, None])
    if any(closed) or any(poles):  # only then can one cell come twice
        for later in range(1, table.shape[1]):
            valid[:, later] &= (table[:, [later]] != table[:, :later]).all(axis=1)
    indptr = np.concatenate([[0], np.cumsum(valid.sum(axis=1))])
    return Neighbours(indptr, table[valid])


def _over_pole(
    i: Ints, j: Ints, columns: int, plain: list[Ints], last: Mask, upper: bool
) -> list[Ints]:
    """Slots of the neighbours above or below, clockwise; in the last row those across the pole.

    Clockwise around a cell at the upper pole, the columns across it come in falling order; at the
    lower pole in rising order.
    """
    half = columns // 2
    across = [half - 1, half, half + 1] + ([half + 2] if columns % 2 else [])
    if upper:
        across.reverse()
    plain = plain + [np.full_like(i, -1)] * (len(across) - len(plain))
    return [
        np.where(last, i * columns + (j + shift) % max(columns, 1), slot)
        for shift, slot in zip(across, plain, strict=True)
    ]
