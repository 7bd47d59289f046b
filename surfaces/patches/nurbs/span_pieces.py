"""Boxes of parameters cut into pieces, each in one span of a spline."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints
from surfaces.patches.nurbs.bernstein import abscissae


class SpanPieces(NamedTuple):
    """What of the boxes lies in single spans, box by box."""

    starts: Ints
    """(k,) where each box's pieces begin."""
    box: Ints
    """(j,) the box of each piece."""
    span: Ints
    """(j,)"""
    low: Array
    """(j, 2) share of the span."""
    high: Array
    """(j, 2)"""
    middle: Array
    """(j, 2) of the piece, in -1..1 of the box."""
    half: Array
    """(j, 2)"""

    def affine(self, values: Array, m: int = 2, n: int = 2) -> Array:
        """(j, m, n, d) nets over the pieces of affine functions of x, (k, 3, d): 1, x_1, x_2."""
        own = values[self.box]
        middle, by_x, by_y = own[:, 0], own[:, 1], own[:, 2]
        middle = middle + self.middle[:, :1] * by_x + self.middle[:, 1:] * by_y
        x = (self.half[:, :1] * abscissae(m))[..., None] * by_x[:, None]
        y = (self.half[:, 1:] * abscissae(n))[..., None] * by_y[:, None]
        return np.asarray((middle[:, None] + x)[:, :, None] + y[:, None])


def pieces_of(breaks: tuple[Array, Array], low: Array, high: Array, quartered: bool) -> SpanPieces:
    """Cut boxes where the spans end; and first, if asked, in the middle both ways.

    Args:
        breaks: rising, where the spans of u and v end.
        low: (k, 2) lower corners of the boxes.
        high: (k, 2)
        quartered: whether to cut in the middle.
    """
    begin, stop = _quarters(low, high) if quartered else (low, high)
    first, count = np.empty((2, len(begin)), np.int64), np.empty((2, len(begin)), np.int64)
    for axis, line in enumerate(breaks):
        spans = len(line) - 1
        first[axis] = np.clip(np.searchsorted(line, begin[:, axis], "right") - 1, 0, spans - 1)
        last = np.clip(np.searchsorted(line, stop[:, axis], "left") - 1, 0, spans - 1)
        count[axis] = np.maximum(last - first[axis], 0) + 1
    total = count[0] * count[1]
    owner = np.repeat(np.arange(len(begin)), total)
    within = np.arange(len(owner)) - np.repeat(np.cumsum(total) - total, total)
    along = np.stack(np.divmod(within, count[1][owner])) + first[:, owner]
    box = owner // (4 if quartered else 1)
    shares, places = [], []
    for axis, line in enumerate(breaks):
        a, b = line[along[axis]], line[along[axis] + 1]
        ends = np.clip(np.stack([begin[owner, axis], stop[owner, axis]]), a, b)
        shares.append(np.clip((ends - a) / (b - a), 0.0, 1.0))
        middle, width = (low[box, axis] + high[box, axis]) / 2.0, high[box, axis] - low[box, axis]
        places.append(2.0 * (ends - middle) / width)
    (low_u, high_u), (low_v, high_v) = shares
    (x0, x1), (y0, y1) = places
    return SpanPieces(
        starts=np.searchsorted(box, np.arange(len(low))),
        box=box,
        span=along[0] * (len(breaks[1]) - 1) + along[1],
        low=np.stack([low_u, low_v], 1),
        high=np.stack([high_u, high_v], 1),
        middle=np.stack([x0 + x1, y0 + y1], 1) / 2.0,
        half=np.stack([x1 - x0, y1 - y0], 1) / 2.0,
    )


def _quarters(low: Array, high: Array) -> tuple[Array, Array]:
    """(4k, 2) corners of the four quarters of each box."""
    upper = np.tile([[False, False], [False, True], [True, False], [True, True]], (len(low), 1))
    middle, begin, stop = (np.repeat(each, 4, axis=0) for each in ((low + high) / 2.0, low, high))
    return np.where(upper, middle, begin), np.where(upper, stop, middle)
