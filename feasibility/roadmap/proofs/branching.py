"""Proofs by branch and bound: no configuration of a box holds the tool where it should be.

Boxes are discarded or contracted (`box_contraction`), and what is left of them
is halved. Contraction makes boxes thin, which is why their widths may become very small before a
box is called undecided. A place that lies on a part of the surface lies on one of its children: a
box may be handed to them.

`root_box` searches joints with a range of a full turn or more over one turn: other windings place
the tool alike. Proofs concern the centre of a cell, with its tolerance and its cone.
"""

import numpy as np

from coverable.arrays import Array
from coverable.kernels import allocating_entry, kernel
from feasibility.roadmap.motions.search_arrays import SearchArrays
from feasibility.roadmap.motions.working_memory import Work, put
from feasibility.roadmap.proofs.box_bounds import rolls_over
from feasibility.roadmap.proofs.box_contraction import THINNEST, shrink
from feasibility.roadmap.proofs.boxes import BoxStack, PlaceParts, box_of, box_work, place_at_rest
from feasibility.roadmap.proofs.ruling import Ruling

DIRECTIONS = np.array(
    [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1]], dtype=float
)
DIRECTIONS /= np.linalg.norm(DIRECTIONS, axis=1)[:, None]


def root_box(arrays: SearchArrays) -> BoxStack:
    """One box that holds every configuration inside the limits, up to full turns."""
    low, high = arrays.lower.copy(), arrays.upper.copy()
    turns = ~arrays.chain.prismatic & (high - low >= 2.0 * np.pi)
    low[turns], high[turns] = -np.pi, np.pi
    return box_of(low, high)


@kernel
def _split(arrays, places, part, driver, space, low, high):  # noqa: ANN001, ANN202
    """Which interval of a box to halve; m where the part is to be cut, -1 where all are too thin.

    The one with most effect on the constraint that is closest to ruling the box out.
    """
    n, m, moves = arrays.lower.shape[0], low.shape[0], space.row
    worst, largest, off = -1, 0.0, 0.0
    for j in range(m):
        moves[j] = 0.0
    for which in range(3 if rolls_over(arrays, places, part) else 2):
        weight, behind = _weight(arrays, which, driver), 0.0
        for j in range(m - 1, -1, -1):
            far = space.lever[which, j]
            if j < n:  # a turn moves what the joints behind it have moved, too
                far += 0.0 if arrays.chain.prismatic[j] else behind
                far = far if which == 0 else min(far, 1.0)
                behind += far * space.half[j]
            moves[j] += weight * far * (high[j] - low[j])
        off += weight * places.radius[part, which]
    for j in range(m):
        thickness = 1.0 if j < n else max(space.lever[0, j], space.lever[1, j])
        if thickness * (high[j] - low[j]) > THINNEST and moves[j] > largest:
            worst, largest = j, moves[j]
    if places.children[part, 0] < 0:
        return worst
    return m if worst < 0 or worst >= n or 2.0 * off > largest else worst


@kernel
def _weight(arrays, which, driver):  # noqa: ANN001, ANN202
    """What a change of tool point (1/m), axis or reference axis counts, beside the driver's."""
    return (1.0 if which == driver else 0.05) / (arrays.scale if which == 0 else 1.0)


@kernel
def _push(boxes, low, high, part, weight):  # noqa: ANN001, ANN202
    """Put a box on the stack."""
    top = boxes.counts[0]
    put(boxes.low[top], low)
    put(boxes.high[top], high)
    boxes.part[top] = part
    boxes.weight[top] = weight
    boxes.counts[0] += 1


@kernel
def _push_children(places, boxes, part, weight, n, low, high):  # noqa: ANN001, ANN202
    """Hand a box to the children of its part (low and high are lost)."""
    axis = places.axis[part]
    for side in range(2):
        child = places.children[part, side]
        if axis < 0:
            for i in range(n, low.shape[0]):
                low[i], high[i] = -1.0, 1.0
            _push(boxes, low, high, child, 0.5 * weight)
            continue
        least, most = low[n + axis], high[n + axis]
        middle = 1.0 if side == 0 else -1.0
        low[n + axis] = max(2.0 * least + middle, -1.0)
        high[n + axis] = min(2.0 * most + middle, 1.0)
        if low[n + axis] <= high[n + axis]:
            _push(boxes, low, high, child, 0.5 * weight)
        low[n + axis], high[n + axis] = least, most


@allocating_entry
def branch_and_bound(arrays, work, places, boxes, most, directions, space, found):  # noqa: ANN001, ANN201
    """Examine up to `most` boxes; returns the value of a `Ruling`.

    Args:
        arrays, work: the `SearchArrays` and the `Work`.
        places: the `PlaceParts` of the target.
        boxes: what is not ruled out, also what ends it; start from `box_of` or `root_box`.
        most: boxes to examine before returning OPEN.
        directions: (k, 3) unit directions for the cuts.
        space: the `BoxWork`.
        found: (n,) receives the configuration when the ruling is REACHED, and the one that could
            not be ruled out when it is UNKNOWN.
    """
    n, m = found.shape[0], boxes.low.shape[1]
    low, high = np.empty(m), np.empty(m)
    for _ in range(most):
        if boxes.counts[0] == 0:
            return 1
        top = boxes.counts[0] - 1  # a box stays on the stack until it is ruled out, or halved
        boxes.counts[1] += 1
        put(low, boxes.low[top])
        put(high, boxes.high[top])
        part, weight = boxes.part[top], boxes.weight[top]
        code, driver = shrink(arrays, work, places, part, directions, space, low, high)
        if code == 1:
            boxes.counts[0] = top
            continue
        if code == 2:
            put(found, space.middle[:n])
            return 2
        worst = _split(arrays, places, part, driver, space, low, high)
        if code == 3 or worst < 0 or top + 2 > boxes.low.shape[0]:
            for j in range(n):
                found[j] = 0.5 * (low[j] + high[j])
            return 3
        boxes.counts[0] = top
        if worst == m:
            _push_children(places, boxes, part, weight, n, low, high)
            continue
        least, middle = low[worst], 0.5 * (low[worst] + high[worst])
        low[worst] = middle
        _push(boxes, low, high, part, 0.5 * weight)
        low[worst], high[worst] = least, middle
        _push(boxes, low, high, part, 0.5 * weight)
    return 0


def rule(
    arrays: SearchArrays, work: Work, cell: int, boxes: BoxStack, most: int
) -> tuple[Ruling, Array]:
    """Examine up to `most` more boxes for one cell.

    Returns:
        The ruling, and a configuration (n,) that covers the cell when it is REACHED, or may nearly
        do so when it is UNKNOWN.
    """
    return examine(arrays, work, place_at_rest(arrays, cell), boxes, most)


def examine(
    arrays: SearchArrays, work: Work, places: PlaceParts, boxes: BoxStack, most: int
) -> tuple[Ruling, Array]:
    """Examine up to `most` more boxes; as `rule`, wherever the tool may be."""
    n = len(arrays.lower)
    found = np.empty(n)
    space = box_work(boxes.low.shape[1])
    code = branch_and_bound(arrays, work, places, boxes, most, DIRECTIONS, space, found)
    return Ruling(code), found
