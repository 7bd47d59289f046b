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

from feasibility.verdict import UNCHECKED
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


@dataclass(frozen=True, slots=True)
class Camera:
    """Where the picture is taken from; the mouse turns it about the target."""

    target: tuple[float, float, float]
    """m, in the root frame."""
    eye: tuple[float, float, float]
    """m, in the root frame."""
    zoom: float = 2.0
    """Narrows meshcat's wide lens of 75 degrees: 2 gives 42."""


def page(
    commands: Iterable[Command], legend: Legend, camera: Camera, *, animated: bool = False
) -> str:
    """The page as HTML text.

    Args:
        commands: of the scene, in order.
        legend: title, text and colours of the overlay.
        camera: where it looks from at first.
        animated: offer a button that pauses and resumes the motion.
    """
    return _TEMPLATE.format(
        title=html.escape(legend.title),
        legend=_legend(legend, animated),
        program=_program(),
        # Each message behind its length in four bytes.
        commands=_base64(b"".join(len(m).to_bytes(4, "little") + m for m in pack(commands))),
        setup=json.dumps(asdict(camera)),
    )


def _legend(legend: Legend, animated: bool) -> str:
    """The overlay as HTML."""
    title, text = html.escape(legend.title), html.escape(legend.text)
    lines = [
        f"<summary>{title}</summary>",
        f"<p>{text}</p>",
        f'<p class="unchecked">{UNCHECKED}</p>',
    ]
    for entry in legend.entries:
        swatch = f'<i style="background:#{hex_colour(entry.colour):06x}"></i>'
        box = ""
        if entry.path is not None:
            checked = " checked" if entry.shown else ""
            path = html.escape(entry.path, quote=True)
            box = f'<input type="checkbox" data-path="{path}"{checked}>'
        lines.append(f"<label>{box}{swatch}{html.escape(entry.label)}</label>")
    if animated:
        lines.append('<button type="button" id="pause">pause</button>')
    return "\n".join(lines)


def _base64(data: bytes) -> str:
    """Bytes, gzipped (without a date, so that equal scenes give equal pages), as text."""
    return base64.b64encode(gzip.compress(data, 9, mtime=0)).decode("ascii")


@cache
def _program() -> str:
    """The meshcat viewer's JavaScript, packed for the page."""
    spec = importlib.util.find_spec("meshcat")  # does not import it
    if spec is None or not spec.submodule_search_locations:
        raise ModuleNotFoundError("the viewer needs meshcat: pip install 'meshcat>=0.3.2,<0.4'")
    file = Path(next(iter(spec.submodule_search_locations)), "viewer", "dist", "main.min.js")
    return _base64(file.read_bytes())


_TEMPLATE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>{title}</title>
<style>
body {{ margin: 0; font: 13px/1.45 system-ui, sans-serif; color: #222; }}
#meshcat-pane {{ width: 100vw; height: 100vh; overflow: hidden; }}
#legend {{ position: absolute; left: 12px; bottom: 12px; max-width: 21em; padding: 10px 14px;
  max-height: calc(100vh - 44px); overflow: auto; overflow-wrap: anywhere;
  background: rgba(255, 255, 255, 0.86); border-radius: 6px; box-shadow: 0 1px 4px #0003; }}
#legend summary {{ font-size: 15px; font-weight: 600; cursor: pointer; }}
#legend p {{ margin: 2px 0 6px; color: #444; }}
#legend label {{ display: flex; align-items: center; gap: 6px; }}
#legend input {{ margin: 0; flex: none; }}
#legend i {{ width: 14px; height: 14px; border-radius: 3px; flex: none; }}
#legend button {{ margin-top: 6px; }}
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
  for (const box of document.querySelectorAll("#legend input")) {{
    box.onchange = () => {{
      const path = box.dataset.path.split("/").filter((name) => name.length > 0);
      viewer.set_property(path, "visible", box.checked);
      viewer.set_dirty();
    }};
  }}
  const button = document.getElementById("pause");
  if (button) {{
    const label = () => {{ button.textContent = viewer.animator.playing ? "pause" : "play"; }};
    button.onclick = () => {{
      if (viewer.animator.playing) viewer.animator.pause(); else viewer.animator.play();
      label();
    }};
    label();
  }}
}}
async function start() {{
  document.getElementById("legend").open = window.innerWidth >= 640;
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
  viewer.camera.zoom = setup.zoom;
  viewer.controls.target.set(...up(setup.target));
  viewer.set_dirty();
  controls(viewer);
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
