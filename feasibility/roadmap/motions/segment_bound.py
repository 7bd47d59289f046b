"""The bound between samples: does a straight segment in joint space obey the constraints?

On q(s) = q0 + s d, s in [0, 1], let r_j be the largest distance of the tool point from axis j. Then

    |p''| <= D = sum_j r_j |d_j| (|d_j| + 2 sum_{i<j, revolute} |d_i|)

for revolute j; a prismatic j adds 2 |d_j| sum_{i<j, revolute} |d_i|. (Differentiate
p' = sum_j d_j z_j x (p - o_j): joint j turns its own term, every earlier revolute joint turns it
once more, and the mixed term appears twice.) The distance to axis j changes only with the joints
behind it, so r_j <= max(r_j(0), r_j(1)) + 1/2 sum_{k>j} r_k |d_k|. The same with the sine
s_j = |z_j x a| in place of r_j bounds |a''| <= Da.

A vector function whose second derivative is at most M stays within s (1 - s) M / 2 of its chord, so
its norm is at most (1 - s) c0 + s c1 + s (1 - s) M / 2: see `peak`. Meanwhile the target moves
along its curve, a piecewise cubic with |T''| <= Tp and |b''| <= Tb (`work.derivative_bound`, zero
where it is at rest). So, with p - T and a - b as the vector functions,

    |p - T|(s)  <= peak of both ends with M = D + Tp
    |a - b|(s)  <= peak of both ends with M = Da + Tb

and |a - b| = 2 sin(angle / 2) compares with the cone chord 2 sin(alpha / 2) exactly. The cone is to
hold at the tool point's closest point on the surface, where the normal differs from the target's by
at most kappa |p - T|, kappa the largest curvature of the target surface:

    |a - n|(s)  <= peak of both ends with M = Da + Tb + kappa (D + Tp)

(`Work.allowance` is already less by what this adds at the ends for tool points within `near` of
their targets, and `cone_used` adds what it costs further off.) Limits are convex: the ends decide.

Where roll is limited, psi of `motions.roll` obeys the same kind of bound. With d_j the absolute
steps of the revolute joints, B_j = sum_{i<j} d_i, turn = sum_j d_j, and

    G = sum_j s_j d_j B_j,      W = sum_j d_j B_j,      A = sum_j s_j d_j

differentiate psi' = (om - Om) . k. As om' = sum_{i<j} d_i d_j z_i x z_j and |(z_i x z_j) . a| <=
s_j, |om' . (a + b)| <= 2 G + W |a - b|; and c = a . b has |c'| <= (A + |b'|) sin theta. So

    |psi''| <= (2 G + W |a - b|) / (1 + c) + (|Om'| + |Om| turn) / cos(theta / 2)
               + (turn + |Om|) / cos(theta / 2) (A + |b'|) tan(theta / 2)

with the peak of |a - b| for the tilt theta: 1 + c = 2 - |a - b|^2 / 2. Both ends of the range are
tested with the signed values of psi, that of the frame at the tool point's closest point included.
They are principal values: a full turn between them is ruled out by its own test, that roll changes
by less than is left of a turn, (turn + |Om|) / cos(theta / 2) < 2 pi - |psi1 - psi0|.
"""

import numpy as np

from coverable.kernels import kernel
from feasibility.collisions.kernels.clearance import blamed, segment_clear
from feasibility.roadmap.motions.roll_kernels import TURN
from feasibility.roadmap.motions.search_arrays import COLLISION, CONE, ROLL
from feasibility.roadmap.motions.working_memory import HERE, NEXT, cone_used, roll_lost


@kernel
def second_derivatives(arrays, work, q0, q1):
    """D and Da of the module's bound for the segment from q0 (slot 0) to q1 (slot 1).

    `work.roll_terms` receives turn, A, G and W.
    """
    n = q0.shape[0]
    behind = 0.0  # how far the tool point moves by the joints behind j
    behind_axis = 0.0
    before = 0.0  # total turn of the revolute joints before j
    for j in range(n):
        if not arrays.chain.prismatic[j]:
            before += abs(q1[j] - q0[j])
    turn = before
    total, total_axis, paired, mixed = 0.0, 0.0, 0.0, 0.0
    for j in range(n - 1, -1, -1):
        d = abs(q1[j] - q0[j])
        if arrays.chain.prismatic[j]:
            total += 2.0 * d * before
            behind += d
            continue
        before -= d
        r, s = 0.0, 0.0
        for slot in range(2):
            zx, zy, zz = work.axes[slot, j, 0], work.axes[slot, j, 1], work.axes[slot, j, 2]
            x = work.point[slot, 0] - work.origins[slot, j, 0]
            y = work.point[slot, 1] - work.origins[slot, j, 1]
            z = work.point[slot, 2] - work.origins[slot, j, 2]
            r = max(r, (zy * z - zz * y) ** 2 + (zz * x - zx * z) ** 2 + (zx * y - zy * x) ** 2)
            x, y, z = work.axis[slot, 0], work.axis[slot, 1], work.axis[slot, 2]
            s = max(s, (zy * z - zz * y) ** 2 + (zz * x - zx * z) ** 2 + (zx * y - zy * x) ** 2)
        r = np.sqrt(r) + 0.5 * behind
        s = min(np.sqrt(s) + 0.5 * behind_axis, 1.0)
        total += r * d * (d + 2.0 * before)
        total_axis += s * d * (d + 2.0 * before)
        paired += s * d * before
        mixed += d * before
        behind += r * d
        behind_axis += s * d
    work.roll_terms[0], work.roll_terms[1] = turn, behind_axis
    work.roll_terms[2], work.roll_terms[3] = paired, mixed
    return total, total_axis


@kernel
def peak(a, b, most):
    """Largest value of (1 - s) a + s b + s (1 - s) most / 2 over s in [0, 1]."""
    slope = abs(b - a)
    if 2.0 * slope >= most:
        return max(a, b)
    return 0.5 * (a + b) + most / 8.0 + slope * slope / (2.0 * most)


@kernel
def roll_derivatives(work, chord, longer):
    """Bounds on |psi'| and |psi''| on a segment, rad; after `second_derivatives`.

    Args:
        work: as everywhere.
        chord: the peak of |a - b|.
        longer: how much further the frame may run, see `segment_holds`.
    """
    turn, axis = work.roll_terms[0], work.roll_terms[1]
    paired, mixed = work.roll_terms[2], work.roll_terms[3]
    approach, frame = longer * work.derivative_bound[5], longer * work.derivative_bound[6]
    second = longer * longer * work.derivative_bound[7]
    along = 2.0 - 0.5 * chord * chord  # 1 + c
    cosine = np.sqrt(0.5 * along)
    rate = (turn + frame) / cosine
    most = (2.0 * paired + mixed * chord) / along + (second + frame * turn) / cosine
    return rate, most + rate * (axis + approach) * 0.5 * chord / cosine


@kernel
def roll_bound(arrays, work, chord, longer, lateral):
    """How far off the middle of its range roll may be on a segment, at most, rad.

    Args:
        arrays, work, chord, longer: as in `segment_holds` and `roll_derivatives`.
        lateral: m, second derivative of the tool point off its target.
    """
    rate, most = roll_derivatives(work, chord, longer)
    if lateral > 0.0:
        most += work.derivative_bound[8] * lateral
    before, after = work.error[HERE, 2], work.error[NEXT, 2]
    if not rate < TURN - abs(after - before):
        return np.inf
    lost, left = roll_lost(arrays, work, HERE), roll_lost(arrays, work, NEXT)
    return max(peak(before + lost, after + left, most), peak(lost - before, left - after, most))


@kernel
def segment_holds(arrays, work, q0, q1):
    """Do the constraints hold everywhere on the straight segment from q0 (slot 0) to q1 (slot 1)?

    Slot 0 holds the errors against the target at the start of the segment, slot 1 at its end.

    Returns the position bound over the allowance of the tolerance, and the larger one of the cone's
    bound and the roll's, each over its allowance: both must be at most 1. NaN compares false, so it
    never certifies. The second is inf where roll does not hold, or the arm is not certified clear.
    Where the position holds, `work.stop_reason` receives which one does not.
    """
    total, total_axis = second_derivatives(arrays, work, q0, q1)
    # The replay matches the ends to the curve's closest points, up to twice the errors from those
    # aimed at; where the target starts from rest, s grows with the root of that distance.
    longer = 1.0
    for slot in range(2):
        error = work.error[slot, 0]
        speed = max(work.derivative_bound[3 + slot], np.sqrt(error * work.derivative_bound[0]))
        if speed > 0.0:
            longer += 2.0 * error / speed
    target = longer * longer * work.derivative_bound[0]
    approach = longer * longer * work.derivative_bound[1]
    position = peak(work.error[0, 0], work.error[1, 0], total + target)
    normal = work.derivative_bound[2] * (total + target)
    cone = peak(
        cone_used(arrays, work, HERE), cone_used(arrays, work, NEXT), total_axis + approach + normal
    )
    position, turned = position / work.allowance[0], cone / work.allowance[1]
    if not (position <= 1.0 and turned <= 1.0):
        if position <= 1.0:
            work.stop_reason[0] = CONE
        return position, turned
    if arrays.roll[1] < np.inf:
        roll = roll_bound(arrays, work, cone, longer, total + target) / work.allowance[2]
        if not roll <= 1.0:
            work.stop_reason[0] = ROLL
            return position, np.inf
        turned = max(turned, roll)
    if arrays.collisions.shape[0] > 0 and not segment_clear(arrays.collisions, q0, q1) > 0.0:
        work.stop_reason[0], work.stop_reason[1] = COLLISION, blamed(arrays.collisions)
        return position, np.inf
    return position, turned
