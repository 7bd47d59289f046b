"""Labels of cells, and the connected patches that they make."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfaces import components

Bools = NDArray[np.bool_]
Ints = NDArray[np.int64]
Lists = list[list[int]]


@dataclass(frozen=True, eq=False, slots=True)
class Labels:
    """A component for each cell."""

    label: Ints
    """(N,) row of the table for each cell; -1 where there is none."""
    pieces: int
    """Connected patches that this makes."""
    bound: int
    """No labels make fewer."""


def pieces_of(label: Ints, pairs: Ints) -> Ints:
    """Number the connected patches.

    Args:
        label: (N,) label of each cell, -1 for none.
        pairs: (M, 2) cells that touch.

    Returns:
        (N,) patch of each cell, from 0; -1 where the label is. Cells of one label that hang
        together are in one patch.
    """
    same = pairs[label[pairs[:, 0]] == label[pairs[:, 1]]]
    piece = components(same, len(label))
    result = np.full(len(label), -1, dtype=np.int64)
    inside = label >= 0
    result[inside] = np.unique(piece[inside], return_inverse=True)[1]
    return result


def count_of(label: Ints, pairs: Ints) -> int:
    """Number of connected patches."""
    return int(pieces_of(label, pairs).max(initial=-1)) + 1


def neighbours_of(n: int, pairs: Ints) -> Lists:
    """For each of n cells the cells that it touches."""
    result: Lists = [[] for _ in range(n)]
    for i, j in pairs.tolist():
        result[i].append(j)
        result[j].append(i)
    return result
