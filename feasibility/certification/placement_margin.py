"""How far a part may stand from where the case says, so that a continuous motion still exists.

**Claim.** Let q(t) be an accepted motion, and let any rigid motion g displace the surface against
the arm, by a translation of at most D and a turn of at most Theta about a pivot. Then there is a
continuous motion q_g(t) whose tool point runs along g(p(q(t))): so its distance from the displaced
surface, the cells it reaches and the tolerance it uses are exactly those of q(t). Joints stay
inside their limits, the tool inside cone and roll, bodies clear, singularities as far as asked.

**Lemma** (Newton and Kantorovich), on a straight stretch q(s), s from 0 to 1, with the joint
changes h_j. J is the tool point's Jacobian, A that of the axis, P about a right inverse of J at
both ends and straight between, with |JP - I| <= eps there; d_j bounds the norms of its rows, N
those of P, T those of AP, at both ends. J and A change by at most C and C_a along the stretch. As P
is a mean of both,

    |J(s) P(s) - I| <= kappa = eps + N C / 2,    |A(s) P(s)| <= T' = T + N C_a / 2.

Over all configurations q(s) + P(s) v, |v| <= y, the second derivatives of tool point and axis by v
are at most M and M_a: `lever_bounds` with the steps d_j over a box of the half widths h_j / 2 +
y d_j about both ends. Let f(y) = (1 - kappa) y - M y^2 / 2 and |g p - p| <= rho. **If** rho <= f(y)
and M y < 1 - kappa, exactly one v with |v| <= y has p(q(s) + P(s) v) = g p(q(s)): with B the
derivative JP at v = 0, v -> v - B^-1 (p(q + P v) - g p) maps the ball into itself, as it takes v to
at most (rho + M y^2 / 2) / (1 - kappa), and is a contraction there. All of it is continuous in t,
so v is; stretches that meet share P, and the smaller of their balls holds both of their v. QED

So joint j moves by e_j = d_j y at most, the axis by x = T' y + M_a y^2 / 2, which is an angle of at
most x c / 2 sin(c / 2) while it is inside c. The part turns the approach direction by at most
Theta, and moves the tool point by rho = D + Theta r, r the largest distance from the pivot. The
roll is the twist about the approach: turning the tool, then the part, by w in all changes it by at
most w / cos(swing / 2), the swing inside the cone all the while; w is at most Theta + sum of e_j of
the joints that turn. The singular value falls by at most the change of the Jacobian.

**Triangle.** With the bounds of one ball as constants, f is concave, and all that is required of y
is convex in (y, Theta). So where y_1 will do for (D, 0), and y_2 for (0, Theta), means of both do
between: for whatever has position / D + angle / Theta <= 1. `displaced_bodies` says which share of
it bodies allow.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.certification.jacobians import jacobians, smallest_singular
from feasibility.certification.lever_bounds import (
    column_changes,
    largest_levers,
    second_derivative_bound,
)
from feasibility.certification.rows import Rows
from feasibility.task import PlacementError, Task
from feasibility.verdict import Bound, Certificate, PlacementMargin
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

if TYPE_CHECKING:
    from feasibility.certification.collisions.pairing import Pairing

CLOSE = 0.95  # [1] of the least room at a configuration: stretches with so much are not cut, ...
CLOSER = 0.97  # [1] ... others into as many pieces as should have this much
ROUNDS = 3  # of cutting what has less
PIECES = 32  # most, that a stretch is cut into at once
MOST = 10.0  # [m] no larger ball is tried
LEAST = 1e-12  # [m], [rad] so that nothing is divided by 0
FREE = 1e9  # [rad] room for what is free
BELOW = 1.0 - 1e-9  # [1] of what is found is claimed: rounding
DAMPED = 1e-10  # [1] of the largest squared singular value: so a right inverse exists everywhere
BOUNDS = (Bound.LIMIT, Bound.CONE, Bound.ROLL, Bound.SINGULAR)


class Given(NamedTuple):
    """What all stretches of a motion share."""

    robot: Robot
    task: Task
    pivot: Array
    kinematics: Kinematics


@dataclass(frozen=True, eq=False, slots=True)
class Ends(Rows):
    """k configurations at which stretches begin or end."""

    q: Array
    points: Array
    levers: Array
    sines: Array
    rows: Array
    """(k, n) norms of the rows of P."""
    norms: Array
    """(k, 3) N, eps and T."""
    sigma: Array
    """(k,) the smallest singular value; inf where it does not matter."""


@dataclass(frozen=True, eq=False, slots=True)
class Balls(Rows):
    """What holds along k stretches for |v| <= y."""

    row: Ints
    share: Array
    """(k, 2) from where to where on the way from that row to the next, 0..1."""
    slope: Array
    """(k,) 1 - kappa."""
    second: Array
    """(k,) M."""
    tilts: Array
    """(k, 2) T' and M_a, times c / 2 sin(c / 2)."""
    moves: Array
    """(k, n) d_j."""
    turns: Array
    """(k,) sum of d_j of the joints that turn."""
    caps: Array
    """(k, 2) m, what y may be for limits, and for singularities and the lemma itself."""
    room: Array
    """(k, 2) rad, of the cone, c; of the roll, times cos(swing / 2)."""
    far: Array
    """(k,) m, r."""

    def allowed(self, turn: Array | float) -> Array:
        """(k, 4) m, y by `BOUNDS`, with the part turned by so many rad for each metre of f(y)."""
        (first, bend), (cone, roll) = self.tilts.T, self.room.T
        swing = solved(first + turn * self.slope, bend - turn * self.second, cone)
        twist = solved(self.turns + turn * self.slope, -turn * self.second, roll)
        return np.stack([self.caps[:, 0], swing, twist, self.caps[:, 1]], axis=1)

    def reached(self, turn: Array | float) -> Array:
        """(k,) m, f of the least of these."""
        y = self.allowed(turn).min(axis=1)
        return np.asarray(self.slope * y - 0.5 * self.second * y**2)

    @property
    def triangle(self) -> Array:
        """(k, 2) D where Theta = 0, m, and Theta where D = 0, rad."""
        angle = np.minimum(self.reached(1.0 / self.far) / self.far, np.pi)
        return np.stack([self.reached(0.0), angle], axis=1)

    def moved(self, position: float, angle: float) -> Array:
        """(m - 1, n) rad or m, e_j from each row to the next, for such a triangle."""
        rho = np.maximum(position, angle * self.far)
        found = np.zeros((int(self.row.max()) + 1, self.moves.shape[1]))
        y = solved(self.slope, -self.second, rho)
        np.maximum.at(found, self.row, self.moves * y[:, None])
        return found


def solved(a: Array, b: Array | float, c: Array) -> Array:
    """The least y >= 0 with a y + b y^2 / 2 = c, at most `MOST`; that, too, where none is."""
    c = np.minimum(c, FREE)
    under = a**2 + 2.0 * b * c
    below = a + np.sqrt(np.maximum(under, 0.0))
    reached = (under < 0.0) | (below <= 0.0)
    return np.minimum(np.where(reached, MOST, 2.0 * c / np.where(reached, 1.0, below)), MOST)


def ends_of(case: Given, q: Array) -> Ends:
    """What has to be known of configurations q (k, n)."""
    at = jacobians(case.kinematics, q)
    back = at.point.transpose(0, 2, 1)
    squares, vectors = np.linalg.eigh(at.point @ back)
    inverse = 1.0 / (np.maximum(squares, 0.0) + DAMPED * squares[:, 2:] + LEAST**2)
    right = back @ (vectors * inverse[:, None]) @ vectors.transpose(0, 2, 1)
    off, turned = at.point @ right - np.eye(3), at.axis @ right
    gram = turned @ turned.transpose(0, 2, 1)  # of rank 2: the axis keeps its length
    trace, square = gram.trace(axis1=1, axis2=2), (gram**2).sum(axis=(1, 2))
    most = 0.5 * (trace + np.sqrt(np.maximum(2.0 * square - trace**2, 0.0)))
    norms = [np.sqrt(inverse[:, 0]), np.sqrt((off**2).sum(axis=(1, 2))), np.sqrt(most)]
    sigma = np.full(len(q), np.inf)
    if case.task.min_manipulability is not None:
        sigma = smallest_singular(at, case.robot.length_unit)
    rows = np.sqrt((right**2).sum(axis=2))
    return Ends(q, at.points, at.levers, at.sines, rows, np.stack(norms, axis=1) / BELOW, sigma)


def left_to_limits(robot: Robot, a: Array, b: Array) -> Array:
    """(..., n) rad or m, from both limits to straight lines between a and b."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    return np.maximum(np.minimum(low - robot.lower, robot.upper - high), 0.0)


def _norms(columns: Array) -> Array:
    """(k,) bounds of the norms of matrices with columns of these lengths (k, n)."""
    return np.asarray(np.sqrt((columns**2).sum(axis=1)))


def _falls(robot: Robot, levers: list[Array], steps: Array) -> Array:
    """(k,) how far the singular value falls at most while joints move by steps (k, n)."""
    point, axis = (_norms(column_changes(one, steps, robot.prismatic)) for one in levers)
    return np.hypot(point / robot.length_unit, axis)


def best_balls(case: Given, at: tuple[Ints, Array], a: Ends, b: Ends, room: Array) -> Balls:
    """Balls that reach about as far as any does."""
    none, free = np.zeros(len(room)), np.full(len(room), MOST)
    guess = balls_of(case, at, a, b, room, none, free)  # it holds for |v| = 0 alone
    size = guess.allowed(0.0).min(axis=1)
    return balls_of(case, at, a, b, room, size, size)


def balls_of(
    case: Given, at: tuple[Ints, Array], a: Ends, b: Ends, room: Array, size: Array, most: Array
) -> Balls:
    """What holds for |v| <= size (k,), m, along stretches from a to b; y may be `most` (k,).

    Args:
        case: what is given.
        at: `row` and `share` of the balls.
        a, b: of the stretches.
        room: (k, 2) rad, what is left of cone and roll along them.
        size, most: see above.
    """
    robot, asked, slides = case.robot, case.task.min_manipulability or 0.0, case.robot.prismatic
    steps, moves = np.abs(b.q - a.q), np.maximum(a.rows, b.rows)
    ends = (np.maximum(a.levers, b.levers), np.inf), (np.maximum(a.sines, b.sines), 1.0)
    along, within = (
        [largest_levers(levers, half, slides, cap) for levers, cap in ends]
        for half in (0.5 * steps, 0.5 * steps + size[:, None] * moves)
    )
    norm, off, turned = np.maximum(a.norms, b.norms).T
    changes = [_norms(column_changes(levers, steps, slides)) for levers in along]
    slope = np.maximum(1.0 - off - 0.5 * norm * changes[0], 0.0)
    second, bend = (second_derivative_bound(levers, moves, slides) for levers in within)
    lemma = np.where(slope > 0.0, solved(second, 0.0, BELOW * slope), 0.0)
    limits = solved(moves, 0.0, left_to_limits(robot, a.q, b.q)).min(axis=1)
    if asked:
        spare = 0.5 * (a.sigma + b.sigma - _falls(robot, along, steps)) - asked
        rest = solved(_falls(robot, within, moves), 0.0, np.maximum(spare, 0.0))
        lemma = np.minimum(lemma, rest)
    far = np.maximum(*(np.linalg.norm(end.points - case.pivot, axis=1) for end in (a, b)))
    far = np.maximum(far + 0.5 * (along[0] * steps).sum(axis=1), LEAST)
    wide = np.where(room[:, 0] < np.pi, 0.5 * room[:, 0], LEAST)
    wide = np.maximum(wide, LEAST) / np.sin(np.maximum(wide, LEAST))
    tilts = wide[:, None] * np.stack([turned + 0.5 * norm * changes[1], bend], axis=1)
    roll = np.cos(0.5 * min(case.task.cone, 0.5 * np.pi))
    room = np.minimum(room, FREE) * [1.0, roll]
    room[room[:, 0] >= np.pi, 0] = FREE
    turns = np.where(slides, 0.0, moves).sum(axis=1)
    caps = np.stack([limits, np.minimum(lemma, most)], axis=1)
    return Balls(*at, slope, second, tilts, moves, turns, caps, room, far)


def balls_along(case: Given, q: Array, room: Array) -> Balls:
    """Of a whole motion q (m, n), in stretches with little less room than configurations have.

    Others are cut into as many pieces as would do if one over the room grew with their length.
    """
    row, share = np.arange(len(q) - 1), np.tile([0.0, 1.0], (len(q) - 1, 1))
    first, ends, found = row, ends_of(case, q), list[Balls]()
    most = np.full(2, np.inf)
    for left in reversed(range(ROUNDS)):
        count, a = len(row), np.tile(first, 2)
        at = np.tile(row, 2), np.vstack([share[:, [0, 0]], share])
        both = np.append(first, first + 1)
        made = best_balls(case, at, ends.of(a), ends.of(both), room[at[0]])
        here, there = np.split(np.maximum(made.triangle, LEAST), 2)
        most = np.minimum(most, here.min(axis=0))
        good = (there >= CLOSE * most).all(axis=1) | (left == 0)
        found.append(made.of(slice(count, None)).of(good))
        if good.all():
            break
        here, there = here[~good], there[~good]
        spare = np.maximum(here / (CLOSER * most) - 1.0, 1.0 / CLOSER - 1.0)
        pieces = np.ceil(((here / there - 1.0) / spare).max(axis=1)).clip(2, PIECES).astype(np.intp)
        cut = np.repeat(np.arange(len(pieces)), pieces + 1)
        number = np.arange(len(cut)) - (np.cumsum(pieces + 1) - pieces - 1)[cut]
        (low, high), row = share[~good][cut].T, row[~good][cut]
        part = low + (high - low) * number / pieces[cut]
        ends = ends_of(case, q[row] + part[:, None] * (q[row + 1] - q[row]))
        first = np.flatnonzero(number < pieces[cut])
        row, share = row[first], np.column_stack([part[first], part[first + 1]])
    return Balls.join(*found)


def placement_margin(
    robot: Robot,
    cells: Cells,
    task: Task,
    q: Array,
    room: Array,
    pairings: tuple[Pairing, ...] | None = None,
) -> PlacementMargin | None:
    """The margin of an accepted motion; see the module. None where bodies were not judged.

    Args:
        robot, cells, task: the case.
        q: (m, n) the motion, m >= 1, rad or m.
        room: (m, 2) rad, what is left of cone and roll from each row to the next; inf where free.
        pairings: all couples of bodies along the motion, as they were judged.
    """
    case = Given(robot, task, cells.centres.mean(axis=0), Kinematics(robot))
    middle = tuple(case.pivot.tolist())
    if robot.start is not None:  # the motion has to begin there, wherever the part stands
        return PlacementMargin(0.0, 0.0, middle, Bound.START, _cell(case, cells, q[0]))
    if pairings is None and task.collision is not None and task.collision.checked:
        return None
    if len(q) == 1:
        q, room = np.repeat(q, 2, axis=0), np.repeat(room, 2, axis=0)
    room = np.vstack([room[:-2], room[-2:].min(axis=0)])  # the last row ends the last segment
    balls = balls_along(case, q, room)
    reach, along = balls.triangle, np.full(len(q) - 1, np.inf)
    np.minimum.at(along, balls.row, reach[:, 0])
    worst = int(np.argmin(reach[:, 0]))
    row, what = int(balls.row[worst]), ""
    bound_by = BOUNDS[int(np.argmin(balls.allowed(0.0)[worst]))]
    if bound_by is Bound.LIMIT:
        left = left_to_limits(robot, q[row], q[row + 1])
        what = robot.joint_names[int(np.argmin(solved(balls.moves[worst], 0.0, left)))]
    position, angle = (BELOW * reach.min(axis=0)).tolist()
    if pairings and position > 0.0:
        from feasibility.certification.displaced_bodies import displaced_share

        clear = displaced_share(robot, cells, task, pairings, (position, angle), balls.moved)
        position, angle = clear.share * position, clear.share * angle
        if clear.pair is not None:
            row, bound_by, what = clear.row, Bound.CLEARANCE, " and ".join(clear.pair)
    return PlacementMargin(
        position, angle, middle, bound_by, _cell(case, cells, q[row]), what, along
    )


def _cell(case: Given, cells: Cells, q: Array) -> tuple[int, ...]:
    """The cell whose target is nearest to the tool at q (n,)."""
    off = case.task.targets(cells).points - case.kinematics.tool(q)[0]
    return cells.unravel(int(np.linalg.norm(off, axis=1).argmin()))


def margin_fault(task: Task, certificate: Certificate) -> str:
    """Why the margin is less than what the task asks for; empty where it is not, or not known."""
    if task.placement_error is None or certificate.placement_margin is None:
        return ""
    error, margin = PlacementError(*task.placement_error), certificate.placement_margin
    if margin.share(error) <= 1.0:
        return ""
    asked = f"{1e3 * error.position:g} mm and {error.angle_deg:g} deg off its place"
    return f"the part may stand {asked}; certified is {margin}"


def margin_of(
    robot: Robot, cells: Cells, task: Task, q: Array, room: Array
) -> Callable[..., PlacementMargin | None]:
    """`placement_margin` of a motion by its `pairings`, found once, when it is first asked for."""
    return cache(partial(placement_margin, robot, cells, task, q, room))
