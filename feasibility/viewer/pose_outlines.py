"""The parts of a picture of poses: outlines in classes, the best one in full, stations.

An outline is light enough to be drawn at hundreds of poses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np

from coverable.arrays import Array, Ints, Mask
from coverable.errors import counted
from feasibility.placement.region import Pose, moved_cells
from feasibility.placement.trials import Trial
from feasibility.viewer import threejs
from feasibility.viewer.cell_meshes import marks, patch
from feasibility.viewer.meshes import joined, tubes
from feasibility.viewer.playback import Playback
from feasibility.viewer.threejs import Colour
from feasibility.viewer.verdict_scene import (
    MISSED,
    PATCHES,
    Layer,
    cells_layers,
    filled,
    hidden,
    mesh_layer,
    trail,
)
from surfaces.cells import Cells
from surfaces.meshes.degenerate import welded
from surfaces.passes.welded_triangles import border_edges

if TYPE_CHECKING:
    from feasibility.placement.stations import StationPlan
    from feasibility.studies.store import Row


MOST = 96  # segments of one outline
FINEST = 8  # pieces that a cell's side is cut into, at most
ALIKE = 1e-6  # [1] of the surface's size: cells whose distances from the middle differ by less
SMALL = 0.5  # [1] of the surface's size: a smaller boundary does not show where the surface lies
STROKE = 0.12  # [1] of the surface's size: the stroke that points to the working side
MOST_DRAWN = 200  # feasible poses drawn; of more, as many spread evenly over their ranks
DOT = 0.02  # [1] of the surface's size: radius of the dots of other poses
THICK = 0.0045  # [1] of an outline's size: radius of those of feasible poses
COVERED: Colour = (0.35, 0.60, 0.80)


class Class(StrEnum):
    """The outcome of a pose, the best first."""

    FEASIBLE = "feasible"
    WHOLE = "covered by a search, not replayed"
    MOST = "75 % or more of the area"
    HALF = "50 to 75 %"
    SOME = "25 to 50 %"
    LITTLE = "less than 25 %"
    FAILED = "could not be tried"


# Distinct for colour-blind readers too; feasible outlines are also thick.
COLOURS: dict[Class, Colour] = {
    Class.FEASIBLE: (0.00, 0.50, 0.36),
    Class.WHOLE: (0.34, 0.71, 0.91),
    Class.MOST: (0.23, 0.05, 0.60),
    Class.HALF: (0.70, 0.10, 0.50),
    Class.SOME: (0.90, 0.42, 0.25),
    Class.LITTLE: (0.95, 0.74, 0.20),
    Class.FAILED: (0.15, 0.15, 0.15),
}


@dataclass(frozen=True, eq=False, slots=True)
class Tried:
    """A pose that was tried, as it is drawn."""

    pose: Pose
    kind: Class
    cover: Mask | None
    """(N,) cells that the best motion found covers; None where that is not known."""


def class_of_share(share: float) -> Class:
    """The class of a pose that was searched, by the share of the area in one motion, 0..1.

    Example:
        >>> class_of_share(0.75).value, class_of_share(0.0).value
        ('75 % or more of the area', 'less than 25 %')
    """
    if share >= 1.0 - 1e-9:
        return Class.WHOLE
    borders = {Class.MOST: 0.75, Class.HALF: 0.50, Class.SOME: 0.25}
    return next((kind for kind, least in borders.items() if share >= least), Class.LITTLE)


def class_of_trial(trial: Trial) -> Class:
    """The class of a placement."""
    if trial.failed:
        return Class.FAILED
    return Class.FEASIBLE if trial.feasible else class_of_share(trial.share)


def class_of_row(row: Row) -> Class:
    """The class of a row of a study of verdicts."""
    if row.status == "failed" or "share" not in row.result:
        return Class.FAILED
    if row.result["verdict"] == "feasible":
        return Class.FEASIBLE
    return class_of_share(float(row.result["share"]))


def best_layers(cells: Cells, best: Tried, motion: Playback | None) -> list[Layer]:
    """The cells at the best placement, what is covered there, and the path of a covering motion."""
    if len(cells) == 0:
        return []
    surface, *marks = cells_layers(cells)
    label = "the surface at one of the poses" if best.kind is Class.FAILED else "the best of them"
    parts = [replace(surface, entry=replace(surface.entry, label=label)), *marks]
    if best.cover is not None and not best.cover.all() and best.kind is not Class.FEASIBLE:
        for words, colour, which in (
            ("covered there in one motion", COVERED, np.flatnonzero(best.cover)),
            ("not covered there", MISSED, np.flatnonzero(~best.cover)),
        ):
            if len(which):
                label = f"{words} ({counted(len(which), 'cell')})"
                parts.append(filled(cells, which, colour, f"/best/{words}", label))
    if motion is not None:
        parts.append(trail(cells, motion))
    return parts


def station_layers(cells: Cells, plan: StationPlan) -> list[Layer]:
    """The surface at each station, with the cells given to it."""
    parts, lines = [], outline(cells)
    for k, trial in enumerate(plan.trials):
        mine, colour = plan.cells(k), PATCHES[k % len(PATCHES)]
        root = f"/stations/station {k + 1}"
        there = moved_cells(cells, trial.pose)
        label = f"station {k + 1} ({counted(len(mine), 'cell')})"
        part = filled(there, mine, colour, f"{root}/cells", label)
        ends = placed(lines, trial.pose).reshape(-1, 3)
        border = threejs.segments(f"{root}/outline", ends, colour)
        entry = replace(part.entry, path=root)
        parts.append(replace(part, commands=(*part.commands, border), entry=entry))
    return parts


def class_layers(lines: Array, tried: Sequence[Tried]) -> list[Layer]:
    """One layer for each class of poses: outlines of the feasible ones, dots for the others.

    Dots are hidden at first: there may be hundreds, and they say where was looked, no more.

    Args:
        lines: (k, 2, 3) m, what is drawn at every feasible pose, in the surface's frame.
        tried: the poses.
    """
    parts = []
    for kind in Class:
        poses = [one.pose for one in tried if one.kind is kind]
        if not poses or len(lines) == 0:
            continue
        path, number = f"/poses/{threejs.safe_name(kind)}", str(len(poses))
        if kind is Class.FEASIBLE:
            some = _spread(poses)
            if len(some) < len(poses):
                number = f"{len(some)} of {len(poses)} drawn"
            shape = _thick(lines, some)
        else:
            middle = (lines.min(axis=(0, 1)) + lines.max(axis=(0, 1))) / 2.0
            dots = np.array([placed(middle, pose) for pose in poses])
            shape = marks(dots, DOT * _size(lines))
        layer = mesh_layer(f"{kind} ({number})", COLOURS[kind], path, *shape, lit=False)
        parts.append(layer if kind is Class.FEASIBLE else hidden(layer))
    return parts


def _spread(poses: Sequence[Pose]) -> list[Pose]:
    """All poses, or `MOST_DRAWN` of them at even distances, the first one among them."""
    chosen = np.unique(np.linspace(0, len(poses) - 1, min(len(poses), MOST_DRAWN)).round())
    return [poses[int(k)] for k in chosen]


def _thick(lines: Array, poses: Sequence[Pose]) -> tuple[Array, Ints]:
    """Segments (k, 2, 3) m as tubes, at every pose: vertices and faces."""
    vertices, faces = tubes(list(lines), THICK * _size(lines.reshape(-1, 3)), sides=4)
    every = np.concatenate([placed(vertices, pose) for pose in poses])
    first = len(vertices) * np.arange(len(poses))[:, None, None]
    return every, (faces + first).reshape(-1, 3)


def outline(cells: Cells) -> Array:
    """The boundary of a surface and a stroke from its middle to the working side.

    A surface without a boundary, or with a small one, shows its three middle sections as well.

    Returns:
        (k, 2, 3) m, ends of segments, in the surface's frame.
    """
    if len(cells) == 0:
        return np.empty((0, 2, 3))
    vertices, faces = _triangles(cells)
    size = _size(vertices)
    lines = vertices[border_edges(faces)]
    if len(lines) == 0 or _size(lines.reshape(-1, 3)) < SMALL * size:
        lines = np.concatenate([lines, _sections(vertices, faces)])
    return np.concatenate([_thinned(lines, 2.0 * size / MOST), _stroke(cells, STROKE * size)])


def placed(points: Array, pose: Pose) -> Array:
    """Points (..., 3) m of the surface's frame in the root frame, for a surface at `pose`."""
    return points @ pose.rotation.T + np.array(pose.position)


def _triangles(cells: Cells) -> tuple[Array, Ints]:
    """A few triangles of all cells, in the surface's frame: (V, 3) m and (F, 3)."""
    every = np.arange(len(cells))
    pieces = int(np.clip(MOST // (2 * sum(cells.shape)), 1, FINEST))
    grid = len(cells.shape) > 1
    vertices, faces = cells.triangles(every, pieces) if grid else patch(cells, every)
    return joined(_in_own_frame(cells, vertices), faces)


def _in_own_frame(cells: Cells, points: Array) -> Array:
    """Points (..., 3) m of the root frame in the surface's frame."""
    return np.asarray((points - cells.surface.position) @ cells.surface.rotation)


def _size(points: Array) -> float:
    """Diagonal of the box around points (k, 3), m."""
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _sections(vertices: Array, faces: Ints) -> Array:
    """(k, 2, 3) m: where the three planes through the middle cut the surface."""
    import trimesh

    body = trimesh.Trimesh(vertices, faces, process=False)
    # Slightly off the middle: a plane through corners cuts along edges, or nothing.
    share = np.array([0.5003, 0.4998, 0.5001])
    middle = body.bounds[0] + share * np.ptp(body.bounds, axis=0)
    cuts = [trimesh.intersections.mesh_plane(body, axis, middle) for axis in np.eye(3)]
    return np.concatenate([np.reshape(cut, (-1, 2, 3)) for cut in cuts])


def _thinned(lines: Array, distance: float) -> Array:
    """At most `MOST` of some segments: ends within a distance, m, of each other become one."""
    points, result = lines.reshape(-1, 3), lines
    while len(result) > MOST:
        ends = np.unique(np.sort(welded(points, distance).reshape(-1, 2), axis=1), axis=0)
        result = points[ends[ends[:, 0] != ends[:, 1]]]
        distance *= 1.25
    return result


def _stroke(cells: Cells, length: float) -> Array:
    """(1, 2, 3) m: from the middle to the working side; (0, 2, 3) where normals cancel out."""
    mean = (cells.areas[:, None] * cells.normals).sum(axis=0) / cells.areas.sum()
    if np.linalg.norm(mean) < SMALL:
        return np.empty((0, 2, 3))
    away = np.linalg.norm(cells.centres - cells.centres.mean(axis=0), axis=1)
    cell = int(np.argmax(away <= away.min() + ALIKE * away.max()))  # the first of several as near
    # The tool is on the side of the targets.
    tip = cells.centres[cell] + length * cells.surface.side_sign * cells.normals[cell]
    return _in_own_frame(cells, np.stack([cells.centres[cell], tip]))[None]
