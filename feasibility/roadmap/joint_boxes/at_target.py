"""What of boxes of joint values can have the tool at a target: contraction to second order.

With c the middle of a box, J the derivatives of the tool point there, h the half widths, and L_j
the largest lever of joint j in the box (`frames`), every q = c + d of the box has

    |p(q) - p(c) - J d| <= D / 2,    D = sum_j L_j h_j (h_j + 2 sum_{i<j} h_i)

(`feasibility.roadmap.motions.segment_bound`), so where p(q) is within the tolerance of the target T

    |w . (p(c) + J d - T)| <= tolerance + D / 2    for every unit vector w,

and likewise for the tool axis and the cone's chord. Each such pair of bounds leaves an interval for
every d_j, whatever the others are.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Mask
from feasibility.roadmap.branch_and_bound import DIRECTIONS
from feasibility.roadmap.joint_boxes.frames import Boxes, Frames, moves
from robots import Chain

ROUNDING = 1e-9  # [m], [1] by which every bound is widened
FLATTEST = 1e-6  # [m], [1] a joint of less effect is not contracted


class Direction(NamedTuple):
    """One direction of the tool, and where it has to point."""

    own: Array
    """(3,) unit vector in the frame of the last joint, as `robots.Chain` has it."""
    aim: Array
    """(3,) unit vector"""
    chord: float
    """The largest |difference|; 2 or more where any will do."""


class Target(NamedTuple):
    """Where the tool has to be."""

    point: Array
    """(3,) m"""
    tip: Array
    """(3,) m, the tool point in the frame of the last joint, as `robots.Chain` has it."""
    tolerance: float
    """m"""
    directions: tuple[Direction, ...]


class Left(NamedTuple):
    """What may still hold the tool at its target."""

    kept: Mask
    """(m,) boxes of which something is left."""
    boxes: Boxes
    """m boxes, contracted."""
    effect: Array
    """(m, n) [1] about how much each joint can change these vectors."""
    held: Mask
    """(m,) boxes with the tool at its target in their middle."""


class _Deviation(NamedTuple):
    """By how much a vector of the tool may be off a given one."""

    gap: Array
    """(m, 3) the given one less the tool's at the middle."""
    rows: Array
    """(m, 3, n) derivatives of the tool's."""
    levers: Array
    """(m, n) L_j, or the largest sine of the angle to each axis."""
    moved: Array
    """(m,) how far it can be from that at the middle."""
    radius: float
    """m or 1, how far it may be from the given one."""


def at_target(chain: Chain, frames: Frames, boxes: Boxes, target: Target, scale: float) -> Left:
    """Contract boxes to what may have the tool at a target.

    Args:
        chain: the arm.
        frames: at the middles of the boxes.
        boxes: m of them.
        target: where the tool has to be.
        scale: m, a length that makes metres comparable to radians.
    """
    half = boxes.half
    low, high = -half, half.copy()
    kept = held = np.ones(len(half), dtype=bool)
    effect = np.zeros_like(half)
    vectors = [_point(chain, frames, half, target)]
    limited = [direction for direction in target.directions if direction.chord < 2.0]
    vectors += [_direction(chain, frames, half, direction) for direction in limited]
    for k, one in enumerate(vectors):
        distance = np.sqrt((one.gap**2).sum(axis=1))
        kept = kept & (distance <= one.radius + one.moved + ROUNDING)
        held = held & (distance <= one.radius)
        effect += one.levers * half * (scale if k else 1.0)
        bound = one.radius + 0.5 * _second(chain, one.levers, half) + ROUNDING
        along = one.gap / np.maximum(distance, 1e-12)[:, None]
        for w in (along, *DIRECTIONS):
            goal = (one.gap * w).sum(axis=1)
            g = np.einsum("mkn,mk->mn", one.rows, np.broadcast_to(w, one.gap.shape))
            low, high = _cut(g, goal - bound, goal + bound, low, high)
    kept = kept & (low <= high).all(axis=1)
    return Left(kept, Boxes(boxes.centre + low, boxes.centre + high), effect, held)


def _point(chain: Chain, frames: Frames, half: Array, target: Target) -> _Deviation:
    """The tool point against its target."""
    n = half.shape[1]
    point = frames.carried(n, chain.translations[n][None])
    moved = moves(chain, frames, half, point, n)
    z = frames.rotations[:, 1:, :, 2]
    rows = np.where(chain.prismatic[:, None], z, np.cross(z, point - frames.points[:, 1:]))
    gap = target.point - point[:, 0]
    most = moved.by_joint[:, 0].sum(axis=1)
    return _Deviation(gap, rows.transpose(0, 2, 1), moved.levers[:, 0], most, target.tolerance)


def _direction(chain: Chain, frames: Frames, half: Array, direction: Direction) -> _Deviation:
    """A direction of the tool against where it has to point."""
    own = frames.rotations[:, -1] @ direction.own
    rows = np.cross(frames.rotations[:, 1:, :, 2], own[:, None])
    rows = np.where(chain.prismatic[:, None], 0.0, rows)
    sines, behind = np.sqrt((rows**2).sum(axis=2)), np.zeros(len(half))
    for j in range(half.shape[1] - 1, -1, -1):
        if not chain.prismatic[j]:
            sines[:, j] = np.minimum(sines[:, j] + behind, 1.0)
            behind = behind + sines[:, j] * np.minimum(half[:, j], 2.0)
    return _Deviation(direction.aim - own, rows.transpose(0, 2, 1), sines, behind, direction.chord)


def _second(chain: Chain, levers: Array, half: Array) -> Array:
    """(m,) D of the module."""
    turns = np.where(chain.prismatic, 0.0, half)
    before = np.cumsum(turns, axis=1) - turns
    return np.asarray((levers * half * (turns + 2.0 * before)).sum(axis=1))


def _cut(g: Array, least: Array, most: Array, low: Array, high: Array) -> tuple[Array, Array]:
    """Boxes (m, n) cut to d with least <= g . d <= most; low > high where nothing is left."""
    a, b = g * low, g * high
    lows, highs = np.minimum(a, b), np.maximum(a, b)
    floor = (least - highs.sum(axis=1))[:, None] + highs
    ceiling = (most - lows.sum(axis=1))[:, None] + lows
    steep = np.abs(g) > FLATTEST
    over = np.where(steep, g, 1.0)
    x, y = floor / over, ceiling / over
    return (
        np.where(steep, np.maximum(low, np.minimum(x, y)), low),
        np.where(steep, np.minimum(high, np.maximum(x, y)), high),
    )
