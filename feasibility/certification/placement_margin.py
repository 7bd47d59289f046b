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
between, with |JP - I| <= eps there; d_j bounds the norms of its rows, N those of P, T those of AP,
at both ends. J and A change by at most s C and s C_a from one end, (1 - s) C and (1 - s) C_a from
the other. As P is a mean of both,

    |J(s) P(s) - I| <= kappa = eps + N C / 2,    |A(s) P(s)| <= T' = T + N C_a / 2.

M and M_a are those of the largest levers along the stretch: no lever is over half of what those at
both ends and the way of all behind it sum to. Let f(y) = (1 - kappa) y - M y^2 / 2, |g p - p| at
most rho. **If** rho <= f(y) and M y < 1 - kappa, exactly one v with |v| <= y has p(q(s) + P(s) v) =
g p(q(s)): with B the derivative JP at v = 0, v -> v - B^-1 (p(q + P v) - g p) maps the ball into
itself, as it takes v to at most (rho + M y^2 / 2) / (1 - kappa), and is a contraction there. All of
it is continuous in t, so v is; stretches that meet share P, and the smaller of their balls holds
both of their v. QED

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

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.certification.bisection import Rows
from feasibility.certification.jacobians import jacobians, smallest_singular
from feasibility.certification.lever_bounds import column_changes, second_derivative_bound
from feasibility.task import PlacementError, Task
from feasibility.verdict import Bound, Certificate, PlacementMargin
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

if TYPE_CHECKING:
    from feasibility.certification.collisions.pairing import Pairing

CLOSE = 0.94  # [1] of the least room at a row: stretches with so much are not cut, ...
CLOSER = 0.97  # [1] ... others into as many pieces as should have this much
ROUNDS = 3  # of cutting what has less
PIECES = 32  # most, that a stretch is cut into at once
MOST = 10.0  # [m] no larger ball is tried
LEAST = 1e-12  # [m], [rad] so that nothing is divided by 0
FREE = 1e9  # [rad] room for what is free
BELOW = 1.0 - 1e-9  # [1] of what is found is claimed: rounding
DAMPED = 1e-10  # [1] of all squared singular values: so a right inverse exists everywhere
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
    """(k, 2, n) r_j, and those of the axis, sines."""
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
    square = at.point @ back
    least = DAMPED * square.trace(axis1=1, axis2=2) + LEAST**2
    right = back @ np.linalg.inv(square + least[:, None, None] * np.eye(3))
    off, turned = at.point @ right - np.eye(3), at.axis @ right
    values = np.linalg.eigvalsh(np.stack([square, turned @ turned.transpose(0, 2, 1)]))
    norm = 1.0 / (np.maximum(values[0, :, 0], 0.0) + least)
    norms = np.sqrt(np.stack([norm, (off**2).sum(axis=(1, 2)), values[1, :, 2]], axis=1))
    sigma = np.full(len(q), np.inf)
    if case.task.min_manipulability is not None:
        sigma = smallest_singular(at, case.robot.length_unit)
    levers = np.stack([at.levers, at.sines], axis=1)
    return Ends(q, at.points, levers, np.sqrt((right**2).sum(axis=2)), norms / BELOW, sigma)


def left_to_limits(robot: Robot, a: Array, b: Array) -> Array:
    """(..., n) rad or m, from both limits to straight lines between a and b."""
    low, high = np.minimum(a, b), np.maximum(a, b)
    return np.maximum(np.minimum(low - robot.lower, robot.upper - high), 0.0)


def _changes(robot: Robot, levers: Array, steps: Array) -> Array:
    """(k, 2) how far J and A change at most while joints move by steps (k, n); levers (k, 2, n)."""
    columns = column_changes(levers, steps[:, None], robot.prismatic)
    return np.asarray(np.sqrt((columns**2).sum(axis=2)))


def _fall(robot: Robot, changes: Array) -> Array:
    """(k,) how far the singular value falls at most."""
    return np.hypot(changes[:, 0] / robot.length_unit, changes[:, 1])


def balls_of(case: Given, at: tuple[Ints, Array], a: Ends, b: Ends, room: Array) -> Balls:
    """What holds along stretches from a to b.

    Args:
        case: what is given.
        at: `row` and `share` of the balls.
        a, b: of the stretches.
        room: (k, 2) rad, what is left of cone and roll along them.
    """
    robot, slides = case.robot, case.robot.prismatic
    steps, moves = np.abs(b.q - a.q), np.maximum(a.rows, b.rows)
    levers, (norm, off, turned) = np.maximum(a.levers, b.levers), np.maximum(a.norms, b.norms).T
    changes, way = _changes(robot, levers, steps), levers * steps[:, None]
    behind = np.cumsum(way[..., ::-1], axis=2)[..., ::-1] - way
    along = np.where(slides, levers, 0.5 * (a.levers + b.levers + behind))
    along[:, 1] = np.minimum(along[:, 1], 1.0)
    second, bend = second_derivative_bound(along, moves[:, None], slides).T
    slope = np.maximum(1.0 - off - 0.5 * norm * changes[:, 0], 0.0)
    lemma = np.minimum(BELOW * slope / np.maximum(second, LEAST), MOST)
    limits = solved(moves, 0.0, left_to_limits(robot, a.q, b.q)).min(axis=1)
    if case.task.min_manipulability is not None:
        least = 0.5 * (a.sigma + b.sigma - _fall(robot, changes)) - case.task.min_manipulability
        falls = _fall(robot, _changes(robot, along, moves))
        lemma = np.minimum(lemma, solved(falls, 0.0, np.maximum(least, 0.0)))
    far = np.maximum(*(np.linalg.norm(end.points - case.pivot, axis=1) for end in (a, b)))
    far = np.maximum(far + 0.5 * way[:, 0].sum(axis=1), LEAST)
    wide = np.maximum(np.where(room[:, 0] < np.pi, 0.5 * room[:, 0], LEAST), LEAST)
    chord = np.stack([turned + 0.5 * norm * changes[:, 1], bend], axis=1)
    tilts = (wide / np.sin(wide))[:, None] * chord
    roll = np.cos(0.5 * min(case.task.cone, 0.5 * np.pi))
    room = np.minimum(room, FREE) * [1.0, roll]
    room[room[:, 0] >= np.pi, 0] = FREE
    turns = np.where(slides, 0.0, moves).sum(axis=1)
    caps = np.stack([limits, lemma], axis=1)
    return Balls(*at, slope, second, tilts, moves, turns, caps, room, far)


def balls_along(case: Given, q: Array, room: Array) -> Balls:
    """Of a whole motion q (m, n), in stretches with little less room than there is at rows.

    Others are cut into as many pieces as would do if one over the room grew with their length.
    """
    row, ends, found = np.arange(len(q) - 1), ends_of(case, q), list[Balls]()
    share = np.tile([0.0, 1.0], (len(row), 1))
    a, b = np.concatenate([row, row, row + 1]), np.concatenate([row + 1, row, row + 1])
    at = np.tile(row, 3), np.tile(share, (3, 1))
    made = balls_of(case, at, ends.of(a), ends.of(b), room[at[0]])
    whole, *both = np.split(np.maximum(made.triangle, LEAST), 3)
    here, made = np.minimum(*both), made.of(row)
    most = here.min(axis=0)
    for left in reversed(range(ROUNDS)):
        good = (whole >= CLOSE * most).all(axis=1) | (left == 0)
        found.append(made.of(good))
        if good.all():
            break
        row, share, here, whole = (one[~good] for one in (row, share, here, whole))
        spare = np.maximum(here / (CLOSER * most) - 1.0, 1.0 / CLOSER - 1.0)
        pieces = ((here / whole - 1.0) / spare).max(axis=1)
        pieces = np.ceil(pieces).clip(2, PIECES).astype(np.intp)
        cut = np.repeat(np.arange(len(row)), pieces + 1)
        number = np.arange(len(cut)) - (np.cumsum(pieces + 1) - pieces - 1)[cut]
        (low, high), row, here = share[cut].T, row[cut], here[cut]
        part = low + (high - low) * number / pieces[cut]
        ends = ends_of(case, q[row] + part[:, None] * (q[row + 1] - q[row]))
        k = np.flatnonzero(number < pieces[cut])
        row, share, here = row[k], np.column_stack([part[k], part[k + 1]]), here[k]
        made = balls_of(case, (row, share), ends.of(k), ends.of(k + 1), room[row])
        whole = np.maximum(made.triangle, LEAST)
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
    bound_by = BOUNDS[int(np.argmin(balls.of(slice(worst, worst + 1)).allowed(0.0)))]
    if bound_by is Bound.LIMIT:
        left = left_to_limits(robot, q[row], q[row + 1])
        what = robot.joint_names[int(np.argmin(solved(balls.moves[worst], 0.0, left)))]
    position, angle = (BELOW * reach.min(axis=0)).tolist()
    if pairings and position > 0.0:
        from feasibility.certification.displaced_bodies import displaced_share

        clear = displaced_share(robot, cells, task, pairings, (position, angle), balls.moved)
        along, share = np.minimum(along, clear.along * position), float(clear.along.min())
        position, angle = share * position, share * angle
        if clear.pair is not None:
            row, bound_by, what = int(along.argmin()), Bound.CLEARANCE, " and ".join(clear.pair)
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
