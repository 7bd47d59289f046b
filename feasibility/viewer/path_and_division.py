"""Pictures of a coverage path, with the trail of the tool, and of the patches of a division.

from coverable import view_path
view_path(path, trajectory).save_html("path.html")
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from coverable.arrays import Array
from coverable.errors import counted
from feasibility.demands.area import TreatedArea
from feasibility.demands.treated_words import share_words
from feasibility.viewer import robot_visuals, threejs
from feasibility.viewer.cell_meshes import cell_size
from feasibility.viewer.html_page import Entry
from feasibility.viewer.meshes import tubes
from feasibility.viewer.playback import Playback, paced, timed
from feasibility.viewer.threejs import Colour
from feasibility.viewer.treated_map import painted_layers
from feasibility.viewer.verdict_scene import (
    TRAIL,
    Layer,
    cells_layers,
    drawn_lines,
    missed_groups,
    missed_layer,
    patch_layers,
)
from feasibility.viewer.viewer import View, compose, titled
from robots.kinematics import Kinematics
from robots.robot import Robot

if TYPE_CHECKING:
    from feasibility.division.division import Division
    from feasibility.division.reconfiguration import Reconfiguration
    from feasibility.paths.coverage import CoveragePath
    from feasibility.timing.sampled_trajectory import Trajectory
    from feasibility.timing.speed_limits import MotionLimits

RECONFIGURED: Colour = (0.80, 0.05, 0.05)
BANDS: tuple[tuple[float, Colour, str], ...] = (
    (0.5, (0.10, 0.55, 0.25), "joints below half of their velocities"),
    (0.9, (0.95, 0.70, 0.10), "joints at 50 to 90 % of them"),
    (np.inf, (0.80, 0.10, 0.10), "joints above 90 % of them"),
)  # share of the velocity limits, colour and words of a piece of the trail
STROKES = 160  # pieces of the trail that appear one after the other
DENSE = 24  # points drawn of one move between patches
FEW = 2  # joints of a move that the legend names


def view_path(
    path: CoveragePath,
    trajectory: Trajectory | None = None,
    case: str | None = None,
    limits: MotionLimits | None = None,
    treated: TreatedArea | None = None,
) -> View:
    """The arm along a path, and the trail of the tool growing behind it.

    Args:
        path: the path.
        trajectory: its timing; played as fast as it is, or in a minute if it takes longer. Without
            one the tool travels evenly.
        case: name of the case, for the title.
        limits: of the timing: where the task has a speed, the trail is coloured by how much of
            them the joints use.
        treated: what it treats, where there is a footprint; painted behind the tool too.
    """
    robot, cells, figures = path.robot, path.cells, path.figures
    count = int(path.needed.sum())
    if trajectory is None:
        motion = paced(robot, path.walk.q, False, "coverage path")
        speed = "not timed"
    else:
        motion = timed(robot, trajectory, "coverage path")
        speed = f"{trajectory.duration:.1f} s"
    times, use = painting(trajectory, motion, limits if path.task.speed is not None else None)
    strokes, tracks = trail_pieces(motion, 0.06 * cell_size(cells), times, use)
    if treated is not None:
        side = cells.surface.side_sign
        painted = painted_layers(treated, side, motion, path.task.standoff)
        strokes, tracks = [*painted.layers, *strokes], [*painted.tracks, *tracks]
    again = f", {figures.revisited:.2g} m of it revisited" if figures.revisited > 0.0 else ""
    text = (
        f"{robot.name}: {counted(count, 'cell')} in order {path.order}, "
        f"{figures.length:.2f} m{again}, {speed}"
    )
    if treated is not None:
        text += f"; treated {share_words(treated)} of the area"
    title = titled(f"feasible, one path over {counted(count, 'cell')}", case)
    drawn = compose(
        robot, cells, title, text, [*cells_layers(cells), *strokes], motion,
        resting=path.walk.q[0], tracks=tracks, task=path.task,
    )  # fmt: skip
    if trajectory is None or drawn.readout is None:
        return drawn
    return replace(drawn, readout=replace(drawn.readout, duration=trajectory.duration))


def view_division(division: Division, case: str | None = None) -> View:
    """The patches, and the moves between them in red.

    Args:
        division: the division.
        case: name of the case, for the title.
    """
    robot, cells = division.robot, division.cells
    names = [
        f"patch {k + 1} ({counted(len(patch.cells), 'cell')})"
        for k, patch in enumerate(division.patches)
    ]
    parts = [*cells_layers(cells), *patch_layers(cells, division.patch_of(len(cells)), names)]
    parts += _left_out(division)
    walks = [patch.walk.q for patch in division.patches if len(patch.walk.q)]
    motion = None
    if walks:
        legs = [walks[0]]
        for move, walk in zip(division.moves, walks[1:], strict=True):
            legs += [_along(move, DENSE)[1:-1], walk]
        motion = paced(robot, np.concatenate(legs), False, "all patches")
        size = cell_size(cells)
        for k, move in enumerate(division.moves):
            parts.append(_move(robot, move, f"{k + 1} to {k + 2}", size))
    patches = counted(len(division.patches), "patch", "patches")
    title = f"{division.n_covered} of {counted(len(cells), 'cell')}: {patches}"
    if division.n_covered < len(cells):
        title += f", {len(cells) - division.n_covered} left out"
    text = f"{robot.name}; " + "; ".join(
        f"move {k + 1} to {k + 2}: {move.described(FEW)}{' (not clear)' if move.refusal else ''}"
        for k, move in enumerate(division.moves)
    )
    return compose(
        robot, cells, titled(title, case), text.rstrip("; "),
        parts, motion, resting=walks[0][0] if walks else robot_visuals.home(robot),
        task=division.task,
    )  # fmt: skip


def painting(
    trajectory: Trajectory | None, motion: Playback, limits: MotionLimits | None
) -> tuple[tuple[float, float], Array | None]:
    """When the tool is over the surface, s, and the share (k,) of their velocities that joints use.

    Entry and exit leave no trail. None in place of the shares without limits.
    """
    end = float(motion.seconds[-1])
    if trajectory is None or len(trajectory) < 2:
        return (0.0, end), None
    over = trajectory.time[trajectory.cell >= 0] - trajectory.time[0]
    played = end / trajectory.duration
    times = (float(over.min()) * played, float(over.max()) * played) if len(over) else (0.0, end)
    if limits is None:
        return times, None
    at = (trajectory.time - trajectory.time[0]) * played
    used = (np.abs(trajectory.dq) / limits.velocity).max(axis=1)
    return times, np.interp(motion.seconds, at, used)


def trail_pieces(
    motion: Playback,
    radius: float,
    when: tuple[float, float],
    use: Array | None = None,
) -> tuple[list[Layer], list[dict[str, Any]]]:
    """The tool's trail in pieces, and the tracks that show each when the tool has passed.

    Args:
        motion: what is played.
        radius: m, of the trail.
        when: s, between which there is one.
        use: (k,) of the joints' velocities, by which it is coloured; None for one colour.
    """
    end, root = float(motion.seconds[-1]), "/motion/painted trail"
    bands = [(np.inf, TRAIL, "painted trail", root)]
    if use is not None:
        bands = [(most, colour, name, f"{root}, {name}") for most, colour, name in BANDS]
    edges = np.linspace(*when, STROKES + 1)
    commands: list[list[Any]] = [[] for _ in bands]
    tracks = []
    for k, (start, stop) in enumerate(pairwise(edges)):
        inside = (motion.seconds > start) & (motion.seconds < stop)
        times = np.concatenate([[start], motion.seconds[inside], [stop]])
        vertices, faces = tubes([motion.tool_at(times)], radius)
        if len(faces) == 0:
            continue
        most = 0.0 if use is None else float(np.interp(times, motion.seconds, use).max())
        band = next(j for j, one in enumerate(bands) if most <= one[0])
        path = f"{bands[band][3]}/{k:03d}"
        commands[band].append(threejs.mesh_object(path, vertices, faces, bands[band][1], lit=False))
        tracks.append(threejs.appearing(path, stop, end))
    layers = [
        Layer(tuple(made), Entry(name, colour, path))
        for made, (_, colour, name, path) in zip(commands, bands, strict=True)
        if made
    ]
    return layers, tracks


def _along(move: Reconfiguration, count: int) -> Array:
    """(k, n) rad or m, configurations along a move: its waypoints, and others in between."""
    rows = move.waypoints
    dense = max(2, -(-count // (len(rows) - 1)) + 1)
    share = np.linspace(0.0, 1.0, dense)[:-1, None]
    legs = [a + share * (b - a) for a, b in pairwise(rows)]
    return np.concatenate([*legs, rows[-1:]])


def _move(robot: Robot, move: Reconfiguration, name: str, size: float) -> Layer:
    """The path of the tool in a move between patches."""
    line, _ = Kinematics(robot).tools(_along(move, 4 * DENSE))
    label = f"move from patch {name}"
    return drawn_lines([line], 0.05 * size, RECONFIGURED, f"/motion/{label}", label)


def _left_out(division: Division) -> list[Layer]:
    """Cells in no patch, by cause."""
    missed = [*(cause.cell for cause in division.left_out), *division.unsettled.tolist()]
    groups = missed_groups(division.left_out, np.array(missed, dtype=np.int64))
    return [missed_layer(division.cells, group) for group in groups]
