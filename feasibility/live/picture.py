"""What a live page draws: the picture that a view has, and what each answer changes in it.

The surface is drawn once, at its first pose, and its group is moved. Its cells are triangles
with a number each, which the page paints.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable
from typing import Any, NamedTuple

import networkx as nx
import numpy as np

from coverable.arrays import Array, Mask
from feasibility.cases.case import Setup
from feasibility.verdict import Answer, Evidence, Verdict
from feasibility.viewer.cell_meshes import patch as filled
from feasibility.viewer.frames.standing_world import GROUP, carried, world_tracks
from feasibility.viewer.html_page import Entry
from feasibility.viewer.obstacles import HULLS
from feasibility.viewer.playback import animate, motion_of
from feasibility.viewer.robot import ROBOT, pose
from feasibility.viewer.scene import MISSED as NOT_YET
from feasibility.viewer.scene import layers, missed_groups, trail
from feasibility.viewer.threejs import Colour, Command, hex_colour, stream_of
from feasibility.viewer.viewer import View, view
from robots.robot import Robot
from surfaces.cells import Cells

SURFACE, CELLS = "/surface", "/cells"
COVERED: Colour = (0.13, 0.60, 0.33)
INSET = 0.06  # [1] of a cell's width that its triangles are smaller by


class Paint(NamedTuple):
    """The colours of the cells, and what they mean."""

    classes: list[int]
    """(N,) which entry each cell is of."""
    entries: list[dict[str, str]]
    """Label and colour."""


def first_view(setup: Setup, name: str) -> View:
    """The case before anything is known of it: arm, ground, scene and surface."""
    robot, cells, task, search = setup
    nothing = Verdict(
        answer=Answer.UNDECIDED,
        evidence=Evidence.BUDGET,
        message="",
        robot=robot,
        cells=cells,
        task=task,
        method=search.method,
        seed=search.seed,
        graph=nx.Graph(),
        covered=np.zeros(len(cells), dtype=bool),
    )
    return view(nothing, name, play=False)


def group_of(robot: Robot) -> str:
    """The group of the scene tree for all that is drawn in the root frame."""
    return "" if robot.surface_link is None else GROUP


def scene_bytes(drawn: View) -> bytes:
    """The drawing commands of a view without its cells, each behind its length in four bytes."""
    cells = group_of(drawn.robot) + CELLS
    return stream_of(one for one in drawn.commands if not one["path"].startswith(cells))


def entries_of(drawn: View) -> list[dict[str, Any]]:
    """The lines of the legend that stay."""
    cells = group_of(drawn.robot) + CELLS
    return [
        _line(entry)
        for entry in drawn.legend.entries
        if entry.path is None or not entry.path.startswith(cells)
    ]


def _line(entry: Entry) -> dict[str, Any]:
    """A line of the legend, with the part of the scene that it switches."""
    return {**_entry(entry.label, entry.colour), "path": entry.path, "shown": entry.shown}


def cell_triangles(cells: Cells) -> dict[str, str]:
    """The triangles of all cells as base64: float32 positions, uint32 corners, cell of a vertex."""
    positions, corners, owners, count = [], [], [], 0
    for k in range(len(cells)):
        vertices, faces, _ = filled(cells, np.array([k]), inset=INSET)
        positions.append(vertices)
        corners.append(faces + count)
        owners.append(np.full(len(vertices), k))
        count += len(vertices)
    arrays = {
        "positions": np.concatenate(positions).astype("<f4"),
        "corners": np.concatenate(corners).astype("<u4"),
        "owners": np.concatenate(owners).astype("<u4"),
    }
    return {name: _base64(array.tobytes()) for name, array in arrays.items()}


def quick_paint(covered: Mask) -> Paint:
    """Two colours: what one motion reaches, and the rest."""
    missed = int((~covered).sum())
    entries = [_entry(f"reached ({len(covered) - missed})", COVERED)]
    if missed:
        entries.append(_entry(f"not reached so far ({missed})", NOT_YET))
    return Paint((~covered).astype(int).tolist(), entries)


def certified_paint(verdict: Verdict) -> Paint:
    """Covered cells, and the missed ones in the colours of their causes."""
    classes = np.zeros(len(verdict.cells), dtype=int)
    entries = [_entry(f"covered ({verdict.n_covered})", COVERED)]
    for group in missed_groups(verdict.causes, np.flatnonzero(~verdict.covered)):
        classes[group.which] = len(entries)
        entries.append(_entry(f"not covered: {group.words} ({len(group.which)})", group.colour))
    return Paint(classes.tolist(), entries)


def posed(robot: Robot, q: Array | None, collides: bool) -> list[Command]:
    """Put the arm into a configuration (n,), and the group of a surface that it carries."""
    if q is None:
        return []
    roots = [ROBOT, HULLS] if collides else [ROBOT]
    commands = [command for root in roots for command in pose(robot, q, root)]
    return carried(robot, commands, [], q)[0]


class Parts(NamedTuple):
    """What only a certified answer has."""

    commands: list[Command]
    paths: list[str]
    """What has to go before the next answer."""
    entries: list[dict[str, Any]]
    """Lines of the legend, with the parts that they switch."""
    seconds: float
    """How long the motion is played; 0 where there is none."""


def certified_parts(verdict: Verdict) -> Parts:
    """Graph G, start, sides of a cut, the motion, and the arm where it starts."""
    parts = [
        part
        for part in layers(verdict)
        if part.entry.path is None or not part.entry.path.startswith((SURFACE, CELLS))
    ]
    robot, moving, seconds = verdict.robot, list[Command](), 0.0
    motion, collides = motion_of(verdict), verdict.task.collision is not None
    known = verdict.postures if verdict.witness is None else verdict.witness.q
    q = None if known is None or not len(known) else known[0]
    if motion is not None:
        parts.append(trail(verdict.cells, motion))
        q, seconds = motion.walk[0], float(motion.seconds[-1])
        times = np.linspace(0.0, seconds, 2 if robot.surface_link is None else 400)
        tracks = world_tracks(robot, times, motion.at(times))
        roots = [ROBOT, HULLS] if collides else [ROBOT]
        moving = [animate(robot, motion, play=False, tracks=tracks, roots=roots)]
    drawn = [command for part in parts for command in part.commands]
    shown, entries = carried(
        robot,
        [*drawn, *moving],
        [part.entry for part in parts],
        np.zeros(robot.n) if q is None else q,
    )
    paths = [entry.path for entry in entries if entry.path is not None]
    commands = [*shown, *posed(robot, q, collides)]
    return Parts(commands, paths, [*map(_line, entries)], seconds)


def packed(commands: Iterable[Command]) -> str:
    """Commands as base64, each behind its length in four bytes."""
    return _base64(stream_of(commands))


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _entry(label: str, colour: Colour) -> dict[str, str]:
    return {"label": label, "colour": f"#{hex_colour(colour):06x}"}
