"""The picture of a verdict: the arm at work over the surface, in a file, a notebook or a window.

    from coverable import show
    show(verdict)

Nothing but other views, reports, commands and the live page imports the viewer.
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

from coverable.arrays import Array
from coverable.errors import counted
from feasibility.collisions.asked_bodies import gather, said_of
from feasibility.cut_words import sentence
from feasibility.safe_files import write_whole
from feasibility.task import Task
from feasibility.verdict import Verdict
from feasibility.viewer import robot_visuals, threejs
from feasibility.viewer.html_page import Camera, Entry, Legend, Readout, page
from feasibility.viewer.live_server import LiveView
from feasibility.viewer.obstacles import (
    HULLS,
    draw_nearest,
    hull_layers,
    points_of,
    scene_layers,
    tool_layers,
)
from feasibility.viewer.playback import (
    Playback,
    animate,
    key_times,
    motion_of,
    readout_of,
    with_nearest,
)
from feasibility.viewer.stage import camera_on, carried, ground, root_in_world, triads, world_tracks
from feasibility.viewer.threejs import Command
from feasibility.viewer.treated_map import area_layers, margin_layers
from feasibility.viewer.verdict_scene import Layer, layers, trail
from robots.robot import Robot
from surfaces.cells import Cells

ARM: threejs.Colour = (0.35, 0.37, 0.40)


@dataclass(frozen=True, eq=False, slots=True)
class View:
    """A verdict drawn: save it, serve it, or let a notebook show it."""

    robot: Robot
    commands: tuple[Command, ...]
    """Drawing commands of the page, in order."""
    legend: Legend
    camera: Camera
    motion: Playback | None
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
        text = self.html()
        return write_whole(path, lambda stream: stream.write(text.encode()))

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
    if verdict.treated is not None:
        parts += area_layers(verdict.treated, verdict.cells.surface.side_sign)
    if motion is not None:
        parts.append(trail(verdict.cells, motion))
    parts += margin_layers(verdict)
    covered = f"{verdict.n_covered} of {counted(len(verdict.cells), 'cell')}"
    text = f"{verdict.robot.name}: {covered} in one continuous motion ({verdict.method} search)"
    if verdict.proof is not None:
        text += f". Proved: {sentence(verdict.proof, verdict.robot, verdict.cells)}."
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
        task=verdict.task,
    )


def compose(
    robot: Robot,
    cells: Cells,
    title: str,
    text: str,
    parts: Sequence[Layer],
    motion: Playback | None,
    *,
    resting: Array,
    tracks: Sequence[dict[str, Any]] = (),
    play: bool = True,
    at: float = 0.0,
    task: Task | None = None,
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
        tracks: what else moves with it, see `threejs.key_frames`.
        play: start the motion when the page opens.
        at: share of the motion, 0 to 1, at which the arm waits when `play` is False.
        task: with what the arm had to stay clear of.
    """
    drawing, roots = robot_visuals.draw(robot), [robot_visuals.ROBOT]
    q, readout, start, around = resting, None, 0.0, None
    moving = list[Command]()
    parts, tracks = list(parts), list(tracks)
    collision = None if task is None else task.collision
    bodies = None if task is None else gather(robot, cells.surface, collision, task.standoff)
    if bodies is not None:
        parts += tool_layers(bodies, robot) + scene_layers(bodies, robot)
        parts += hull_layers(bodies, robot)
        around, roots = points_of(bodies.scene, robot), [*roots, HULLS]
    if motion is not None:
        readout, start = readout_of(robot, cells, motion), float(at * motion.seconds[-1])
        near = draw_nearest(robot, bodies, motion, start)
        if near is not None:
            parts.append(near.layer)
            tracks += near.tracks
            readout = with_nearest(readout, near.distances, near.names)
        times = key_times(motion)
        tracks += world_tracks(robot, times, motion.at(times))
        moving = [animate(robot, motion, play=play, tracks=tracks, roots=roots)]
        q = motion.at(np.array([start]))[0]
    entries = [Entry(robot.name, ARM, robot_visuals.ROBOT), *(part.entry for part in parts)]
    drawn = [command for part in parts for command in part.commands]
    poses = [command for root in roots for command in robot_visuals.pose(robot, q, root)]
    every = (*drawing.commands, *triads(robot), *drawn, *moving, *poses)
    seen, entries = carried(robot, every, entries, q)
    place = root_in_world(robot, q)[0]
    return View(
        robot=robot,
        commands=(*ground(robot, cells, drawing.lowest, place), *seen),
        legend=Legend(
            title, " · ".join([text, *drawing.notes]), tuple(entries), said_of(robot, collision)
        ),
        camera=camera_on(robot, cells, q, drawing.lowest, around, place),
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
    if in_notebook():
        return drawn
    live = drawn.show()
    live.wait_in_script(block)
    return live


def in_notebook() -> bool:
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
