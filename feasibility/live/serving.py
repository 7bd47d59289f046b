"""`live`: the page of a case, in a browser window or in a notebook's output.

viser serves it, on 127.0.0.1 alone, under a secret address, and to no page of another origin.
"""

from __future__ import annotations

import atexit
import base64
import html
import os
import secrets
import threading
import warnings
from collections.abc import Generator
from contextlib import contextmanager
from http import HTTPStatus
from typing import Any

import networkx as nx
import numpy as np

from coverable.errors import CoverableError
from feasibility.cases.case import Case, Setup, load_case
from feasibility.live.controls import Controls
from feasibility.live.page import Page
from feasibility.live.workbench import Workbench
from feasibility.verdict import Answer, Evidence, Verdict
from feasibility.viewer.live_server import Served
from feasibility.viewer.viewer import View, in_notebook, view

ADDRESS = "127.0.0.1"
MOST_CELLS = 20_000  # that a page paints anew with each answer
MOST_PAGES = 8
DIM = 0.4  # [1] of the light around, so that the colours of cells stay what they are
AROUND = 0.7  # [1] of light on what is turned away from it
TOO_FINE = "has {:,} cells; a live page takes at most {:,}: cut the surface more coarsely for it"
TOO_MANY = f"{MOST_PAGES} pages of this case are open already; close one of them, and load this one"
EXTRA = "a live page needs the extra: pip install 'coverable[live]'"
POLICY = (  # nothing is fetched from elsewhere; viser's page makes code of its own
    "default-src 'self' blob: data: 'unsafe-inline' 'unsafe-eval'; connect-src 'self' blob: data:; "
    "base-uri 'none'; form-action 'none'"
)
_starting = threading.Lock()


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
            CoverableError: it has too many cells, or viser is not installed.
        """
        try:
            import viser
        except ImportError as error:
            raise CoverableError(EXTRA) from error

        self.case, self.bench = case, Workbench(case, setup)
        setup = self.bench.setup
        if len(setup.cells) > MOST_CELLS:
            raise CoverableError(TOO_FINE.format(len(setup.cells), MOST_CELLS), case.name)
        self._view, self.controls = _first_view(setup, case.name), Controls(case, setup.robot)
        self.pages: dict[int, Page] = {}
        """The windows that are open, by viser's number."""
        secret = secrets.token_urlsafe(16)
        with _guarded(secret), _silent():
            self._server = viser.ViserServer(ADDRESS, 0, label=case.name, verbose=False)
        self._server.gui.configure_theme(
            control_width="large", show_logo=False, show_share_button=False
        )
        self._server.gui.main_panel.dock_right()
        self._server.scene.configure_default_lights(True, cast_shadow=False)
        self._server.scene.configure_environment_map("city", environment_intensity=DIM)
        self._server.scene.add_light_ambient("/light", intensity=AROUND)
        self._server.on_client_connect(self._open)
        self._server.on_client_disconnect(self._leave)
        super().__init__(f"http://{ADDRESS}:{self._server.get_port()}/{secret}/", self._end)
        atexit.register(self.close)
        # A window may be closed at any moment, and what is drawn there then is lost.
        warnings.filterwarnings("ignore", r"Queued a .* on a closed connection", UserWarning)

    def _open(self, client: Any) -> None:
        """A window wants the page."""
        if len(self.pages) >= MOST_PAGES:
            client.gui.add_markdown(TOO_MANY)
            return
        self.pages[client.client_id] = Page(client, self.controls, self.bench, self._view)

    def _leave(self, client: Any) -> None:
        """A window is gone."""
        page = self.pages.pop(client.client_id, None)
        if page is not None:
            page.close()

    def _end(self) -> None:
        """Give up all questions, and free the port."""
        atexit.unregister(self.close)
        for page in list(self.pages.values()):
            page.close()
        with _silent():
            self._server.stop()

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


@contextmanager
def _guarded(secret: str) -> Generator[None]:
    """A server that viser starts inside the block refuses strangers.

    They come by another path than the secret one, by another name of this machine, which a page
    elsewhere may have rebound, or from a page of another origin. viser has no place for such a
    rule, so that the function by which it starts the server is another one meanwhile.
    """
    from websockets import Headers
    from websockets.asyncio import server
    from websockets.http11 import Response

    plain = server.serve

    def serve(*args: Any, process_request: Any, **options: Any) -> Any:
        def gate(connection: Any, request: Any) -> Any:
            host, origin = request.headers.get("Host"), request.headers.get("Origin")
            here = f"{ADDRESS}:{connection.local_address[1]}"
            given, path = request.path[1 : 1 + len(secret)], request.path[1 + len(secret) :]
            known = secrets.compare_digest(given.encode(), secret.encode())
            if not known or host != here or origin not in (None, f"http://{here}"):
                return Response(HTTPStatus.NOT_FOUND, "Not SearchResult", Headers())
            request.path = path or "/"
            answer = process_request(connection, request)
            if answer is not None:
                answer.headers["Cache-Control"] = "no-store"
                answer.headers["Referrer-Policy"] = "no-referrer"
                answer.headers["X-Content-Type-Options"] = "nosniff"
                answer.headers["Content-Security-Policy"] = POLICY
            return answer

        return plain(*args, process_request=gate, **options)

    with _starting:
        server.serve = serve  # pyrefly: ignore[bad-assignment]
        try:
            yield
        finally:
            server.serve = plain


@contextmanager
def _silent() -> Generator[None]:
    """viser does not say on stdout, which is the program's, that it has started or stopped."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before


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
        CoverableError: the library viser is not installed, or there are too many cells.
    """
    page = Live(case if isinstance(case, Case) else load_case(case))
    if in_notebook():
        return page
    if open_browser:
        page.open()
    page.wait_in_script(block)
    return page


def _first_view(setup: Setup, name: str) -> View:
    """The case before anything is known of it: arm, ground, scene and surface."""
    robot, cells, task, search = setup
    nothing = Verdict(
        answer=Answer.UNDECIDED,
        evidence=Evidence.BUDGET,
        message="",
        robot=robot,
        cells=cells,
        task=task,
        method=search.method,
        seed=search.seed,
        graph=nx.Graph(),
        covered=np.zeros(len(cells), dtype=bool),
    )
    return view(nothing, name, play=False)
