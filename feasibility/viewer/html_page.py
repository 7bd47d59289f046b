"""One HTML page with a complete scene: the meshcat viewer, the drawing commands, a legend.

Nothing is fetched from anywhere: the page works offline, from a file, and inside a saved notebook.
The viewer's program (0.85 MB) and the commands are gzipped and unpacked by the browser.
"""

from __future__ import annotations

import base64
import gzip
import html
import importlib.util
import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from string import Template

from feasibility.collisions.words import UNCHECKED
from feasibility.viewer.threejs import Colour, Command, hex_colour, stream_of

PAGE = Path(__file__).with_name("page")
"""The files that the page is made of; picture.css and picture.js are those of the live page too."""


@dataclass(frozen=True, slots=True)
class Entry:
    """One line of the legend, with a box that shows or hides a part of the scene."""

    label: str
    colour: Colour
    path: str | None
    """Part of the scene tree that the box switches; None for a line without a box."""
    shown: bool = True


@dataclass(frozen=True, slots=True)
class Legend:
    """The text of the overlay: plain, escaped when it is written."""

    title: str
    text: str
    entries: tuple[Entry, ...]
    checked: str = UNCHECKED
    """What is said about collisions."""


@dataclass(frozen=True, slots=True)
class Camera:
    """Where the picture is taken from; the mouse turns it about the target."""

    target: tuple[float, float, float]
    """m, in the root frame."""
    eye: tuple[float, float, float]
    """m, in the root frame."""
    zoom: float = 2.0
    """Narrows meshcat's wide lens of 75 degrees: 2 gives 42."""


@dataclass(frozen=True, slots=True)
class Readout:
    """What is read beside the time slider, at some times; between them it is interpolated."""

    times: tuple[float, ...]
    """s, rising from 0."""
    rows: tuple[tuple[str, str, list[float]], ...]
    """A name, a unit, and a value for each of the times."""
    there_and_back: bool
    """The motion is played to the end and back again."""
    duration: float | None = None
    """s that the motion takes in truth; None where it is not timed: its share is shown instead."""
    nearest: tuple[str, ...] = ()
    """The two bodies that are nearest to each other at each of the times; none where not known."""


def page(
    commands: Iterable[Command],
    legend: Legend,
    camera: Camera,
    readout: Readout | None = None,
    start: float = 0.0,
) -> str:
    """The page as HTML text.

    Args:
        commands: of the scene, in order.
        legend: title, text and colours of the overlay.
        camera: where it looks from at first.
        readout: of the motion: a button plays and pauses it, a slider goes through it.
        start: s, where a motion that does not play at once waits.
    """
    return Template(_text("view.html")).substitute(
        title=html.escape(legend.title),
        style=_text("picture.css") + _text("view.css"),
        legend=_legend(legend, readout),
        program=_program(),
        commands=_base64(stream_of(commands)),
        setup=json.dumps({**asdict(camera), "start": start}),
        readout=_in_script("null" if readout is None else json.dumps(asdict(readout))),
        script=_text("picture.js") + _text("view.js"),
    )


@cache
def _text(name: str) -> str:
    """A file of the page."""
    return PAGE.joinpath(name).read_text(encoding="utf-8")


def _in_script(text: str) -> str:
    """JSON that can stand in a script: names in it close no element."""
    return text.replace("<", "\\u003c")


def _legend(legend: Legend, readout: Readout | None) -> str:
    """Text, player and parts of the scene as HTML."""
    title, text = html.escape(legend.title), html.escape(legend.text)
    kind = "unchecked" if legend.checked == UNCHECKED else "checked"
    lines = [
        f"<summary>{title}</summary>",
        f"<p>{text}</p>",
        f'<p class="{kind}">{html.escape(legend.checked)}</p>',
    ]
    if readout is not None:
        lines.append(_player(readout))
    for entry in legend.entries:
        swatch = f'<i style="background:#{hex_colour(entry.colour):06x}"></i>'
        box = ""
        if entry.path is not None:
            checked = " checked" if entry.shown else ""
            path = html.escape(entry.path, quote=True)
            box = f'<input type="checkbox" data-path="{path}"{checked}>'
        lines.append(f'<label class="line">{box}{swatch}{html.escape(entry.label)}</label>')
    return "\n".join(lines)


def _player(readout: Readout) -> str:
    """Button, slider and the values at that moment."""
    rows = [
        f"<tr><th>{html.escape(name)}</th><td></td><td>{html.escape(unit)}</td></tr>"
        for name, unit, _ in readout.rows
    ]
    end = readout.times[-1]
    near = '<p id="nearest"></p>' if readout.nearest else ""
    slider = f'<input type="range" id="time" min="0" max="{end:.3f}" step="any" value="0">'
    return (
        f'<div id="player"><button type="button" id="pause">pause</button>{slider}'
        f'<output id="seconds"></output></div>\n<table id="readout">{"".join(rows)}</table>'
        f"{near}"
    )


def _base64(data: bytes) -> str:
    """Bytes, gzipped (without a date, so that equal scenes give equal pages), as text."""
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode("ascii")


@cache
def _program() -> str:
    """The meshcat viewer's JavaScript, packed for the page."""
    return _base64(meshcat_program())


def meshcat_program() -> bytes:
    """The meshcat viewer's JavaScript.

    Raises:
        ModuleNotFoundError: meshcat is not installed.
    """
    spec = importlib.util.find_spec("meshcat")  # does not import it
    if spec is None or not spec.submodule_search_locations:
        raise ModuleNotFoundError("the viewer needs meshcat: pip install 'meshcat>=0.3.2,<0.4'")
    file = Path(next(iter(spec.submodule_search_locations)), "viewer", "dist", "main.min.js")
    return file.read_bytes()
