"""Proofs that a cell cannot be covered: the reach bound, and branch and bound over joint boxes.

A box is a centre c and half widths h. With r_j the largest distance of the tool point from axis j
over the box (the distance at c plus what the joints behind j can add), a tool point in the box is
at most

    sum_j r_j h_j                          from p(c)                (first order)
    D / 2 = 1/2 sum_j r_j h_j (h_j + 2 sum_{i<j} h_i)   from p(c) + J d    (second order)

and likewise for the axis, with sines s_j in place of r_j (D is that of
`feasibility.roadmap.segment_bound`). A box is discarded when the target is further than that plus
the tolerance; or when, projected onto one of a few directions, no d in the box can bring
p(c) + J d close enough. Along a direction every joint's interval can also be contracted to what the
others leave open. This makes boxes thin, which is why their widths may become very small before a
box is called undecided.

Joints with a range of a full turn or more are searched over one turn: other windings place the tool
alike. Proofs concern the centre of a cell, with its tolerance and its cone.
"""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility.compiled import kernel, put
from feasibility.roadmap.arrays import NEXT, SearchArrays, Work, look_at, place
from robots import jacobians

THINNEST = 1e-6  # [rad], [m]: a box with no wider joint that moves the tool is left undecided
STACK = 512  # most boxes on the stack; depth first, so their number grows with the depth only
ROUNDING = 1e-12  # [m], [1]: error of double arithmetic in a cut
_DIRECTIONS = np.array(
    [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [1.0, 1.0, 1.0],
        [1.0, 1.0, -1.0],
        [1.0, -1.0, 1.0],
        [-1.0, 1.0, 1.0],
    ]
)
_DIRECTIONS /= np.linalg.norm(_DIRECTIONS, axis=1)[:, None]


class Ruling(IntEnum):
    """The outcome of branch and bound over a cell."""

    OPEN = 0
    """Boxes are left: call again to go on."""
    PROVED = 1
    """No configuration covers the cell."""
    REACHED = 2
    """A box's centre covers the cell."""
    UNKNOWN = 3
    """A box too thin to split could not be discarded."""


class Boxes(NamedTuple):
    """A stack of boxes to be examined."""

    low: NDArray[np.float64]
    """(STACK, n)"""
    high: NDArray[np.float64]
    """(STACK, n)"""
    counts: NDArray[np.int64]
    """(2,) boxes on the stack; boxes examined so far."""


def root_box(arrays: SearchArrays) -> Boxes:
    """One box that holds every configuration inside the limits, up to full turns."""
    n = len(arrays.lower)
    low, high = arrays.lower.copy(), arrays.upper.copy()
    turns = ~arrays.chain.prismatic & (high - low >= 2.0 * np.pi)
    low[turns], high[turns] = -np.pi, np.pi
    boxes = Boxes(np.empty((STACK, n)), np.empty((STACK, n)), np.zeros(2, dtype=np.int64))
    boxes.low[0], boxes.high[0], boxes.counts[0] = low, high, 1
    return boxes


@kernel
def _cut(rows, gap, radius, low, high, direction):  # type: ignore[no-untyped-def]
    """Cut the box to d with |direction . (rows d - gap)| <= radius; False when nothing is left."""
    n = low.shape[0]
    goal = 0.0
    for k in range(3):
        goal += direction[k] * gap[k]
    least, most = 0.0, 0.0
    for j in range(n):
        g = 0.0
        for k in range(3):
            g += direction[k] * rows[k, j]
        a, b = g * low[j], g * high[j]
        least += min(a, b)
        most += max(a, b)
    if least > goal + radius or most < goal - radius:
        return False
    for j in range(n):
        g = 0.0
        for k in range(3):
            g += direction[k] * rows[k, j]
        if abs(g) < 1e-9:
            continue
        a, b = g * low[j], g * high[j]
        # What the other joints leave open for joint j.
        left = goal - radius - (most - max(a, b))
        right = goal + radius - (least - min(a, b))
        if g > 0.0:
            low[j] = max(low[j], left / g)
            high[j] = min(high[j], right / g)
        else:
            low[j] = max(low[j], right / g)
            high[j] = min(high[j], left / g)
        if not low[j] <= high[j]:
            return False
        least += min(g * low[j], g * high[j]) - min(a, b)
        most += max(g * low[j], g * high[j]) - max(a, b)
    return True


@kernel
def _reach_of_box(arrays, work, half, longest, lever, sine):  # type: ignore[no-untyped-def]
    """Largest levers and sines over a box about slot 1; returns (first, D/2, first, Da/2)."""
    n = half.shape[0]
    behind, behind_axis, before = 0.0, 0.0, 0.0
    for j in range(n):
        if not arrays.chain.prismatic[j]:
            before += half[j]
    first, second, first_axis, second_axis = 0.0, 0.0, 0.0, 0.0
    for j in range(n - 1, -1, -1):
        h = half[j]
        if arrays.chain.prismatic[j]:
            lever[j], sine[j] = 1.0, 0.0
            first += h
            second += h * before
            behind += h
            continue
        before -= h
        zx, zy, zz = work.axes[1, j, 0], work.axes[1, j, 1], work.axes[1, j, 2]
        x = work.point[1, 0] - work.origins[1, j, 0]
        y = work.point[1, 1] - work.origins[1, j, 1]
        z = work.point[1, 2] - work.origins[1, j, 2]
        r = np.sqrt((zy * z - zz * y) ** 2 + (zz * x - zx * z) ** 2 + (zx * y - zy * x) ** 2)
        x, y, z = work.axis[1, 0], work.axis[1, 1], work.axis[1, 2]
        s = np.sqrt((zy * z - zz * y) ** 2 + (zz * x - zx * z) ** 2 + (zx * y - zy * x) ** 2)
        lever[j] = min(r + behind, longest[j])
        sine[j] = min(1.0, s + behind_axis)
        first += lever[j] * h
        second += 0.5 * lever[j] * h * (h + 2.0 * before)
        first_axis += sine[j] * h
        second_axis += 0.5 * sine[j] * h * (h + 2.0 * before)
        behind += lever[j] * h
        behind_axis += sine[j] * h
    return first, second, first_axis, second_axis


@kernel
def _static_levers(arrays, longest):  # type: ignore[no-untyped-def]
    """The longest lever that each joint can have: the links behind it, stretched out."""
    total = 0.0
    for j in range(longest.shape[0] - 1, -1, -1):
        link = arrays.chain.translations[j + 1]
        total += np.sqrt(link[0] ** 2 + link[1] ** 2 + link[2] ** 2)
        longest[j] = total
        if arrays.chain.prismatic[j]:
            total += max(abs(arrays.lower[j]), abs(arrays.upper[j]))


@kernel
def _cut_all(rows, gap, distance, radius, low, high, directions):  # type: ignore[no-untyped-def]
    """Cut the box along the gap and along every direction; False when nothing is left."""
    along = np.empty(3)
    for k in range(3):
        along[k] = gap[k] / max(distance, 1e-12)
    if not _cut(rows, gap, radius, low, high, along):
        return False
    for k in range(directions.shape[0]):
        if not _cut(rows, gap, radius, low, high, directions[k]):
            return False
    return True


@kernel
def _shrink(arrays, work, low, high, longest, lever, sine, directions):  # type: ignore[no-untyped-def]
    """Cut one box (in place) to what may still hold a solution.

    Returns:
        1 when nothing is left, 2 when its centre (slot 1) is a solution, 0 otherwise; and whether
        the tool point, rather than the axis, is closer to ruling it out.
    """
    n = low.shape[0]
    q, half = np.empty(n), np.empty(n)
    gap, tilt = np.empty(3), np.empty(3)
    by_point = True
    for _ in range(3):
        for j in range(n):
            q[j] = 0.5 * (low[j] + high[j])
            half[j] = 0.5 * (high[j] - low[j])
        place(arrays, work, NEXT, q)
        distance, chord = work.error[1, 0], work.error[1, 1]
        if distance <= arrays.tolerance and chord <= arrays.cone_chord:
            return 2, by_point
        first, second, first_axis, second_axis = _reach_of_box(
            arrays, work, half, longest, lever, sine
        )
        near = arrays.tolerance + min(first, second) + ROUNDING
        narrow = arrays.cone_chord + min(first_axis, second_axis) + ROUNDING
        by_point = distance / near > chord / narrow
        if (
            distance > arrays.tolerance + first + ROUNDING
            or chord > arrays.cone_chord + first_axis + ROUNDING
        ):
            return 1, by_point
        # The second order is of use only where it beats the first.
        if not (second < first or second_axis < first_axis):
            break
        jacobians(
            arrays.chain, work.origins[1], work.axes[1], work.point[1], work.axis[1],
            work.point_rows, work.axis_rows,
        )  # fmt: skip
        for k in range(3):
            gap[k] = work.target[0, k] - work.point[1, k]
            tilt[k] = work.target[1, k] - work.axis[1, k]
        for j in range(n):
            low[j] -= q[j]
            high[j] -= q[j]
        alive = True
        if second < first:
            alive = _cut_all(work.point_rows, gap, distance, near, low, high, directions)
        if alive and second_axis < first_axis:
            alive = _cut_all(work.axis_rows, tilt, chord, narrow, low, high, directions)
        if not alive:
            return 1, by_point
        left = 1.0
        for j in range(n):
            if half[j] > 0.0:
                left *= max((high[j] - low[j]) / (2.0 * half[j]), 1e-3)
            low[j] += q[j]
            high[j] += q[j]
        if left > 0.3:
            break  # cutting again would gain little
    return 0, by_point


@kernel
def branch_and_bound(arrays, work, target, approach, boxes, most, directions, found):  # type: ignore[no-untyped-def]
    """Examine up to `most` boxes; returns the value of a `Ruling`.

    Args:
        arrays: the `SearchArrays`.
        work: the `Work`.
        target: (3,) target point of the cell.
        approach: (3,) approach direction of the cell.
        boxes: the `Boxes` on the stack; start from `root_box`.
        most: boxes to examine before returning OPEN.
        directions: (m, 3) unit directions for the cuts.
        found: (n,) receives the configuration when the ruling is REACHED, and the one that could
            not be ruled out when it is UNKNOWN.
    """
    n = found.shape[0]
    low, high = np.empty(n), np.empty(n)
    lever, sine, longest = np.empty(n), np.empty(n), np.empty(n)
    _static_levers(arrays, longest)
    look_at(arrays, work, target, approach)
    for _ in range(most):
        if boxes.counts[0] == 0:
            return 1
        boxes.counts[0] -= 1
        boxes.counts[1] += 1
        top = boxes.counts[0]
        put(low, boxes.low[top])
        put(high, boxes.high[top])
        code, by_point = _shrink(arrays, work, low, high, longest, lever, sine, directions)
        if code == 2:
            for j in range(n):
                found[j] = 0.5 * (low[j] + high[j])
            return 2
        if code == 1:
            continue
        # Split the joint with most effect on the constraint that is closest to ruling the box out.
        for_point, for_axis = (1.0, 0.05) if by_point else (0.05, 1.0)
        worst, largest = -1, 0.0
        for j in range(n):
            width = high[j] - low[j]
            if width > THINNEST:
                move = (for_point * lever[j] / arrays.scale + for_axis * sine[j]) * width
                if move > largest:
                    worst, largest = j, move
        if worst < 0 or boxes.counts[0] + 2 > boxes.low.shape[0]:
            for j in range(n):
                found[j] = 0.5 * (low[j] + high[j])
            return 3
        middle = 0.5 * (low[worst] + high[worst])
        for side in range(2):
            top = boxes.counts[0]
            put(boxes.low[top], low)
            put(boxes.high[top], high)
            if side == 0:
                boxes.high[top, worst] = middle
            else:
                boxes.low[top, worst] = middle
            boxes.counts[0] += 1
    return 0


def rule(
    arrays: SearchArrays, work: Work, cell: int, boxes: Boxes, most: int
) -> tuple[Ruling, NDArray[np.float64]]:
    """Examine up to `most` more boxes for one cell.

    Returns:
        The ruling, and a configuration (n,) that covers the cell when it is REACHED, or may nearly
        do so when it is UNKNOWN.
    """
    found = np.empty(len(arrays.lower))
    code = branch_and_bound(
        arrays,
        work,
        arrays.points[cell],
        arrays.approaches[cell],
        boxes,
        most,
        _DIRECTIONS,
        found,
    )
    return Ruling(code), found
