"""How far an arm can reach: an upper bound that needs no search."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from coverable.arrays import Array, Mask

SWEEPS = 60  # of the descent below; any number gives a bound, more a tighter one
MOST_SLIDES = 10  # prismatic joints in a row whose 2^k end positions are looked at one by one


class ReachBound(NamedTuple):
    """A ball that the tool point cannot leave."""

    origin: Array
    """(3,) m, on the first joint that moves, in the root frame."""
    radius: float
    """m; inf where a prismatic joint has no limits."""


def reach_bound(
    model: pin.Model,
    tool_frame: int,
    prismatic: Mask,
    lower: Array,
    upper: Array,
) -> ReachBound:
    """Upper bound on the distance of the tool point from the origin of the first joint.

    A revolute joint leaves every point of its axis where it is. So put one anchor on each revolute
    axis: neighbouring anchors keep their distance whatever the joints do, and the tool point is
    never further from the first anchor than these distances add up to (the triangle inequality).
    The anchors may slide along their axes; sliding them until the string of distances is short
    gives a good bound. Where prismatic joints lie between two anchors, the distance is convex in
    their positions, so its maximum is at an end of the strokes.

    Joints whose limits leave one value are no joints: they stand at it, and the first joint that
    does move is the one that counts, such as that of an arm beside a table that is locked.

    Args:
        model: the n joints, base to tip.
        tool_frame: index of the frame whose origin is the tool point.
        prismatic: (n,) True where a joint slides.
        lower, upper: (n,) rad or m.
    """
    n, data = len(prismatic), model.createData()
    fixed = lower == upper
    columns = pin.computeJointJacobians(model, data, np.where(fixed, lower, 0.0))
    columns = columns.reshape(6, n)  # in the root frame; Pinocchio flattens a single column
    pin.updateFramePlacements(model, data)
    free = np.flatnonzero(~fixed)
    first = int(free[0]) if len(free) else n - 1
    origin = data.oMi[first + 1].translation.copy()
    anchors = [origin.copy()]
    axes: list[Array | None] = [None]  # None: this anchor does not slide
    slides: list[list[int]] = [[]]  # prismatic joints between an anchor and the next one
    for i in map(int, free):
        if prismatic[i]:
            slides[-1].append(i)
        elif i > first:
            anchors.append(data.oMi[i + 1].translation.copy())
            axes.append(columns[3:, i])
            slides.append([])
    anchors.append(data.oMf[tool_frame].translation.copy())
    _shorten(anchors, axes, slides)
    strokes = np.column_stack([lower, upper])
    radius = float(
        sum(
            _longest(end - start, columns[:3, joints].T, strokes[joints])
            for start, end, joints in zip(anchors, anchors[1:], slides, strict=False)
        )
    )
    return ReachBound(origin, radius)


def _shorten(
    anchors: list[Array],
    axes: list[Array | None],
    slides: list[list[int]],
) -> None:
    """Slide the anchors, one at a time, to where the path past each is shortest; in place.

    For a point on a line, the path from a over it to b is shortest where a mirror would put it: at
    the projections of a and b onto the line, each weighted by the other's distance from it.
    """
    for _ in range(SWEEPS):
        for k, axis in enumerate(axes):
            if axis is None or slides[k - 1] or slides[k]:
                continue
            before, after = anchors[k - 1] - anchors[k], anchors[k + 1] - anchors[k]
            along_before, along_after = float(before @ axis), float(after @ axis)
            far_before = float(np.linalg.norm(before - along_before * axis))
            far_after = float(np.linalg.norm(after - along_after * axis))
            total = far_before + far_after
            if total > 1e-12:
                shift = (along_before * far_after + along_after * far_before) / total
                anchors[k] = anchors[k] + shift * axis


def _longest(apart: Array, directions: Array, strokes: Array) -> float:
    """Largest |apart + sum_i s_i directions_i| with lower_i <= s_i <= upper_i, m."""
    if not np.isfinite(strokes).all():
        return float("inf")
    if len(strokes) > MOST_SLIDES:
        return float(np.linalg.norm(apart) + np.abs(strokes).max(axis=1).sum())
    return max(
        float(np.linalg.norm(apart + np.array(ends) @ directions))
        for ends in itertools.product(*strokes)
    )
