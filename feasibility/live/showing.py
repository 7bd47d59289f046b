"""`live`: the page of a case, in a browser window or in a notebook's output."""

from __future__ import annotations

import base64
import html
import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

from coverable.errors import CoverableError
from feasibility.cases.case import Case, Setup, load_case
from feasibility.live import picture
from feasibility.live.answers import Answers
from feasibility.live.controls import Controls
from feasibility.live.server import PageServer
from feasibility.live.sessions import Sessions
from feasibility.live.workbench import Workbench
from feasibility.viewer.html_page import PAGE, meshcat_program
from feasibility.viewer.live_server import HTML, File, Served
from feasibility.viewer.viewer import View, in_notebook

FILES = Path(__file__).with_name("page")
SHARED = (PAGE / "picture.css", PAGE / "picture.js")  # with the page of a view
KINDS = {
    ".html": HTML,
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
}
MOST_CELLS = 20_000  # that a page paints anew with each answer
TOO_FINE = "has {:,} cells; a live page takes at most {:,}: cut the surface more coarsely for it"


class Live(Served):
    """A live page of one case, served on this machine until it is closed or the program ends.

    Example:
        >>> with Live(load_case("paper/4a")) as page:
        ...     page.url.startswith("http://127.0.0.1:")
        True
    """

    def __init__(self, case: Case, setup: Setup | None = None) -> None:
        """Begin to serve.

        Args:
            case: what the page begins with.
            setup: what it builds, where that is known.

        Raises:
            CaseError: the case cannot be built.
            CoverableError: it has too many cells.
            OSError: the system gives no port.
        """
        bench = Workbench(case, setup)
        if len(bench.setup.cells) > MOST_CELLS:
            text = TOO_FINE.format(len(bench.setup.cells), MOST_CELLS)
            raise CoverableError(text, case.name)
        self.case = case
        self._view = picture.first_view(bench.setup, case.name)
        controls = Controls(case, bench.setup.robot)
        files = _files(bench.setup, controls, self._view)
        super().__init__(PageServer(files, Sessions(Answers(controls, bench)), controls))

    def _repr_mimebundle_(self, include: Any = None, exclude: Any = None) -> dict[str, str]:
        """The page inside a notebook's output; the case as a picture where nobody serves it."""
        shown = base64.b64encode(self._view.png()).decode("ascii")
        page = _IN_NOTEBOOK.format(picture=shown, url=html.escape(self.url, quote=True))
        return {"text/plain": repr(self), "text/html": page, "image/png": shown}

    def __repr__(self) -> str:
        """One line, for consoles."""
        return f"Live({self.case.name!r}: {self.url})"


# The frame comes to lie over the picture once the server answers: in a notebook that is opened
# again nobody does, and the picture stays.
_IN_NOTEBOOK = """<div class="coverable-live" data-url="{url}"
 style="position: relative; min-height: 640px">
<img src="data:image/png;base64,{picture}" style="max-width: 100%; height: 560px">
<script>
for (const place of document.querySelectorAll(".coverable-live:not([data-seen])")) {{
  place.dataset.seen = "yes";
  fetch(place.dataset.url, {{mode: "no-cors", cache: "no-store"}}).then(() => {{
    const frame = document.createElement("iframe");
    frame.src = place.dataset.url;
    frame.style = "position: absolute; inset: 0; width: 100%; height: 640px; border: 0; "
      + "background: #fff";
    place.appendChild(frame);
  }}, () => undefined);
}}
</script></div>"""


def live(
    case: Case | str | os.PathLike[str], *, block: bool | None = None, open_browser: bool = True
) -> Live:
    """A page where the part is moved and limits are turned, and the verdict follows.

    Args:
        case: a case, the name of a built-in one, or the path of a case file.
        block: wait until interrupted; by default only a script waits, since the page is served by
            this program and ends with it.
        open_browser: outside of notebooks, open a window.

    Returns:
        What serves the page; a notebook displays it.

    Raises:
        CaseError: the case cannot be loaded or built.
        OSError: the system gives no port.
    """
    page = Live(case if isinstance(case, Case) else load_case(case))
    if in_notebook():
        return page
    if open_browser:
        page.open()
    page.wait_in_script(block)
    return page


def _files(setup: Setup, controls: Controls, drawn: View) -> dict[str, File]:
    """Everything that a page loads."""
    files = {
        path.name: File(KINDS[path.suffix], path.read_bytes())
        for path in (*sorted(FILES.iterdir()), *SHARED)
    }
    described = {
        "name": controls.case.name,
        "robot": setup.robot.name,
        "kind": setup.cells.surface.kind,
        "grid": list(setup.cells.shape),
        "controls": controls.described(),
        "camera": asdict(drawn.camera),
        "group": picture.group_of(setup.robot),
        "centre": setup.cells.centres.mean(axis=0).tolist(),
        "position": setup.cells.surface.position.tolist(),
        "rotation": setup.cells.surface.rotation.tolist(),
        "note": drawn.legend.checked,
        "entries": picture.entries_of(drawn),
        "cells": picture.cell_triangles(setup.cells),
    }
    text = json.dumps(described, allow_nan=False)
    return {
        "": files.pop("live.html"),
        **files,
        "meshcat.js": File(KINDS[".js"], meshcat_program()),
        "scene": File("application/octet-stream", picture.scene_bytes(drawn)),
        "case.json": File("application/json", text.encode()),
    }
