"""What the judge asks of all bodies on all segments: how their balls move, and stay apart.

A point on joint b, seen from joint a, is moved by the joints a + 1 .. b. With T_j the sum of the
|d_i| of revolute joints i <= j, the sum in the bound of `relative_motion` is

    sum_j r_j |d_j| (|d_j| + 2 T_(j-1)) - 2 T_a sum_j r_j |d_j|,    j = a + 1 .. b,

so that running sums from the tip on give it for all a. Compiled, because these are some thousand
small numbers for each body; the search has nothing of it.
"""

from __future__ import annotations

import numpy as np

from coverable_kernels import njit

kernel = njit(cache=True, error_model="numpy", _nrt=False)  # makes no arrays: nothing is counted


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


@kernel
def chord_bounds(  # type: ignore[no-untyped-def]
    rotations, points, twists, prismatic, steps, turned, strays,
    joints, centres, balls, levers, delta, moved, stray,
):  # fmt: skip
    """How far points of bodies may be from their chords, and move, seen from every joint.

    Args:
        rotations: (m, n + 1, 3, 3) of the joints, the root first, and so on.
        points: (m, n + 1, 3) m.
        twists: (n, 6) each joint's in its own frame, see `lever`.
        prismatic: (n,) which joints slide.
        steps: (m - 1, n) |d_j|.
        turned: (m - 1, n) T_(j-1).
        strays: (m - 1, n) e_j.
        joints: (B,) which joint carries each body, 0 for the root.
        centres: (B, 3) m, of their balls.
        balls: (B,) m, radii.
        levers: (B, n) m, for use in here.
        delta: (n + 1, m - 1, B) m, set where the body moves: how far a point may leave its chord.
        moved: the same, how far it may move.
        stray: the same, how far straying from straight joint motion may move it besides.
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
                    off += strays[k - 1, j]
                else:
                    mean = 0.5 * (before + now + rate)
                    second += mean * d * (d + 2.0 * ahead)
                    first += mean * d
                    rate += mean * d
                    off += (mean + off) * strays[k - 1, j]
                delta[j, k - 1, b] = max(second - 2.0 * ahead * first, 0.0) / 8.0
                moved[j, k - 1, b], stray[j, k - 1, b] = rate, off


@kernel
def ball_bounds(  # type: ignore[no-untyped-def]
    rotations, points, joints, centres, balls, couples, delta, stray, low
):  # fmt: skip
    """How far the balls of couples stay apart, whose centres move along chords but for `delta`.

    Args:
        rotations: see `chord_bounds`, as are all but these:
        points: see there.
        joints: see there.
        centres: see there.
        balls: (B,) m, radii; infinite of what has no end.
        couples: (c, 2) two bodies, the one nearer to the root first.
        delta: see there.
        stray: see there.
        low: (c, m - 1) m, set: lower bounds along each segment.
    """
    for c in range(couples.shape[0]):
        a, b = couples[c]
        joint, radii = joints[a], balls[a] + balls[b]
        x, y, z = 0.0, 0.0, 0.0
        for k in range(rotations.shape[0]):
            u, v, w = carried_point(rotations, points, k, joints[b], centres, b)
            u, v, w = seen_from(rotations, points, k, joint, u, v, w)
            u, v, w = u - centres[a, 0], v - centres[a, 1], w - centres[a, 2]
            if k > 0:
                r, s, t = u - x, v - y, w - z
                square = r * r + s * s + t * t
                share = -(x * r + y * s + z * t) / square if square > 0.0 else 0.0
                share = min(max(share, 0.0), 1.0)
                x, y, z = x + share * r, y + share * s, z + share * t
                away = np.sqrt(x * x + y * y + z * z)
                low[c, k - 1] = away - radii - delta[joint, k - 1, b] - stray[joint, k - 1, b]
            x, y, z = u, v, w
