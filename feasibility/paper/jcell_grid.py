"""J-cells: the grid in joint space that the paper searches, and what makes one of them feasible.

A J-cell is a point of a grid in joint space, written as whole numbers: q = q_start + offset * step.
So two J-cells are equal or they are not, and a set of J-cells is exact.

A neighbour needs no forward kinematics of its own. When joint i moves by one step, the tool point p
turns about the axis (o_i, z_i) that the joint already has:

    p' = o_i + Rot(z_i, +-step) (p - o_i),    a' = Rot(z_i, +-step) a

(p' = p +- step z_i for a prismatic joint), with one sine and one cosine for one search. Several
joints at once are the same thing from the last joint inwards, and neighbours that move their last
joints alike share that part of the work.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from coverable.kernels import allocating, allocating_entry
from robots.chain import frames
from surfaces.patches.closed_form_kernels import cell_at, closest_on_patch, u_direction
from surfaces.triangle_kernel import cell_under, u_direction_under

HAIR = 1e-12  # [m], [1]: required beyond the task, so that another rounding of the same q agrees


class Grid(NamedTuple):
    """The J-cells of one arm around one start configuration, and what makes them feasible."""

    origin: Array
    """(n,) q_start, rad or m."""
    step: Array
    """(n,) delta q, rad or m."""
    sine: Array
    """(n,) sin(delta q)."""
    cosine: Array
    """(n,) cos(delta q)."""
    lowest: Ints
    """(n,) least offset inside the joint limits."""
    highest: Ints
    """(n,) greatest offset inside the joint limits."""
    moves_all: bool
    """True: any joints may move at once (3^n - 1 neighbours); False: one of them (2 n)."""
    side: float
    """-1.0 inside, +1.0 outside."""
    height: float
    """m, signed height of the tool point over the surface: side sign times standoff."""
    tolerance: float | Array
    """m, allowed distance of a J-cell from the offset surface; on triangles (N + 1,), over each
    cell and over the border of several."""
    cone_cosine: float | Array
    """Least cosine between approach axis and approach direction, -2 when any angle will do; on
    triangles likewise (N + 1,)."""
    approach: Array
    """(3,) the approach direction where it is one for all of the surface; (0,) for its normals."""
    roll: Array
    """(2,) rad, middle and half width of the range of the roll; half is inf where it is free."""
    reference: Array
    """(3,) the direction that it is measured from; (0,) for the u direction."""


@allocating
def place_joints(rotations, translations, prismatic, origin, step, offsets, placed, wanted, base):
    """Bring the frames of joints `placed` .. `wanted` up to date, each before its own motion.

    Args:
        rotations, translations, prismatic: of a `Chain`.
        origin, step: (n,) of a `Grid`.
        offsets: (n,) the J-cell.
        placed: number of joints, from the base on, whose frames are right already.
        wanted: the last joint that is needed.
        base: (n, 12) in and out; columns x, y, z of the joint frame, and its origin.
    """
    for i in range(placed, wanted + 1):
        if i == 0:
            for k in range(3):
                for column in range(3):
                    base[0, 3 * column + k] = rotations[0, k, column]
                base[0, 9 + k] = translations[0, k]
            continue
        value = origin[i - 1] + offsets[i - 1] * step[i - 1]
        c, s, slide = 1.0, 0.0, value
        if not prismatic[i - 1]:
            c, s, slide = np.cos(value), np.sin(value), 0.0
        r, t = rotations[i], translations[i]
        for k in range(3):
            x = c * base[i - 1, k] + s * base[i - 1, 3 + k]
            y = c * base[i - 1, 3 + k] - s * base[i - 1, k]
            z = base[i - 1, 6 + k]
            for column in range(3):
                base[i, 3 * column + k] = x * r[0, column] + y * r[1, column] + z * r[2, column]
            base[i, 9 + k] = base[i - 1, 9 + k] + z * slide + x * t[0] + y * t[1] + z * t[2]


@allocating
def _turn(x, y, z, vx, vy, vz, sine, cosine):
    """Rotate the vector v about the unit axis (x, y, z)."""
    along = (x * vx + y * vy + z * vz) * (1.0 - cosine)
    return (
        cosine * vx + sine * (y * vz - z * vy) + along * x,
        cosine * vy + sine * (z * vx - x * vz) + along * y,
        cosine * vz + sine * (x * vy - y * vx) + along * z,
    )


@allocating
def _facing(side, approach, nx, ny, nz, tool):
    """a.b over a place with the normal (nx, ny, nz)."""
    if approach.shape[0] == 3:
        return tool[3] * approach[0] + tool[4] * approach[1] + tool[5] * approach[2]
    return -side * (tool[3] * nx + tool[4] * ny + tool[5] * nz)


@allocating_entry
def cell_of(patch_kernel, triangles, side, height, tolerance, cosine, approach, tool):
    """E-cell of a tool point and axis (6,) that satisfy the task constraints; -1 where they do not.

    The paper's eqs. (5) and (7), with a tolerance, and with the angle of its prose: a.b >= cos. N
    for what is feasible on the border of several cells.

    Args:
        patch_kernel: a `PatchKernel`, or None.
        triangles: a `TriangleKernel` where there is no patch kernel; else None. What is None is
            left out by numba.
        side: -1.0 inside, 1.0 outside; of a `Grid`, as the next four.
        height: m, signed height of the tool point over the surface.
        tolerance: m.
        cosine: least cosine of the angle between axis and approach direction.
        approach: (3,) that direction, or (0,).
        tool: (6,) tool point and axis.
    """
    if triangles is not None:
        cell, over, nx, ny, nz = cell_under(triangles, tool[0], tool[1], tool[2])
        if cell < 0 or not abs(over - height) <= tolerance[cell] - HAIR:
            return -1
        facing = _facing(side, approach, nx, ny, nz, tool)
        return cell if facing >= cosine[cell] + HAIR else -1
    if patch_kernel is not None:
        u, v, over, nx, ny, nz = closest_on_patch(patch_kernel, tool[0], tool[1], tool[2])
        if not abs(over - height) <= tolerance - HAIR:
            return -1
        if not _facing(side, approach, nx, ny, nz, tool) >= cosine + HAIR:
            return -1
        return cell_at(patch_kernel, u, v)
    return -1


@allocating_entry
def place_tool(chain, grid, offsets, tool, reference):
    """Tool point and axis (6,) and reference axis (3,) of one J-cell, by forward kinematics."""
    n = offsets.shape[0]
    q = np.empty(n)
    for i in range(n):
        q[i] = grid.origin[i] + offsets[i] * grid.step[i]
    frames(chain, q, np.empty((n, 3)), np.empty((n, 3)), tool[:3], tool[3:], reference)


@allocating_entry
def rolls_within(chain, patch_kernel, triangles, grid, offsets, tool):
    """True where a J-cell with its tool (6,) has a roll in the task's range: eq. (6).

    See `feasibility.roll`. The arguments are those of `cell_of`, and a `Chain` and the `Grid`. It
    is checked last, so only J-cells that satisfy all else are placed once more for it.
    """
    x = np.empty(3)
    place_tool(chain, grid, offsets, np.empty(6), x)
    nx, ny, nz, tx, ty, tz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if triangles is not None:
        _, _, nx, ny, nz = cell_under(triangles, tool[0], tool[1], tool[2])
        tx, ty, tz = u_direction_under(triangles)
    if patch_kernel is not None:
        u, v, _, nx, ny, nz = closest_on_patch(patch_kernel, tool[0], tool[1], tool[2])
        tx, ty, tz = u_direction(patch_kernel, u, v)
    bx, by, bz = -grid.side * nx, -grid.side * ny, -grid.side * nz
    if grid.approach.shape[0] == 3:
        bx, by, bz = grid.approach[0], grid.approach[1], grid.approach[2]
    if grid.reference.shape[0] == 3:
        tx, ty, tz = grid.reference[0], grid.reference[1], grid.reference[2]
    along = tx * bx + ty * by + tz * bz
    tx, ty, tz = tx - along * bx, ty - along * by, tz - along * bz
    ux, uy, uz = by * tz - bz * ty, bz * tx - bx * tz, bx * ty - by * tx
    a0, a1, a2 = tool[3], tool[4], tool[5]
    y0, y1, y2 = a1 * x[2] - a2 * x[1], a2 * x[0] - a0 * x[2], a0 * x[1] - a1 * x[0]
    # Both times the length of t, which changes no angle.
    cosine = tx * x[0] + ty * x[1] + tz * x[2] + ux * y0 + uy * y1 + uz * y2
    sine = ux * x[0] + uy * x[1] + uz * x[2] - tx * y0 - ty * y1 - tz * y2
    if cosine == 0.0 and sine == 0.0:
        return False
    off = np.arctan2(sine, cosine) - grid.roll[0]
    return abs(np.arctan2(np.sin(off), np.cos(off))) <= grid.roll[1] - HAIR


@allocating
def distance(tool, target):
    """|p - p_T|, m."""
    dx, dy, dz = tool[0] - target[0], tool[1] - target[1], tool[2] - target[2]
    return np.sqrt(dx * dx + dy * dy + dz * dz)


@allocating
def neighbour(number, moves_all, delta):
    """Write neighbour `number` (0, 1, ...) as moves -1, 0, +1 of the joints; False past the last.

    Single moves: +joint 0, -joint 0, +joint 1, ... All moves count in base 3 with digits 0, +1, -1,
    joint 0 fastest; number 0 is the first that moves something.
    """
    n = delta.shape[0]
    for i in range(n):
        delta[i] = 0
    if not moves_all:
        if number >= 2 * n:
            return False
        delta[number >> 1] = 1 - 2 * (number & 1)
        return True
    rest = number + 1
    for i in range(n):
        digit = rest % 3
        rest //= 3
        delta[i] = digit if digit < 2 else -1
    return rest == 0


@allocating
def move_tool(prismatic, step, sine, cosine, base, delta, held, partial):
    """Tool of a neighbour, left in partial[0], given the tool of the J-cell in partial[n].

    Args:
        prismatic: (n,) of a `Chain`.
        step, sine, cosine: (n,) of a `Grid`.
        base: (n, 12) joint frames of the J-cell, right up to the last joint that moves.
        delta: (n,) moves -1, 0, +1.
        held: (n,) in and out; the moves for which partial[i] is right, 2 where there are none.
        partial: (n + 1, 6) in and out; partial[i] is the tool after joints i, i + 1, ... moved.
    """
    top = delta.shape[0] - 1
    while top >= 0 and delta[top] == held[top]:
        top -= 1
    for i in range(top, -1, -1):
        held[i] = delta[i]
        for k in range(6):
            partial[i, k] = partial[i + 1, k]
        if delta[i] == 0:
            continue
        x, y, z = base[i, 6], base[i, 7], base[i, 8]
        if prismatic[i]:
            for k in range(3):
                partial[i, k] += delta[i] * step[i] * base[i, 6 + k]
            continue
        s, c = delta[i] * sine[i], cosine[i]
        ox, oy, oz = base[i, 9], base[i, 10], base[i, 11]
        px, py, pz = _turn(
            x, y, z, partial[i + 1, 0] - ox, partial[i + 1, 1] - oy, partial[i + 1, 2] - oz, s, c
        )
        ax, ay, az = _turn(x, y, z, partial[i + 1, 3], partial[i + 1, 4], partial[i + 1, 5], s, c)
        partial[i, 0], partial[i, 1], partial[i, 2] = ox + px, oy + py, oz + pz
        partial[i, 3], partial[i, 4], partial[i, 5] = ax, ay, az
