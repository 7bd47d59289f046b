"""Boxes of joint values, and of places on a surface: what branch and bound works on."""

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.roadmap.motions.search_arrays import SearchArrays

STACK = 512  # most boxes on the stack; depth first, so their number grows with the depth only


class PlaceParts(NamedTuple):
    """Where the tool may be: target points and approach directions, part by part.

    The fields are those of `surfaces.SurfaceParts`, of the target surface. Compiled code reads them
    as a plain tuple of arrays.
    """

    centre: Array
    """(K, 9) target point (m), approach direction, and where the tool's reference axis is to point:
    the reference direction, turned to the middle of the range of roll."""
    slopes: Array
    """(K, 2, 9) their change by x."""
    radius: Array
    """(K, 3) how far they may be from that model (m, 1, 1); the last is inf where roll is free, or
    not known well enough: proofs then leave it out."""
    children: Ints
    """(K, 2) parts that a part is cut into; -1 where it is not."""
    axis: Ints
    """(K,) the parameter that is halved, or -1."""


def place_at_rest(arrays: SearchArrays, cell: int) -> PlaceParts:
    """The target of a cell's centre."""
    limited = bool(arrays.roll[1] < np.inf)
    toward = np.zeros(3)
    if limited:
        toward = toward_middle(arrays.approaches[cell], arrays.references[cell], arrays.roll[0])
    return PlaceParts(
        centre=np.concatenate([arrays.points[cell], arrays.approaches[cell], toward])[None],
        slopes=np.zeros((1, 2, 9)),
        radius=np.array([[0.0, 0.0, 0.0 if limited else np.inf]]),
        children=np.full((1, 2), -1),
        axis=np.full(1, -1),
    )


def toward_middle(approach: Array, reference: Array, middle: float) -> Array:
    """A reference direction (..., 3) turned about the approach direction by an angle (rad)."""
    turned = np.cos(middle) * reference + np.sin(middle) * np.cross(approach, reference)
    return np.asarray(turned, dtype=np.float64)


class BoxStack(NamedTuple):
    """A stack of boxes to be examined; m is n joints, or n + 2 with the parameters of a part."""

    low: Array
    """(STACK, m)"""
    high: Array
    """(STACK, m)"""
    part: Ints
    """(STACK,) index into the `PlaceParts`."""
    weight: Array
    """(STACK,) share of the first box: each half of a box has half of its share."""
    counts: Ints
    """(2,) boxes on the stack; boxes examined so far."""


class BoxWork(NamedTuple):
    """Working memory for boxes of m intervals, n of them of joints; of the present box.

    The first axis of length 3 is for the tool's point, its axis and its reference axis.
    """

    middle: Array
    """(m,)"""
    half: Array
    """(m,)"""
    gap: Array
    """(3, 3) m, 1, 1: where each is to be, at the middle, less where it is there."""
    rows: Array
    """(3, 3, m) derivatives of where each is less where it is to be."""
    lever: Array
    """(3, m) their lengths."""
    most: Array
    """(3,) how far rows times d may be from these gaps; inf where that says nothing."""
    row: Array
    """(m,)"""


def box_work(m: int) -> BoxWork:
    """Working memory for boxes of m intervals."""
    return BoxWork(*(np.zeros(shape) for shape in (m, m, (3, 3), (3, 3, m), (3, m), 3, m)))


def box_of(low: Array, high: Array, parameters: int = 0) -> BoxStack:
    """A stack with one box: the joints from low to high (n,), and all of part 0.

    Args:
        low, high: (n,) rad or m.
        parameters: 2 where the place on the part is free, 0 for a target at rest.
    """
    m = len(low) + parameters
    boxes = BoxStack(
        np.empty((STACK, m)),
        np.empty((STACK, m)),
        np.zeros(STACK, dtype=np.int64),
        np.ones(STACK),
        np.array([1, 0]),
    )
    boxes.low[0], boxes.high[0] = -1.0, 1.0
    boxes.low[0, : len(low)], boxes.high[0, : len(low)] = low, high
    return boxes
