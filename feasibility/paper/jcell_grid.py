"""J-cells: the grid in joint space that the paper searches, and what makes one of them feasible.

A J-cell is a point of a grid in joint space, written as whole numbers: q = q_start + offset * step.
So two J-cells are equal or they are not, and a set of J-cells is exact.
"""

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from coverable.kernels import entry, kernel
from robots.chain import frames
from surfaces.patches.closed_form_kernels import cell_at, closest_on_patch, u_direction
from surfaces.triangle_kernel import cell_under, u_direction_under

ROUNDING = (
    1e-12  # [m], [1]: required beyond the task, so that another rounding of the same q agrees
)


class Grid(NamedTuple):
    """The J-cells of one arm around one start configuration, and what makes them feasible."""

    origin: Array
    """(n,) q_start, rad or m."""
    step: Array
    """(n,) delta q, rad or m."""
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
    tolerance: Array
    """(N + 1,) m, allowed distance of a J-cell from the offset surface, over each cell and over the
    border of several."""
    cone_cosine: Array
    """(N + 1,) likewise the least cosine between approach axis and approach direction, -2 when any
    angle will do."""
    approach: Array
    """(3,) the approach direction where it is one for all of the surface; (0,) for its normals."""
    roll: Array
    """(2,) rad, middle and half width of the range of the roll; half is inf where it is free."""
    reference: Array
    """(3,) the direction that it is measured from; (0,) for the u direction."""


@entry
def place_tool(chain, grid, offsets, q, placed):
    """Place the J-cell `offsets` (n,) by forward kinematics.

    Args:
        chain, grid: a `Chain` and a `Grid`.
        offsets: (n,) the J-cell.
        q: (n,) out, rad or m.
        placed: (2 n + 3, 3) out; in its last rows tool point (m), axis and reference axis.
    """
    n = q.shape[0]
    for i in range(n):
        q[i] = grid.origin[i] + offsets[i] * grid.step[i]
    frames(
        chain, q, placed[:n], placed[n : 2 * n], placed[2 * n], placed[2 * n + 1], placed[2 * n + 2]
    )


@entry
def cell_of(patch_kernel, triangles, grid, tool):
    """E-cell of a tool (3, 3) that satisfies the task constraints; -1 where it does not.

    The paper's eqs. (5) to (7), with a tolerance, and with the angle of its prose: a.b >= cos. N
    for what is feasible on the border of several cells.

    Args:
        patch_kernel: a `PatchKernel`, or None.
        triangles: a `TriangleKernel` where there is no patch kernel; else None. What is None is
            left out by numba.
        grid: the `Grid`.
        tool: (3, 3) tool point (m), axis and reference axis.
    """
    limited, along_u = grid.roll[1] < np.inf, grid.reference.shape[0] == 0
    tx, ty, tz = 0.0, 0.0, 0.0
    if triangles is not None:
        cell, over, nx, ny, nz = cell_under(triangles, tool[0, 0], tool[0, 1], tool[0, 2])
        if limited and along_u:
            tx, ty, tz = u_direction_under(triangles)
    if patch_kernel is not None:
        u, v, over, nx, ny, nz = closest_on_patch(patch_kernel, tool[0, 0], tool[0, 1], tool[0, 2])
        cell = cell_at(patch_kernel, u, v)
        if limited and along_u:
            tx, ty, tz = u_direction(patch_kernel, u, v)
    if cell < 0 or not abs(over - grid.height) <= grid.tolerance[cell] - ROUNDING:
        return -1
    bx, by, bz = -grid.side * nx, -grid.side * ny, -grid.side * nz
    if grid.approach.shape[0] == 3:
        bx, by, bz = grid.approach[0], grid.approach[1], grid.approach[2]
    if not tool[1, 0] * bx + tool[1, 1] * by + tool[1, 2] * bz >= grid.cone_cosine[cell] + ROUNDING:
        return -1
    if limited:
        if not along_u:
            tx, ty, tz = grid.reference[0], grid.reference[1], grid.reference[2]
        off = _roll(tool, bx, by, bz, tx, ty, tz) - grid.roll[0]
        if not abs(np.arctan2(np.sin(off), np.cos(off))) <= grid.roll[1] - ROUNDING:
            return -1
    return cell


@kernel
def _roll(tool, bx, by, bz, tx, ty, tz):
    """Roll of a tool (3, 3) about b from t, rad, see `feasibility.roll`; NaN where it has none."""
    along = tx * bx + ty * by + tz * bz
    tx, ty, tz = tx - along * bx, ty - along * by, tz - along * bz
    ux, uy, uz = by * tz - bz * ty, bz * tx - bx * tz, bx * ty - by * tx
    a0, a1, a2 = tool[1, 0], tool[1, 1], tool[1, 2]
    x0, x1, x2 = tool[2, 0], tool[2, 1], tool[2, 2]
    y0, y1, y2 = a1 * x2 - a2 * x1, a2 * x0 - a0 * x2, a0 * x1 - a1 * x0
    # Both times the length of t, which changes no angle.
    cosine = tx * x0 + ty * x1 + tz * x2 + ux * y0 + uy * y1 + uz * y2
    sine = ux * x0 + uy * x1 + uz * x2 - tx * y0 - ty * y1 - tz * y2
    return np.arctan2(sine, cosine) if cosine != 0.0 or sine != 0.0 else np.nan


@kernel
def distance(tool, target):
    """|p - p_T|, m."""
    dx, dy, dz = tool[0, 0] - target[0], tool[0, 1] - target[1], tool[0, 2] - target[2]
    return np.sqrt(dx * dx + dy * dy + dz * dz)


@kernel
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
