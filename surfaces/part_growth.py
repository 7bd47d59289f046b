"""Growing the tree of parts of a surface: the roughest pieces are cut in two, again and again."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Self

import numpy as np

from coverable.arrays import Array, Ints, Mask, Rows
from coverable.errors import ArgumentError
from surfaces.parts import PartModels, SurfaceParts

_WAIT = 4.0  # parts this much better than the worst wait until that is cut


class Pieces(Rows, ABC):
    """k pieces of a surface that can be cut in two."""

    in_halves: ClassVar[bool]
    """Whether the two are the halves of what x runs over, as `SurfaceParts.axis` says."""

    @abstractmethod
    def models(self) -> PartModels:
        """Rigorous bounds on each."""

    @abstractmethod
    def cut(self, axis: Ints) -> Self:
        """(2k) both halves of each across its own axis, the lower beside the upper one."""

    @property
    @abstractmethod
    def sides(self) -> Array:
        """(k, 2) how long they are: the longer one is cut where errors do not tell."""

    @property
    def divisible(self) -> Mask:
        """(k,) which can be cut."""
        return np.ones(len(self.sides), dtype=bool)


@dataclass(frozen=True, eq=False, slots=True)
class Boxes(Pieces):
    """k boxes of parameters."""

    in_halves: ClassVar[bool] = True

    bounds: Callable[[Ints, Array, Array], PartModels]
    """(root, low, high) -> models of the surface over these boxes."""
    root: Ints
    """(k,) which of the boxes that the tree began with each is cut from."""
    low: Array
    """(k, 2)"""
    high: Array
    """(k, 2)"""

    def models(self) -> PartModels:
        """See `Pieces`, as for the others."""
        return self.bounds(self.root, self.low, self.high)

    def cut(self, axis: Ints) -> Boxes:
        """In the middle."""
        row, middle = np.arange(len(axis)), (self.low + self.high) / 2.0
        low, high = np.repeat(self.low, 2, axis=0), np.repeat(self.high, 2, axis=0)
        high[2 * row, axis] = low[2 * row + 1, axis] = middle[row, axis]
        return Boxes(self.bounds, np.repeat(self.root, 2), low, high)

    @property
    def sides(self) -> Array:
        """In parameters."""
        return self.high - self.low


@dataclass(frozen=True, eq=False, slots=True)
class _Waiting(Rows):
    """Parts that are too rough, and not cut yet."""

    number: Ints
    score: Array
    axis: Ints
    pieces: Pieces


def grown(roots: Pieces, flat: float, straight: float, most: int) -> SurfaceParts:
    """The tree of the parts of a surface; see `Surface.parts`.

    The worst parts are cut first: those within a factor of `_WAIT` of the worst, all at once.

    Args:
        roots: pieces that together are the surface.
        flat: m, the largest r_f wanted.
        straight: the largest r_n wanted.
        most: how many parts may be made.

    Raises:
        ArgumentError: flat or straight is not above 0.
    """
    if not (flat > 0.0 and straight > 0.0):
        raise ArgumentError(f"flat and straight must be above 0, got {flat!r} and {straight!r}")
    limits = np.array([flat, straight])
    width = roots.sides.max(axis=0)
    found = roots.models().guarded()
    top = _joined(found)
    first = len(top.children)
    count = first + len(found.centre)
    blocks = [top.models, found]
    children = np.full((max(most, count), 2), -1, dtype=np.int64)
    axes = np.full(len(children), -1, dtype=np.int64)
    children[:first] = top.children
    waiting = _rough(roots, found, first, limits, width)
    while len(waiting.number) and count + 2 <= most:
        some = np.flatnonzero(waiting.score >= waiting.score.max() / _WAIT)
        order = np.argsort(-waiting.score[some], kind="stable")
        some = some[order[: (most - count) // 2]]
        cut = waiting.of(some)
        pieces = cut.pieces.cut(cut.axis)
        found = pieces.models().guarded()
        children[cut.number] = count + np.arange(2 * len(some)).reshape(-1, 2)
        axes[cut.number] = cut.axis if roots.in_halves else -1
        blocks.append(found)
        left = np.ones(len(waiting.number), dtype=bool)
        left[some] = False
        more = _rough(pieces, found, count, limits, width)
        waiting, count = _Waiting.join(waiting.of(left), more), count + 2 * len(some)
    made = PartModels.join(*blocks)
    return SurfaceParts(made.centre, made.slopes, made.radius, children[:count], axes[:count])


def _rough(pieces: Pieces, found: PartModels, first: int, limits: Array, width: Array) -> _Waiting:
    """Pieces that are rougher than the limits allow, and across which axis each is to be cut."""
    score = (found.radius / limits).max(axis=1)
    some = np.flatnonzero((score > 1.0) & pieces.divisible)
    by_axis = (found.along[some] / limits).max(axis=2)
    sides = pieces.sides[some] / width
    even = by_axis[:, 0] == by_axis[:, 1]
    axis = np.where(even, sides[:, 1] > sides[:, 0], by_axis[:, 1] > by_axis[:, 0])
    return _Waiting(first + some, score[some], axis.astype(np.int64), pieces.of(some))


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
        centre = roots.centre[group, :3]
        axis = int(np.argmax(np.ptp(centre, axis=0)))
        group = group[np.argsort(centre[:, axis], kind="stable")]
        half = len(group) // 2
        waiting += [(number, 1, group[half:]), (number, 0, group[:half])]
    every = PartModels.join(roots.of(slice(1, None)), roots)
    for number in range(count - 2, -1, -1):
        one, other = (every.of(children[[number], side]) for side in (0, 1))
        every.put(slice(number, number + 1), _around(one, other))
    return _Top(every.of(slice(count - 1)), children)


def _around(one: PartModels, other: PartModels) -> PartModels:
    """Models of k parts that hold all of two others each: balls around them."""
    balls = [_balls(models) for models in (one, other)]
    (a, ra), (b, rb) = balls
    centre, radius = np.empty((len(a), 6)), np.empty((len(a), 2))
    for column, some in ((0, slice(0, 3)), (1, slice(3, 6))):
        apart = np.linalg.norm(b[:, some] - a[:, some], axis=1)
        p, q = ra[:, column], rb[:, column]
        # From the far end of one ball to that of the other; or the larger one where it holds both.
        size = np.maximum((apart + p + q) / 2.0, np.maximum(p, q))
        with np.errstate(invalid="ignore"):
            share = np.clip((size - p) / np.maximum(apart, 1e-300), 0.0, 1.0)
        share = np.nan_to_num(share)
        middle = a[:, some] + share[:, None] * (b[:, some] - a[:, some])
        to_a, to_b = (np.linalg.norm(middle - end[:, some], axis=1) for end in (a, b))
        centre[:, some], radius[:, column] = middle, np.maximum(to_a + p, to_b + q)
    flat = np.zeros((len(centre), 2, 6))
    return PartModels(centre, flat, radius, np.zeros((len(centre), 2, 2))).guarded()


def _balls(models: PartModels) -> tuple[Array, Array]:
    """Centres (k, 6), and radii (k, 2) of the balls that hold the points, and the normals."""
    reach = [
        np.linalg.norm(models.slopes[..., some], axis=2).sum(axis=1)
        for some in (slice(0, 3), slice(3, 6))
    ]
    return models.centre, models.radius + np.stack(reach, axis=1)
