"""The fewest patches: cells shared out among components, each in exactly one patch.

Each cell gets one label, a component that covers it; cells of one label that hang together form one
connected patch. Unlike the sets of a set cover, patches do not overlap, so that two regions which
cross may cost a third patch.

A set cover by connected regions bounds the number of connected patches from below; patches grown
from the cells that have no choice bound it from above. Mostly the two are equal. Where they are
not, the integer programme of `connected_labels` decides.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from coverable_arrays import Ints, Mask, Protected
from coverable_errors import ArgumentError
from feasibility.division.connected_labels import (
    Labels,
    Lists,
    count_of,
    fewest_labels,
    neighbours_of,
    pieces_of,
)
from feasibility.division.set_covering import set_cover, undominated

TIME_LIMIT = 10.0  # [s]
OTHER_COVERS = 40  # other choices of regions that patches are grown of


@dataclass(frozen=True, eq=False, slots=True)
class Partition(Protected):
    """Each cell in exactly one patch, each patch inside one component."""

    rows: Ints
    """(P,) the component of each patch, a row of the table; the largest patch first."""
    patch: Ints
    """(N,) the patch of each cell; -1 for cells that are not needed or that nothing covers."""
    pieces: int
    """Connected pieces that the patches have together; P when each is connected."""
    bound: int
    """No partition of this kind has fewer patches."""

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
    left_out: Mask
    """(N,) needed cells that no component covers; they are in no patch."""


def fewest_patches(
    covers: Mask, needed: Mask, pairs: Ints, time_limit: float = TIME_LIMIT
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
    connected = _partition(
        free.label, pieces_of(free.label, pairs), free.pieces, max(free.bound, chosen.bound)
    )
    used = len(np.unique(connected.rows))
    if used == len(connected) <= len(rows):
        return Cover(connected, connected, left_out)
    if used < len(rows):  # the set cover ran out of time
        few = free
    fewest = _partition(few.label, few.label, few.pieces, chosen.bound)
    return Cover(fewest, connected, left_out)


def _partition(label: Ints, group: Ints, pieces: int, bound: int) -> Partition:
    """One patch for each group of cells; the largest first, then the one that begins first."""
    names, first, sizes = np.unique(group[group >= 0], return_index=True, return_counts=True)
    order = np.lexsort((first, -sizes))
    rank = np.empty(len(names), dtype=np.int64)
    rank[order] = np.arange(len(names))
    patch = np.full(len(group), -1, dtype=np.int64)
    patch[group >= 0] = rank[np.searchsorted(names, group[group >= 0])]
    return Partition(label[group >= 0][first[order]], patch, pieces, bound)


def connected_cover(covers: Mask, pairs: Ints, deadline: float = np.inf) -> Labels:
    """Label every cell that a row of `covers` (K, N) has, with the fewest connected patches.

    Pairs (M, 2) are of cells that touch. At the deadline, by `time.monotonic()`, the best so far
    is taken.
    """
    label = np.full(covers.shape[1], -1, dtype=np.int64)
    inside = np.where(covers.any(axis=0), 0, -1)
    part = pieces_of(inside, pairs)  # parts that do not touch are independent
    pieces = bound = 0
    for k in range(part.max(initial=-1) + 1):
        cells = np.flatnonzero(part == k)
        number = np.full(len(part), -1, dtype=np.int64)
        number[cells] = np.arange(len(cells))
        local = number[pairs[(part[pairs] == k).all(axis=1)]]
        found = _one_part(covers[:, cells], local, deadline)
        label[cells] = found.label
        pieces, bound = pieces + found.pieces, bound + found.bound
    return Labels(label, pieces, bound)


def _one_part(covers: Mask, pairs: Ints, deadline: float) -> Labels:
    """Label cells that hang together."""
    regions, rows = _regions(covers, pairs)
    chosen = set_cover(regions, deadline - time.monotonic())
    neighbours = neighbours_of(covers.shape[1], pairs)
    best = Labels(np.zeros(0, dtype=np.int64), covers.shape[1] + 1, chosen.bound)
    for use in _choices(regions, chosen.rows):
        if best.pieces <= best.bound:
            break
        if len(use) < best.pieces:
            grown = use[_grow(regions[use], neighbours)]
            count = count_of(grown, pairs)
            if count < best.pieces:
                best = Labels(grown, count, chosen.bound)
    if best.pieces > best.bound:
        best = fewest_labels(regions, pairs, best, deadline)
    return Labels(rows[best.label], best.pieces, best.bound)


def _choices(regions: Mask, least: tuple[int, ...]) -> Iterator[Ints]:
    """Regions to grow patches of, in the order of their priority.

    First the regions of a least set cover in several orders, then other covers: all regions,
    thrown out one by one in random order where the rest still covers everything.
    """
    use = np.array(least, dtype=np.int64)
    for turn in range(2 * len(use)):
        yield np.roll(use, turn // 2)[:: 1 - 2 * (turn % 2)]
    rng = np.random.default_rng(0)
    for _ in range(OTHER_COVERS):
        order = rng.permutation(len(regions))
        counts = regions.sum(axis=0)
        kept = []
        for k in order.tolist():
            if (counts[regions[k]] > 1).all():
                counts = counts - regions[k]
            else:
                kept.append(k)
        yield np.array(kept, dtype=np.int64)


def _regions(covers: Mask, pairs: Ints) -> tuple[Mask, Ints]:
    """(L, N) the largest connected regions of the rows, and the row (L,) that each is part of.

    A patch inside a region that is contained in another one can have the other's label, so only
    undominated regions are kept.
    """
    regions, rows = [], []
    for row in undominated(covers):
        piece = pieces_of(np.where(covers[row], 0, -1), pairs)
        for k in range(piece.max(initial=-1) + 1):
            regions.append(piece == k)
            rows.append(row)
    kept = undominated(np.array(regions))
    return np.array(regions)[kept], np.array(rows, dtype=np.int64)[kept]


def _grow(regions: Mask, neighbours: Lists) -> Ints:
    """(N,) labels (rows of `regions`) grown from the cells that have no choice.

    Label by label, a patch in several pieces is joined by shortest paths through cells that are
    still free; then all patches grow at the same speed. What no patch can grow into becomes a patch
    of its own.
    """
    alone = regions.sum(axis=0) == 1
    label = np.where(alone, np.argmax(regions, axis=0), -1)
    for k in range(len(regions)):
        _bridge(label, k, regions[k], neighbours)
    queue = deque(np.flatnonzero(label >= 0).tolist())
    while True:
        while queue:
            i = queue.popleft()
            for j in neighbours[i]:
                if label[j] < 0 and regions[label[i], j]:
                    label[j] = label[i]
                    queue.append(j)
        free = label < 0
        if not free.any():
            return label
        k = int(np.argmax((regions & free).sum(axis=1)))
        first = int(np.flatnonzero(regions[k] & free)[0])
        label[first] = k
        queue.append(first)


def _bridge(label: Ints, k: int, region: Mask, neighbours: Lists) -> None:
    """Join the pieces of label k by shortest paths through free cells of its region."""
    own = np.flatnonzero(label == k).tolist()
    if not own:
        return
    joined = {own[0]}
    came: dict[int, int] = {own[0]: -1}
    queue = deque([own[0]])
    while queue:
        i = queue.popleft()
        for j in neighbours[i]:
            if j in came or not (label[j] == k or (label[j] < 0 and region[j])):
                continue
            came[j] = i
            # Cells that have the label cost nothing: look at them first.
            if label[j] == k:
                queue.appendleft(j)
                while j not in joined:
                    joined.add(j)
                    label[j] = k
                    j = came[j]
            else:
                queue.append(j)
