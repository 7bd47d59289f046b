"""The parts of a picture of poses: outlines in classes, the best one in full, stations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from feasibility.placement import Pose, Stage, Trial, moved_cells
from feasibility.viewer import threejs
from feasibility.viewer.html_page import Entry
from feasibility.viewer.outline import outline, placed
from feasibility.viewer.playback import Motion
from feasibility.viewer.robot_meshes import tubes
from feasibility.viewer.scene import (
    MISSED,
    PATCHES,
    Layer,
    cells_layers,
    counted,
    filled,
    hidden,
    trail,
)
from feasibility.viewer.threejs import Colour
from surfaces import Cells

if TYPE_CHECKING:
    from feasibility.placement import StationPlan
    from feasibility.studies import Row

Array = NDArray[np.float64]

MOST_DRAWN = 200  # poses drawn of one class; of more, as many spread evenly over their ranks
FULL_SIZE = 16  # poses up to which outlines are drawn in full size
SMALLEST = 0.15  # [1] of their size
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
    UNSEARCHED = "ruled out without a search"
    FAILED = "could not be tried"


# Distinct for colour-blind readers too; feasible outlines are also thick.
COLOURS: dict[Class, Colour] = {
    Class.FEASIBLE: (0.00, 0.50, 0.36),
    Class.WHOLE: (0.34, 0.71, 0.91),
    Class.MOST: (0.23, 0.05, 0.60),
    Class.HALF: (0.70, 0.10, 0.50),
    Class.SOME: (0.90, 0.42, 0.25),
    Class.LITTLE: (0.95, 0.74, 0.20),
    Class.UNSEARCHED: (0.62, 0.62, 0.62),
    Class.FAILED: (0.15, 0.15, 0.15),
}
HIDDEN = (Class.UNSEARCHED, Class.FAILED)


@dataclass(frozen=True, eq=False, slots=True)
class Tried:
    """A pose that was tried, as it is drawn."""

    pose: Pose
    kind: Class
    cover: NDArray[np.bool_] | None
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
    if trial.feasible:
        return Class.FEASIBLE
    if trial.stage is Stage.FAILED:
        return Class.FAILED
    if trial.stage in (Stage.BOUND, Stage.PROBE):
        return Class.UNSEARCHED
    return class_of_share(trial.share)


def class_of_row(row: Row) -> Class:
    """The class of a row of a study of verdicts."""
    if row.status == "failed" or "share" not in row.result:
        return Class.FAILED
    if row.result["verdict"] == "feasible":
        return Class.FEASIBLE
    return class_of_share(float(row.result["share"]))


def best_layers(cells: Cells, best: Tried, motion: Motion | None) -> list[Layer]:
    """The best placement as a surface with its cells, what is covered there, and the tool's path.

    Args:
        cells: at the best placement.
        best: its outcome.
        motion: that covers it, or None.
    """
    if len(cells) == 0:
        return []
    surface, *marks = cells_layers(cells)
    label = "the surface at one of the poses" if best.kind in HIDDEN else "the best of them"
    parts = [replace(surface, entry=replace(surface.entry, label=label)), *marks]
    if best.cover is not None and not best.cover.all() and best.kind is not Class.FEASIBLE:
        for words, colour, which in (
            ("covered there in one motion", COVERED, np.flatnonzero(best.cover)),
            ("not covered there", MISSED, np.flatnonzero(~best.cover)),
        ):
            if len(which):
                path = f"/best/{words}"
                command = filled(cells, which, colour, path)
                entry = Entry(f"{words} ({counted(len(which))})", colour, path)
                parts.append(Layer((command,), entry, len(which)))
    if motion is not None:
        parts.append(trail(cells, motion))
    return parts


def station_layers(cells: Cells, plan: StationPlan) -> list[Layer]:
    """The surface at each station, with the cells given to it."""
    parts, lines = [], outline(cells)
    for k, (station, trial) in enumerate(zip(plan.stations.stations, plan.trials, strict=True)):
        colour = PATCHES[k % len(PATCHES)]
        root = f"/stations/station {k + 1}"
        there = moved_cells(cells, trial.pose)
        commands = (
            filled(there, station.cells, colour, f"{root}/cells"),
            threejs.segments(f"{root}/outline", placed(lines, trial.pose).reshape(-1, 3), colour),
        )
        entry = Entry(f"station {k + 1} ({counted(len(station.cells))})", colour, root)
        parts.append(Layer(commands, entry, len(station.cells)))
    return parts


def class_layers(lines: Array, tried: Sequence[Tried]) -> list[Layer]:
    """One layer for each class of poses: the outlines of at most `MOST_DRAWN` of them.

    Args:
        lines: (k, 2, 3) m, what is drawn at every pose, in the surface's frame.
        tried: the poses.
    """
    parts = []
    for kind in Class:
        poses = [one.pose for one in tried if one.kind is kind]
        if not poses or len(lines) == 0:
            continue
        some = _spread(poses)
        number = (
            str(len(poses)) if len(some) == len(poses) else f"{len(some)} of {len(poses)} drawn"
        )
        path = f"/poses/{threejs.safe_name(kind)}"
        if kind is Class.FEASIBLE:
            command = _thick(path, lines, some, COLOURS[kind])
        else:
            every = np.concatenate([placed(lines, pose) for pose in some])
            command = threejs.segments(path, every.reshape(-1, 3), COLOURS[kind])
        layer = Layer((command,), Entry(f"{kind} ({number})", COLOURS[kind], path), len(poses))
        parts.append(hidden(layer) if kind in HIDDEN else layer)
    return parts


def drawn_size(tried: Sequence[Tried]) -> float:
    """How large outlines are drawn, 0..1 of their size: the more there are, the smaller."""
    shown = sum(
        min(sum(one.kind is kind for one in tried), MOST_DRAWN)
        for kind in Class
        if kind not in HIDDEN
    )
    return float(np.clip(np.sqrt(FULL_SIZE / max(shown, 1)), SMALLEST, 1.0))


def _spread(poses: Sequence[Pose]) -> list[Pose]:
    """All poses, or `MOST_DRAWN` of them at even distances, the first one among them."""
    chosen = np.unique(np.linspace(0, len(poses) - 1, min(len(poses), MOST_DRAWN)).round())
    return [poses[int(k)] for k in chosen]


def _thick(path: str, lines: Array, poses: Sequence[Pose], colour: Colour) -> threejs.Command:
    """Segments (k, 2, 3) m as tubes, at every pose."""
    size = float(np.linalg.norm(np.ptp(lines.reshape(-1, 3), axis=0)))
    vertices, faces = tubes(list(lines), THICK * size, sides=4)
    every = np.concatenate([placed(vertices, pose) for pose in poses])
    first = len(vertices) * np.arange(len(poses))[:, None, None]
    return threejs.mesh(path, every, (faces + first).reshape(-1, 3), colour, lit=False)
