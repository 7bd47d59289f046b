"""Roll: how far the tool is turned about its approach direction.

With a the tool's axis and x its reference axis, y = a x x; b the approach direction, t the
direction across it that roll is measured from, s = b x t; theta the angle between a and b: carry x
by the least rotation that takes a to b (swing), and measure its angle psi from t about b (twist).
In closed form, with c = a . b,

    C = t.x + s.y = (1 + c) cos psi        N = s.x - t.y = (1 + c) sin psi

which is singular only where a = -b. With om and Om the angular velocities of tool and frame

    psi' = (om - Om) . k,    k = (a + b) / (1 + c),    |k| = 1 / cos(theta / 2)

so that the derivative by a revolute joint is z_j . k, and 0 by a prismatic one.
"""

import numpy as np

from coverable.kernels import kernel

TURN = 2.0 * np.pi


@kernel
def roll_off_middle(target, axis, reference, middle):
    """psi less the middle of its range, wrapped to -pi .. pi.

    Args:
        target: (3, 3) its rows 1 and 2 are b and t, at right angles; t is a unit vector.
        axis, reference: (3,) a and x.
        middle: rad.
    """
    ax, ay, az = axis[0], axis[1], axis[2]
    xx, xy, xz = reference[0], reference[1], reference[2]
    bx, by, bz = target[1, 0], target[1, 1], target[1, 2]
    tx, ty, tz = target[2, 0], target[2, 1], target[2, 2]
    yx, yy, yz = ay * xz - az * xy, az * xx - ax * xz, ax * xy - ay * xx
    sx, sy, sz = by * tz - bz * ty, bz * tx - bx * tz, bx * ty - by * tx
    length = np.sqrt(sx * sx + sy * sy + sz * sz)
    cosine = tx * xx + ty * xy + tz * xz + (sx * yx + sy * yy + sz * yz) / length
    sine = (sx * xx + sy * xy + sz * xz) / length - (tx * yx + ty * yy + tz * yz)
    off = np.arctan2(sine, cosine) - middle
    return off - TURN * np.floor(off / TURN + 0.5)


@kernel
def roll_gradient(target, axis, axes, prismatic, out):
    """The derivative of roll by each joint, into `out` (n,).

    `target` and `axis` are those of `roll_off_middle`, `axes` (n, 3) those of the joints.
    """
    bx, by, bz = target[1, 0], target[1, 1], target[1, 2]
    along = 1.0 / (1.0 + axis[0] * bx + axis[1] * by + axis[2] * bz)
    kx, ky, kz = along * (axis[0] + bx), along * (axis[1] + by), along * (axis[2] + bz)
    for j in range(out.shape[0]):
        out[j] = 0.0
        if not prismatic[j]:
            out[j] = kx * axes[j, 0] + ky * axes[j, 1] + kz * axes[j, 2]


@kernel
def level(target):
    """Turn row 2 of a target (3, 3) into a unit vector at right angles to row 1."""
    b, t = target[1], target[2]
    along = (b[0] * t[0] + b[1] * t[1] + b[2] * t[2]) / (b[0] ** 2 + b[1] ** 2 + b[2] ** 2)
    square = 0.0
    for k in range(3):
        t[k] -= along * b[k]
        square += t[k] * t[k]
    length = np.sqrt(square)
    for k in range(3):
        t[k] /= length


@kernel
def frame_rates(change, second, slope, curl, off, lateral):
    """How fast a frame turns, at most, whose b and t are nearly unit vectors at right angles.

    With b^ = b / |b|, P = 1 - b^ b^T, and t^ = P t / |P t|: the frame t^, b^ x t^, b^ turns with
    Om = b^ x b^' + g b^, where |P t| g = t'.s - (t.b^)(b^'.s). Each factor is bounded below, with
    m <= |b|, h <= |P t| and e >= |t.b^|.

    Args:
        change: |b(1) - b(0)|.
        second: largest |b''|.
        slope, curl: largest |t'| and |t''|.
        off, lateral: how far b and t are from such unit vectors, at most.

    Returns:
        (|b^'|, |Om|, |Om'|): bounds, inf where b or t may vanish.
    """
    m, e = 1.0 - off, off + lateral + off * lateral
    square = (1.0 - lateral) ** 2 - (e / m) ** 2
    if not (m > 0.0 and lateral < 1.0 and square > 0.0):
        return np.inf, np.inf, np.inf
    h, e = np.sqrt(square), e / m
    speed = (change + 0.5 * second) / m  # |b'| is within |b''| / 2 of its mean
    second = second / m + 2.0 * speed * speed
    turn = (slope + e * speed) / h
    rate = np.sqrt(speed * speed + turn * turn)
    about = (
        curl
        + slope * rate
        + (slope + (1.0 + lateral) * speed) * speed
        + e * (second + speed * rate)
        + (slope + e * speed) * turn
    ) / h
    return speed, rate, np.sqrt((second + turn * speed) ** 2 + about * about)
