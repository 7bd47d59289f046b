"""The parts of a verdict's picture: surface, cells, graph G, causes, legend.

Everything here is plain drawing commands with plain names, so that the legend can show and hide
each part; `html_page` and `live_server` present it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from coverable.arrays import Array, Ints
from coverable.errors import counted
from feasibility.verdict import Cause, CauseKind, Verdict
from feasibility.viewer import threejs
from feasibility.viewer.cell_meshes import (
    COLOURS,
    FULL_DETAIL,
    LOST,
    Sides,
    borders,
    cell_size,
    marks,
    patch,
    sides_of,
)
from feasibility.viewer.html_page import Entry
from feasibility.viewer.meshes import joined, split_at_creases, tubes
from feasibility.viewer.playback import Playback
from feasibility.viewer.threejs import Colour, Command
from surfaces.cells import Cells

SURFACE: Colour = (0.62, 0.71, 0.80)
OUTLINES: Colour = (0.30, 0.35, 0.41)
CENTRES: Colour = (0.25, 0.30, 0.36)
EDGES: Colour = (0.05, 0.25, 0.85)
START: Colour = (0.0, 0.62, 0.25)
MISSED: Colour = (0.84, 0.12, 0.12)
TRAIL: Colour = (0.95, 0.55, 0.05)
CAUSES: dict[CauseKind, Colour] = {  # distinct for colour-blind readers too (Okabe and Ito)
    CauseKind.OUT_OF_REACH: (0.50, 0.05, 0.22),
    CauseKind.JOINT_LIMITS: (0.90, 0.60, 0.00),
    CauseKind.ORIENTATION: (0.80, 0.47, 0.65),
    CauseKind.COLLISION: (0.20, 0.20, 0.20),
    CauseKind.DISCONNECTED: (0.94, 0.86, 0.20),
}
PAIRS: tuple[Colour, ...] = (  # of cells that a pair of bodies is in the way of, by pair
    (0.50, 0.10, 0.65),
    (0.10, 0.50, 0.50),
    (0.20, 0.20, 0.20),
    (0.55, 0.35, 0.17),
    (0.95, 0.45, 0.30),
    (0.35, 0.45, 0.85),
    (0.55, 0.62, 0.20),
    (0.60, 0.60, 0.60),
)
PATCHES: tuple[Colour, ...] = (
    (0.00, 0.45, 0.70),
    (0.90, 0.60, 0.00),
    (0.00, 0.62, 0.45),
    (0.80, 0.47, 0.65),
    (0.34, 0.71, 0.91),
    (0.84, 0.37, 0.00),
    (0.94, 0.86, 0.20),
    (0.45, 0.35, 0.65),
)
TRAIL_POINTS = 2_000
APPROACH: Colour = (0.10, 0.35, 0.80)
REFERENCE: Colour = (0.80, 0.25, 0.10)
ARROW = 0.3  # [1] of a cell's width, of the lines that show how the tool is to be held
LOST_SIZE = 0.16  # [1] of a cell's width, of a mark on a cell that is proved lost


@dataclass(frozen=True, slots=True)
class Layer:
    """One part of the picture."""

    commands: tuple[Command, ...]
    entry: Entry


def mesh_layer(
    label: str, colour: Colour, path: str, vertices: ArrayLike, faces: ArrayLike, **looks: Any
) -> Layer:
    """Triangles of one colour with a line of the legend; `looks` as in `threejs.mesh_object`."""
    command = threejs.mesh_object(path, vertices, faces, colour, **looks)
    return Layer((command,), Entry(label, colour, path))


def lines_layer(label: str, colour: Colour, path: str, ends: Array) -> Layer:
    """Line segments (..., 2, 3) m with a line of the legend."""
    command = threejs.segments(path, ends.reshape(-1, 3), colour)
    return Layer((command,), Entry(label, colour, path))


def layers(verdict: Verdict) -> list[Layer]:
    """Every part of the picture but the arm, in the order of the legend."""
    cells = verdict.cells
    if len(cells) == 0:
        return []
    missed = []
    sides = sides_of(verdict)
    for group in missed_groups(verdict.causes, np.flatnonzero(~verdict.covered)):
        layer = missed_layer(cells, group)
        # These cells are in the colour of their side.
        by_side = sides is not None and group.kind == CauseKind.DISCONNECTED
        missed.append(hidden(layer) if by_side else layer)
    parted = [] if sides is None else side_layers(cells, sides)
    return [
        *cells_layers(cells),
        *_frames(verdict),
        *_graph(verdict),
        *_start(verdict),
        *parted,
        *missed,
    ]


def side_layers(cells: Cells, sides: Sides) -> list[Layer]:
    """Cells in the colour of the side of a cut on which they are reached, and those proved lost."""
    parts = patch_layers(cells, sides.labels, sides.names, COLOURS, "/cut")
    lost = np.array(sides.lost, dtype=np.int64)
    dots = marks(cells.centres[lost], LOST_SIZE * cell_size(cells))
    return [*parts, mesh_layer(sides.lost_name, LOST, "/cut/proved", *dots, lit=False)]


def cells_layers(cells: Cells) -> list[Layer]:
    """The surface, shaded and half transparent, the borders of its cells, and their centres."""
    count, path = len(cells), "/surface/patch"
    if count == 0:
        return [Layer((), Entry("surface", SURFACE, path))]
    shape = split_at_creases(*joined(*patch(cells, np.arange(count))))
    grid = f" ({' x '.join(map(str, cells.shape))})" if len(cells.shape) > 1 else ""
    label, path_of_lines = counted(count, "cell") + grid, "/surface/cell outlines"
    parts = [
        mesh_layer("surface", SURFACE, path, *shape, opacity=0.45),
        lines_layer(label, OUTLINES, path_of_lines, borders(cells)),
    ]
    if count <= FULL_DETAIL:
        dots, path = marks(cells.centres, 0.035 * cell_size(cells)), "/surface/cell centres"
        parts.append(mesh_layer("cell centres", CENTRES, path, *dots, lit=False))
    return parts


def _frames(verdict: Verdict) -> Iterator[Layer]:
    """Where the tool's axes are to point at each cell's target, where that is not the normal alone.

    A line along the approach direction, and one along the reference that roll is measured from.
    """
    cells, task = verdict.cells, verdict.task
    points, approaches, references = task.targets(cells)
    length, path = ARROW * cell_size(cells), "/surface/approach directions"
    if references is not None or not task.along_normals(cells):
        # It ends at the target, and comes from where the tool is.
        ends = np.stack([points - length * approaches, points], axis=1)
        yield lines_layer("approach directions", APPROACH, path, ends)
    if references is not None and task.roll_deg is not None:
        path = "/surface/roll references"
        ends = np.stack([points, points + length * references], axis=1)
        label = "roll 0 (allowed {:g} to {:g} deg)".format(*task.roll_deg)
        yield lines_layer(label, REFERENCE, path, ends)


def patch_layers(
    cells: Cells,
    labels: Ints,
    names: Sequence[str],
    colours: Sequence[Colour] = PATCHES,
    root: str = "/patches",
) -> list[Layer]:
    """Cells filled with one colour for each label.

    Args:
        cells: the cells.
        labels: (N,) which of `names` each cell belongs to; -1 for none.
        names: one for each colour.
        colours: which are used in turn.
        root: where in the scene tree.
    """
    parts = []
    for k, name in enumerate(names):
        which, path = np.flatnonzero(labels == k), f"{root}/{threejs.safe_name(name)}"
        if len(which):
            parts.append(filled(cells, which, colours[k % len(colours)], path, name))
    return parts


def filled(
    cells: Cells,
    which: Ints,
    colour: Colour,
    path: str,
    label: str,
    inset: float = 0.06,
) -> Layer:
    """Some cells filled with a colour, smaller by `inset` of their size."""
    shape = patch(cells, which, inset=inset)
    return mesh_layer(label, colour, path, *shape, opacity=0.85, lit=False)


def drawn_lines(
    lines: Sequence[Array], radius: float, colour: Colour, path: str, label: str
) -> Layer:
    """Polylines, (k, 3) m each, as tubes."""
    return mesh_layer(label, colour, path, *tubes(lines, radius), lit=False)


def edge_lines(verdict: Verdict) -> Array:
    """The edges of G, in the order of `graph.edges`: lines (E, k, 3) m at the standoff.

    Each runs over the surface from target to target and shows that a motion joins the two cells.
    The motion itself may differ (the greedy search stops as soon as it has entered a cell).
    """
    cells = verdict.cells
    pairs = np.array(list(verdict.graph.edges), dtype=np.int64).reshape(-1, 2)
    keys = cells.pairs[:, 0] * len(cells) + cells.pairs[:, 1]
    curve = np.searchsorted(keys, pairs.min(axis=1) * len(cells) + pairs.max(axis=1))
    # The more cells, the shorter and straighter their edges.
    points = 2 if len(cells) > FULL_DETAIL else 5 if len(cells) > 400 else 9
    t = np.linspace(0.0, 1.0, points)
    backwards = (pairs[:, 0] > pairs[:, 1])[:, None]
    places = np.where(backwards, 1.0 - t, t)
    closest_point, normal = cells.curves.at(np.repeat(curve, len(t)), places.reshape(-1))
    height = cells.surface.side_sign * verdict.task.standoff
    return (closest_point + height * normal).reshape(len(pairs), len(t), 3)


@dataclass(frozen=True, eq=False, slots=True)
class Missed:
    """Cells that are missed for one reason."""

    kind: CauseKind | None
    """None where no cause is known."""
    pair: tuple[str, str] | None
    """The two bodies that are in the way, if that is known."""
    which: Ints
    """Flat indices of the cells."""
    colour: Colour

    @property
    def words(self) -> str:
        """The reason, with the bodies that are in the way."""
        words = "cause not known" if self.kind is None else self.kind.replace("_", " ")
        return words if self.pair is None else f"{words}: {' and '.join(self.pair)}"


def missed_groups(causes: Sequence[Cause], missed: Ints) -> list[Missed]:
    """Cells that are not covered, by cause, and by the pair of bodies that is in the way.

    Cells of one pair have a colour of their own.

    Args:
        causes: of the cells.
        missed: (k,) flat indices of the cells.
    """
    known = {cause.cell: (cause.kind, cause.pair) for cause in causes}
    groups: dict[tuple[CauseKind | None, tuple[str, str] | None], list[int]] = {}
    for cell in missed.tolist():
        groups.setdefault(known.get(cell, (None, None)), []).append(cell)
    kinds = [*CauseKind, None]
    found, pairs = [], 0
    for kind, pair in sorted(groups, key=lambda group: (kinds.index(group[0]), group[1] or ())):
        colour = MISSED if kind is None else CAUSES[kind]
        if pair is not None:
            colour, pairs = PAIRS[pairs % len(PAIRS)], pairs + 1
        found.append(Missed(kind, pair, np.array(groups[kind, pair], dtype=np.int64), colour))
    return found


def _graph(verdict: Verdict) -> Iterator[Layer]:
    """Graph G: one line for each edge."""
    lines = edge_lines(verdict)
    if len(lines) == 0:
        return
    path = f"/graph/edges of G ({len(lines)})"
    label = f"{len(lines)} edges of G (of {len(verdict.cells.pairs)} pairs)"
    if len(verdict.cells) <= FULL_DETAIL:
        yield drawn_lines(list(lines), 0.022 * cell_size(verdict.cells), EDGES, path, label)
    else:
        ends = np.stack([lines[:, :-1], lines[:, 1:]], axis=2)
        yield lines_layer(label, EDGES, path, ends)


def _start(verdict: Verdict) -> Iterator[Layer]:
    """A ball at the target of the cell where the search starts."""
    if verdict.start is None:
        return
    import trimesh

    path = f"/graph/start, cell {verdict.start}"
    ball = trimesh.creation.icosphere(subdivisions=2, radius=0.1 * cell_size(verdict.cells))
    centre = verdict.task.targets(verdict.cells).points[verdict.start]
    yield mesh_layer("start cell", START, path, ball.vertices + centre, ball.faces)


def missed_layer(cells: Cells, group: Missed) -> Layer:
    """Some cells in the colour of what they are missed for."""
    words = "not covered" if group.kind is None else f"not covered: {group.words}"
    number = len(group.which)
    label = f"{words} ({number if group.pair is None else counted(number, 'cell')})"
    path = f"/cells/{label}"
    if group.pair is not None:  # names of any length: the first cell tells two groups apart
        path = f"/cells/{group.which[0]} {threejs.safe_name(label)}"
    return filled(cells, group.which, group.colour, path, label)


def hidden(layer: Layer) -> Layer:
    """The same part, shown only when the reader asks for it."""
    path = layer.entry.path
    if path is None:
        return layer
    command = threejs.set_property(path, "visible", False)
    entry = replace(layer.entry, shown=False)
    return replace(layer, commands=(*layer.commands, command), entry=entry)


def trail(cells: Cells, motion: Playback) -> Layer:
    """The path of the tool point in the motion that is played.

    A covering motion runs along most edges of G, so it is hidden at first.
    """
    path = f"/motion/tool path, {motion.label}"
    even = np.linspace(0.0, motion.seconds[-1], TRAIL_POINTS)
    label = f"tool path: {motion.label}"
    layer = drawn_lines([motion.tool_at(even)], 0.035 * cell_size(cells), TRAIL, path, label)
    return layer if motion.there_and_back else hidden(layer)
