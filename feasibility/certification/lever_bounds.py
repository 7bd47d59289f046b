"""How far a tool moves over a box of joints, or along a motion, and how far off its linear model.

**Lemma.** Let r_j be the lever of joint j at the centre c of a box, the distance of the tool point
from its axis, and h_j the half width. Then for every d in the box p(c + d) is within
sum_j r_j h_j of p(c), and

    |p(c + d) - p(c) - J d| <= D / 2,    D = sum_j r_j h_j (h_j + 2 sum_{i before j} h_i),

the sums over revolute joints; a prismatic j adds h_j to the first one, and to D what a lever of 1
would without its own turn, 2 h_j sum_{i before j} h_i. *Proof.* Change the joints one by one, the
first first. Those behind j are where they are at c when j is changed, so it moves the tool point by
R v: v is what it would do at c, and R what the joints before j turn by, at most the sum of their
h_i. |v| <= r_j h_j, and v is J_j d_j up to r_j d_j^2 / 2; |R v - v| is at most that sum times |v|.
QED The axis likewise: s_j = |z_j x a| in place of r_j, and nothing from joints that slide.

**Along a segment** q(s), s from 0 to 1, with |q'| <= d, |p''| <= D with d in place of h and L_j in
place of r_j, where no lever on the segment is longer than L_j: for i before j,
d2p/dq_i dq_j = z_i x (z_j x (p - o_j)), at most r_j long; z_i x z_j, at most 1, if j slides; 0 if i
slides. *Levers:* r_j depends on the joints behind j alone. Change these one by one, the last first:
joint k moves the tool point by at most 2 sin(h_k / 2) L_k, not more than min(h_k, 2) L_k, or by h_k
if it slides; so L_j = r_j(c) + sum_{k behind j} min(h_k, 2) L_k. A distance to a line changes by no
more than the point does. Every place of the segment is within d / 2 of one of its ends, so the
larger lever at the two takes the place of r_j(c).

**Jacobians** come from Pinocchio's twists. Column j of the tool point's Jacobian, z_j x (p - o_j),
is as long as the lever arm r_j; that of the axis, z_j x a, has the length s_j, a sine. A joint that
slides has z_j in place of the first, and 0.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coverable.arrays import Array, Mask, Rows
from robots.kinematics import Kinematics
from robots.robot import Robot


def second_derivative_bound(largest: Array, steps: Array, prismatic: Mask) -> Array:
    """(..., ) D, from r_j or L_j (..., n) and the changes of joints (..., n), h_j or d_j."""
    turns = np.where(prismatic, 0.0, steps)
    before = np.cumsum(turns, axis=-1) - turns
    return np.asarray((largest * steps * (turns + 2.0 * before)).sum(axis=-1))


def column_changes(largest: Array, steps: Array, prismatic: Mask, twice: bool = False) -> Array:
    """(..., n) how far each column of the Jacobian moves at most, from L_j and the steps.

    Column j turns with the joints up to j, and is changed by what those behind j move. Or how fast
    that changes along a segment, |J_j''|: of three joints the third derivative is z_a x (z_b x
    (z_c x (p - o_c))), c the last of them, as long as its lever at most, and 0 if a or b slides.
    """
    turns = np.where(prismatic, 0.0, steps)
    own = np.cumsum(turns, axis=-1)
    moved = largest * steps * (2.0 * own - turns if twice else 1.0)
    behind = np.cumsum(moved[..., ::-1], axis=-1)[..., ::-1] - moved
    # A joint that slides keeps its direction unless joints before it turn.
    return np.asarray(largest * own ** (1 + twice) + np.where(prismatic, 0.0, behind))


def levers_along(steps: Array, prismatic: Mask, first: Array, last: Array, cap: float) -> Array:
    """(m, n) L_j along m segments.

    Args:
        steps: (m, n) bounds on |q'|, rad or m.
        prismatic: (n,) which joints slide.
        first, last: (m, n) r_j or s_j at both ends; of a prismatic joint 1 for points, 0 for axes.
        cap: what no lever exceeds anywhere: inf for points, 1 for axes.
    """
    largest, behind = np.maximum(first, last), np.zeros(len(first))
    for j in range(largest.shape[1] - 1, -1, -1):
        turned = 0.5 * steps[:, j]
        if not prismatic[j]:
            largest[:, j] = np.minimum(largest[:, j] + behind, cap)
            turned = np.minimum(turned, 2.0)
        behind = behind + largest[:, j] * turned
    return largest


def second_derivatives(steps: Array, prismatic: Mask, levers: Array, cap: float) -> Array:
    """(m,) D of |p''| (or |a''|) along segments of absolute joint changes (m, n), one by one.

    The levers (m + 1, n) are r_j (or s_j) at their ends; the cap as in `levers_along`.
    """
    largest = levers_along(steps, prismatic, levers[:-1], levers[1:], cap)
    return second_derivative_bound(largest, steps, prismatic)


def peaks(a: Array, b: Array, most: Array) -> Array:
    """(m,) largest values along m segments of a norm with the values a and b (m,) at their ends.

    `most` (m,) bounds the second derivative, so the norm is at most
    (1 - s) a + s b + s (1 - s) most / 2, whose largest value this is. NaN comes out as NaN.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.abs(b - a)
        inner = 0.5 * (a + b) + most / 8.0 + slope**2 / (2.0 * most)
    return np.where(2.0 * slope >= most, np.maximum(a, b), inner)


def out_of_line(robot: Robot) -> str:
    """Why the joints are no serial chain, of which alone the lemma speaks; empty where they are."""
    model = robot.model
    in_line = model.nv == robot.n and all(model.parents[k] == k - 1 for k in range(1, robot.n + 1))
    if in_line and model.frames[robot.tool_frame_id].parentJoint == robot.n:
        return ""
    return f"the joints of {robot.name!r} form no serial chain up to its tool"


def _links(robot: Robot) -> Array:
    """(n + 1,) m, distances from the root to the first joint, from joint to joint, to the tool."""
    places = [*list(robot.model.jointPlacements)[1:]]
    places.append(robot.model.frames[robot.tool_frame_id].placement)
    return np.array([np.linalg.norm(place.translation) for place in places], dtype=float)


def longest_levers(robot: Robot, low: Array, high: Array) -> Array:
    """(n,) m, no lever of joint j exceeds this: the lengths of all links behind it, stretched out.

    Joints that slide add the larger of their two ends in low .. high (n,).
    """
    strokes = np.where(robot.prismatic, np.maximum(np.abs(low), np.abs(high)), 0.0)
    behind = _links(robot)[1:] + np.append(strokes[1:], 0.0)
    return np.asarray(np.cumsum(behind[::-1])[::-1])


def stretched_length(robot: Robot, without: int) -> float:
    """m, all links and slides in one line, but for the slide of one joint."""
    strokes = np.maximum(np.abs(robot.lower), np.abs(robot.upper))
    counted = robot.prismatic & (np.arange(robot.n) != without)
    return float(_links(robot).sum() + strokes[counted].sum())


@dataclass(frozen=True, eq=False, slots=True)
class Jacobians(Rows):
    """Of m configurations."""

    points: Array
    """(m, 3) m, tool points."""
    axes: Array
    """(m, 3) approach axes."""
    point: Array
    """(m, 3, n) derivatives of the tool point."""
    axis: Array
    """(m, 3, n) derivatives of the approach axis."""
    angular: Array
    """(m, 3, n) what the joints turn about; 0 for those that slide."""

    @property
    def levers(self) -> Array:
        """(m, n) m, r_j; 1 for a joint that slides."""
        return np.asarray(np.linalg.norm(self.point, axis=1))

    @property
    def sines(self) -> Array:
        """(m, n) s_j; 0 for a joint that slides."""
        return np.asarray(np.linalg.norm(self.axis, axis=1))


def jacobians(kinematics: Kinematics, q: Array) -> Jacobians:
    """Of configurations q (m, n), rad or m."""
    points, axes, twists = kinematics.tools_and_twists(q)
    linear, angular = twists[:, :3], twists[:, 3:]
    around, turned = (np.cross(angular, one[..., None], axis=1) for one in (points, axes))
    return Jacobians(points, axes, linear + around, turned, angular)


def smallest_singular(at: Jacobians, scale: float) -> Array:
    """(k,) the smallest singular value that counts: of two directions of the axis, not three."""
    both = np.concatenate([at.point / scale, at.axis], axis=1)
    values = np.linalg.svd(both, compute_uv=False)
    return np.asarray(values[:, min(both.shape[2], 5) - 1], dtype=float)
