"""The picture of a verdict: the arm at work over the surface, in a file, a notebook or a window.

    from feasibility.viewer import show
    show(verdict)

Nothing but other views, reports and commands imports the viewer.
"""

from __future__ import annotations

import base64
import html
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from feasibility.collisions import Collision, checked_words
from feasibility.cut_words import sentence
from feasibility.verdict import Verdict
from feasibility.viewer import robot as robot_visuals
from feasibility.viewer import threejs
from feasibility.viewer.html_page import Camera, Entry, Legend, Readout, page
from feasibility.viewer.live_server import LiveView
from feasibility.viewer.playback import Motion, animate, motion_of
from feasibility.viewer.readout import readout_of
from feasibility.viewer.scene import Layer, counted, layers, trail
from feasibility.viewer.threejs import Command
from robots import Robot
from surfaces import Cells

Array = NDArray[np.float64]

ARM: threejs.Colour = (0.35, 0.37, 0.40)
THICKNESS = 0.12  # [1] of the reach: by how much links may stand out beyond their joints
FRAMED = 0.34  # [rad]: half the angle that arm and surface fill, of a lens of 42 degrees


@dataclass(frozen=True, eq=False, slots=True)
class View:
    """A verdict drawn: save it, serve it, or let a notebook show it."""

    robot: Robot
    commands: tuple[Command, ...]
    """Drawing commands of the page, in order."""
    legend: Legend
    camera: Camera
    motion: Motion | None
    """What the arm plays."""
    notes: tuple[str, ...]
    """What could not be drawn as the URDF says."""
    readout: Readout | None = None
    """Values beside the time slider; None where the arm does not move."""
    start: float = 0.0
    """s, where a motion waits that does not play at once."""

    def html(self) -> str:
        """One self-contained page; it fetches nothing and needs no server."""
        return page(self.commands, self.legend, self.camera, self.readout, self.start)

    def save_html(self, path: str | os.PathLike[str]) -> Path:
        """Write the page to a file and return its path."""
        file = Path(path)
        file.write_text(self.html(), encoding="utf-8")
        return file

    def show(self, open_browser: bool = True) -> LiveView:
        """Serve the page on 127.0.0.1 until the result is closed or this program ends."""
        live = LiveView(self.html())
        if open_browser:
            live.open()
        return live

    def image(self, width: int = 900, height: int = 560) -> Array:
        """The picture as it is at first, painted without a browser: (height, width, 3), 0..1."""
        from feasibility.viewer.painter import painted

        return painted(self.commands, self.camera, width, height)

    def png(self) -> bytes:
        """That picture with title and legend, as PNG."""
        from feasibility.viewer.view_figures import plot_view, small_png

        return small_png(plot_view(self))

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        """The page inside a notebook's output, and a picture for where it is not shown.

        A notebook that is not trusted, a printed one and one on GitHub show the picture.
        """
        picture = base64.b64encode(self.png()).decode("ascii")
        inner = html.escape(self.html(), quote=True)
        page = _BESIDE.format(picture=picture, page=inner)
        return {"text/plain": repr(self), "text/html": page, "image/png": picture}

    def __repr__(self) -> str:
        """One line, for consoles."""
        return f"View({self.legend.title!r}: {self.legend.text})"


# The page covers the picture; where frames are dropped or printed, the picture is left.
_BESIDE = """<style>@media print {{ .coverable-view iframe {{ display: none; }} }}</style>
<div class="coverable-view" style="position: relative; min-height: 560px">
<img src="data:image/png;base64,{picture}" style="max-width: 100%; height: 560px">
<iframe srcdoc="{page}" loading="lazy"
 style="position: absolute; inset: 0; width: 100%; height: 560px; border: 0; background: #fff">
</iframe></div>"""


def view(verdict: Verdict, case: str | None = None, *, play: bool = True, at: float = 0.0) -> View:
    """Draw a verdict.

    Args:
        verdict: of either method.
        case: name of the case, for the title.
        play: start the motion when the page opens; else the reader starts it.
        at: share of the motion, 0 to 1, at which the arm waits when `play` is False.

    Raises:
        ValueError: the verdict's own motions do not join.
    """
    motion = motion_of(verdict)
    parts = layers(verdict)
    if motion is not None:
        parts.append(trail(verdict.cells, motion))
    covered = f"{verdict.n_covered} of {counted(len(verdict.cells))}"
    text = f"{verdict.robot.name}: {covered} in one continuous motion ({verdict.method} search)"
    if verdict.proof is not None:
        said = sentence(verdict.proof, verdict.robot, verdict.cells)
        text += f". Proved: {said}."
    return compose(
        verdict.robot,
        verdict.cells,
        titled(f"{verdict.answer} ({verdict.evidence}), {covered}", case),
        text,
        parts,
        motion,
        resting=_resting(verdict),
        play=play,
        at=at,
        collision=verdict.task.collision,
    )


def compose(
    robot: Robot,
    cells: Cells,
    title: str,
    text: str,
    parts: Sequence[Layer],
    motion: Motion | None,
    *,
    resting: Array,
    tracks: Sequence[dict[str, Any]] = (),
    play: bool = True,
    at: float = 0.0,
    collision: Collision | None = None,
) -> View:
    """Put arm, ground and parts into one picture.

    Args:
        robot: the arm.
        cells: what it works on; the camera frames both.
        title: of the legend.
        text: below it.
        parts: what is drawn, in the order of the legend.
        motion: what the arm plays, or None.
        resting: (n,) its configuration otherwise.
        tracks: what else moves with it, see `threejs.track`.
        play: start the motion when the page opens.
        at: share of the motion, 0 to 1, at which the arm waits when `play` is False.
        collision: what was checked.
    """
    drawing = robot_visuals.draw(robot)
    commands = ground(robot, cells, drawing.lowest) + list(drawing.commands)
    entries = [Entry(robot.name, ARM, robot_visuals.ROOT)]
    for part in parts:
        commands += part.commands
        entries.append(part.entry)
    q, readout, start = resting, None, 0.0
    if motion is not None:
        readout, start = readout_of(robot, cells, motion), float(at * motion.seconds[-1])
        commands.append(animate(robot, motion, play=play, tracks=tracks))
        q = motion.at(np.array([start]))[0]
    commands += robot_visuals.pose(robot, q)
    said = checked_words(collision)
    return View(
        robot=robot,
        commands=tuple(commands),
        legend=Legend(title, " · ".join([text, *drawing.notes]), tuple(entries), said),
        camera=camera_on(robot, cells, q, drawing.lowest),
        motion=motion,
        notes=drawing.notes,
        readout=readout,
        start=start,
    )


def show(
    verdict: Verdict, case: str | None = None, *, block: bool | None = None
) -> View | LiveView:
    """Show a verdict: in the notebook's output, else in a browser window.

    Args:
        verdict: of either method.
        case: name of the case, for the title.
        block: wait until interrupted; by default only a script waits, since the window's page is
            served by this program and ends with it.

    Returns:
        In a notebook the view, which the notebook displays; else what serves the window.
    """
    drawn = view(verdict, case)
    if _in_notebook():
        return drawn
    live = drawn.show()
    if block or (block is None and not hasattr(sys, "ps1")):
        try:
            live.wait()
        except KeyboardInterrupt:
            live.close()
    return live


def _in_notebook() -> bool:
    """True where a Jupyter kernel runs this."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and getattr(ipython.get_ipython(), "kernel", None) is not None


def titled(title: str, case: str | None) -> str:
    """A title with the name of the case, where it has one."""
    return f"{case}: {title}" if case else title


def _resting(verdict: Verdict) -> Array:
    """A configuration for an arm that does not move: over the start cell if one is known."""
    nodes = verdict.graph.nodes(data="q")
    for _, q in sorted(nodes, key=lambda node: (node[0] != verdict.start, node[0])):
        if q is not None:
            return np.asarray(q, dtype=float)
    return robot_visuals.home(verdict.robot)


def ground(robot: Robot, cells: Cells, floor: float) -> list[Command]:
    """Background, a ground grid at the height of the lowest thing, and the root frame's axes."""
    box = _extent(cells)
    size = max(robot.reach if np.isfinite(robot.reach) else 1.0, 0.2)
    spacing = _round_below(size / 5.0)
    extent = np.abs(box[:, :2]).max(initial=size)
    half = spacing * np.ceil(extent / spacing)
    lines = np.arange(-half, half + spacing / 2.0, spacing)
    z = min(floor, float(box[:, 2].min(initial=0.0)))
    ends = [[(x, -half, z), (x, half, z), (-half, x, z), (half, x, z)] for x in lines]
    axis = 0.25 * size
    frame = [(0, 0, 0), (axis, 0, 0), (0, 0, 0), (0, axis, 0), (0, 0, 0), (0, 0, axis)]
    colours = np.repeat([(0.85, 0.1, 0.1), (0.1, 0.65, 0.1), (0.1, 0.2, 0.9)], 2, axis=0)
    return [
        threejs.set_property("/Background", "top_color", [1.0, 1.0, 1.0]),
        threejs.set_property("/Background", "bottom_color", [0.93, 0.95, 0.97]),
        threejs.set_property("/Grid", "visible", False),
        threejs.set_property("/Axes", "visible", False),
        threejs.segments("/ground", np.reshape(ends, (-1, 3)), (0.78, 0.80, 0.83)),
        threejs.segments("/root frame", np.array(frame), (0, 0, 0), colours=colours),
    ]


def _round_below(value: float) -> float:
    """The largest of 1, 2.5 and 5 times a power of ten that is at most `value`."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step * power for step in (1.0, 2.5, 5.0) if step * power <= value))


def camera_on(robot: Robot, cells: Cells, q: Array, floor: float) -> Camera:
    """Look at arm and surface from the tool's side, a little from above.

    Args:
        robot: the arm.
        cells: what it works on.
        q: (n,) its configuration.
        floor: m, height of the ground.
    """
    # Links are thick, and reach beyond their joints.
    thick = THICKNESS * robot.reach if np.isfinite(robot.reach) else 0.0
    round_joints = np.vstack([np.eye(3), -np.eye(3)]) * thick
    links = (joint_points(robot, q)[:, None] + round_joints).reshape(-1, 3)
    points = np.concatenate([_extent(cells), links, [[0.0, 0.0, floor]]])
    toward = np.zeros(3)
    if len(cells):
        toward = cells.surface.side_sign * cells.normals.mean(axis=0)
    heading = np.arctan2(toward[1], toward[0]) if np.hypot(*toward[:2]) > 0.1 else -np.pi / 3.0
    heading, height = heading + np.radians(25.0), np.radians(24.0)
    level = np.cos(height)
    direction = np.array([np.cos(heading) * level, np.sin(heading) * level, np.sin(height)])
    return framing(points, direction)


def framing(points: Array, direction: Array, near: float = 1.0) -> Camera:
    """A camera that has points (k, 3) m in its picture.

    Args:
        points: what is to be seen.
        direction: (3,) unit, from the points to the camera.
        near: 1 where a ball around all points fills `FRAMED`; less comes nearer.
    """
    target = (points.min(axis=0) + points.max(axis=0)) / 2.0
    radius = max(float(np.linalg.norm(points - target, axis=1).max()), 0.1)
    eye = target + near * radius / np.sin(FRAMED) * direction
    return Camera(tuple(target.tolist()), tuple(eye.tolist()))


def joint_points(robot: Robot, walk: ArrayLike) -> Array:
    """The joints (m n, 3) m of the arm at configurations (m, n) or (n,)."""
    placements = robot_visuals.joint_placements(robot, walk)
    place, points = np.eye(4), []
    for step in placements.transpose(1, 0, 2, 3):
        place = place @ step
        points.append(place[:, :3, 3])
    return np.concatenate(points)


def _extent(cells: Cells) -> Array:
    """Points (k, 3) m of the surface and the arm's base."""
    if len(cells) == 0:
        return np.zeros((1, 3))
    return np.concatenate([np.zeros((1, 3)), cells.centres, cells.borders(1).reshape(-1, 3)])
