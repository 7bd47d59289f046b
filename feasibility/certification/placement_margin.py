"""How far a part may stand from where the case says, so that a continuous motion still exists.

**Claim.** Let q(t) be an accepted motion, and let any rigid motion g displace the surface against
the arm, by a translation of at most D and a turn of at most Theta about a pivot. Then there is a
continuous motion q_g(t) whose tool point runs along g(p(q(t))): so its distance from the displaced
surface, the cells it reaches and the tolerance it uses are exactly those of q(t). Joints stay
inside their limits, the tool inside cone and roll, bodies clear, singularities as far as asked.

**Levers.** Change the joints of a configuration c by at most d_j, one by one from the base on. When
j moves, those behind it have not, so the tool point moves by at most r_j d_j, r_j its lever at c;
column j of its Jacobian J by at most r_j for each of what joints up to j turn, and by what those
behind it move: `column_changes` at c, without any growth of levers. Times the d_j these sum to
M = `second_derivative_bound` at c: if |v| <= y moves joint j by at most d_j y, the derivative by v
changes by at most M y, the tool point is M y^2 / 2 off its linear model. The axis likewise.

**Lemma** (Newton and Kantorovich), on a straight stretch q(s), s from 0 to 1, with the joint
changes h_j. A is the Jacobian of the axis, P about a right inverse of J at both ends and straight
between, with |JP - I| <= eps and |AP| <= T there. d_j bounds the norms of its rows, which change by
g_j in all; columns of J change at the rate c_j at most (`column_changes`), and that by b_j
(the same, twice); those of A likewise. Whatever is no more than so much at both ends is in between
no more than that and an eighth of its second derivative. P'' = 0, and products of matrices are sums
over columns and rows:

    |J(s) P(s) - I| <= kappa = eps + sum_j (b_j d_j + 2 c_j g_j) / 8,    |A(s) P(s)| <= T' likewise.

All of these, M and M_a are those of the largest levers along the stretch: no lever is over half of
what those at both ends and the way of all behind it sum to. Let f(y) = (1 - kappa) y - M y^2 / 2,
|g p - p| at most rho. **If** rho <= f(y) and M y < 1 - kappa, exactly one v with |v| <= y has
p(q(s) + P(s) v) = g p(q(s)): with B the derivative JP at v = 0, v -> v - B^-1 (p(q + P v) - g p)
maps the ball into itself, as it takes v to at most (rho + M y^2 / 2) / (1 - kappa), and is a
contraction there. All of it is continuous in t, so v is; stretches that meet share P, and the
smaller of their balls holds both of their v. QED

So joint j moves by e_j = d_j y at most, the axis by x = T' y + M_a y^2 / 2, which is an angle of at
most x c / 2 sin(c / 2) while it is inside c. The part turns the approach direction by at most
Theta, and moves the tool point by rho = D + Theta r, r the largest distance from the pivot. The
roll is the twist about the approach: turning the tool, then the part, by w in all changes it by at
most w / cos(swing / 2), the swing inside the cone all the while; w is at most Theta + sum of e_j of
the joints that turn. The singular value falls by at most the change of the Jacobian.

**Triangle.** f is concave, and all that is required of y is convex in (y, Theta). So where y_1 will
do for (D, 0), and y_2 for (0, Theta), means of both do between: for whatever has position / D +
angle / Theta <= 1. `displaced_bodies` says which share of it bodies allow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from coverable.arrays import Array, Ints, Rows
from feasibility.certification.lever_bounds import (
    column_changes,
    jacobians,
    second_derivative_bound,
    smallest_singular,
)
from feasibility.task import Task
from feasibility.verdict import Bound, Certificate, PlacementMargin
from robots.kinematics import Kinematics
from surfaces.cells import Cells

if TYPE_CHECKING:
    from feasibility.certification.collisions.pairing import Pairing

STEP = 0.03  # [rad], [m] no joint moves further along a stretch: the shorter, the less is lost
FINE = 0.001  # [rad], [m] where singular values count, whose bounds lose most
MOST = 10.0  # [m] no larger ball is tried
LEAST = 1e-12  # [m], [rad] so that nothing is divided by 0
FREE = 1e9  # [rad] room for what is free
BELOW = 1.0 - 1e-9  # [1] of what is found is claimed: rounding
DAMPED = 1e-10  # [m2] added to squared singular values: so a right inverse exists everywhere
BOUNDS = (Bound.SINGULAR, Bound.CONE, Bound.ROLL)


@dataclass(frozen=True, eq=False, slots=True)
class Balls(Rows):
    """What holds along k stretches for |v| <= y."""

    slope: Array
    """(k,) 1 - kappa."""
    second: Array
    """(k,) M."""
    turns: Array
    """(k, 2, 2) T' and M_a, times c / 2 sin(c / 2); sum of d_j of the joints that turn, and 0."""
    moves: Array
    """(k, n) d_j."""
    caps: Array
    """(k, n + 1) m, what y may be for each joint's limits; for singularities and the lemma."""
    room: Array
    """(k, 2) rad, of the cone, c; of the roll, times cos(swing / 2)."""
    far: Array
    """(k,) m, r."""

    def allowed(self, turn: Array | float) -> Array:
        """(..., k, n + 3) m, y by `caps` and `room`, the part turned (..., k) rad a metre of f."""
        part = np.asarray(turn)[..., None]
        first = self.turns[..., 0] + part * self.slope[:, None]
        angles = solved(first, self.turns[..., 1] - part * self.second[:, None], self.room)
        caps = np.broadcast_to(self.caps, (*angles.shape[:-1], self.caps.shape[1]))
        return np.concatenate([caps, angles], axis=-1)

    def reached(self, turn: Array | float) -> Array:
        """(..., k) m, f of the least of these."""
        y = self.allowed(turn).min(axis=-1)
        return np.asarray(self.slope * y - 0.5 * self.second * y**2)

    @property
    def triangle(self) -> Array:
        """(k, 2) D where Theta = 0, m, and Theta where D = 0, rad."""
        shift, turn = self.reached(np.stack([0.0 * self.far, 1.0 / self.far]))
        return np.stack([shift, np.minimum(turn / self.far, np.pi)], axis=1)

    def moved(self, position: float, angle: float) -> Array:
        """(k, n) rad or m, e_j for such a triangle."""
        y = solved(self.slope, -self.second, np.maximum(position, angle * self.far))
        return np.asarray(self.moves * y[:, None])


def solved(a: Array, b: Array | float, c: Array) -> Array:
    """The least y >= 0 with a y + b y^2 / 2 = c, at most `MOST`; that, too, where none is."""
    c = np.minimum(c, FREE)
    under = a**2 + 2.0 * b * c
    below = a + np.sqrt(np.maximum(under, 0.0))
    reached = (under < 0.0) | (below <= 0.0)
    return np.minimum(np.where(reached, MOST, 2.0 * c / np.where(reached, 1.0, below)), MOST)


def larger(ends: Array) -> Array:
    """The larger one of the values at both ends of stretches."""
    return np.maximum(ends[:-1], ends[1:])


def cut(q: Array, task: Task) -> tuple[Array, Ints]:
    """Rows of a motion (m, n) and others between; and behind which row each but the last one is."""
    step = STEP if task.min_manipulability is None else FINE
    parts = np.ceil(np.abs(np.diff(q, axis=0)).max(axis=1) / step).clip(1.0).astype(np.intp)
    row = np.repeat(np.arange(len(parts)), parts)
    share = (np.arange(len(row)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[row]
    return np.vstack([q[row] + share[:, None] * np.diff(q, axis=0)[row], q[-1:]]), row


def balls_along(kinematics: Kinematics, task: Task, pivot: Array, q: Array, room: Array) -> Balls:
    """What holds along a motion q (k + 1, n), with (k, 2) rad left of cone and roll."""
    robot, at = kinematics.robot, jacobians(kinematics, q)
    slides = robot.prismatic
    square = at.point @ at.point.transpose(0, 2, 1)
    inverse = at.point.transpose(0, 2, 1) @ np.linalg.inv(square + DAMPED * np.eye(3))  # P
    off = np.linalg.norm(at.point @ inverse - np.eye(3), axis=(1, 2)) / BELOW
    right, axis = inverse.transpose(0, 2, 1), at.axis @ inverse
    axis = np.sqrt(np.linalg.eigvalsh(axis @ axis.transpose(0, 2, 1))[:, 2]) / BELOW
    steps, moves = np.abs(np.diff(q, axis=0)), larger(np.linalg.norm(right, axis=1))
    ends = np.stack([at.levers, at.sines], axis=1)
    way = larger(ends) * steps[:, None]
    behind = np.cumsum(way[..., ::-1], axis=2)[..., ::-1] - way
    levers = np.where(slides, ends[:-1], 0.5 * (ends[:-1] + ends[1:] + behind))
    levers[:, 1] = np.minimum(levers[:, 1], 1.0)
    rates, bends = (
        column_changes(levers, steps[:, None], slides, twice) for twice in (False, True)
    )
    change = np.linalg.norm(np.diff(right, axis=0), axis=1)
    between = 0.125 * (bends * moves[:, None] + 2.0 * rates * change[:, None]).sum(axis=2)
    second, bend = second_derivative_bound(levers, moves[:, None], slides).T
    slope = np.maximum(1.0 - larger(off) - between[:, 0], 0.0)
    lemma = np.minimum(BELOW * slope / np.maximum(second, LEAST), MOST)
    if task.min_manipulability is not None:
        both = np.stack([rates, column_changes(levers, moves[:, None], slides)])
        fall, falls = np.sqrt((both**2 / [[robot.length_unit**2], [1.0]]).sum(axis=(2, 3)))
        sigma = smallest_singular(at, robot.length_unit)
        spare = 0.5 * (sigma[:-1] + sigma[1:] - fall) - task.min_manipulability
        lemma = np.minimum(lemma, solved(falls, 0.0, np.maximum(spare, 0.0)))
    left = -larger(-np.minimum(q - robot.lower, robot.upper - q))  # at both ends, so between, too
    caps = np.column_stack([solved(moves, 0.0, np.maximum(left, 0.0)), lemma])
    far = larger(np.linalg.norm(at.points - pivot, axis=1)) + LEAST
    far += 0.125 * second_derivative_bound(levers[:, 0], steps, slides)
    half = np.clip(0.5 * room[:, 0], LEAST, 0.5 * np.pi)
    tilts = np.stack([larger(axis) + between[:, 1], bend]) * half / np.sin(half)
    rolls = np.stack([np.where(slides, 0.0, moves).sum(axis=1), 0.0 * bend])
    turns = np.stack([tilts, rolls]).transpose(2, 0, 1)
    room = np.minimum(room, FREE) * [1.0, np.cos(0.5 * min(task.cone, 0.5 * np.pi))]
    return Balls(slope, second, turns, moves, caps, room, far)


def placement_margin(
    kinematics: Kinematics,
    cells: Cells,
    task: Task,
    q: Array,
    room: Array,
    pairings: Sequence[Pairing] | None = None,
) -> PlacementMargin | None:
    """The margin of an accepted motion; see the module. None where bodies were not judged.

    Args:
        kinematics, cells, task: the case.
        q: (m, n) the motion, m >= 1, rad or m.
        room: (m, 2) rad, what is left of cone and roll from each row to the next; inf where free.
        pairings: all couples of bodies along the motion, as they were judged.
    """
    robot, pivot = kinematics.robot, cells.centres.mean(axis=0)
    worst, what = 0, ""
    position, angle, bound_by, along = 0.0, 0.0, Bound.START, None
    if robot.start is None:  # else the motion has to begin there, wherever the part stands
        if pairings is None and task.collision is not None and task.collision.checked:
            return None
        rows, row = cut(np.vstack([q, q[-1:]]), task)  # the last row stands for itself
        balls = balls_along(kinematics, task, pivot, rows, room[row])
        row = np.minimum(row, len(q) - 2)
        first, reach = np.flatnonzero(np.diff(row, prepend=-2)), balls.triangle
        along, least = np.minimum.reduceat(reach[:, 0], first), int(reach[:, 0].argmin())
        worst, bound = max(int(row[least]), 0), int(balls.allowed(0.0)[least].argmin())
        bound_by = Bound.LIMIT if bound < robot.n else BOUNDS[bound - robot.n]
        what = robot.joint_names[bound] if bound < robot.n else ""
        position, angle = (BELOW * reach.min(axis=0)).tolist()
        if pairings and position > 0.0:
            from feasibility.certification.displaced_bodies import displaced_share

            def moved(*part: float) -> Array:
                return np.asarray(np.maximum.reduceat(balls.moved(*part), first))

            shares, pair = displaced_share(robot, task, pivot, pairings, (position, angle), moved)
            along, share = np.minimum(along, shares * position), float(shares.min())
            position, angle = share * position, share * angle
            if pair:
                worst, bound_by, what = int(along.argmin()), Bound.CLEARANCE, " and ".join(pair)
    point = kinematics.tool(q[worst])[0]
    off = np.linalg.norm(task.targets(cells).points - point, axis=1)
    cell, middle = cells.unravel(int(off.argmin())), tuple(pivot.tolist())
    return PlacementMargin(position, angle, middle, bound_by, cell, what, along)


def margin_fault(task: Task, certificate: Certificate) -> str:
    """Why the margin is less than what the task asks for; empty where it is not, or not known."""
    error = task.placement_error
    margin = None if error is None else certificate.placement_margin  # found when it is asked for
    if error is None or margin is None or margin.share(*error) <= 1.0:
        return ""
    asked = f"{1e3 * error[0]:g} mm and {error[1]:g} deg off its place"
    return f"the part may stand {asked}; certified is {margin}"
