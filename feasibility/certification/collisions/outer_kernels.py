"""What the judge asks of all bodies on all segments: how they move, and by what they stay apart.

They are seen as balls and boxes here.

A point on joint b, seen from joint a, is moved by the joints a + 1 .. b. With T_j the sum of the
|d_i| of revolute joints i <= j, the sum in the bound of `relative_motion` is

    sum_j r_j |d_j| (|d_j| + 2 T_(j-1)) - 2 T_a sum_j r_j |d_j|,    j = a + 1 .. b,

so that running sums from the tip on give it for all a. Compiled, because these are some thousand
small numbers for each body; the search has nothing of it.
"""

from __future__ import annotations

import numpy as np

from coverable_kernels import entry, kernel

FAR = 0.05  # [m] between balls, from which on boxes are not looked at


@kernel
def carried_point(rotations, points, k, joint, centres, body):  # type: ignore[no-untyped-def]
    """Where the centre of a body's ball is in the root frame, at row k."""
    x, y, z = centres[body, 0], centres[body, 1], centres[body, 2]
    turn, at = rotations[k, joint], points[k, joint]
    return (
        turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z + at[0],
        turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z + at[1],
        turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z + at[2],
    )


@kernel
def seen_from(rotations, points, k, joint, x, y, z):  # type: ignore[no-untyped-def]
    """A point of the root frame as seen from a joint, at row k."""
    turn, at = rotations[k, joint], points[k, joint]
    x, y, z = x - at[0], y - at[1], z - at[2]
    return (
        turn[0, 0] * x + turn[1, 0] * y + turn[2, 0] * z,
        turn[0, 1] * x + turn[1, 1] * y + turn[2, 1] * z,
        turn[0, 2] * x + turn[1, 2] * y + turn[2, 2] * z,
    )


@kernel
def lever(twist, x, y, z):  # type: ignore[no-untyped-def]
    """How fast a joint moves a point of its own frame, whose unit twist there is given.

    The linear part comes first: linear + angular x point, m for each rad, or 1 for a slide.
    """
    u = twist[0] + twist[4] * z - twist[5] * y
    v = twist[1] + twist[5] * x - twist[3] * z
    w = twist[2] + twist[3] * y - twist[4] * x
    return np.sqrt(u * u + v * v + w * w)


@entry
def chord_bounds(  # type: ignore[no-untyped-def]
    rotations, points, twists, prismatic, steps, turned, deviations,
    joints, centres, balls, levers, delta, moved, deviation,
):  # fmt: skip
    """How far points of bodies may be from their chords, and move, seen from every joint.

    Args:
        rotations: (m, n + 1, 3, 3) of the joints, the root first, and so on.
        points: (m, n + 1, 3) m.
        twists: (n, 6) each joint's in its own frame, see `lever`.
        prismatic: (n,) which joints slide.
        steps: (m - 1, n) |d_j|.
        turned: (m - 1, n) T_(j-1).
        deviations: (m - 1, n) e_j.
        joints: (B,) which joint carries each body, 0 for the root.
        centres: (B, 3) m, of their balls.
        balls: (B,) m, radii.
        levers: (B, n) m, for use in here.
        delta: (n + 1, m - 1, B) m, set where the body moves: how far a point may leave its chord.
        moved: the same, how far it may move.
        deviation: the same, how far deviating from straight joint motion may move it besides.
    """
    for k in range(rotations.shape[0]):
        for b in range(joints.shape[0]):
            x, y, z = carried_point(rotations, points, k, joints[b], centres, b)
            second, first, rate, off = 0.0, 0.0, 0.0, 0.0
            for j in range(joints[b] - 1, -1, -1):
                u, v, w = seen_from(rotations, points, k, j + 1, x, y, z)
                before, now = levers[b, j], lever(twists[j], u, v, w) + balls[b]
                levers[b, j] = now
                if k == 0:
                    continue
                d, ahead = steps[k - 1, j], turned[k - 1, j]
                if prismatic[j]:
                    second += 2.0 * d * ahead
                    first += d
                    rate += d
                    off += deviations[k - 1, j]
                else:
                    mean = 0.5 * (before + now + rate)
                    second += mean * d * (d + 2.0 * ahead)
                    first += mean * d
                    rate += mean * d
                    off += (mean + off) * deviations[k - 1, j]
                delta[j, k - 1, b] = max(second - 2.0 * ahead * first, 0.0) / 8.0
                moved[j, k - 1, b], deviation[j, k - 1, b] = rate, off


@kernel
def reach(rotations, k, joint, body, halves, x, y, z):  # type: ignore[no-untyped-def]
    """How far a body's box reaches from its centre along a direction of the root frame."""
    turn = rotations[k, joint]
    u = turn[0, 0] * x + turn[1, 0] * y + turn[2, 0] * z
    v = turn[0, 1] * x + turn[1, 1] * y + turn[2, 1] * z
    w = turn[0, 2] * x + turn[1, 2] * y + turn[2, 2] * z
    return abs(u) * halves[body, 0] + abs(v) * halves[body, 1] + abs(w) * halves[body, 2]


@kernel
def box_gap(rotations, k, joints, a, b, halves, n, apart):  # type: ignore[no-untyped-def]
    """How far a plane across n parts the boxes of two bodies at row k; inputs seen from the first.

    `apart` is from the centre of the first to that of the second.
    """
    turn = rotations[k, joints[a]]
    x = turn[0, 0] * n[0] + turn[0, 1] * n[1] + turn[0, 2] * n[2]
    y = turn[1, 0] * n[0] + turn[1, 1] * n[1] + turn[1, 2] * n[2]
    z = turn[2, 0] * n[0] + turn[2, 1] * n[1] + turn[2, 2] * n[2]
    own = abs(n[0]) * halves[a, 0] + abs(n[1]) * halves[a, 1] + abs(n[2]) * halves[a, 2]
    away = n[0] * apart[0] + n[1] * apart[1] + n[2] * apart[2]
    return away - own - reach(rotations, k, joints[b], b, halves, x, y, z)


@kernel
def box_bound(rotations, k, joints, a, b, halves, before, now):  # type: ignore[no-untyped-def]
    """How far boxes stay apart along chords up to row k, by two planes.

    One is across the line between the centres, the other along that side of the first box from
    which the second is furthest.
    """
    x, y, z = 0.5 * (before[0] + now[0]), 0.5 * (before[1] + now[1]), 0.5 * (before[2] + now[2])
    best, length = -np.inf, np.sqrt(x * x + y * y + z * z)
    u, v, w = abs(x) - halves[a, 0], abs(y) - halves[a, 1], abs(z) - halves[a, 2]
    side = (np.sign(x), 0.0, 0.0)
    if v > u and v >= w:
        side = (0.0, np.sign(y), 0.0)
    elif w > u:
        side = (0.0, 0.0, np.sign(z))
    for n in ((x / length, y / length, z / length), side):
        start = box_gap(rotations, k - 1, joints, a, b, halves, n, before)
        end = box_gap(rotations, k, joints, a, b, halves, n, now)
        if min(start, end) > best:  # not so where nothing is known of n
            best = min(start, end)
        if best >= FAR:
            break
    return best


@entry
def outer_bounds(  # type: ignore[no-untyped-def]
    rotations, points, joints, centres, balls, halves, couples, delta, deviation, low
):  # fmt: skip
    """How far couples stay apart by balls and boxes, whose centres keep to chords but for `delta`.

    Args:
        rotations: see `chord_bounds`, as are all but these:
        points: see there.
        joints: see there.
        centres: see there, of balls and boxes.
        balls: (B,) m, radii; infinite of what has no end.
        halves: (B, 3) m, half the sides of boxes along the axes of the joint; the same.
        couples: (c, 2) two bodies, the one nearer to the root first.
        delta: see there.
        deviation: see there.
        low: (c, m - 1) m, set: lower bounds along each segment.
    """
    for c in range(couples.shape[0]):
        a, b = couples[c]
        joint, radii, before = joints[a], balls[a] + balls[b], (0.0, 0.0, 0.0)
        for k in range(rotations.shape[0]):
            u, v, w = carried_point(rotations, points, k, joints[b], centres, b)
            u, v, w = seen_from(rotations, points, k, joint, u, v, w)
            now = (u - centres[a, 0], v - centres[a, 1], w - centres[a, 2])
            if k > 0:
                x, y, z = before
                r, s, t = now[0] - x, now[1] - y, now[2] - z
                square = r * r + s * s + t * t
                share = -(x * r + y * s + z * t) / square if square > 0.0 else 0.0
                share = min(max(share, 0.0), 1.0)
                x, y, z = x + share * r, y + share * s, z + share * t
                away = np.sqrt(x * x + y * y + z * z) - radii
                if away < FAR:
                    away = max(away, box_bound(rotations, k, joints, a, b, halves, before, now))
                low[c, k - 1] = away - delta[joint, k - 1, b] - deviation[joint, k - 1, b]
            before = now
