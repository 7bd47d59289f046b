"""Growing the tree of parts of a parametric surface: boxes of parameters, cut in halves."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfaces.parts import PartModels, SurfaceParts, around

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

Models = Callable[[Ints, Array, Array], PartModels]
"""(which root (k,), low (k, 2), high (k, 2)) -> the models of the surface over these boxes."""

_TURNS = 4.0  # parts this much better than the worst wait until that is cut


class Boxes(NamedTuple):
    """k boxes of parameters."""

    root: Ints
    """(k,) which of the roots each is cut from: they may be of different patches."""
    low: Array
    """(k, 2)"""
    high: Array
    """(k, 2)"""

    def rows(self, some: Ints | NDArray[np.bool_]) -> Boxes:
        """Some of them."""
        return Boxes(self.root[some], self.low[some], self.high[some])

    def halves(self, axis: Ints) -> Boxes:
        """(2k) both halves across each box's own axis, the lower beside the upper one."""
        row, middle = np.arange(len(axis)), (self.low + self.high) / 2.0
        low, high = np.repeat(self.low, 2, axis=0), np.repeat(self.high, 2, axis=0)
        high[2 * row, axis] = low[2 * row + 1, axis] = middle[row, axis]
        return Boxes(np.repeat(self.root, 2), low, high)


class _Waiting(NamedTuple):
    """Parts that are too rough, and not cut yet."""

    number: Ints
    score: Array
    axis: Ints
    boxes: Boxes

    def rows(self, some: Ints | NDArray[np.bool_]) -> _Waiting:
        return _Waiting(self.number[some], self.score[some], self.axis[some], self.boxes.rows(some))

    def with_more(self, more: _Waiting) -> _Waiting:
        boxes = Boxes(*(np.concatenate(two) for two in zip(self.boxes, more.boxes, strict=True)))
        number, score, axis = (
            np.concatenate([a, b]) for a, b in zip(self[:3], more[:3], strict=True)
        )
        return _Waiting(number, score, axis, boxes)


def grown(roots: Boxes, models: Models, flat: float, straight: float, most: int) -> SurfaceParts:
    """The tree of the parts of a surface; see `Surface.parts`.

    The worst parts are cut first: those within a factor of `_TURNS` of the worst, all at once.

    Args:
        roots: boxes that together are the whole surface; `root` is 0, 1, ...
        models: bounds on the surface over boxes.
        flat: m, the largest r_f wanted.
        straight: the largest r_n wanted.
        most: how many parts may be made.
    """
    limits = np.array([flat, straight])
    width = (roots.high - roots.low).max(axis=0)
    found = models(roots.root, roots.low, roots.high).guarded()
    top = _joined(found)
    blocks = [top.models, found]
    count = len(top.children) + len(roots.root)
    children = np.full((max(most, count), 2), -1, dtype=np.int64)
    axes = np.full(len(children), -1, dtype=np.int64)
    children[: len(top.children)] = top.children
    waiting = _rough(roots, found, len(top.children), limits, width)
    while len(waiting.number) and count + 2 <= most:
        now = waiting.score >= waiting.score.max() / _TURNS
        some = np.flatnonzero(now)
        order = np.argsort(-waiting.score[some], kind="stable")
        some = some[order[: (most - count) // 2]]
        cut = waiting.rows(some)
        boxes = cut.boxes.halves(cut.axis)
        found = models(boxes.root, boxes.low, boxes.high).guarded()
        children[cut.number] = count + np.arange(2 * len(some)).reshape(-1, 2)
        axes[cut.number] = cut.axis
        blocks.append(found)
        left = np.ones(len(waiting.number), dtype=bool)
        left[some] = False
        more = _rough(boxes, found, count, limits, width)
        waiting, count = waiting.rows(left).with_more(more), count + 2 * len(some)
    centre, slopes, radius, _ = (np.concatenate(part) for part in zip(*blocks, strict=True))
    return SurfaceParts(centre, slopes, radius, children[:count], axes[:count])


def _rough(boxes: Boxes, found: PartModels, first: int, limits: Array, width: Array) -> _Waiting:
    """The boxes that are rougher than the limits allow, and across which axis each is to be cut."""
    score = (found.radius / limits).max(axis=1)
    some = np.flatnonzero(score > 1.0)
    by_axis = (found.along[some] / limits).max(axis=2)
    sides = (boxes.high[some] - boxes.low[some]) / width
    even = by_axis[:, 0] == by_axis[:, 1]
    axis = np.where(even, sides[:, 1] > sides[:, 0], by_axis[:, 1] > by_axis[:, 0])
    return _Waiting(first + some, score[some], axis.astype(np.int64), boxes.rows(some))


class _Top(NamedTuple):
    """The parts above several roots."""

    models: PartModels
    children: Ints


def _joined(roots: PartModels) -> _Top:
    """A tree over m roots: the m - 1 parts above them, each halved across its longest extent.

    The roots are numbered behind these parts.
    """
    count = len(roots.centre)
    children = np.full((count - 1, 2), -1, dtype=np.int64)
    waiting, made = [(-1, 0, np.arange(count))], 0
    while waiting:
        parent, side, group = waiting.pop()
        number = made if len(group) > 1 else count - 1 + int(group[0])
        if parent >= 0:
            children[parent, side] = number
        if len(group) == 1:
            continue
        made += 1
        centre = np.nan_to_num(roots.centre[group, :3])
        axis = int(np.argmax(np.ptp(centre, axis=0)))
        group = group[np.argsort(centre[:, axis], kind="stable")]
        half = len(group) // 2
        waiting += [(number, 1, group[half:]), (number, 0, group[:half])]
    whole = PartModels(*(np.concatenate([np.zeros_like(a[1:]), a]) for a in roots))
    for number in range(count - 2, -1, -1):
        one, other = (whole.rows(children[[number], side]) for side in (0, 1))
        for array, value in zip(whole, around(one, other), strict=True):
            array[number] = value[0]
    return _Top(whole.rows(np.arange(count - 1)), children)
