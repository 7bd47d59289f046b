"""Colours along a motion: how often the tool comes by, what is untreated, the local margin."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from coverable.arrays import Ints
from coverable.errors import at_least
from feasibility.demands.area import TreatedArea
from feasibility.verdict import Verdict
from feasibility.viewer import threejs
from feasibility.viewer.cell_meshes import cell_size, marks
from feasibility.viewer.html_page import Entry
from feasibility.viewer.playback import Playback
from feasibility.viewer.threejs import Colour, Command
from feasibility.viewer.verdict_scene import (
    SURFACE,
    TRAIL_POINTS,
    Layer,
    drawn_lines,
    hidden,
    lines_layer,
    mesh_layer,
)
from robots.kinematics import Kinematics
from surfaces.passes.welded_triangles import WorkingMesh

UNTREATED: Colour = (0.84, 0.12, 0.12)
TIMES: tuple[tuple[str, Colour], ...] = (  # a sequence that colour-blind readers can tell apart
    ("treated once", (0.45, 0.75, 0.55)),
    ("treated twice", (0.10, 0.48, 0.62)),
    ("three times or more", (0.20, 0.10, 0.42)),
)
STROKES = 160  # groups of faces that appear one after the other
CLOSE = (
    0.25  # [1] of the footprint's radius: how far places of the tool are apart that are looked at
)
ABOVE = 1e-3  # [1] of the surface's extent, so that colours lie over the surface
HALF = 0.5  # [1] of a face: with more of it treated it counts as treated


class Painted(NamedTuple):
    """Layers, and the tracks that show parts of them when the tool has passed."""

    layers: list[Layer]
    tracks: list[dict[str, Any]]


def surface_layer(mesh: WorkingMesh) -> Layer:
    """The surface itself."""
    return mesh_layer("surface", SURFACE, "/surface/itself", mesh.vertices, mesh.faces, opacity=0.6)


def area_layers(found: TreatedArea, side: float) -> list[Layer]:
    """Faces by how often the tool comes by, all at once.

    Args:
        found: the treated area.
        side: 1.0 where the tool is outside, -1.0 inside: colours are drawn on that side.
    """
    return _layers(found, side, [np.arange(len(found.shares))])[0]


def painted_layers(found: TreatedArea, side: float, motion: Playback, height: float) -> Painted:
    """The same, each face when the tool comes by first.

    Args:
        found: the treated area.
        side: see `area_layers`.
        motion: what the picture plays.
        height: m, of the tool point over the surface.
    """
    first = _first_strokes(found, motion, height)
    groups = [np.flatnonzero(first == number) for number in range(STROKES)]
    layers, paths = _layers(found, side, groups)
    end = float(motion.seconds[-1])
    times = np.linspace(0.0, end, STROKES + 1)[1:]
    return Painted(layers, [threejs.appearing(path, times[k], end) for path, k in paths])


def _first_strokes(found: TreatedArea, motion: Playback, height: float) -> Ints:
    """(F,) in which stroke the tool comes by each face first, however long the path is.

    A face that it does not come by counts to the stroke that comes nearest.
    """
    from scipy.spatial import KDTree

    middles, radius = found.mesh.corners.mean(axis=1), 0.5 * max(found.footprint)
    edges = np.linspace(0.0, float(motion.seconds[-1]), STROKES + 1)
    times = np.union1d(motion.seconds, edges)
    steps = np.linalg.norm(np.diff(motion.tool_at(times), axis=0), axis=1)
    count = np.maximum(np.ceil(steps / (CLOSE * radius)), 1).astype(np.int64)
    within = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    times = np.repeat(times[:-1], count) + within * np.repeat(np.diff(times) / count, count)
    points, stroke = motion.tool_at(times), np.searchsorted(edges, times, side="right") - 1
    first = stroke[KDTree(points).query(middles)[1]]
    rest, reach = np.arange(len(middles)), float(np.hypot(radius, height))
    for number in np.unique(stroke):
        own = points[stroke == number]
        beside = (middles[rest] > own.min(0) - reach) & (middles[rest] < own.max(0) + reach)
        here = rest[beside.all(axis=1)]  # to be looked at: most are far away from one stroke
        near, _ = KDTree(own).query(middles[here], distance_upper_bound=reach)
        here = here[np.isfinite(near)]
        first[here] = number
        rest = np.setdiff1d(rest, here, assume_unique=True)
    return np.asarray(first)


def _layers(
    found: TreatedArea, side: float, groups: Sequence[Ints]
) -> tuple[list[Layer], list[tuple[str, int]]]:
    """A layer for each number of times and for what is untreated; paths of groups in the scene."""
    mesh = found.mesh
    times = np.where(found.shares >= HALF, np.maximum(found.times(), 1), 0)
    extent = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    lift = side * ABOVE * extent * mesh.doubled_areas
    lift /= np.maximum(np.linalg.norm(mesh.doubled_areas, axis=1), 1e-300)[:, None]
    layers, paths = list[Layer](), list[tuple[str, int]]()
    for level, (name, colour) in enumerate(TIMES, start=1):
        root, commands = f"/treated/{name}", list[Command]()
        for k, group in enumerate(groups):
            own = times[group] == level if level < len(TIMES) else times[group] >= level
            if own.any():
                path = f"{root}/{k:03d}"
                commands.append(_faces(mesh, group[own], lift, colour, path))
                paths.append((path, k))
        if commands:
            layers.append(Layer(tuple(commands), Entry(name, colour, root)))
    missed = np.flatnonzero(times == 0)
    if len(missed):
        path, name = "/treated/untreated", f"untreated ({100.0 * (1.0 - found.lower):.2g} %)"
        command = _faces(mesh, missed, lift, UNTREATED, path)
        layers.append(Layer((command,), Entry(name, UNTREATED, path)))
    return layers, paths


def _faces(mesh: WorkingMesh, which: Ints, lift: Any, colour: Colour, path: str) -> Command:
    """Some faces in one colour, a little above the surface."""
    corners = (mesh.vertices[mesh.faces[which]] + lift[which][:, None]).reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    return threejs.mesh_object(path, corners, faces, colour, opacity=0.9, lit=False)


BANDS: tuple[tuple[float, Colour], ...] = (
    (1.5, (0.84, 0.12, 0.12)),
    (3.0, (0.90, 0.60, 0.00)),
    (np.inf, (0.00, 0.62, 0.45)),
)
"""Times the least margin, up to which the path has a colour."""
LEAST: Colour = (0.84, 0.12, 0.12)
WIDE = 0.04  # [1] of a cell's width, the radius of that path: edges of G are thinner
NOTHING = 1e-6  # [m] colours are for multiples of the least margin, or of this
MARK = 0.1  # [1] of a cell's width, of the mark where the margin is least


def margin_layers(verdict: Verdict) -> Iterator[Layer]:
    """The tool's path in colours, by how far the part may be shifted there, and the least place."""
    margin = None if verdict.certificate is None else verdict.certificate.placement_margin
    if margin is None or margin.along is None or verdict.witness is None:
        return
    points = Kinematics(verdict.robot).tools(verdict.witness.q)[0]
    size, worst = cell_size(verdict.cells), int(np.argmin(margin.along))
    low = float(margin.along[worst])
    least = max(low, NOTHING)
    for times, colour in BANDS:
        some = (margin.along >= low) & (margin.along < times * least)
        if some.any():
            label = f"tool path: the part may be off by {at_least(1e3 * low, 3)} mm"
            which, path = np.flatnonzero(some), f"/margin/{times:g} times"
            runs = np.split(which, np.flatnonzero(np.diff(which) > 1) + 1)
            lines = [points[run[0] : run[-1] + 2] for run in runs]
            if len(points) > TRAIL_POINTS:
                yield hidden(lines_layer(label, colour, path, points[which[:, None] + [0, 1]]))
            else:
                yield hidden(drawn_lines(lines, WIDE * size, colour, path, label))
        low = times * least
    dot = marks(points[[worst, worst + 1]].mean(axis=0, keepdims=True), MARK * size)
    yield mesh_layer("least room for the part", LEAST, "/margin/least", *dot, lit=False)
