"""Where a tool touches the surface along a motion: the path of its contacts.

The contact of a tool point is the place of the surface below it. Between two configurations the
tool point leaves its chord by at most reach (sum of |dq|)^2 / 8, because the second derivative
along a straight line in joint space is at most reach (sum of |dq|)^2 for joints that turn. So rows
are put in until that is less than `SAG`.
"""

from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints
from feasibility.paths.metrics import denser
from feasibility.verdict import Walk
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.passes.tool_lines import ToolLines
from surfaces.passes.toolpath import PassPlaces
from surfaces.surface import Surface
from surfaces.toolpaths.arcs import arc_at

SAG = 1e-5  # [m] how far the path between two contacts may be from straight
FAR = 10.0  # [m] the reach of an arm whose slides have no ends
MOST_ROWS = 400_000


class ContactPath(NamedTuple):
    """The path on the surface below a tool point."""

    lines: ToolLines
    off: float
    """m, how far the path may be from these lines at most."""


def contacts_on(surface: Surface, robot: Robot, walk: Walk) -> ContactPath:
    """The contacts of a motion all of which runs over a surface."""
    dense = _dense(robot, walk.q)
    points, _ = Kinematics(robot).tools(dense.q)
    at = surface.closest(points)
    contacts = points - at.height[:, None] * at.normal
    lines = ToolLines(contacts, at.normal, np.zeros(len(contacts), dtype=np.int64))
    return ContactPath(lines, 2.0 * dense.sag)


def contacts_along(places: PassPlaces, robot: Robot, walk: Walk, height: float) -> ContactPath:
    """The contacts of a motion marked at the poses of passes; where the tool is lifted it has none.

    `height` (m, signed) is that of the tool point over the surface, along the outward normal.
    """
    dense = _dense(robot, walk.q)
    points, _ = Kinematics(robot).tools(dense.q)
    marks = np.flatnonzero(walk.cell >= 0)
    last, section = len(marks) - 1, np.searchsorted(marks, dense.row, side="right") - 1
    known = (section >= 0) & (dense.row <= marks[-1])
    pose = walk.cell[marks]
    before = np.clip(section, 0, last)
    after = np.minimum(before + 1, last)
    a, b = pose[before], pose[after]
    normals, _ = arc_at(places.normals[a], places.normals[b], _share(places.points, a, b, points))
    of = places.at_work
    own = known & (of[a] >= 0) & (of[b] >= 0)
    contacts, stretch = (points - height * normals)[own], of[a][own]
    rows = np.flatnonzero(own)
    # A new number where something lies between two contacts, so that they are not joined.
    part = np.cumsum(np.diff(rows, prepend=rows[:1]) > 1)
    _, number = np.unique(np.column_stack([part, stretch]), axis=0, return_inverse=True)
    return ContactPath(ToolLines(contacts, normals[own], number.reshape(-1)), 2.0 * dense.sag)


def _share(points: Array, a: Ints, b: Ints, tool: Array) -> Array:
    """(k,) how far tool points are from the poses a to the poses b, 0 to 1."""
    line = points[b] - points[a]
    along = ((tool - points[a]) * line).sum(axis=1)
    return np.asarray(np.clip(along / np.maximum((line**2).sum(axis=1), 1e-18), 0.0, 1.0))


class _Dense(NamedTuple):
    """A motion with more rows."""

    q: Array
    row: Array
    """(m,) in the given motion, with the share of the line to the next one."""
    sag: float
    """m, how far the tool point is from its chord between rows at most."""


def _dense(robot: Robot, q: Array) -> _Dense:
    """The same motion with so many rows that the tool point's path is straight between them."""
    reach = robot.reach if np.isfinite(robot.reach) else FAR
    # A slide moves the tool straight; it counts as the turn that sweeps it.
    scale = np.where(robot.prismatic, 1.0 / reach, 1.0)
    steps = (np.abs(np.diff(q, axis=0)) * scale).sum(axis=1)
    finest = np.ceil(steps * np.sqrt(reach / (8.0 * SAG))).astype(np.int64)
    count = np.maximum(finest, 1)
    if count.sum() > MOST_ROWS:
        count = np.maximum(count * MOST_ROWS // count.sum(), 1)
    sag = float((reach * (steps / count) ** 2).max(initial=0.0)) / 8.0
    return _Dense(*denser(q, count), sag)
