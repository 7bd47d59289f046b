"""How much of a surface a certified motion treats, measured on the surface itself.

The contact of a tool point is the place of the surface below it. Between two configurations the
tool point leaves its chord by at most reach (sum of |dq|)^2 / 8, because the second derivative
along a straight line in joint space is at most reach (sum of |dq|)^2 for joints that turn. So rows
are put in until that is less than `SAG`.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from coverable.arrays import Array, Ints, Protected
from feasibility.certification.bisection import runs
from feasibility.paths.metrics import denser
from feasibility.task import Task
from feasibility.verdict import Walk
from robots.kinematics import Kinematics
from robots.robot import Robot
from surfaces.adjacency import components
from surfaces.cells import Cells
from surfaces.passes.tool_lines import ToolLines, visits
from surfaces.passes.toolpath import PassPlaces
from surfaces.passes.treated_share import Treated, treated_share
from surfaces.passes.triangulation import working_mesh
from surfaces.passes.welded_triangles import WorkingMesh
from surfaces.surface import Surface
from surfaces.toolpaths.arcs import arc_at
from surfaces.toolpaths.pose_surface import PoseSurface

FINE = 0.5  # [1] of the footprint's radius: edges of the triangles that are measured on
ACROSS = 60  # edges along the surface's extent, at least: triangles cut the corners of curved parts
MOST_COUNTED = 20_000  # faces on which visits are counted
OPEN = 0.5  # [1] a face of which at least this share is untreated for certain belongs to a region
LEAST = 1e-6  # [1] of the whole area: smaller regions are not listed
SAG = 1e-5  # [m] how far the path between two contacts may be from straight
FAR = 10.0  # [m] the reach of an arm whose slides have no ends
MOST_ROWS = 400_000


class ContactPath(NamedTuple):
    """The path on the surface below a tool point."""

    lines: ToolLines
    off: float
    """m, how far the path may be from these lines at most."""


class UntreatedRegion(NamedTuple):
    """A connected part of the surface that the tool does not treat."""

    centre: Array
    """(3,) m, in the root frame: a place of the surface in its middle."""
    area: float
    """m^2."""


@dataclass(frozen=True, eq=False, slots=True)
class TreatedArea(Protected):
    """What a tool treats along a motion: everything within half a footprint of its contacts."""

    footprint: tuple[float, float]
    """m, along the path and across it."""
    area: float
    """m^2, of the whole surface."""
    lower: float
    """[1] at least this share of it is treated."""
    upper: float
    """[1] and at most this."""
    twice: float
    """[1] share that the tool comes by more than once, about."""
    untreated: tuple[UntreatedRegion, ...]
    """What is left out for certain, the largest region first."""
    mesh: WorkingMesh
    """The surface as it was measured, for pictures."""
    shares: Array
    """(F,) the treated share of each of its faces, at least."""
    lines: ToolLines
    """The path on the surface below the tool point."""
    notes: tuple[str, ...] = ()
    """What to know, one sentence each."""

    def times(self, which: Ints | slice = slice(None)) -> Ints:
        """(k,) how often the tool comes by some faces, all by default."""
        normals = self.mesh.doubled_areas[which]
        middles = self.mesh.corners[which].mean(axis=1)
        return visits(middles, normals, self.lines, 0.5 * min(self.footprint))


def treated_by_walk(robot: Robot, cells: Cells, task: Task, *walks: Walk) -> TreatedArea | None:
    """What motions over cells treat together; None without a footprint.

    Over poses it is the surface under them, where that is known, and where the tool works on it.
    """
    surface = cells.surface.wall
    if task.disc is None or surface is None or not sum(len(walk.q) for walk in walks):
        return None
    parts = list(walks)
    if isinstance(cells.surface, PoseSurface):  # those in which the tool works
        parts = []
        for walk in walks:
            works = cells.surface.works(walk.cell)
            parts += [Walk(walk.q[part], walk.cell[part]) for part in runs(works)]
    found = [contacts_on(surface, robot, walk) for walk in parts]
    return _measured(surface, task.disc, _joined(found))


def treated_by_passes(
    surface: Surface, places: PassPlaces, robot: Robot, task: Task, walks: tuple[Walk, ...]
) -> TreatedArea | None:
    """What motions, marked at the poses of passes, treat; None without a footprint."""
    if task.disc is None:
        return None
    height = surface.side_sign * task.standoff
    found = [contacts_along(places, robot, walk, height) for walk in walks]
    return _measured(surface, task.disc, _joined(found))


def _joined(found: list[ContactPath]) -> ContactPath:
    """Several paths as one, their stretches numbered on."""
    none = np.zeros((0, 3))
    parts, first = [ToolLines(none, none, np.zeros(0, dtype=np.int64))], 0
    for each in found:
        parts.append(each.lines._replace(stretch=each.lines.stretch + first))
        first += int(each.lines.stretch.max(initial=-1)) + 1
    lines = ToolLines(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))
    return ContactPath(lines, max((each.off for each in found), default=0.0))


def _measured(
    surface: Surface, footprint: tuple[float, float], contacts: ContactPath
) -> TreatedArea:
    """The bracket: an ellipse holds the disc of its smaller axis, and lies in that of its larger.

    The disc is a ball about each contact, see `surfaces.passes.treated_share`.
    """
    inner, outer = 0.5 * min(footprint), 0.5 * max(footprint)
    measured = surface.wall or surface  # not a smoothed copy
    extent = float(np.linalg.norm(np.ptp(working_mesh(measured, np.inf).vertices, axis=0)))
    mesh = working_mesh(measured, min(FINE * inner, extent / ACROSS))
    doubled = mesh.doubled_areas
    normals = doubled / np.maximum(np.linalg.norm(doubled, axis=1), 1e-300)[:, None]
    off = contacts.off
    small = treated_share(mesh, normals, contacts.lines, inner, off=off)
    large = treated_share(mesh, normals, contacts.lines, outer, off=off) if outer > inner else small
    notes, (error, _) = list[str](), measured.deviations
    if 0.25 * math.pi * footprint[0] * footprint[1] >= small.area:
        notes.append("the footprint is larger than the whole surface")
    if footprint[0] != footprint[1]:
        notes.append(
            "of an ellipse the share is at least that of the disc inside it, and at most that of "
            "the disc around it"
        )
    if error > 0.0:
        notes.append(f"the surface is known to {1e3 * error:.2g} mm")
    found = TreatedArea(
        footprint=footprint,
        area=small.area,
        lower=small.lower,
        upper=large.upper,
        twice=0.0,
        untreated=_untreated_regions(large),
        mesh=small.mesh,
        shares=small.shares,
        lines=contacts.lines,
        notes=tuple(notes),
    )
    some = np.arange(0, len(found.shares), max(1, -(-len(found.shares) // MOST_COUNTED)))
    again = found.mesh.areas[some] * (found.times(some) > 1)
    return replace(found, twice=float(again.sum() / found.mesh.areas[some].sum()))


def _untreated_regions(found: Treated) -> tuple[UntreatedRegion, ...]:
    """The regions that are untreated for certain, the largest first."""
    mesh = found.mesh
    faces = np.flatnonzero(found.most <= 1.0 - OPEN)
    if not len(faces):
        return ()
    corners = mesh.faces[faces]
    used, of = np.unique(corners, return_inverse=True)
    of = of.reshape(-1, 3)
    joined = np.concatenate([of[:, [0, 1]], of[:, [1, 2]]]).astype(np.int64)
    part = components(joined, len(used))[of[:, 0]]
    middles = mesh.corners[faces].mean(axis=1)
    areas = mesh.areas[faces] * (1.0 - found.most[faces])
    regions = []
    for number in np.unique(part):
        own = part == number
        mean = np.average(middles[own], axis=0, weights=areas[own])
        nearest = np.linalg.norm(middles[own] - mean, axis=1).argmin()
        regions.append(UntreatedRegion(middles[own][nearest], float(areas[own].sum())))
    listed = (each for each in regions if each.area >= LEAST * found.area)
    return tuple(sorted(listed, key=lambda each: -each.area))


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
