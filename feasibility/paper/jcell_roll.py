"""Whether a J-cell has the roll that the task asks for: eq. (6) of the paper, with a range.

It is checked last, so only J-cells that satisfy all else need the frame of the tool.
"""

from __future__ import annotations

import numpy as np

from coverable_kernels import njit
from feasibility.paper.jcell_grid import HAIR, place_joints
from surfaces import cell_under, u_direction_under
from surfaces.patches import closest_on_patch, u_direction


@njit(cache=True, error_model="numpy")
def _reference_axis(chain, grid, offsets):  # type: ignore[no-untyped-def]
    """(3,) the reference axis of the TCP at one J-cell."""
    n = offsets.shape[0]
    base, axis = np.empty((n, 12)), np.empty(3)
    place_joints(
        chain.rotations, chain.translations, chain.prismatic, grid.origin, grid.step, offsets,
        0, n - 1, base,
    )  # fmt: skip
    value = grid.origin[n - 1] + offsets[n - 1] * grid.step[n - 1]
    if chain.prismatic[n - 1]:
        value = 0.0
    c, s, r = np.cos(value), np.sin(value), chain.reference
    for k in range(3):
        x, y = base[n - 1, k], base[n - 1, 3 + k]
        axis[k] = (c * x + s * y) * r[0] + (c * y - s * x) * r[1] + base[n - 1, 6 + k] * r[2]
    return axis


@njit(cache=True, error_model="numpy")
def rolls_within(chain, patch_kernel, triangles, grid, offsets, tool):  # type: ignore[no-untyped-def]
    """True where a J-cell with its tool (6,) has the roll that the task asks for: eq. (6).

    See `feasibility.roll`. The arguments are those of `cell_of`, and a `Chain` and the `Grid`.
    """
    x = _reference_axis(chain, grid, offsets)
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
