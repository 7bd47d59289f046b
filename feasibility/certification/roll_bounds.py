"""The roll of the tool between two exact configurations: bounds without angles' whole turns.

With the tool's x and y, the target's t and u = b x t, and the middle m of the roll's range, let

    z = (C cos m + N sin m, N cos m - C sin m)    C = t . x + u . y    N = u . x - t . y

so that z = (1 + c) (cos off, sin off) with off = psi - m, see `feasibility.roll`. |off| <= h <= 90
deg means F = z . (sin h, -+cos h) >= 0 for both signs. z is linear in each of x, y, t, u. Let them
differ from straight lines by at most s (1 - s) / 2 times D_x, D_y, D_t, D_u. The product of two
straight lines differs from the straight line between its ends by s (1 - s) times that of their
changes, so F differs from a straight line by at most s (1 - s) / 2 times

    D = 2 |(dt . dx + du . dy, du . dx - dt . dy)| + D_x + D_y + sqrt(2) (D_t + D_u)

where the root is that of |sin| + |cos|. F is bounded at every instant, and no angle is followed, so
no whole turn can hide between the ends. Of a range of more than 180 deg only what is outside both
of its half turns is left out: there it is enough that F >= 0 for one sign, or that h = 90 deg does.
"""

from __future__ import annotations

import numpy as np

from coverable.arrays import Array, Mask
from feasibility.certification.jacobians import cross, lengths
from feasibility.certification.lever_bounds import peaks, second_derivatives
from feasibility.certification.tool_directions import ROLL_CLOSE
from feasibility.roll import Roll
from robots.kinematics import Kinematics
from robots.robot import Robot

ROUNDS = 24  # halvings of the angle that is looked for
ROOT = float(np.sqrt(2.0))


def frame_second_derivatives(robot: Robot, q: Array, axes: Array, x: Array) -> Array:
    """(m - 1,) D_x + D_y between rows q (m, n), whose approach and reference axes (m, 3) are known.

    With the sines of the angles between revolute axes and x, or y, in place of levers.
    """
    angular, steps = Kinematics(robot).twists(q)[:, 3:], np.abs(np.diff(q, axis=0))
    sines = [lengths(cross(angular, axis)) for axis in (x, np.cross(axes, x))]
    found = [second_derivatives(steps, robot.prismatic, one, 1.0) for one in sines]
    return found[0] + found[1]


def roll_vectors(x: Array, axes: Array, references: Array, approaches: Array, roll: Roll) -> Array:
    """(..., 2) z, from x, a, t and b (..., 3)."""
    return vectors_of(x, np.cross(axes, x), references, np.cross(approaches, references), roll)


def vectors_of(x: Array, y: Array, t: Array, u: Array, roll: Roll) -> Array:
    """(..., 2) z, from vectors (..., 3) that need not be unit or square."""
    cosine = (t * x).sum(axis=-1) + (u * y).sum(axis=-1)
    sine = (u * x).sum(axis=-1) - (t * y).sum(axis=-1)
    c, s = np.cos(roll.middle), np.sin(roll.middle)
    return np.stack([c * cosine + s * sine, c * sine - s * cosine], axis=-1)


def products_of_changes(dx: Array, dy: Array, dt: Array, du: Array) -> Array:
    """(...) 2 |(dt . dx + du . dy, du . dx - dt . dy)|, from changes (..., 3)."""
    along = (dt * dx + du * dy).sum(axis=-1)
    across = (du * dx - dt * dy).sum(axis=-1)
    return np.asarray(2.0 * np.hypot(along, across))


def off_middle(z: Array) -> Array:
    """(...) rad, |off| of z (..., 2)."""
    return np.abs(np.arctan2(z[..., 1], z[..., 0]))


def largest_off(z0: Array, z1: Array, second: Array, unknown: Array, half: float) -> Array:
    """(k,) rad, bounds on |off| along k stretches, where that is shown to be at most `half`.

    Args:
        z0, z1: (k, 2) at both ends.
        second: (k,) D.
        unknown: (k, 2) how much less F may be at both ends than z shows.
        half: rad, half the range of the roll.

    Returns:
        Bounds; inf where the roll may leave the range, NaN where something is.
    """

    def holds(angle: Array, sign: float) -> Mask:
        ends = [np.sin(angle) * z[:, 0] - sign * np.cos(angle) * z[:, 1] for z in (z0, z1)]
        low = peaks(unknown[:, 0] - ends[0], unknown[:, 1] - ends[1], second)
        return np.asarray(low <= ROLL_CLOSE)

    most = np.full(len(z0), min(half, 0.5 * np.pi))
    within = holds(most, 1.0) & holds(most, -1.0)
    low, high = np.minimum(np.maximum(off_middle(z0), off_middle(z1)), most), most.copy()
    for _ in range(ROUNDS):
        tried = 0.5 * (low + high)
        good = holds(tried, 1.0) & holds(tried, -1.0)
        high, low = np.where(good, tried, high), np.where(good, low, tried)
    if half <= 0.5 * np.pi:
        return np.where(within, high, np.inf)
    whole = np.full(len(z0), half)
    one_side = holds(whole, 1.0) | holds(whole, -1.0)
    return np.where(within, high, np.where(one_side, half, np.inf))
