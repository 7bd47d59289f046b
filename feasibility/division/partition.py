"""The fewest patches: cells shared out among components, each in exactly one patch."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from coverable_errors import ArgumentError
from feasibility.division.connected_cover import connected_cover
from feasibility.division.connected_labels import Bools, Ints, Labels, pieces_of
from feasibility.division.set_covering import set_cover

TIME_LIMIT = 10.0  # [s]


@dataclass(frozen=True, eq=False, slots=True)
class Partition:
    """Each cell in exactly one patch, each patch inside one component."""

    rows: NDArray[np.int64]
    """(P,) the component of each patch, a row of the table; the largest patch first."""
    patch: NDArray[np.int64]
    """(N,) the patch of each cell; -1 for cells that are not needed or that nothing covers."""
    pieces: int
    """Connected pieces that the patches have together; P when each is connected."""
    bound: int
    """No partition of this kind has fewer patches."""

    def __post_init__(self) -> None:
        """Copy and write-protect the arrays."""
        for name in ("rows", "patch"):
            array = np.array(getattr(self, name), dtype=np.int64)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def __len__(self) -> int:
        """Number of patches."""
        return len(self.rows)

    @property
    def optimal(self) -> bool:
        """Is it proved that no partition of this kind has fewer patches?"""
        return len(self) <= self.bound


@dataclass(frozen=True, eq=False, slots=True)
class Cover:
    """The fewest patches, and the fewest that are each connected on the surface."""

    fewest: Partition
    """Connected where that costs no patch; otherwise in few pieces."""
    connected: Partition
    """Every patch connected; the same object as `fewest` where connectedness costs nothing."""
    left_out: NDArray[np.bool_]
    """(N,) needed cells that no component covers; they are in no patch."""


def fewest_patches(
    covers: Bools, needed: Bools, pairs: Ints, time_limit: float = TIME_LIMIT
) -> Cover:
    """Share cells out among as few components as possible.

    Args:
        covers: (K, N) True where component k covers cell c.
        needed: (N,) cells that are to be covered.
        pairs: (M, 2) cells that touch.
        time_limit: s; running out leaves a gap between a number of patches and its bound.

    Returns:
        Both answers. Cells that are needed but that nothing covers are left out.

    Raises:
        ArgumentError: the shapes do not fit together, or a pair names a cell that does not exist.

    Example:
        >>> covers = np.array([[1, 1, 0], [0, 1, 1]], dtype=bool)
        >>> cover = fewest_patches(covers, np.ones(3, dtype=bool), np.array([[0, 1], [1, 2]]))
        >>> len(cover.fewest), cover.fewest.optimal, cover.fewest.pieces
        (2, True, 2)
    """
    covers, needed = np.asarray(covers, dtype=bool), np.asarray(needed, dtype=bool)
    pairs = np.asarray(pairs, dtype=np.int64).reshape(-1, 2)
    if covers.ndim != 2 or needed.shape != covers.shape[1:]:
        raise ArgumentError(
            f"covers must be (K, N) and needed (N,), got {covers.shape} and {needed.shape}"
        )
    if not ((pairs >= 0) & (pairs < len(needed))).all():
        raise ArgumentError(f"pairs must name cells 0 .. {len(needed) - 1}")
    now = time.monotonic()
    left_out = needed & ~covers.any(axis=0)
    covers = covers & needed
    chosen = set_cover(covers[:, covers.any(axis=0)], 0.3 * time_limit)
    rows = np.array(chosen.rows, dtype=np.int64)
    free = connected_cover(covers, pairs, now + 0.7 * time_limit)
    few = (
        connected_cover(covers[rows], pairs, now + time_limit) if free.pieces > len(rows) else free
    )
    if few is not free:
        few = Labels(np.append(rows, -1)[few.label], few.pieces, few.bound)
    if few.pieces < free.pieces:  # out of time
        free = Labels(few.label, few.pieces, free.bound)
    connected = _connected(free, pairs, max(free.bound, chosen.bound))
    used = len(np.unique(connected.rows))
    if used == len(connected) <= len(rows):
        return Cover(connected, connected, left_out)
    if used < len(rows):  # the set cover ran out of time
        few = free
    fewest = _partition(few.label, few.label, few.pieces, chosen.bound)
    return Cover(fewest, connected, left_out)


def _connected(labels: Labels, pairs: Ints, bound: int) -> Partition:
    """One patch for each connected piece."""
    return _partition(labels.label, pieces_of(labels.label, pairs), labels.pieces, bound)


def _partition(label: Ints, group: Ints, pieces: int, bound: int) -> Partition:
    """One patch for each group of cells; the largest first, then the one that begins first."""
    names, first, sizes = np.unique(group[group >= 0], return_index=True, return_counts=True)
    order = np.lexsort((first, -sizes))
    rank = np.empty(len(names), dtype=np.int64)
    rank[order] = np.arange(len(names))
    patch = np.full(len(group), -1, dtype=np.int64)
    patch[group >= 0] = rank[np.searchsorted(names, group[group >= 0])]
    return Partition(label[group >= 0][first[order]], patch, pieces, bound)
