"""Boxes of joint values, and of places on a surface: what branch and bound works on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

STACK = 512  # most boxes on the stack; depth first, so their number grows with the depth only


class Places(NamedTuple):
    """Where the tool may be: target points and approach directions, part by part.

    The fields are those of `surfaces.SurfaceParts`, of the target surface. Compiled code reads them
    as a plain tuple of arrays.
    """

    centre: NDArray[np.float64]
    """(K, 6) target point (m) and approach direction."""
    slopes: NDArray[np.float64]
    """(K, 2, 6) their change by x."""
    radius: NDArray[np.float64]
    """(K, 2) how far both may be from that model (m, 1)."""
    children: NDArray[np.int64]
    """(K, 2) parts that a part is cut into; -1 where it is not."""
    axis: NDArray[np.int64]
    """(K,) the parameter that is halved, or -1."""


def place_at_rest(point: NDArray[np.float64], approach: NDArray[np.float64]) -> Places:
    """One target point (3,) and approach direction (3,)."""
    return Places(
        centre=np.concatenate([point, approach])[None],
        slopes=np.zeros((1, 2, 6)),
        radius=np.zeros((1, 2)),
        children=np.full((1, 2), -1),
        axis=np.full(1, -1),
    )


class Slabs(NamedTuple):
    """Bounds low <= w . q <= high that every box has besides its own."""

    weights: NDArray[np.float64]
    """(m, n)"""
    low: NDArray[np.float64]
    """(m,) may be -inf."""
    high: NDArray[np.float64]
    """(m,) may be inf."""


def no_slabs(n: int) -> Slabs:
    """Boxes of n joints that nothing else bounds."""
    return Slabs(np.empty((0, n)), np.empty(0), np.empty(0))


class Boxes(NamedTuple):
    """A stack of boxes to be examined; m is n joints, or n + 2 with the parameters of a part."""

    low: NDArray[np.float64]
    """(STACK, m)"""
    high: NDArray[np.float64]
    """(STACK, m)"""
    part: NDArray[np.int64]
    """(STACK,) index into the `Places`."""
    weight: NDArray[np.float64]
    """(STACK,) share of the whole: halves of a box have half of its share each."""
    counts: NDArray[np.int64]
    """(2,) boxes on the stack; boxes examined so far."""


class BoxWork(NamedTuple):
    """Working memory for boxes of m intervals; q, middle and half are those of the present box."""

    q: NDArray[np.float64]
    """(n,)"""
    middle: NDArray[np.float64]
    """(m,)"""
    half: NDArray[np.float64]
    """(m,)"""
    lever: NDArray[np.float64]
    """(n,) m, the largest over the box."""
    sine: NDArray[np.float64]
    """(n,)"""
    longest: NDArray[np.float64]
    """(n,)"""
    point_rows: NDArray[np.float64]
    """(3, m) derivatives of tool point less target point."""
    axis_rows: NDArray[np.float64]
    """(3, m) derivatives of tool axis less approach direction."""
    gap: NDArray[np.float64]
    """(2, 3)"""
    row: NDArray[np.float64]
    """(m,)"""


def box_work(n: int, parameters: int) -> BoxWork:
    """Working memory for boxes of n joints and some parameters."""
    m = n + parameters
    return BoxWork(
        q=np.zeros(n),
        middle=np.zeros(m),
        half=np.zeros(m),
        lever=np.zeros(n),
        sine=np.zeros(n),
        longest=np.zeros(n),
        point_rows=np.zeros((3, m)),
        axis_rows=np.zeros((3, m)),
        gap=np.zeros((2, 3)),
        row=np.zeros(m),
    )


def box_of(low: NDArray[np.float64], high: NDArray[np.float64], parameters: int = 0) -> Boxes:
    """A stack with one box: the joints from low to high (n,), and the whole of part 0.

    Args:
        low, high: (n,) rad or m.
        parameters: 2 where the place on the part is free, 0 for a target at rest.
    """
    m = len(low) + parameters
    boxes = Boxes(
        np.empty((STACK, m)),
        np.empty((STACK, m)),
        np.zeros(STACK, dtype=np.int64),
        np.ones(STACK),
        np.array([1, 0]),
    )
    boxes.low[0], boxes.high[0] = -1.0, 1.0
    boxes.low[0, : len(low)], boxes.high[0, : len(low)] = low, high
    return boxes
