"""Pictures of passes: the surface itself, passes with their numbers, and the area behind the tool.

from coverable import view_passes
view_passes(along, [path], treated, trajectory).save_html("passes.html")
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from coverable.arrays import Array
from coverable.errors import counted
from feasibility.demands.area import TreatedArea
from feasibility.demands.treated_words import share_words
from feasibility.division.pass_planning import PlannedPasses
from feasibility.paths.coverage import CoveragePath
from feasibility.timing.sampled_trajectory import Trajectory
from feasibility.timing.speed_limits import MotionLimits
from feasibility.viewer import robot_visuals
from feasibility.viewer.path_and_division import painting, trail_pieces
from feasibility.viewer.playback import Playback, paced, timed
from feasibility.viewer.treated_map import painted_layers, surface_layer
from feasibility.viewer.verdict_scene import MISSED, OUTLINES, PATCHES, Layer, drawn_lines
from feasibility.viewer.viewer import View, compose, titled
from robots.robot import Robot
from surfaces.passes.pass_stretches import Pass
from surfaces.passes.triangulation import working_mesh

WIDTH = 0.5  # [1] of the height
GAP = 0.25  # [1] of the height, between digits
_CORNERS = {"a": (0, 2), "b": (1, 2), "c": (0, 1), "d": (1, 1), "e": (0, 0), "f": (1, 0)}
_DIGITS = (
    "abfeca", "bf", "abdcef", "abdcdfe", "acdbf", "bacdfe", "bacefdc", "abf", "cabfecd", "dcabfe",
)  # fmt: skip
"""Strokes from corner to corner: top a b, middle c d, bottom e f."""


def digit_lines(number: int, middle: Array, along: Array, up: Array) -> list[Array]:
    """Polylines (k, 3) m of a number.

    Args:
        number: at least 0.
        middle: (3,) m, of the number.
        along: (3,) unit, the direction in which it is read.
        up: (3,) m, the height of a digit.
    """
    height, lines = float(np.linalg.norm(up)), []
    wide = (len(str(number)) * (WIDTH + GAP) - GAP) * height
    origin = middle - 0.5 * (wide * along + up)
    for place, digit in enumerate(str(number)):
        corners = np.array([_CORNERS[name] for name in _DIGITS[int(digit)]], dtype=float)
        x = (WIDTH * corners[:, 0] + place * (WIDTH + GAP)) * height
        lines.append(origin + x[:, None] * along + 0.5 * corners[:, 1:] * up)
    return lines


THIN = 0.03  # [1] of the distance between passes: radius of their lines
TALL = 0.5  # [1] of it: height of their numbers
BEFORE = 0.15  # [1] of it: from a number to its pass
UPRIGHT = np.array([-1.0, 1.0, 3.0])  # upwards, or away from where the page looks from


def view_passes(
    along: PlannedPasses,
    paths: Sequence[CoveragePath],
    treated: TreatedArea | None = None,
    trajectory: Trajectory | None = None,
    case: str | None = None,
    limits: MotionLimits | None = None,
) -> View:
    """The arm along passes, and the area that it treats painted behind the tool.

    Args:
        along: the passes.
        paths: the motion along all of them, or several that work on a part each.
        treated: what they treat, where there is a footprint.
        trajectory: of a single path; played as fast as it is, or in a minute if it takes longer.
        case: name of the case, for the title.
        limits: of the timing: where the task has a speed, the tool's trail is coloured by how much
            of them the joints use.
    """
    robot, passes = along.verdict.robot, along.passes
    motion = _motion(robot, paths, trajectory)
    mesh = working_mesh(passes.surface, passes.spacing) if treated is None else treated.mesh
    parts, tracks = [surface_layer(mesh)], list[dict[str, Any]]()
    if treated is not None and motion is not None:
        side, height = passes.surface.side_sign, along.task.standoff
        painted = painted_layers(treated, side, motion, height)
        parts, tracks = [*parts, *painted.layers], painted.tracks
    if trajectory is not None and motion is not None and limits and along.task.speed is not None:
        trail, more = trail_pieces(
            motion, 2.0 * THIN * passes.spacing, *painting(trajectory, motion, limits)
        )
        parts, tracks = [*parts, *trail], [*tracks, *more]
    parts += _pass_layers(along, paths)
    count = counted(passes.count, "pass", "passes")
    runs = "one motion" if len(paths) == 1 else f"{len(paths)} motions"
    runs += " over a part" if _left_out(along, paths) else ""
    text = f"{robot.name}: {count}, {1e3 * passes.spacing:.4g} mm apart, {passes.length:.4g} m"
    if treated is not None:
        text += f"; treated {share_words(treated)} of the area"
    if trajectory is not None:
        text += f"; {trajectory.duration:.1f} s"
    return compose(
        robot, along.cells, titled(f"{count} in {runs}", case), text, parts, motion,
        resting=robot_visuals.home(robot) if motion is None else motion.walk[0], tracks=tracks,
        task=along.task,
    )  # fmt: skip


def _motion(
    robot: Robot, paths: Sequence[CoveragePath], trajectory: Trajectory | None
) -> Playback | None:
    """What is played: the trajectory, or all paths in even time, with the moves between them."""
    if trajectory is None:
        walks = [path.walk.q for path in paths]
        return paced(robot, np.concatenate(walks), False, "passes") if walks else None
    return timed(robot, trajectory, "passes")


def _pass_layers(along: PlannedPasses, paths: Sequence[CoveragePath]) -> list[Layer]:
    """Passes as lines, those of each run in a colour of their own, and their numbers."""
    places, spacing = along.places, along.passes.spacing
    layers = []
    for number, path in enumerate(paths):
        colour = PATCHES[number % len(PATCHES)]
        lines = []
        for stretch in range(len(along.passes.stretches)):
            own = (places.stretch == stretch) & path.needed
            if own.sum() > 1:
                lines.append(places.points[own])
        label = "passes" if len(paths) == 1 else f"run {number + 1}"
        if lines:
            layers.append(drawn_lines(lines, THIN * spacing, colour, f"/passes/{label}", label))
    left = _left_out(along, paths)
    if left:
        layers.append(drawn_lines(left, THIN * spacing, MISSED, "/passes/left", "left out"))
    digits = [line for each in along.passes.stretches for line in _number(each, along)]
    layers.append(drawn_lines(digits, THIN * spacing, OUTLINES, "/passes/numbers", "numbers"))
    return layers


def _left_out(along: PlannedPasses, paths: Sequence[CoveragePath]) -> list[Array]:
    """Lines (k, 3) m of the parts of passes on which no path works."""
    places, worked = along.places, np.zeros(len(along.cells) - 1, dtype=bool)
    for path in paths:
        own = np.flatnonzero(path.needed)
        worked[own[0] : own[-1]] = True
    stretch = places.stretch
    open_ = ~worked & (stretch[1:] == stretch[:-1]) & (stretch[1:] >= 0)
    parted = np.diff(stretch[:-1], prepend=-2) != 0
    begins = np.flatnonzero(open_ & (parted | ~np.append(False, open_[:-1])))
    lines = []
    for first in begins.tolist():
        last = first
        while last < len(open_) and open_[last] and stretch[last] == stretch[first]:
            last += 1
        lines.append(places.points[first : last + 1])
    return lines


def _number(each: Pass, along: PlannedPasses) -> list[Array]:
    """The number of a pass before the beginning of a stretch, upright on the tool's side."""
    spacing, side = along.passes.spacing, along.passes.surface.side_sign
    heading = each.points[1] - each.points[0]
    heading = heading / max(float(np.linalg.norm(heading)), 1e-300)
    up = heading if heading @ UPRIGHT >= 0.0 else -heading
    reading = np.cross(up, side * each.normals[0])
    name, height = each.level + 1, TALL * spacing
    middle = each.points[0] - (BEFORE * spacing + 0.5 * height) * heading
    return digit_lines(name, middle, reading, height * up)
