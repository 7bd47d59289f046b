"""How far a curved motion is from the straight lines between its samples.

On a stretch with samples a and b at its ends let q'' be the second derivative by the share t of the
stretch. Both the motion and the straight line a + t (b - a) go through a and b, so they are at most
max |q''| / 8 apart, joint by joint. What of q'' points along b - a only changes how fast the line
is run: as long as that part is at most 2 |b - a|, the motion runs along it without going back,
and is off the line by the rest of q'' alone.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable_arrays import Array, Ints
from feasibility.certification import placements
from feasibility.timing.sampled_trajectory import (
    Kind,
    Trajectory,
    accelerations,
    coefficients,
    values,
)
from feasibility.verdict import Walk
from robots import Robot

ROUNDING = 1e-12  # [rad] or [m]
NEAR = 2e-6  # [m] and [rad] that tool point and axis may be off a motion of straight lines
MOST_LINES = 64  # in place of one polynomial


def deviations(q: Array, seconds: Array) -> Array:
    """(m - 1, n) how far each joint may be from the straight lines between m samples.

    Args:
        q: (m, n) rad or m.
        seconds: (k, m - 1, n) values by the square of a stretch, between which q'' stays.
    """
    ahead = np.diff(q, axis=0)
    length = np.sqrt((ahead**2).sum(axis=1, keepdims=True))
    with np.errstate(invalid="ignore", divide="ignore"):
        along = np.where(length > 0.0, ahead / length, 0.0)
    share = (seconds * along).sum(axis=2, keepdims=True)
    onwards = np.abs(share).max(axis=0) <= 2.0 * length
    beside = np.where(onwards, seconds - share * along, seconds)
    return np.asarray(np.abs(beside).max(axis=0) / 8.0 + ROUNDING)


def deviations_between(run: Trajectory, kind: Kind, q: Array) -> Array:
    """`deviations` of what a controller makes of the k samples of a trajectory.

    q ((k - 1) * places + 1, n) is the motion at so many places of each polynomial.
    """
    places = (len(q) - 1) // (len(run) - 1)
    stretch = np.diff(run.time)[:, None] / places
    return deviations(q, np.repeat(accelerations(run, kind) * stretch**2, places, axis=1))


class NearMotion(NamedTuple):
    """Straight lines in place of what a controller makes of a trajectory."""

    walk: Walk
    point: float
    """m, how far the tool point may be from where it is on these lines, at most."""
    turn: float
    """rad, the same of its axis."""


def motion_near(robot: Robot, run: Trajectory, kind: Kind) -> NearMotion:
    """As few straight lines as are `NEAR` the polynomials: mostly one for each.

    With deviations d_j of the joints the tool point is off by at most sum r_j d_j, r_j its largest
    distance from the axis, and its axis by the sum over revolute joints. The lever arm r_j is at
    most that at the nearer end, and half of what the tool point moves meanwhile.
    """
    off = deviations_between(run, kind, run.q)
    plain = np.abs(accelerations(run, kind) * np.diff(run.time)[:, None] ** 2).max(axis=0) / 8.0
    levers = _longest(robot, run.q, np.abs(np.diff(run.q, axis=0)) + 2.0 * off)
    point, turn = _moves(robot, levers, off)
    point_most, turn_most = _moves(robot, levers, plain + ROUNDING)
    far = np.maximum(point, turn) > NEAR
    lines = np.ones(len(off), dtype=np.int64)
    lines[far] = np.ceil(np.sqrt(np.maximum(point_most, turn_most)[far] / NEAR))
    lines = np.minimum(lines, MOST_LINES)
    # Of more lines than one the plain bound counts: they point elsewhere than the one.
    point, turn = (
        np.where(far, one / lines**2, other)
        for one, other in ((point_most, point), (turn_most, turn))
    )
    walk = _lines(run, kind, lines)
    return NearMotion(walk, float(point.max(initial=0.0)), float(turn.max(initial=0.0)))


def _moves(robot: Robot, levers: Array, off: Array) -> tuple[Array, Array]:
    """(m,) how far tool point (m) and axis (rad) move when joints move by `off` (m, n)."""
    return (levers * off).sum(axis=1), off[:, ~robot.prismatic].sum(axis=1)


def _longest(robot: Robot, q: Array, moves: Array) -> Array:
    """(m, n) m, bounds on lever arms between rows `moves` (m, n) apart; 1 of joints that slide."""
    levers = placements(robot, q).levers
    ends = np.maximum(levers[:-1], levers[1:])
    behind = np.zeros(len(moves))
    for j in range(robot.n - 1, -1, -1):
        if not robot.prismatic[j]:
            ends[:, j] += 0.5 * behind
        behind += ends[:, j] * moves[:, j]
    return ends


def _lines(run: Trajectory, kind: Kind, lines: Ints) -> Walk:
    """The polynomials at so many places (m,) each, in equal steps, and the last sample."""
    first = np.concatenate([[0], np.cumsum(lines)])
    q = np.empty((first[-1] + 1, run.q.shape[1]))
    cell = np.full(len(q), -1, dtype=np.int64)
    q[first], cell[first] = run.q, run.cell
    more = np.flatnonzero(lines > 1)
    points = coefficients(run, kind)[:, more]
    for count in np.unique(lines[more]):
        alike = lines[more] == count
        rows = first[more[alike]][:, None] + np.arange(count)
        q[rows.ravel()] = values(points[:, alike], int(count))
    return Walk(q=q, cell=cell)
