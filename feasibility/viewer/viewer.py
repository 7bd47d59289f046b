"""The picture of a verdict: the arm at work over the surface, in a file, a notebook or a window.

    from feasibility.viewer import show
    show(verdict)

Nothing but other views, reports and commands imports the viewer.
"""

from __future__ import annotations

import html
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from feasibility.verdict import Verdict
from feasibility.viewer import robot as robot_visuals
from feasibility.viewer import threejs
from feasibility.viewer.html_page import Camera, Entry, Legend, page
from feasibility.viewer.live_server import LiveView
from feasibility.viewer.playback import Motion, animate, motion_of
from feasibility.viewer.scene import Layer, layers, trail
from feasibility.viewer.stage import camera_on, ground
from feasibility.viewer.threejs import Command
from robots import Robot
from surfaces import Cells

ARM: threejs.Colour = (0.35, 0.37, 0.40)


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

    def html(self) -> str:
        """One self-contained page; it fetches nothing and needs no server."""
        return page(self.commands, self.legend, self.camera, animated=self.motion is not None)

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

    def _repr_html_(self) -> str:
        """The page inside a notebook's output; it stays there when the notebook is saved."""
        inner = html.escape(self.html(), quote=True)
        style = "width: 100%; height: 560px; border: 0"
        return f'<iframe srcdoc="{inner}" style="{style}" loading="lazy"></iframe>'

    def __repr__(self) -> str:
        """One line, for consoles."""
        return f"View({self.legend.title!r}: {self.legend.text})"


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
    return compose(
        verdict.robot,
        verdict.cells,
        titled(f"{verdict.answer} ({verdict.evidence})", case),
        f"{verdict.robot.name}: {verdict.n_covered} of {len(verdict.cells)} cells in one "
        f"continuous motion ({verdict.method} search)",
        parts,
        motion,
        resting=_resting(verdict),
        play=play,
        at=at,
    )


def compose(
    robot: Robot,
    cells: Cells,
    title: str,
    text: str,
    parts: Sequence[Layer],
    motion: Motion | None,
    *,
    resting: NDArray[np.float64],
    tracks: Sequence[dict[str, Any]] = (),
    play: bool = True,
    at: float = 0.0,
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
    """
    drawing = robot_visuals.draw(robot)
    commands = ground(robot, cells, drawing.lowest) + list(drawing.commands)
    entries = [Entry(robot.name, ARM, robot_visuals.ROOT)]
    for part in parts:
        commands += part.commands
        entries.append(part.entry)
    q = resting
    if motion is not None:
        commands.append(animate(robot, motion, play=play, tracks=tracks))
        q = motion.at(np.array([at * motion.seconds[-1]]))[0]
    commands += robot_visuals.pose(robot, q)
    return View(
        robot=robot,
        commands=tuple(commands),
        legend=Legend(title, " · ".join([text, *drawing.notes]), tuple(entries)),
        camera=camera_on(robot, cells, q, drawing.lowest),
        motion=motion,
        notes=drawing.notes,
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
    if block is None:
        block = not hasattr(sys, "ps1")
    if block:
        try:
            live.wait()
        except KeyboardInterrupt:
            live.close()
    return live


def _in_notebook() -> bool:
    """True where a Jupyter kernel runs this."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return getattr(shell, "kernel", None) is not None


def titled(title: str, case: str | None) -> str:
    """A title with the name of the case, where it has one."""
    return f"{case}: {title}" if case else title


def _resting(verdict: Verdict) -> NDArray[np.float64]:
    """A configuration for an arm that does not move: over the start cell if one is known."""
    nodes = verdict.graph.nodes(data="q")
    for _, q in sorted(nodes, key=lambda node: (node[0] != verdict.start, node[0])):
        if q is not None:
            return np.asarray(q, dtype=float)
    return robot_visuals.home(verdict.robot)
