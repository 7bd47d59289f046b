"""Smooth surfaces cut into as few nearly flat tiles as a deviation allows.

`Surface.parts` halves parts until they are flat enough, which takes up to four times as many. Here
each box of parameters is cut at once into as many equal ones along u and v as its own errors say.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Ints, Rows
from surfaces.parts import PartModels
from surfaces.patches.patch import Patch

CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
MOST_ROUNDS = 60
_AIM = 0.97  # of the deviation: what a cut aims at, since errors shrink only nearly as is assumed
_AT_ONCE = 8  # cuts along one parameter that errors predict well


@dataclass(frozen=True, eq=False, slots=True)
class FlatTiles(Rows):
    """k tiles of a surface: |f - (c + x_1 e_1 + x_2 e_2 + x_1 x_2 t)| <= r_f for |x_i| <= 1."""

    models: PartModels
    twist: Array
    """(k, 3) t; see `Twisted`. Zero where normals count."""
    piece: Ints
    """(k,) which of the patches each is of."""
    low: Array
    """(k, 2) u and v at x = (-1, -1)."""
    high: Array
    """(k, 2) u and v at x = (1, 1)."""

    def halves(self) -> Array:
        """(2 k, 3, 6) the two triangles of each: points (m) and normals at their corners."""
        corners = self.models.centre[:, None] + CORNERS @ self.models.slopes
        corners[..., :3] += CORNERS.prod(axis=1)[:, None] * self.twist[:, None]
        return np.asarray(corners[:, HALVES].reshape(-1, 3, 6))

    def parameters(self) -> Array:
        """(2 k, 3, 2) u and v at the corners of the two triangles of each."""
        high = (CORNERS > 0.0)[HALVES]
        ends = np.where(high, self.high[:, None, None], self.low[:, None, None])
        return ends.reshape(-1, 3, 2)

    def deviations(self, depth: float) -> Array:
        """(k,) m, r_f + depth r_n."""
        return np.asarray(self.models.radius @ np.array([1.0, depth]))


def flat_tiles(
    pieces: Sequence[tuple[Patch, float]], deviation: float, depth: float, most: int
) -> FlatTiles | None:
    """Tiles that together are the patches, each with r_f + depth r_n <= deviation.

    Args:
        pieces: patches, and 1.0, or -1.0 where the normals are turned over.
        deviation: m > 0.
        depth: m >= 0, see `sheet_of`.
        most: how many tiles may be made; but all boxes that the patches begin with are taken.

    Returns:
        The tiles; None where more would be needed.
    """
    found, count = list[FlatTiles](), 0
    for piece, (patch, sign) in enumerate(pieces):
        low, high = patch.part_roots
        for number in range(MOST_ROUNDS):
            models, twist = _models(patch, low, high, sign, twisted=depth == 0.0)
            made = FlatTiles(models, twist, np.full(len(low), piece), low, high)
            rough = made.deviations(depth)
            fine = rough <= deviation
            found.append(made.of(fine))
            count += int(fine.sum())
            if fine.all():
                break
            low, high = low[~fine], high[~fine]
            shares = made.models.along[~fine] @ np.array([1.0, depth])
            counts = _counts(shares, rough[~fine], high - low, _AIM * deviation)
            if count + counts.prod(axis=1).sum() > most or number == MOST_ROUNDS - 1:
                return None
            low, high = _cut(low, high, counts)
    return FlatTiles.join(*found)


def _models(
    patch: Patch, low: Array, high: Array, sign: float, twisted: bool
) -> tuple[PartModels, Array]:
    """The models over boxes of parameters, in the root frame, and t."""
    found, twist = patch.placed_models(low, high, sign, twisted)
    models = found.guarded()
    known = np.isfinite(models.radius[:, 0]) & np.isfinite(twist).all(axis=1)
    return models, np.where(known[:, None], twist, 0.0)


def _counts(shares: Array, rough: Array, sides: Array, aim: float) -> Ints:
    """(k, 2) how many equal boxes to make of each along u and v.

    An error falls with the square of the count: a / m^2 + b / n^2 <= aim, with m n least where both
    terms are half of it. Where many are needed, fewer are made first: then the errors say more.

    Args:
        shares: (k, 2) m, what of the error comes from u and from v.
        rough: (k,) m, the error.
        sides: (k, 2) of the boxes.
        aim: m, the error that is wanted.
    """
    total = shares.sum(axis=1, keepdims=True)
    known = np.isfinite(rough[:, None]) & (total > 0.0)
    part = np.where(known, shares * rough[:, None] / np.where(known, total, 1.0), 0.0)
    first = np.argmax(part, axis=1)
    row = np.arange(len(part))
    small = np.minimum(part[row, 1 - first], part[row, first])
    fewer = np.ceil(np.sqrt(np.maximum(2.0 * small / aim, 1.0)))
    left = np.maximum(aim - small / fewer**2, aim / 2.0)
    more = np.ceil(np.sqrt(np.maximum(part[row, first] / left, 1.0)))
    counts = np.empty(part.shape)
    counts[row, first], counts[row, 1 - first] = np.maximum(more, 2.0), fewer
    counts = np.where(counts > _AT_ONCE, np.clip(np.ceil(counts / 5.0), 2.0, 16.0), counts)
    longest = np.where(np.arange(2) == np.argmax(sides, axis=1)[:, None], 2.0, 1.0)
    return np.where(known, counts, longest).astype(np.int64)


def _cut(low: Array, high: Array, counts: Ints) -> tuple[Array, Array]:
    """Each box cut into equal ones, counts (k, 2) of them; neighbours have the same ends."""
    total = counts.prod(axis=1)
    box = np.repeat(np.arange(len(low)), total)
    number = np.arange(len(box)) - np.repeat(np.cumsum(total) - total, total)
    place = np.stack([number // counts[box, 1], number % counts[box, 1]], axis=1)
    share = place / counts[box]
    after = (place + 1) / counts[box]
    start, end = low[box], high[box]
    return start * (1.0 - share) + end * share, start * (1.0 - after) + end * after
