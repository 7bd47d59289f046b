"""Motions made by other means: rasters over a surface through inverse kinematics.

Nothing of the search is used, nor its curves: targets lie on straight lines between cell centres
in a serpentine, put onto the surface by its closest points, and damped least squares with
Pinocchio follow them from one to the next.
"""

from __future__ import annotations

import itertools
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from feasibility import Task
from robots import Kinematics, Robot, load_robot
from surfaces import Cells, bspline, cylinder, mesh, piecewise, plane, sphere, torus
from surfaces.meshes import TriangleMesh

SPACING = 8e-4  # m between targets
MOST_STEP = 0.1  # rad, of one joint from row to row
DAMPING = 1e-3
STARTS = 60


class Raster(NamedTuple):
    robot: Robot
    cells: Cells
    task: Task
    q: NDArray[np.float64]


def sheet(count=25):
    """A bumpy mesh."""
    x, y = np.meshgrid(np.linspace(-0.12, 0.12, count), np.linspace(-0.1, 0.1, count))
    z = 0.02 * np.sin(12 * x) * np.cos(9 * y) - 0.8 * x**2
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    right, up = corner + 1, corner + count
    faces = np.concatenate(
        [np.column_stack([corner, right, right + count]), np.column_stack([corner, up + 1, up])]
    )
    place = np.array([0.45, 0.05, 0.25])
    points = np.stack([x, y, z], axis=-1).reshape(-1, 3) + place
    return mesh(TriangleMesh(points, faces))


def net():
    x, y = np.meshgrid(np.linspace(0, 0.25, 5), np.linspace(-0.1, 0.1, 4), indexing="ij")
    z = 0.03 * np.cos(9 * x) + 0.02 * np.sin(15 * y)
    return np.stack([x + 0.35, y, z + 0.25], axis=-1).tolist()


def sheets():
    """Two flat pieces that meet at a slight crease."""
    lower = plane((0.0, 0.2), (-0.1, 0.0))
    upper = plane((0.0, 0.2), (0.0, 0.1), rpy_deg=(4, 0, 0))
    return piecewise([lower, upper], side="outside", position=(0.4, 0.0, 0.25))


SURFACES = {
    "plane": lambda: plane(
        (0.35, 0.55), (-0.1, 0.1), side="outside", position=(0, 0, 0.3)
    ).cells(4, 5),
    "ball": lambda: sphere(
        0.12, (0, 60), (0, 360), side="outside", position=(0.45, 0, 0.25)
    ).cells(3, 6),
    "pipe": lambda: cylinder(
        0.1, (0, 150), (0.0, 0.2), side="outside", position=(0.45, -0.1, 0.3), rpy_deg=(-90, 0, 0)
    ).cells(5, 4),
    "ring": lambda: torus(
        0.2, 0.06, (0, 60), (20, 110), side="outside", position=(0.3, -0.1, 0.25)
    ).cells(4, 4),
    "spline": lambda: bspline(net(), (3, 3), side="outside").cells(4, 4),
    "mesh": lambda: sheet().cells(count=16),
    "sheets": lambda: sheets().cells((4, 3)),
}  # fmt: skip
TASK = Task(standoff=0.01, cone_deg=20, tolerance=1e-3)
LAX = Task(standoff=0.005, cone_deg=20, tolerance=1e-3)  # a crease shifts targets by the standoff
TASKS = {"sheets": LAX}


def serpentine(cells):
    """The cells row by row, every other row backwards; on a mesh in strips along x."""
    if len(cells.shape) == 2:
        rows = np.arange(len(cells)).reshape(cells.shape)
        return np.concatenate([row[:: 1 if k % 2 == 0 else -1] for k, row in enumerate(rows)])
    strip = np.floor(cells.centres[:, 0] / 0.055).astype(int)
    way = np.where(strip % 2 == 0, 1.0, -1.0)
    return np.lexsort((way * cells.centres[:, 1], strip))


def line_of_places(cells, task):
    """Targets and approach directions (k, 3) of a raster through all centres."""
    centres = cells.centres[serpentine(cells)]
    parts = []
    for a, b in itertools.pairwise(centres):
        count = max(int(np.ceil(np.linalg.norm(b - a) / SPACING)), 1)
        parts.append(a + np.arange(count)[:, None] / count * (b - a))
    line = np.concatenate([*parts, centres[-1:]])
    foot = line
    for _ in range(4):  # on a mesh the normal does not lead to the closest point
        found = cells.surface.closest(foot)
        foot = foot - found.height[:, None] * found.normal
    sign = cells.surface.side_sign
    return foot + sign * task.standoff * found.normal, -sign * found.normal


def solved(kinematics, q, point, axis, most=60):
    """The configuration near q with the tool at a point along an axis; None where that fails."""
    for _ in range(most):
        at, along = kinematics.tool(q)
        off = np.concatenate([point - at, axis - along])
        if np.abs(off).max() < 1e-8:
            return q
        jacobian = np.vstack(kinematics.jacobians(q))
        square = jacobian @ jacobian.T + DAMPING**2 * np.eye(6)
        step = jacobian.T @ np.linalg.solve(square, off)
        q = q + step * min(1.0, 0.5 / max(np.abs(step).max(), 1e-12))
    return q if np.abs(off).max() < 1e-5 else None


def followed(robot, points, axes, q):
    """Rows (k, n) from q on, or None."""
    kinematics, rows = Kinematics(robot), []
    for point, axis in zip(points, axes, strict=True):
        found = solved(kinematics, q, point, axis)
        if found is None or (rows and np.abs(found - q).max() > MOST_STEP):
            return None
        if (found < robot.lower).any() or (found > robot.upper).any():
            return None
        rows.append(found)
        q = found
    return np.array(rows)


@cache
def raster(name):
    """A raster over one of `SURFACES` by a UR5."""
    robot, cells, task = load_robot("ur5"), SURFACES[name](), TASKS.get(name, TASK)
    points, axes = line_of_places(cells, task)
    rng = np.random.default_rng(0)
    for _ in range(STARTS):
        begun = solved(Kinematics(robot), rng.uniform(-2.5, 2.5, robot.n), points[0], axes[0], 200)
        q = None if begun is None else followed(robot, points, axes, begun)
        if q is not None:
            return Raster(robot, cells, task, q)
    raise RuntimeError(f"no raster over {name}")
