"""An arm whose joints are known in closed form, and rasters that its tool draws over surfaces.

Three slides carry a wrist that tilts the tool about x, then about y, and rolls it; the tool point
is 100 mm before the wrist. Neither the search nor inverse kinematics by numbers is needed, nor are
the surface's own curves: targets lie on straight lines between cell centres in a serpentine.
"""

import itertools
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np
from arm_urdfs import joint
from mesh_patches import bent
from numpy.typing import NDArray
from random_arms import robot_of

from coverable import Cells, Robot, Task, bspline, cylinder, mesh, piecewise, plane, sphere, torus
from surfaces.meshes.triangle_mesh import TriangleMesh

TOOL = 0.1  # m, from the wrist to the tool point
SPACING = 2e-3  # m between targets


@cache
def gantry() -> Robot:
    """Slides along x, y and z, and a wrist about x, y and the tool axis, which is -z at zero."""
    slides = [joint(k, "prismatic", axis=np.eye(3)[k - 1]) for k in (1, 2, 3)]
    turns = [joint(k + 4, axis=np.eye(3)[k], limits=(-7.0, 7.0)) for k in range(3)]
    made = robot_of([*slides, *turns, joint(7, "fixed", (0, 0, -TOOL))], (0.0, 0.0, -1.0))
    return replace(made, reference_axis=np.array([1.0, 0.0, 0.0]))


def configurations(points, axes, roll=0.0):
    """(k, 6) with the tool at points (k, 3) along axes (k, 3) that look down."""
    x, y, z = np.asarray(axes).T
    about_x = np.unwrap(np.arctan2(y, -z))
    turns = np.column_stack([about_x, -np.arcsin(x), np.broadcast_to(roll, x.shape)])
    return np.hstack([points - TOOL * np.asarray(axes), turns])


class Raster(NamedTuple):
    robot: Robot
    cells: Cells
    task: Task
    q: NDArray[np.float64]


def sheet():
    def shape(u, v):
        x, y = 0.24 * u - 0.12, 0.2 * v - 0.1
        return x + 0.45, y + 0.05, 0.25 + 0.02 * np.sin(12 * x) * np.cos(9 * y) - 0.8 * x**2

    return mesh(TriangleMesh(*bent(shape, 24, 24)))


def net():
    x, y = np.meshgrid(np.linspace(0, 0.25, 5), np.linspace(-0.1, 0.1, 4), indexing="ij")
    z = 0.03 * np.cos(9 * x) + 0.02 * np.sin(15 * y)
    return np.stack([x + 0.35, y, z + 0.25], axis=-1).tolist()


def sheets():
    """Two flat pieces that meet at a slight crease."""
    lower, upper = plane((0.0, 0.2), (-0.1, 0)), plane((0.0, 0.2), (0, 0.1), rpy_deg=(4, 0, 0))
    return piecewise([lower, upper], side="outside", position=(0.4, 0.0, 0.25))


OUT = {"side": "outside"}
SURFACES = {
    "plane": lambda: plane((0.35, 0.55), (-0.1, 0.1), position=(0, 0, 0.3), **OUT).cells(4, 5),
    "ball": lambda: sphere(0.12, (0, 60), (0, 360), position=(0.45, 0, 0.25), **OUT).cells(3, 6),
    "pipe": lambda: cylinder(0.1, (15, 150), (0.0, 0.2), position=(0.45, -0.1, 0.3),
                             rpy_deg=(-90, 0, 0), **OUT).cells(5, 4),
    "ring": lambda: torus(0.2, 0.06, (0, 60), (20, 110), position=(0.3, -0.1, 0.25),
                          **OUT).cells(4, 4),
    "spline": lambda: bspline(net(), (3, 3), **OUT).cells(4, 4),
    "mesh": lambda: sheet().cells(count=16),
    "sheets": lambda: sheets().cells((4, 3)),
}  # fmt: skip
TASK = Task(standoff=0.01, cone_deg=20, tolerance=1e-3)
LAX = Task(standoff=0.005, cone_deg=20, tolerance=1e-3)  # a crease shifts targets by the standoff


def serpentine(cells):
    """The cells row by row, every other row backwards; on a mesh in strips along x."""
    if len(cells.shape) == 2:
        rows = np.arange(len(cells)).reshape(cells.shape)
        return np.concatenate([row[:: 1 if k % 2 == 0 else -1] for k, row in enumerate(rows)])
    strip = np.floor(cells.centres[:, 0] / 0.055).astype(int)
    way = np.where(strip % 2 == 0, 1.0, -1.0)
    return np.lexsort((way * cells.centres[:, 1], strip))


def places_along(cells, task):
    """Targets and approach directions (k, 3) of a raster through all centres."""
    parts = []
    centres = cells.centres[serpentine(cells)]
    for a, b in itertools.pairwise(centres):
        count = max(int(np.ceil(np.linalg.norm(b - a) / SPACING)), 1)
        parts.append(a + np.arange(count)[:, None] / count * (b - a))
    foot = np.concatenate([*parts, centres[-1:]])
    for _ in range(4):  # on a mesh the normal does not lead to the closest point
        found = cells.surface.closest(foot)
        foot = foot - found.height[:, None] * found.normal
    sign = cells.surface.side_sign
    return foot + sign * task.standoff * found.normal, -sign * found.normal


@cache
def raster(name: str) -> Raster:
    cells, task = SURFACES[name](), LAX if name == "sheets" else TASK
    points, axes = places_along(cells, task)
    roll = 0.2 * np.sin(np.linspace(0.0, 9.0, len(points)))
    return Raster(gantry(), cells, task, configurations(points, axes, roll))


def marks_of(made: Raster):
    """(m,) the cell at whose centre's target a row is, -1 at none."""
    points, _ = tools_of(made.q)
    away = np.linalg.norm(points[:, None] - made.task.targets(made.cells).points, axis=2)
    return np.where(away.min(axis=1) < 0.1 * made.task.effective_tolerance, away.argmin(axis=1), -1)


def tools_of(q):
    """Tool points and axes (k, 3) of the gantry, without any library."""
    q = np.asarray(q)
    a, b = q[:, 3], q[:, 4]
    axes = np.column_stack([-np.sin(b), np.sin(a) * np.cos(b), -np.cos(a) * np.cos(b)])
    return q[:, :3] + TOOL * axes, axes


def references_of(q):
    """(k, 3) the tool's reference axis."""
    a, b, g = np.asarray(q).T[3:]
    turned = np.stack([np.cos(b) * np.cos(g), np.sin(g), -np.sin(b) * np.cos(g)])
    x, y, z = turned
    return np.column_stack([x, np.cos(a) * y - np.sin(a) * z, np.sin(a) * y + np.cos(a) * z])
