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
"""

from __future__ import annotations

import numpy as np

from feasibility.collisions import segment_clear
from feasibility.compiled import kernel
from feasibility.roadmap.arrays import HERE, NEXT, cone_used

COLLIDES = np.inf  # in place of the cone bound


@kernel
def spread(arrays, work, q0, q1):  # type: ignore[no-untyped-def]
    """D and Da of the module's bound for the segment from q0 (slot 0) to q1 (slot 1)."""
    n = q0.shape[0]
    behind = 0.0  # how far the tool point moves by the joints behind j
    behind_axis = 0.0
    before = 0.0  # total turn of the revolute joints before j
    for j in range(n):
        if not arrays.chain.prismatic[j]:
            before += abs(q1[j] - q0[j])
    total, total_axis = 0.0, 0.0
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
        behind += r * d
        behind_axis += s * d
    return total, total_axis


@kernel
def peak(a, b, most):  # type: ignore[no-untyped-def]
    """Largest value of (1 - s) a + s b + s (1 - s) most / 2 over s in [0, 1]."""
    slope = abs(b - a)
    if 2.0 * slope >= most:
        return max(a, b)
    return 0.5 * (a + b) + most / 8.0 + slope * slope / (2.0 * most)


@kernel
def segment_holds(arrays, work, q0, q1):  # type: ignore[no-untyped-def]
    """Do point and cone hold everywhere on the straight segment from q0 (slot 0) to q1 (slot 1)?

    Slot 0 holds the errors against the target at the start of the segment, slot 1 at its end.

    Returns the position bound over the allowance of the tolerance, and the cone bound over that of
    the cone chord: both must be at most 1. NaN compares false, so it never certifies. Where both
    hold, but the arm is not certified clear, the second is COLLIDES.
    """
    total, total_axis = spread(arrays, work, q0, q1)
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
    position, cone = position / work.allowance[0], cone / work.allowance[1]
    asked = arrays.collisions.shape[0] > 0 and position <= 1.0 and cone <= 1.0
    if asked and not segment_clear(arrays.collisions, q0, q1) > 0.0:
        cone = COLLIDES
    return position, cone
