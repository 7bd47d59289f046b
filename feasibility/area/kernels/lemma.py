"""Does one tile hold: a continuous map of configurations over it, from one over its middle?

Let q be a configuration, p the tool point, J its (3, n) Jacobian, and G any right inverse: J G = I.
With d_j the length of row j of G, the joints of q + G v differ from q by at most d_j |v|. There
F(v) = p(q + G v) has F(0) = p(q), F'(0) = I and, by the bound of `motions.segment_bound` for steps
in the proportions d,

    |F''| <= M = sum_j r_j d_j (d_j + 2 sum_{i<j, revolute} d_i)  (prismatic j: 2 d_j sum d_i)

on |v| <= R, with r_j the lever arms on that box: r_j(q) + sum_{k>j} r_k d_k R. (F'' is symmetric,
so its norm is that of its values at equal arguments.) Let |T(x) - p(q)| <= rho over the tile. If
2 M rho < 1 and R >= y, Newton and Kantorovich's theorem, started at v = 0, gives for each x a v in
|v| <= y with F(v) = T(x), where

    y = (1 - sqrt(1 - 2 M rho)) / M <= 2 rho.

On that ball |F' - I| <= M y < 1, so F is one to one there and its inverse is continuous: v depends
continuously on T(x), and T on x. So x -> q + G v(T(x)) is a continuous map over the tile, through
configurations with |q'_j - q_j| <= d_j y. They are inside their limits if q_j -+ d_j y are. Free
joints need no care: joint values are real numbers, which are never wrapped.

**Cone.** Over the tile T and b are within r_T and r_b of points (T_i, b_i) mixed in the same
shares, its corners'. With A the Jacobian of the tool axis a, and M_a as M with the sines
s_j <= 1 between joint axes and tool axis in place of r_j,

    a(q + G v) = a + A G v + e,  |e| <= M_a y^2 / 2,      v = T - p - e',  |e'| <= M y^2 / 2

    |a - b| <= max_i |a + A G (T_i - p) - b_i| + |A G| (r_T + M y^2 / 2) + M_a y^2 / 2 + r_b

so much of the turn of a and that of b cancel. The cone holds where that is <= 2 sin(alpha / 2).

**Which G.** That of least squares, G = W J^T (J W J^T)^-1, joints weighing by the room that limits
leave them: one at its limit stays where it is. Or, by two more rows, the one that turns the tool
axis as the approach direction turns over the tile.
"""

from __future__ import annotations

import numpy as np

from feasibility.compiled import kernel
from feasibility.roadmap.motions import HERE, cholesky_solve, linearise

HOLDS, BENT, PAST_LIMIT, PAST_CONE = 0, 1, 2, 3
ROOM = 0.3  # rad or m: joints nearer than this to a limit weigh less
ROUNDING = 1.0 + 1e-9
SINGULAR = 1e-8  # [1] of the largest: the least square of a pivot
POINT, WITH_AXIS = np.int64(3), np.int64(5)  # rows of the inverse


@kernel
def across(work, tile):  # type: ignore[no-untyped-def]
    """Set rows 3 and 4 of `tile.rows` and `tile.wanted`: how the axis tilts with the joints, and b
    along the tile, where it changes by N dT, with N of least squares for the tile's two sides.
    """
    ax, ay, az = work.axis[HERE, 0], work.axis[HERE, 1], work.axis[HERE, 2]
    tx, ty, tz = 0.0, az, -ay
    if abs(ax) > 0.6:
        tx, ty, tz = -az, 0.0, ax
    length = np.sqrt(tx * tx + ty * ty + tz * tz)
    tx, ty, tz = tx / length, ty / length, tz / length
    sx, sy, sz = ay * tz - az * ty, az * tx - ax * tz, ax * ty - ay * tx
    for j in range(work.step.shape[0]):
        x, y, z = work.axis_rows[0, j], work.axis_rows[1, j], work.axis_rows[2, j]
        tile.rows[3, j] = tx * x + ty * y + tz * z
        tile.rows[4, j] = sx * x + sy * y + sz * z
    ee, ef, ff = 0.0, 0.0, 0.0
    for k in range(3):
        e = tile.corners[1, 0, k] - tile.corners[0, 0, k]
        f = tile.corners[3, 0, k] - tile.corners[0, 0, k]
        ee += e * e
        ef += e * f
        ff += f * f
    determinant = ee * ff - ef * ef
    flat = determinant > 1e-9 * ee * ff
    gt, gs, ht, hs = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        t, s = (tx, ty, tz)[k], (sx, sy, sz)[k]
        gt += t * (tile.corners[1, 1, k] - tile.corners[0, 1, k])
        gs += s * (tile.corners[1, 1, k] - tile.corners[0, 1, k])
        ht += t * (tile.corners[3, 1, k] - tile.corners[0, 1, k])
        hs += s * (tile.corners[3, 1, k] - tile.corners[0, 1, k])
    for k in range(3):
        e = tile.corners[1, 0, k] - tile.corners[0, 0, k]
        f = tile.corners[3, 0, k] - tile.corners[0, 0, k]
        # The rows of [e f]^+, which give the shares of a change along both sides.
        u = (ff * e - ef * f) / determinant if flat else 0.0
        w = (ee * f - ef * e) / determinant if flat else 0.0
        tile.wanted[3, k] = gt * u + ht * w
        tile.wanted[4, k] = gs * u + hs * w


@kernel
def gain_of(work, tile, m):  # type: ignore[no-untyped-def]
    """Set G by the first m rows; False where they are nearly dependent."""
    n = work.step.shape[0]
    for column in range(3):
        largest = 0.0
        for i in range(m):
            tile.right[i] = tile.wanted[i, column]
            for k in range(i + 1):
                total = 0.0
                for j in range(n):
                    total += tile.weights[j] * tile.rows[i, j] * tile.rows[k, j]
                tile.square[i, k] = total
            largest = max(largest, tile.square[i, i])
        if not cholesky_solve(tile.square, tile.right, m):
            return False
        for i in range(m):
            if not tile.square[i, i] ** 2 > SINGULAR * largest:
                return False
        for j in range(n):
            total = 0.0
            for i in range(m):
                total += tile.rows[i, j] * tile.right[i]
            tile.gain[j, column] = tile.weights[j] * total
    for j in range(n):
        total = 0.0
        for k in range(3):
            total += tile.gain[j, k] ** 2
        tile.rate[j] = ROUNDING * np.sqrt(total)
    return True


@kernel
def most_bent(arrays, tile, rows, radius, cap):  # type: ignore[no-untyped-def]
    """M on |v| <= radius, of `rows` (3, n): of the tool point, or of its axis with the cap 1."""
    before, behind, most = 0.0, 0.0, 0.0
    for j in range(tile.rate.shape[0]):
        if not arrays.chain.prismatic[j]:
            before += tile.rate[j]
    for j in range(tile.rate.shape[0] - 1, -1, -1):
        d = tile.rate[j]
        if arrays.chain.prismatic[j]:
            if cap > 1.0:
                most += 2.0 * d * before
                behind += d * radius
            continue
        before -= d
        lever = 0.0
        for k in range(3):
            lever += rows[k, j] ** 2
        lever = min(np.sqrt(lever) + behind, cap)
        most += lever * d * (d + 2.0 * before)
        behind += lever * d * radius
    return most


@kernel
def solution_radius(arrays, work, tile, rho):  # type: ignore[no-untyped-def]
    """y and M of the module's text; y is -1 where nothing is known."""
    radius, most = 2.0 * rho, 0.0
    for _ in range(3):
        most = most_bent(arrays, tile, work.point_rows, radius, np.inf)
        left = 1.0 - 2.0 * most * rho
        if not left > 0.0:
            return -1.0, most
        radius = ROUNDING * 2.0 * rho / (1.0 + np.sqrt(left))
    return radius, most


@kernel
def tilt(arrays, work, tile, radius, most):  # type: ignore[no-untyped-def]
    """The largest |a - b| over the tile."""
    n = tile.rate.shape[0]
    size = 0.0
    for i in range(3):
        for k in range(3):
            total = 0.0
            for j in range(n):
                total += work.axis_rows[i, j] * tile.gain[j, k]
            tile.turn[i, k] = total
            size += total * total
    furthest = 0.0
    for c in range(tile.corners.shape[0]):
        square = 0.0
        for i in range(3):
            off = work.axis[HERE, i] - tile.corners[c, 1, i]
            for k in range(3):
                off += tile.turn[i, k] * (tile.corners[c, 0, k] - work.point[HERE, k])
            square += off * off
        furthest = max(furthest, square)
    half = 0.5 * radius * radius
    bent = most_bent(arrays, tile, work.axis_rows, radius, 1.0)
    lost = np.sqrt(size) * (tile.radii[0] + most * half) + bent * half + tile.radii[1]
    return np.sqrt(furthest) + ROUNDING * lost


@kernel
def holds_with(arrays, work, tile, q, rho, m):  # type: ignore[no-untyped-def]
    """`tile_holds` with G by the first m rows."""
    if not gain_of(work, tile, m):
        return BENT
    radius, most = solution_radius(arrays, work, tile, rho)
    if not radius >= 0.0:
        return BENT
    for j in range(q.shape[0]):
        away = tile.rate[j] * radius
        if not (q[j] - away >= arrays.lower[j] and q[j] + away <= arrays.upper[j]):
            return PAST_LIMIT
    if not arrays.cone_chord < np.inf:
        return HOLDS
    inside = tilt(arrays, work, tile, radius, most) <= arrays.cone_chord
    return HOLDS if inside else PAST_CONE


@kernel
def tile_holds(arrays, work, tile, q):  # type: ignore[no-untyped-def]
    """Does the tile hold from q (n,), whose placement is in slot 0?

    `tile.corners` and `tile.radii` say which; `tile.gain` receives G. Returns HOLDS, or why not.
    """
    rho = 0.0
    for c in range(tile.corners.shape[0]):
        square = 0.0
        for k in range(3):
            square += (tile.corners[c, 0, k] - work.point[HERE, k]) ** 2
        rho = max(rho, square)
    rho = ROUNDING * np.sqrt(rho) + tile.radii[0]
    if not rho < np.inf:
        return BENT
    linearise(arrays, work, HERE)
    for j in range(q.shape[0]):
        share = min(q[j] - arrays.lower[j], arrays.upper[j] - q[j]) / ROOM
        share = min(max(share, 0.0), 1.0)
        tile.weights[j] = share * share
        for i in range(3):
            tile.rows[i, j] = work.point_rows[i, j]
    code = holds_with(arrays, work, tile, q, rho, POINT)
    if code == PAST_CONE:
        across(work, tile)
        code = holds_with(arrays, work, tile, q, rho, WITH_AXIS)
    return code
