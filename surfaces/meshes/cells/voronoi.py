"""Compiled loops that cut a graph of faces into cells: seeds far apart, and floods from them.

Distances are rounded to whole numbers before they are compared, and equal ones are ordered by
their index. So the cells of a regular mesh, where many distances are the same, do not depend on the
last digit: a turned mesh gets the same cells.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from coverable.kernels import allocating, allocating_entry
from surfaces.meshes.triangle_mesh import least_by, sum_by

DETOUR = 1.35
"""Over flat ground, steps from face to face are at most about this much longer than the straight
line. Where they are longer still, the straight line leaves the surface."""
SLACK = 0.1137
"""Share of its area that a cell may be off for a smoother border; odd, so that no whole number of
equal faces lies just there."""
_FINE = 749_371.0  # units of a rounded distance in one length; odd, so that no fraction is a tie
_BITS = np.int64(22)  # of a face's index, in a heap's entries; MOST_FACES fits
_MASK = np.int64((1 << 22) - 1)
_FAR = np.int64(1 << 40)
_MOST_SEEDS = 1024  # chosen in one go
_SHIFT = 4.0  # added to distances, which offsets can make negative
_WIDTH = np.int64(13)  # bits of a bucket: 1/91 of a cell, less than a face
_BUCKETS = np.int64(91 * 64)  # what is farther than 60 cells waits in the last one


@allocating_entry
def units(distance):  # noqa: ANN001, ANN201
    """A distance (in lengths of a cell) as a whole number."""
    return np.int64(math.floor(distance * _FINE + 0.347))


def whole_steps(step: Array) -> Ints:
    """Lengths (in cells) as whole numbers > 0, as `far_seeds` takes them."""
    return np.maximum(np.floor(step * _FINE + 0.347).astype(np.int64), 1)


@allocating
def push(heap, size, entry):  # noqa: ANN001, ANN201
    """Put an entry on a binary heap of `size` entries, least first."""
    k = size
    while k > 0:
        above = (k - 1) >> 1
        if heap[above] <= entry:
            break
        heap[k] = heap[above]
        k = above
    heap[k] = entry
    return size + 1


@allocating
def pop(heap, size):  # noqa: ANN001, ANN201
    """Take the least entry; returns it and the new size."""
    least = heap[0]
    size -= 1
    entry = heap[size]
    k = 0
    while True:
        below = 2 * k + 1
        if below >= size:
            break
        if below + 1 < size and heap[below + 1] < heap[below]:
            below += 1
        if heap[below] >= entry:
            break
        heap[k] = heap[below]
        k = below
    heap[k] = entry
    return least, size


@allocating
def _settle(across, step, distance, heap, size):  # noqa: ANN001, ANN202
    """Lower distances (whole numbers) to those over the faces on the heap, where these are less."""
    while size > 0:
        entry, size = pop(heap, size)
        face, far = entry & _MASK, entry >> _BITS
        if far > distance[face]:
            continue
        for k in range(3):
            other = across[face, k]
            if other >= 0 and far + step[face, k] < distance[other]:
                distance[other] = far + step[face, k]
                size = push(heap, size, (distance[other] << _BITS) | other)


class _Seeding(NamedTuple):
    """Seeds that are being chosen."""

    distance: Ints
    """(F,) of each face from the seeds so far."""
    heap: Ints
    """Room for `_settle`."""
    queue: Ints
    """(F,) the faces, the farthest first; entries may be out of date."""
    missing: Ints
    """(P,) seeds that each piece still needs."""
    end: Ints
    """(P,) where the seeds of each piece end."""
    seeds: Ints
    """(N,) written."""


def far_seeds(across: Ints, step: Ints, piece: Ints, quota: Ints, border: int) -> Ints:
    """Seeds as far from each other as one after the other can be chosen.

    Args:
        across: (F, 3) faces across the edges, or -1.
        step: (F, 3) whole numbers, the lengths of these steps.
        piece: (F,) connected piece of each face.
        quota: (P,) seeds of each piece, from 1 to its number of faces.
        border: whole number: the mesh's border counts as a seed this far outside. So seeds keep
            half as far from it as from each other, and are as dense there as elsewhere.

    Returns:
        (N,) faces, those of piece 0 first, N the sum of `quota`.
    """
    count = len(across)
    state = _Seeding(
        distance=np.full(count, _FAR),
        heap=np.empty(4 * count, dtype=np.int64),
        queue=np.empty(count, dtype=np.int64),
        missing=quota.copy(),
        end=np.cumsum(quota),
        seeds=np.empty(quota.sum(), dtype=np.int64),
    )
    size = _begin_seeds(across, step, border, *state[:3])
    chosen = 1
    while size > 0:  # in parts, so that a Ctrl-C or a time limit comes in between
        size = _more_seeds(across, step, piece, *state, size, chosen)
        chosen = min(2 * chosen, _MOST_SEEDS)
    return state.seeds


@allocating_entry
def _begin_seeds(across, step, border, distance, heap, queue):  # noqa: ANN001, ANN202
    """Fill in the distances from the border, and the queue; returns its size."""
    count = across.shape[0]
    size = 0
    for face in range(count):
        if across[face].min() < 0:
            distance[face] = border
            size = push(heap, size, (border << _BITS) | face)
    _settle(across, step, distance, heap, size)
    # Distances only fall, so the top of the queue is the farthest face once its entry is current.
    size = 0
    for face in range(count):
        size = push(queue, size, -((distance[face] << _BITS) | (_MASK - face)))
    return size


@allocating_entry
def _more_seeds(across, step, piece, distance, heap, queue, missing, end, seeds, size, most):  # noqa: ANN001, ANN202
    """Choose up to `most` seeds more; returns the queue's size, 0 when all are chosen."""
    chosen = 0
    while size > 0 and chosen < most:
        entry, size = pop(queue, size)
        far, face = (-entry) >> _BITS, _MASK - ((-entry) & _MASK)
        p = piece[face]
        if missing[p] == 0 or distance[face] == 0:
            continue
        if distance[face] < far:
            size = push(queue, size, -((distance[face] << _BITS) | (_MASK - face)))
            continue
        distance[face] = 0
        heap[0] = face
        _settle(across, step, distance, heap, 1)
        seeds[end[p] - missing[p]] = face
        missing[p] -= 1
        chosen += 1
    return size


@allocating_entry
def flood(across, step, centre, seeds, anchors, offsets, labels):  # noqa: ANN001, ANN201
    """Every face gets the label of the seed that reaches it first; lengths in cells.

    A face goes to the seed with the least straight distance from its anchor, less its offset;
    where the path over the surface is much longer than straight, its length counts. A label spreads
    from face to face only, so each cell is connected. Faces wait in buckets by distance.

    Args:
        across: (F, 3) faces across the edges, or -1.
        step: (F, 3) lengths of these steps.
        centre: (F, 3) the faces' centres.
        seeds: (N,) faces, all different, at least one in each connected piece.
        anchors: (N, 3) points that distances are measured from.
        offsets: (N,) head starts, at most 4.
        labels: (F,) int64, written.
    """
    count = across.shape[0]
    first = np.full(_BUCKETS, np.int64(-1))  # of the entries in each bucket
    following = np.empty(3 * count + seeds.shape[0], dtype=np.int64)
    waiting = np.empty(3 * count + seeds.shape[0], dtype=np.int64)
    best = np.full(count, np.int64(1) << 60)
    walked = np.zeros(count)
    done = np.zeros(count, dtype=np.bool_)
    size = 0
    for n in range(seeds.shape[0]):  # first of all: a seed belongs to its own cell
        best[seeds[n]] = 0
        labels[seeds[n]] = n
        waiting[size], following[size], first[0] = seeds[n], first[0], size
        size += 1
    bucket = 0
    while bucket < _BUCKETS:
        entry = first[bucket]
        if entry < 0:
            bucket += 1
            continue
        first[bucket] = following[entry]
        face = waiting[entry]
        if done[face]:
            continue
        done[face] = True
        n = labels[face]
        for k in range(3):
            other = across[face, k]
            if other < 0 or done[other]:
                continue
            dx = centre[other, 0] - anchors[n, 0]
            dy = centre[other, 1] - anchors[n, 1]
            dz = centre[other, 2] - anchors[n, 2]
            path = walked[face] + step[face, k]
            far = max(math.sqrt(dx * dx + dy * dy + dz * dz), path / DETOUR)
            key = units(max(far - offsets[n] + _SHIFT, 0.0))
            if key < best[other]:
                best[other] = key
                walked[other] = path
                labels[other] = n
                place = max(min(key >> _WIDTH, _BUCKETS - 1), bucket)
                waiting[size], following[size], first[place] = other, first[place], size
                size += 1


def recentre(
    centre: Array, normal: Array, area: Array, labels: Ints, seeds: Ints, anchors: Array
) -> None:
    """Move each seed to the face nearest to its cell's centroid, and its anchor to the centroid.

    Args:
        centre: (F, 3) the faces' centres.
        normal: (F, 3) unit normals.
        area: (F,) areas.
        labels: (F,) cell of each face.
        seeds: (N,) written.
        anchors: (N, 3) written: the centroid, put onto the plane of the seed.
    """
    sums = sum_by(labels, area[:, None] * centre, len(seeds))
    anchors[:] = sums / sum_by(labels, area, len(seeds))[:, None]
    off = np.linalg.norm(centre - anchors[labels], axis=1)
    seeds[:] = least_by(labels, np.floor(off * _FINE + 0.347))
    heights = ((centre[seeds] - anchors) * normal[seeds]).sum(axis=1)
    anchors += heights[:, None] * normal[seeds]


@allocating_entry
def smooth(across, edge, area, target, labels):  # noqa: ANN001, ANN201
    """Give away teeth: faces on a border that are held by one edge only, and a short one.

    Such a face can leave without tearing its cell. It goes to the neighbour it shares the longest
    border with, so that all borders together get shorter with each move; hence it ends. No cell
    may deviate far from its target: along a wedge, borders would slide to the tip.

    Args:
        across: (F, 3) faces across the edges, or -1.
        edge: (F, 3) whole numbers, the lengths of the edges.
        area: (F,) areas.
        target: (N,) areas that the cells should have.
        labels: (F,) cell of each face, changed.
    """
    areas = np.zeros(target.shape[0])
    for face in range(labels.shape[0]):
        areas[labels[face]] += area[face]
    moved = True
    while moved:
        moved = False
        for face in range(labels.shape[0]):
            own, to = labels[face], _tooth_to(across, edge, labels, face)
            if to < 0 or areas[own] - area[face] < (1.0 - SLACK) * target[own]:
                continue
            if areas[to] + area[face] > (1.0 + SLACK) * target[to]:
                continue
            areas[own] -= area[face]
            areas[to] += area[face]
            labels[face] = to
            moved = True


@allocating
def _tooth_to(across, edge, labels, face):  # noqa: ANN001, ANN202
    """The cell that a face should go to: the one it shares most border with; or -1."""
    own, held, most = labels[face], 0, np.int64(0)
    for k in range(3):
        if across[face, k] >= 0 and labels[across[face, k]] == own:
            held += 1
            most = edge[face, k]
    to = np.int64(-1)
    if held != 1:
        return to
    for k in range(3):
        other = across[face, k]
        if other < 0 or labels[other] == own:
            continue
        shared = np.int64(0)
        for m in range(3):
            if across[face, m] >= 0 and labels[across[face, m]] == labels[other]:
                shared += edge[face, m]
        if shared > most:
            most, to = shared, labels[other]
    return to
