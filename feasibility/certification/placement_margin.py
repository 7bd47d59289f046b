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
(`column_bends`); those of A likewise. Whatever is no more than so much at both ends is in between
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

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.certification.bisection import Rows
from feasibility.certification.jacobians import Jacobians, jacobians, smallest_singular
from feasibility.certification.lever_bounds import (
    column_bends,
    column_changes,
    second_derivative_bound,
)
from feasibility.task import PlacementError, Task
from feasibility.verdict import Bound, Certificate, PlacementMargin
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.cells import Cells

if TYPE_CHECKING:
    from feasibility.certification.collisions.pairing import Pairing

CLOSE = 0.95  # [1] of the least room at a row: stretches with less are cut
ROUNDS = 3  # of cutting, after which they are taken as they are
PIECES = 4  # that a stretch is cut into
MOST = 10.0  # [m] no larger ball is tried
LEAST = 1e-12  # [m], [rad] so that nothing is divided by 0
FREE = 1e9  # [rad] room for what is free
BELOW = 1.0 - 1e-9  # [1] of what is found is claimed: rounding
DAMPED = 1e-10  # [1] of all squared singular values: so a right inverse exists everywhere
BOUNDS = (Bound.LIMIT, Bound.SINGULAR, Bound.CONE, Bound.ROLL)


class Given(NamedTuple):
    """What all stretches of a motion share."""

    robot: Robot
    task: Task
    pivot: Array


@dataclass(frozen=True, eq=False, slots=True)
class Ends(Rows):
    """k configurations at which stretches begin or end; or (2, k) of them, where some end too."""

    q: Array
    points: Array
    levers: Array
    """(k, 2, n) r_j, and those of the axis, sines."""
    right: Array
    """(k, n, 3) P."""
    rows: Array
    """(k, n) norms of its rows."""
    norms: Array
    """(k, 2) eps and T."""
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
    turns: Array
    """(k, 2, 2) T' and M_a, times c / 2 sin(c / 2); sum of d_j of the joints that turn, and 0."""
    moves: Array
    """(k, n) d_j."""
    caps: Array
    """(k, 2) m, what y may be for limits, and for singularities and the lemma itself."""
    room: Array
    """(k, 2) rad, of the cone, c; of the roll, times cos(swing / 2)."""
    far: Array
    """(k,) m, r."""

    def allowed(self, turn: Array | float) -> Array:
        """(..., k, 4) m, y by `BOUNDS`, with the part turned by (..., k) rad a metre of f(y)."""
        part = np.asarray(turn)[..., None]
        first = self.turns[..., 0] + part * self.slope[:, None]
        angles = solved(first, self.turns[..., 1] - part * self.second[:, None], self.room)
        return np.concatenate([np.broadcast_to(self.caps, angles.shape), angles], axis=-1)

    def reached(self, turn: Array | float) -> Array:
        """(..., k) m, f of the least of these."""
        y = self.allowed(turn).min(axis=-1)
        return np.asarray(self.slope * y - 0.5 * self.second * y**2)

    @property
    def triangle(self) -> Array:
        """(k, 2) D where Theta = 0, m, and Theta where D = 0, rad."""
        shift, turn = self.reached(np.stack([0.0 * self.far, 1.0 / self.far]))
        return np.stack([shift, np.minimum(turn / self.far, np.pi)], axis=1)

    @property
    def first(self) -> Ints:
        """(m - 1,) which is the first one behind each row."""
        return np.flatnonzero(self.row != np.append(-1, self.row[:-1]))

    def moved(self, position: float, angle: float) -> Array:
        """(m - 1, n) rad or m, e_j from each row to the next, for such a triangle."""
        y = solved(self.slope, -self.second, np.maximum(position, angle * self.far))
        return np.maximum.reduceat(self.moves * y[:, None], self.first)


def solved(a: Array, b: Array | float, c: Array) -> Array:
    """The least y >= 0 with a y + b y^2 / 2 = c, at most `MOST`; that, too, where none is."""
    c = np.minimum(c, FREE)
    under = a**2 + 2.0 * b * c
    below = a + np.sqrt(np.maximum(under, 0.0))
    reached = (under < 0.0) | (below <= 0.0)
    return np.minimum(np.where(reached, MOST, 2.0 * c / np.where(reached, 1.0, below)), MOST)


def ends_of(case: Given, q: Array, at: Jacobians | None = None) -> Ends:
    """What has to be known of configurations q (k, n), whose Jacobians may be known."""
    at = jacobians(Kinematics(case.robot), q) if at is None else at
    back = at.point.transpose(0, 2, 1)
    square = at.point @ back
    least = DAMPED * square.trace(axis1=1, axis2=2) + LEAST**2
    right = back @ np.linalg.inv(square + least[:, None, None] * np.eye(3))
    off, turned = at.point @ right - np.eye(3), at.axis @ right
    most = np.linalg.eigvalsh(turned @ turned.transpose(0, 2, 1))[:, 2]
    norms = np.sqrt(np.stack([(off**2).sum(axis=(1, 2)), most], axis=1)) / BELOW
    sigma = np.full(len(q), np.inf)
    if case.task.min_manipulability is not None:
        sigma = smallest_singular(at, case.robot.length_unit)
    levers = np.stack([at.levers, at.sines], axis=1)
    return Ends(q, at.points, levers, right, np.sqrt((right**2).sum(axis=2)), norms, sigma)


def left_to_limits(robot: Robot, ends: Array) -> Array:
    """(..., n) rad or m, from both limits to straight lines between ends (2, ..., n)."""
    low, high = ends.min(axis=0), ends.max(axis=0)
    return np.maximum(np.minimum(low - robot.lower, robot.upper - high), 0.0)


def balls_of(case: Given, row: Ints, share: Array, ends: Ends, room: Array) -> Balls:
    """What holds along stretches.

    Args:
        case: what is given.
        row, share: of the balls.
        ends: (2, k) where they begin and end.
        room: (m - 1, 2) rad, what is left of cone and roll along the motion.
    """
    robot, slides, least = case.robot, case.robot.prismatic, case.task.min_manipulability
    steps, moves = np.abs(ends.q[1] - ends.q[0]), ends.rows.max(axis=0)
    off, turned = ends.norms.max(axis=0).T
    way = ends.levers.max(axis=0) * steps[:, None]
    behind = np.cumsum(way[..., ::-1], axis=2)[..., ::-1] - way
    levers = np.where(slides, ends.levers[0], 0.5 * (ends.levers.sum(axis=0) + behind))
    levers[:, 1] = np.minimum(levers[:, 1], 1.0)
    rates = column_changes(levers, steps[:, None], slides)
    bends = column_bends(levers, steps[:, None], slides)
    change = np.sqrt(((ends.right[1] - ends.right[0]) ** 2).sum(axis=2))
    between = 0.125 * (bends * moves[:, None] + 2.0 * rates * change[:, None]).sum(axis=2)
    second, bend = second_derivative_bound(levers, moves[:, None], slides).T
    slope = np.maximum(1.0 - off - between[:, 0], 0.0)
    lemma = np.minimum(BELOW * slope / np.maximum(second, LEAST), MOST)
    limits = solved(moves, 0.0, left_to_limits(robot, ends.q)).min(axis=1)
    if least is not None:
        both = np.stack([rates, column_changes(levers, moves[:, None], slides)])
        fall, falls = np.sqrt((both**2 / [[robot.length_unit**2], [1.0]]).sum(axis=(2, 3)))
        spare = np.maximum(0.5 * (ends.sigma.sum(axis=0) - fall) - least, 0.0)
        lemma = np.minimum(lemma, solved(falls, 0.0, spare))
    far = np.linalg.norm(ends.points - case.pivot, axis=2).max(axis=0)
    far += 0.125 * second_derivative_bound(levers[:, 0], steps, slides) + LEAST
    room = np.minimum(room[row], FREE) * [1.0, np.cos(0.5 * min(case.task.cone, 0.5 * np.pi))]
    wide = np.maximum(np.where(room[:, 0] < np.pi, 0.5 * room[:, 0], LEAST), LEAST)
    room[room[:, 0] >= np.pi, 0] = FREE
    chord = wide / np.sin(wide)
    turns = np.stack([
        chord * (turned + between[:, 1]), chord * bend,
        np.where(slides, 0.0, moves).sum(axis=1), 0.0 * bend,
    ], axis=1).reshape(-1, 2, 2)  # fmt: skip
    caps = np.stack([limits, lemma], axis=1)
    return Balls(row, share, slope, second, turns, moves, caps, room, far)


def balls_along(case: Given, q: Array, room: Array, at: Jacobians | None = None) -> Balls:
    """Of a whole motion q (m, n), in stretches with little less room than there is at rows."""
    row, ends, found = np.arange(len(q) - 1), ends_of(case, q, at), list[Balls]()
    share = np.tile([0.0, 1.0], (len(row), 1))
    pairs = np.array([[row, row, row + 1], [row + 1, row, row + 1]]).reshape(2, -1)
    made = balls_of(case, np.tile(row, 3), np.tile(share, (3, 1)), ends.of(pairs), room)
    reach, made = made.triangle, made.of(slice(len(row)))
    most, reach = reach[len(row) :].min(axis=0), reach[: len(row)]
    for _ in range(ROUNDS):
        bad = (reach < CLOSE * most).any(axis=1)
        if not bad.any():
            break
        found.append(made.of(~bad))
        (low, high), row = share[bad].T, row[bad, None]
        part = np.linspace(low, high, PIECES + 1, axis=1)
        between = q[row] + part[..., None] * (q[row + 1] - q[row])
        k = np.arange(part.size).reshape(part.shape)
        pairs = np.stack([k[:, :-1], k[:, 1:]]).reshape(2, -1)
        row, share = np.repeat(row, PIECES), part.ravel()[pairs].T
        ends = ends_of(case, between.reshape(-1, q.shape[1]))
        made = balls_of(case, row, share, ends.of(pairs), room)
        reach = made.triangle
    if not found:
        return made
    made = Balls.join(*found, made)
    return made.of(np.argsort(made.row, kind="stable"))


def placement_margin(
    robot: Robot,
    cells: Cells,
    task: Task,
    q: Array,
    room: Array,
    at: Jacobians | None = None,
    pairings: tuple[Pairing, ...] | None = None,
) -> PlacementMargin | None:
    """The margin of an accepted motion; see the module. None where bodies were not judged.

    Args:
        robot, cells, task: the case.
        q: (m, n) the motion, m >= 1, rad or m.
        room: (m, 2) rad, what is left of cone and roll from each row to the next; inf where free.
        at: m Jacobians at its rows, where they are known.
        pairings: all couples of bodies along the motion, as they were judged.
    """
    case = Given(robot, task, cells.centres.mean(axis=0))
    middle, poses = tuple(case.pivot.tolist()), at or jacobians(Kinematics(robot), q)

    def cell_at(row: int) -> tuple[int, ...]:  # the one whose target is nearest to the tool
        off = np.linalg.norm(task.targets(cells).points - poses.points[row], axis=1)
        return cells.unravel(int(off.argmin()))

    if robot.start is not None:  # the motion has to begin there, wherever the part stands
        return PlacementMargin(0.0, 0.0, middle, Bound.START, cell_at(0))
    if pairings is None and task.collision is not None and task.collision.checked:
        return None
    if len(q) == 1:
        q, room = np.repeat(q, 2, axis=0), np.repeat(room, 2, axis=0)
        poses = poses.of(np.array([0, 0]))
    room = np.vstack([room[:-2], room[-2:].min(axis=0)])  # the last row ends the last segment
    balls = balls_along(case, q, room, poses)
    reach = balls.triangle
    along = np.minimum.reduceat(reach[:, 0], balls.first)
    worst = int(np.argmin(reach[:, 0]))
    row, what = int(balls.row[worst]), ""
    bound_by = BOUNDS[int(balls.allowed(0.0)[worst].argmin())]
    if bound_by is Bound.LIMIT:
        left = left_to_limits(robot, q[row : row + 2])
        what = robot.joint_names[int(np.argmin(solved(balls.moves[worst], 0.0, left)))]
    position, angle = (BELOW * reach.min(axis=0)).tolist()
    if pairings and position > 0.0:
        from feasibility.certification.displaced_bodies import displaced_share

        clear = displaced_share(robot, task, case.pivot, pairings, (position, angle), balls.moved)
        along, share = np.minimum(along, clear.along * position), float(clear.along.min())
        position, angle = share * position, share * angle
        if clear.pair is not None:
            row, bound_by, what = int(along.argmin()), Bound.CLEARANCE, " and ".join(clear.pair)
    return PlacementMargin(position, angle, middle, bound_by, cell_at(row), what, along)


def margin_fault(task: Task, certificate: Certificate) -> str:
    """Why the margin is less than what the task asks for; empty where it is not, or not known."""
    if task.placement_error is None or certificate.placement_margin is None:
        return ""
    error, margin = PlacementError(*task.placement_error), certificate.placement_margin
    if margin.share(error) <= 1.0:
        return ""
    asked = f"{1e3 * error.position:g} mm and {error.angle_deg:g} deg off its place"
    return f"the part may stand {asked}; certified is {margin}"
