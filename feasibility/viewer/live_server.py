"""A scene in a browser window, live: a web server on the loopback address that ends with us.

meshcat's own server listens on every interface and lives in a process of its own, which survives
its owner. This one is a thread of the program that shows the scene: it listens on 127.0.0.1 alone,
answers only under an address that holds a random token, and is gone when the program is, however
that ends.
"""

from __future__ import annotations

import asyncio
import secrets
import threading
from collections.abc import Callable, Iterable
from types import TracebackType
from typing import TYPE_CHECKING, Any

from feasibility.viewer.threejs import Command, pack

if TYPE_CHECKING:
    import tornado.web

ADDRESS = "127.0.0.1"


class LiveView:
    """One scene served to browsers on this machine.

    Example:
        >>> with LiveView(lambda socket: "<p>scene</p>") as live:
        ...     live.url.startswith("http://127.0.0.1:")
        True
    """

    def __init__(self, render: Callable[[str], str]) -> None:
        """Start serving.

        Args:
            render: makes the page's HTML, given the path of the WebSocket it shall listen to.
        """
        self._token = secrets.token_urlsafe(16)
        self._page = render(f"/{self._token}/socket")
        self._sockets: set[Any] = set()
        self._ready = threading.Event()
        self._fault: BaseException | None = None
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="coverable-view", daemon=True)
        self.port = 0
        self._thread.start()
        self._ready.wait()
        if self._fault is not None:
            self._thread.join()
            raise OSError(f"the view cannot be served on {ADDRESS}: {self._fault}")

    @property
    def url(self) -> str:
        """The address to open in a browser on this machine."""
        return f"http://{ADDRESS}:{self.port}/{self._token}/"

    def open(self) -> bool:
        """Open the scene in the default browser; False where there is none."""
        import webbrowser

        return webbrowser.open(self.url)

    def send(self, commands: Iterable[Command]) -> None:
        """Change the scene in every window that shows it now."""
        messages = pack(commands)
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._forward, messages)

    def wait(self) -> None:
        """Serve until `close` is called from elsewhere or the user interrupts."""
        while self._thread.is_alive():
            self._thread.join(0.2)

    def close(self) -> None:
        """Stop serving and free the port."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._loop.stop)
            self._thread.join()

    def __enter__(self) -> LiveView:
        """Serve inside a `with` block."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Stop serving."""
        self.close()

    def _run(self) -> None:
        """The server thread."""
        asyncio.set_event_loop(self._loop)
        server = None
        try:
            from tornado.httpserver import HTTPServer
            from tornado.netutil import bind_sockets

            sockets = bind_sockets(0, ADDRESS)
            self.port = sockets[0].getsockname()[1]
            server = HTTPServer(_application(self))
            server.add_sockets(sockets)
        except OSError as error:
            self._fault = error
            self._ready.set()
        else:
            self._loop.call_soon(self._ready.set)
            self._loop.run_forever()
        finally:
            if server is not None:
                server.stop()
                self._loop.run_until_complete(server.close_all_connections())
            for task in asyncio.all_tasks(self._loop):
                task.cancel()
            self._loop.run_until_complete(asyncio.sleep(0))
            self._loop.run_until_complete(self._loop.shutdown_asyncgens())
            self._loop.run_until_complete(self._loop.shutdown_default_executor())
            self._loop.close()

    def _forward(self, messages: list[bytes]) -> None:
        """Send to every window; runs in the server thread."""
        from tornado.websocket import WebSocketClosedError

        for socket in list(self._sockets):
            try:
                for message in messages:
                    socket.write_message(message, binary=True)
            except WebSocketClosedError:
                self._sockets.discard(socket)


def _application(live: LiveView) -> tornado.web.Application:
    """The two addresses that are served: the page and its WebSocket."""
    import tornado.web
    import tornado.websocket

    class Page(tornado.web.RequestHandler):
        def get(self) -> None:
            self.set_header("Cache-Control", "no-store")
            self.set_header("Referrer-Policy", "no-referrer")
            self.set_header("X-Content-Type-Options", "nosniff")
            self.finish(live._page)

    class Socket(tornado.websocket.WebSocketHandler):  # refuses pages of other origins
        def open(self, *args: str, **kwargs: str) -> None:
            live._sockets.add(self)

        def on_message(self, message: str | bytes) -> None:
            """Nothing that a page sends is acted upon."""

        def on_close(self) -> None:
            live._sockets.discard(self)

    application = tornado.web.Application(log_function=lambda handler: None)
    # Other host names get nothing: a page elsewhere cannot reach in by rebinding its name.
    application.add_handlers(
        r"^127\.0\.0\.1$",
        [(f"/{live._token}/", Page), (f"/{live._token}/socket", Socket)],
    )
    return application
