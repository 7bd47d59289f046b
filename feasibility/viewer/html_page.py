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

from feasibility.collisions import UNCHECKED
from feasibility.viewer.threejs import Colour, Command, hex_colour, pack


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
    return _TEMPLATE.format(
        title=html.escape(legend.title),
        legend=_legend(legend, readout),
        program=_program(),
        # Each message behind its length in four bytes.
        commands=_base64(b"".join(len(m).to_bytes(4, "little") + m for m in pack(commands))),
        setup=json.dumps({**asdict(camera), "start": start}),
        readout=_in_script("null" if readout is None else json.dumps(asdict(readout))),
    )


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
        lines.append(f"<label>{box}{swatch}{html.escape(entry.label)}</label>")
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


_TEMPLATE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>{title}</title>
<style>
body {{ margin: 0; display: flex; height: 100vh; font: 13px/1.45 system-ui, sans-serif;
  color: #222; background: #fff; }}
#meshcat-pane {{ flex: 1 1 auto; min-width: 0; height: 100vh; overflow: hidden; order: 2; }}
#legend {{ flex: 0 0 20em; box-sizing: border-box; padding: 10px 14px; order: 1;
  overflow: auto; overflow-wrap: anywhere; border-right: 1px solid #dfe3e8; }}
#legend summary {{ font-size: 15px; font-weight: 600; cursor: pointer; }}
#legend p {{ margin: 2px 0 6px; color: #444; }}
#legend p.unchecked {{ color: #8a4b08; }}
#legend label {{ display: flex; align-items: center; gap: 6px; }}
#legend label input {{ margin: 0; flex: none; }}
#legend i {{ width: 14px; height: 14px; border-radius: 3px; flex: none; }}
#player {{ display: flex; align-items: center; gap: 6px; margin: 8px 0 2px; }}
#player button {{ width: 4.2em; flex: none; }}
#player input {{ flex: 1 1 auto; min-width: 0; }}
#player output {{ flex: none; width: 4em; text-align: right; }}
#readout {{ border-collapse: collapse; margin: 0 0 8px; width: 100%;
  font-variant-numeric: tabular-nums; }}
#legend #nearest {{ margin-top: -6px; min-height: 2.9em; }}
#readout th {{ text-align: left; font-weight: 400; color: #444; }}
#readout td {{ text-align: right; width: 3.8em; }}
#readout td:last-child {{ text-align: left; width: 2.2em; padding-left: 4px; color: #444; }}
.dg {{ display: none !important; }}
@media (max-width: 639px) {{
  body {{ flex-direction: column; }}
  #meshcat-pane {{ order: 1; flex: none; height: 62vh; }}
  #legend {{ flex: 1 1 auto; border: 0; order: 2; }}
}}
</style>
</head>
<body>
<div id="meshcat-pane"></div>
<details id="legend" open>
{legend}
</details>
<script type="application/octet-stream" id="program">{program}</script>
<script type="application/octet-stream" id="commands">{commands}</script>
<script>
"use strict";
async function unpacked(id) {{
  const text = atob(document.getElementById(id).textContent);
  const bytes = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return await new Response(stream).arrayBuffer();
}}
function controls(viewer) {{
  for (const box of document.querySelectorAll("#legend label input")) {{
    box.onchange = () => {{
      const path = box.dataset.path.split("/").filter((name) => name.length > 0);
      viewer.set_property(path, "visible", box.checked);
      viewer.set_dirty();
    }};
  }}
}}
function player(viewer, readout, begin) {{
  const animator = viewer.animator, end = readout.times[readout.times.length - 1];
  const [button, slider, seconds] = ["pause", "time", "seconds"].map(
    (id) => document.getElementById(id));
  const cells = [...document.querySelectorAll("#readout tr")].map((row) => row.cells[1]);
  const near = document.getElementById("nearest");
  const digits = (unit) => unit === "mm" ? 2 : 1;
  const now = () => {{
    const action = animator.actions[0];
    const back = readout.there_and_back && action._loopCount > 0 && action._loopCount % 2 === 1;
    return back ? end - action.time : action.time;
  }};
  const show = (time) => {{
    const times = readout.times;
    let k = 1;
    while (k < times.length - 1 && times[k] < time) k += 1;
    const span = times[k] - times[k - 1];
    const share = span > 0 ? Math.min(Math.max((time - times[k - 1]) / span, 0), 1) : 1;
    readout.rows.forEach(([, unit, values], row) => {{
      const value = values[k - 1] + share * (values[k] - values[k - 1]);
      cells[row].textContent = value.toFixed(digits(unit));
    }});
    // A pair is the nearest from its key frame on.
    if (readout.nearest.length > 0)
      near.textContent = "nearest: " + readout.nearest[times[k] <= time ? k : k - 1];
    slider.value = time;
    const share_of_all = end > 0 ? time / end : 0;
    seconds.textContent = readout.duration === null
      ? (100 * share_of_all).toFixed(0) + " %"
      : (share_of_all * readout.duration).toFixed(1) + " s";
  }};
  const label = () => {{ button.textContent = animator.playing ? "pause" : "play"; }};
  const seek = (time) => {{
    for (const action of animator.actions) action.reset().play();
    animator.seek(time);
    show(time);
  }};
  button.onclick = () => {{
    if (animator.playing) animator.pause(); else animator.play();
    label();
  }};
  slider.oninput = () => {{
    if (animator.playing) animator.pause();
    seek(Number(slider.value));
    label();
  }};
  const follow = () => {{
    if (animator.playing) show(now());
    label();
    window.requestAnimationFrame(follow);
  }};
  if (animator.playing) show(0); else seek(begin);
  follow();
}}
function fitted(viewer, zoom) {{
  const pane = document.getElementById("meshcat-pane");
  const fit = () => {{
    const [width, height] = [pane.clientWidth, pane.clientHeight];
    viewer.camera.zoom = zoom * Math.min(1, width / height);
    viewer.set_3d_pane_size(width, height);
  }};
  window.addEventListener("resize", fit);
  fit();
}}
async function start() {{
  const program = document.createElement("script");
  program.textContent = new TextDecoder().decode(await unpacked("program"));
  document.head.appendChild(program);
  const viewer = new MeshCat.Viewer(document.getElementById("meshcat-pane"));
  const buffer = await unpacked("commands");
  const view = new DataView(buffer);
  for (let at = 0; at < buffer.byteLength; ) {{
    const length = view.getUint32(at, true);
    viewer.handle_command_bytearray(new Uint8Array(buffer, at + 4, length));
    at += 4 + length;
  }}
  const setup = {setup};
  // The page's own y axis points up.
  const up = ([x, y, z]) => [x, z, -y];
  viewer.camera.position.set(...up(setup.eye));
  viewer.controls.target.set(...up(setup.target));
  fitted(viewer, setup.zoom);
  controls(viewer);
  const readout = {readout};
  if (readout) player(viewer, readout, setup.start);
  window.viewer = viewer;
}}
function complain(error) {{
  const note = document.createElement("p");
  note.textContent = "This browser cannot show the scene (it needs WebGL and DecompressionStream, "
    + "as in any browser since 2023): " + error;
  document.getElementById("legend").appendChild(note);
}}
// A notebook may hold many scenes: there, each starts when it is first seen. None plays unseen.
let started = false;
let resting = false;
function begin() {{
  if (started) return;
  started = true;
  start().catch(complain);
}}
if (window.parent === window) begin();
new IntersectionObserver((changes) => {{
  const seen = changes[changes.length - 1].isIntersecting;
  if (seen) begin();
  const animator = window.viewer && window.viewer.animator;
  if (!animator || seen !== resting) return;
  if (seen) animator.play();
  else if (animator.playing) animator.pause();
  else return;
  resting = !seen;
}}).observe(document.getElementById("meshcat-pane"));
</script>
</body>
</html>
"""
